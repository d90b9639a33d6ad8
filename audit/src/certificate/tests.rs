//! Which certificates can be read.

mod formed;

use super::read::Words;
use super::{Certificate, HEADER};

/// Lines of every kind, as they are written.
const LINES: [&str; 36] = [
    "core cortex-m33 0x12",
    "deadline 1000",
    "fetches 1",
    "cores 2",
    "dead 0x20001800",
    "kernels 0x34",
    "memory 0x20000000 0x8000 1 1 1 0 1 2 3",
    "bus 0x40000000 0x1000 4 3",
    "dma 0x40000000 20 7",
    "neighbour 0x40000000 4 12",
    "section 0x20000000 0x56",
    "targets 0x20000010 0x20000020 0x20000030",
    "frame 0 0 0x20002000 3 28 36",
    "function keys keys 0xf 1 12",
    "returns 0x20000006 1",
    "entered 0 -1 7",
    "base 6 0x20004000",
    "loop 0x20000102 9",
    "context 0 0x0 0x20000100",
    "call 0x20000104 0x20000200 costs 0 3",
    "call 0x20000108 0x20000200 never",
    "piece 0x20000100 5 0 0x100000000000000000000",
    "pipe 0x0",
    "place -12 0 5 0 0x20004000 0 14 1 0 1 -4 2 -8",
    "facts 0xffff 2 -3 7 0 2147483647 0 1 1 1 20 0",
    "round 0 0x20000102 3",
    "point 0 0x20000100 0 0 0 1",
    "state 0 0 -5",
    "point 0 0x20000102 136 0",
    "helper 0x20003000 2 0",
    "function until until 0xf 0 0",
    "until 0x20000300 0xb0",
    "frame 1 0 0x20002100 3 28 36",
    "function handler handler 0xf 0 0",
    "function idle idle 0xf 0 0",
    "function legs legs 0xf 0 0",
];

fn text(lines: &[&str]) -> String {
    let all = [&[HEADER], lines].concat();
    all.join("\n") + "\n"
}

/// What lines say, without asking whether that is all.
fn said(lines: &[&str]) -> Certificate {
    let mut certificate = Certificate::default();
    for line in lines {
        let mut words = Words(line.split_whitespace());
        certificate.line(&mut words).expect("a line");
    }
    certificate
}

fn read(lines: &[&str]) -> Result<Certificate, String> {
    Certificate::read(&text(lines))
}

#[test]
fn what_is_written_is_read_and_written_again() {
    for (wrote, line) in said(&LINES).to_string().lines().zip(text(&LINES).lines()) {
        assert_eq!(wrote, line);
    }
    let certificate = read(&LINES).expect("it can be read");
    assert_eq!(certificate.to_string(), text(&LINES));
    let frame = &certificate.frames[0];
    let keys = &frame.functions[0];
    assert_eq!(
        (keys.returns, keys.hands_stack),
        (Some((0x2000_0006, true)), true)
    );
    assert_eq!(keys.entered, [(0, [-1, 7])]);
    assert_eq!(
        keys.calls.iter().map(|own| own.costs).collect::<Vec<_>>(),
        [Some((0, 3)), None]
    );
    let piece = &keys.pieces[0];
    assert_eq!(piece.begins, 1 << 80);
    assert_eq!(piece.points[0].loops, [0, 1]);
    assert_eq!(piece.points[0].states, [(0, 0, -5)]);
    let place = &piece.places[0];
    assert_eq!(
        (
            place.sp,
            place.slots.len(),
            place.registers.iter().flatten().count()
        ),
        (-12, 1, 2)
    );
    let facts = &piece.facts[0];
    assert_eq!(
        (facts.of(0), facts.of(1), facts.of(2)),
        ([0, 0x7fff_ffff], [0, 0x7fff_ffff], super::super::ALL)
    );
    let helper = frame.helper.as_ref().expect("a helper");
    assert_eq!(
        (helper.visits.clone(), helper.functions[0].until),
        (vec![2, 0], Some((0x2000_0300, 0xb0)))
    );
}

/// Each line as it is not read: the number of the line is told, and why.
#[test]
fn what_is_no_line_is_refused() {
    for (line, why) in [
        ("deadline", "ends too early"),
        ("deadline 1 2", "`2` is too much"),
        ("deadline -1", "`-1` is no such number"),
        ("deadline 0xg", "`0xg` is no such number"),
        ("fetches 2", "a flag is 0 or 1"),
        ("cores 4294967296", "`4294967296` is no such number"),
        ("nothing 1", "`nothing` is no entry"),
        ("function more what 0 0 0", "`what` is no kind of function"),
        (
            "call 0x2 0x4 often",
            "`often` is neither `costs` nor `never`",
        ),
        ("point 0 0x2 256 0", "`256` is no such number"),
        ("point 0 0x2 16 0", "is no state of IT"),
        ("place 0 0 5 0", "ends too early"),
        ("place 0 2 5 0 0", "is neither register nor slot"),
        ("place 0 0 15 0 0", "is neither register nor slot"),
        ("place 0 0 -1 0 0", "is neither register nor slot"),
        ("place 0 0 5 0 -1", "`-1` is no such number"),
        ("place 0 0 5 -1 0", "`-1` is no such number"),
        ("place 0 0 5 4294967296 0", "`4294967296` is no such number"),
        (
            "place 0 0 5 -9223372036854775808 0",
            "`-9223372036854775808` is no such number",
        ),
        ("place 0 0 5 1 4294967296", "`4294967296` is no such number"),
        ("place 0 1 4294967296 0 0", "`4294967296` is no such number"),
        ("place 0 1 -4 0 0x0 9", "ends too early"),
        ("facts 0xffff 1 0 7 0", "names what is not there"),
        ("facts 0xffff 1 0 7 0 1", "names what is not there"),
        ("facts 0xffff 1 0 7 21 0", "names what is not there"),
    ] {
        let at = 24;
        let lines = [&LINES[..at], &[line]].concat();
        let told = format!("line {}: {why}", at + 2);
        assert_eq!(read(&lines).err(), Some(told), "{line}");
    }
    // As large as a number of a call may be, it is written again.
    let lines = [
        &LINES[..24],
        &["place 0 0 5 4294967295 -1 1 -4 0 0xffffffff"],
    ]
    .concat();
    assert_eq!(read(&lines).err(), None);
    let other = Certificate::read("whippen-certificate 2\n").err();
    assert_eq!(other, Some(format!("does not begin with `{HEADER}`")));
    for line in ["helper 0x2 1", "function f plain 0 0 0"] {
        assert_eq!(
            read(&[line]).err(),
            Some("line 2: stands nowhere".to_string())
        );
    }
    for line in ["loop 0x2 1", "pipe 0x0", "state 0 0 0"] {
        let lines = ["frame 0 0 0x2 0 0 0", line];
        assert_eq!(
            read(&lines).err(),
            Some("line 3: stands nowhere".to_string()),
            "{line}"
        );
    }
}

/// A thing is said in one way, once.
#[test]
fn nothing_is_said_twice_or_otherwise() {
    let twice = Some("says something twice, or otherwise".to_string());
    let other = |from: &'static str, to: &'static str| {
        let lines = LINES.map(|line| if line == from { to } else { line });
        read(&lines).err()
    };
    assert_eq!(other("deadline 1000", "deadline 0x3e8"), twice);
    assert_eq!(other("deadline 1000", "deadline  1000"), twice);
    assert_eq!(other("deadline 1000", "deadline 01000"), twice);
    assert_eq!(read(&[&["deadline 9"], &LINES[..]].concat()).err(), twice);
    assert_eq!(
        read(&[&LINES[1..2], &LINES[..1], &LINES[2..]].concat()).err(),
        twice
    );
}

/// Whose table of vectors is whose, and whose functions.
#[test]
fn a_core_has_its_own_vectors_and_functions() {
    let lines = [
        "frame 0 0 0x10 0 0 0",
        "function a plain 0 0 0",
        "helper 0x20",
        "function b plain 0 0 0",
    ];
    let mut certificate = said(&lines);
    assert_eq!(
        [0, 1].map(|core| certificate.vectors(core)),
        [Some(0x10), Some(0x20)]
    );
    let of = |core| certificate.frames[0].functions_of(core)[0].name.clone();
    assert_eq!([of(0), of(1)], ["a", "b"]);
    certificate.frames[0].functions_on(1).clear();
    assert_eq!(
        [0, 1].map(|core| certificate.frames[0].functions_of(core).len()),
        [1, 0]
    );
    certificate.frames[0].functions_on(0).clear();
    assert!(certificate.frames[0].functions.is_empty());
    let alone = said(&["frame 0 0 0x10 0 0 0", "frame 1 0 0x30 0 0 0"]);
    assert_eq!(
        [0, 1, 2].map(|core| alone.vectors(core)),
        [Some(0x10), Some(0x30), None]
    );
}
