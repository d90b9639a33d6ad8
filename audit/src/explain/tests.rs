//! What is said of a certificate, word by word.

use whippen_isa::timing::Evidence;

use super::{ALWAYS, NOT_CHECKED, assumptions, explain};
use crate::certificate::{Call, Certificate, Dma, Frame, Function, Helper, Kind, Neighbour, Piece};
use crate::frame::Checked;
use crate::made::{DEVICES, board, call, function};
use crate::ranges::Ranges;

/// What is assumed beyond what always is.
fn told(certificate: &Certificate, ranges: &[Ranges]) -> Vec<String> {
    let mut all = assumptions(certificate, ranges);
    assert!(all.iter().zip(ALWAYS).all(|(own, always)| own == always));
    all.split_off(ALWAYS.len())
}

const BOARD: [&str; 6] = [
    "1 cores play; no other one fetches or accesses anything",
    "a core fetches and accesses data through one port",
    "an interrupt that leads to 0x20001800 is the end: nothing has to be in time behind it",
    "32768 bytes of memory at 0x20000000 are accessed in 1 cycles and fetched in 1 cycles, word by \
     word in banks 0, 1, 2, 3",
    "4096 bytes of memory at 0x20010000 are accessed in 1 cycles and fetched in 1 cycles, in banks \
     4",
    "devices in 4096 bytes at 0x40000000 are read in 4 cycles and written in 3",
];

#[test]
fn a_board_is_told() {
    let mut own = board();
    assert_eq!(told(&own, &[]), BOARD);
    own.fetches = true;
    (own.memories[1].access, own.memories[1].fetch) = (0, 2);
    own.neighbour = Some(Neighbour {
        bus: DEVICES,
        waits: vec![4, 12],
    });
    let dma = |accesses| Dma {
        bus: DEVICES,
        wait: 20,
        accesses,
    };
    own.dma = Some(dma(0));
    let all = told(&own, &[]);
    assert_eq!(
        all[1],
        "a core fetches and accesses data through a port each"
    );
    let memory = "4096 bytes of memory at 0x20010000 are accessed in a time that nobody knows and \
                  fetched in 2 cycles, in banks 4";
    assert_eq!(all[4], memory);
    let more = [
        "a DMA makes an access of a core behind the bridge at 0x40000000 wait 20 cycles at most",
        "at memory the cores go before the DMA",
        "an access of a core behind the bridge at 0x40000000 waits 4 and 12 cycles at most for the \
         other core, core by core",
    ];
    assert_eq!(all[6..], more);
    own.dma = Some(dma(7));
    let accesses = "the DMA accesses memory 7 times at most between two ticks";
    assert_eq!(told(&own, &[])[7], accesses);
}

#[test]
fn targets_and_promises_are_told() {
    let mut own = board();
    own.targets = vec![(0x10, vec![0x20, 0x30, 0x40]), (0x12, vec![0x20; 5])];
    let ranges = Ranges {
        kernel: "k".to_string(),
        promises: vec!["v1: i32 [0..1] = assume v0 0 1".to_string()],
        ..Ranges::default()
    };
    let more = [
        "the Kernel `k`: `v1: i32 [0..1] = assume v0 0 1` holds, by an argument beyond intervals",
        "the indirect branch at 0x10 leads to 0x20, 0x30, 0x40, nowhere else",
        "the indirect branch at 0x12 leads to 0x20, 0x20, 0x20 or 2 places more, nowhere else",
    ];
    assert_eq!(told(&own, &[ranges])[BOARD.len()..], more);
}

/// Functions with all that is assumed of some.
fn functions() -> Vec<Function> {
    let mut keys = function("keys", Kind::Keys, 0x100);
    keys.entered = vec![(0, [-1, 7])];
    keys.bases = vec![(6, 0x4000)];
    keys.loops = vec![(0x102, 9)];
    let mut handler = function("handler", Kind::Handler, 0x300);
    handler.calls = vec![
        call(0x302, 0x100, 0, 3),
        call(0x306, 0x200, 1, 0),
        Call {
            site: 0x308,
            callee: 0x500,
            costs: None,
        },
        call(0x30a, 0x600, 9, 3),
    ];
    vec![keys, function("idle", Kind::Idle, 0x200), handler]
}

const FUNCTIONS: [&str; 5] = [
    "core 0, program 2, `keys`: R0 is 0xffffffff to 0x7 where it is entered",
    "core 0, program 2, `keys`: R6 points into the section at 0x4000 where a key's mode begins",
    "core 0, program 2, `keys`: the loop at 0x102 runs 9 times at most each time it is entered",
    "core 0, program 2, `handler`: the call at 0x302 ticks 3 keys at most",
    "core 0, program 2, `handler`: the call at 0x308 never leads to 0x500",
];

#[test]
fn a_frame_is_told() {
    let mut own = board();
    own.frames = vec![Frame {
        program: 2,
        vectors: 0x2000,
        visits: 5,
        functions: functions(),
        ..Frame::default()
    }];
    let first = [
        "core 0, program 2: the table of vectors lies at 0x2000",
        "core 0, program 2: between ticks runs what begins at 0x200, nothing else",
    ];
    let all = told(&own, &[]);
    assert_eq!(all[BOARD.len()..], [&first[..], &FUNCTIONS].concat());
    // Of two cores each one's own functions are told, and how often the other one visits.
    own.cores = 2;
    let visits = "core 0, program 2: between two ticks the other core accesses its memory 5 times \
                  at most";
    let all = told(&own, &[]);
    assert_eq!(
        all[0],
        "2 cores play; no other one fetches or accesses anything"
    );
    assert_eq!(
        all[BOARD.len()..],
        [&first[..], &[visits], &FUNCTIONS].concat()
    );
}

/// Where core 1 runs parts: its functions too, and where the cores meet.
#[test]
fn two_cores_that_meet_are_told() {
    let legs = |entries: &[u32]| {
        let mut own = function("legs", Kind::Legs, entries[0]);
        own.pieces = entries
            .iter()
            .map(|entry| Piece {
                entry: *entry,
                ..Piece::default()
            })
            .collect();
        own.loops = vec![(entries[0], 3)];
        own
    };
    let mut own = board();
    own.cores = 2;
    let mut until = function("until", Kind::Until, 0x300);
    until.until = Some((0x308, 0));
    own.frames = vec![Frame {
        functions: vec![legs(&[0x700, 0x710, 0x720]), until],
        helper: Some(Helper {
            vectors: 0x3000,
            visits: vec![2, 4],
            functions: vec![legs(&[0x800, 0x810])],
        }),
        ..Frame::default()
    }];
    let more = [
        "core 0, program 0: the table of vectors lies at 0x0",
        "core 0, program 0: between two ticks the other core accesses its memory 0 times at most",
        "core 0, program 0, `legs`: the loop at 0x700 runs 3 times at most each time it is entered",
        "core 0, program 0, `until`: no way that does not come to 0x308 starts core 1",
        "core 1, program 0, `legs`: the loop at 0x800 runs 3 times at most each time it is entered",
        "core 1 runs its legs for ever: its table of vectors lies at 0x3000; nobody but the other \
         core writes the words that a core waits for, and both have one clock",
        "a number that the other core has written is found after 3 rounds of a wait at most",
        "core 0 has written its numbers where it comes to 0x710, 0x720, core 1 where it comes to \
         0x810",
        "core 0 accesses core 1's memory 2, 4 times at most in the legs of that, one after the \
         other",
    ];
    assert_eq!(told(&own, &[])[BOARD.len()..], more);
}

#[test]
fn what_is_proven_is_told() {
    let frame = |class| Checked {
        core: 1,
        program: 2,
        cycles: 90,
        key: 11,
        keys: 3,
        parts: vec![("the handler", 80), ("the rest", 10)],
        stack: 44,
        class,
        states: 17,
    };
    let ranges = Ranges {
        kernel: "k".to_string(),
        values: 21,
        stores: 5,
        promises: Vec::new(),
    };
    let own = board();
    let of = |class| explain(&own, &[frame(class)], std::slice::from_ref(&ranges));
    let sure = |class, text: &str| {
        let says = format!("3 keys or parts of at most 11 cycles; {text}\n");
        assert!(of(class).contains(&says), "{says}");
    };
    sure(Evidence::Exact, "exact: published counts are reproduced");
    sure(
        Evidence::Rule,
        "rule: documented, without an independent count",
    );
    sure(
        Evidence::Estimate,
        "estimate: the least sure number is by analogy, or a bound",
    );
    let mut lines = vec![
        "",
        "proven:",
        "  core 1 takes at most 90 of 1000 cycles from a tick's request to the return from its handler",
        "    while program 2 plays, 3 keys or parts of at most 11 cycles; exact: published counts are reproduced",
        "          80  the handler",
        "          10  the rest",
        "    its stack takes 44 bytes at most and meets nothing; 17 states were checked",
        "  every instruction that is reached decodes and lies in code of its core, fetched in a cycle;",
        "  every cycle of the code is in a loop with a bound; every return goes back to its caller;",
        "  no vector leads elsewhere than to the handler or to the end",
        "  no value of the Kernel `k` leaves its interval: 21 values follow from those that they are made of, 5 stores have room for what is stored",
        "",
        "not checked:",
    ];
    lines.extend(NOT_CHECKED);
    let assumed = format!("assumed ({}):", ALWAYS.len() + BOARD.len());
    lines.extend(["", &assumed]);
    lines.extend(ALWAYS.iter().chain(&BOARD));
    let text = of(Evidence::Exact);
    let told: Vec<&str> = text.split('\n').collect();
    assert_eq!(told.len(), lines.len());
    for (told, line) in told.iter().zip(lines) {
        assert_eq!(told.trim_start(), line.trim_start());
    }
}
