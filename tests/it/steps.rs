//! `run --steps`: what is told of a board, instruction by instruction, is what `emulate` traces of
//! the same image and the same stroke; and no tick is longer than what is proven.

use std::fmt::Write;

use serde_json::Value;
use whippen_runtime::device::Device;

use crate::cli::{Shell, bundled};
use crate::common;

/// Ticks of rest before the stroke for `emulate`: the board starts, its force comes up. The
/// firmware does something every 16 ticks, and the engine has had a multiple of them. The history
/// of the spring's words has 45 rows, and the engine begins with the first: that is behind the
/// first tick and a multiple of 45.
const REST: usize = 16 * 121;
const _: () = assert!((REST - 1).is_multiple_of(45));
/// The ticks of the stroke: rest, the way down, held.
const TICKS: [usize; 3] = [100, 200, 20];
/// The first one that is told, and how many: the contact of the organ closes there.
const TOLD: (usize, usize) = (150, 60);

/// An instruction: its address, its cycles and their reasons.
type Row = (u32, u64, String);

/// What `run --steps` tells of an instrument on a board.
fn told(shell: &Shell, program: &str, board: &str, keys: &str) -> Value {
    let [from, count] = [TOLD.0, TOLD.1].map(|n| n.to_string());
    let run = ["run", program, "--engine", "emulated"];
    let motion = ["--motion", "x.csv", "--rate", "44100"];
    let on = ["--board", board, "--keys", keys];
    let steps = [
        "--steps",
        "s.json",
        "--steps-from",
        &from,
        "--steps-ticks",
        &count,
    ];
    let (out, _) = shell.ends(0, &[&run[..], &motion, &on, &steps].concat());
    assert!(out.contains("steps: s.json"), "{out}");
    let text = std::fs::read_to_string(shell.path("s.json")).expect("written");
    serde_json::from_str(&text).expect("JSON")
}

/// The instructions of a core in each tick that is told.
fn told_rows(told: &Value, core: usize) -> Vec<Vec<Row>> {
    let mut ticks = vec![Vec::new(); TOLD.1];
    for step in told["steps"].as_array().expect("steps") {
        let number = |name: &str| step[name].as_u64().expect("a number");
        if number("core") == core as u64 {
            let why = step["why"].as_str().expect("a reason").to_string();
            let row = (number("address") as u32, number("cycles"), why);
            ticks[number("tick") as usize - TOLD.0].push(row);
        }
    }
    ticks
}

/// The instructions of a core's exceptions, in the order of a trace of `emulate`.
fn traced_rows(trace: &str, core: usize) -> Vec<Vec<Row>> {
    let (mut frames, mut inside) = (Vec::new(), false);
    for line in trace.lines().filter(|line| !line.starts_with('#')) {
        let Some((head, rest)) = line.split_at_checked(16) else {
            continue;
        };
        if head.split_whitespace().next() != Some(&core.to_string()) {
            continue;
        }
        if rest.contains("-- exception") {
            (inside, _) = (true, frames.push(Vec::new()));
        } else if rest.contains("-- return") {
            inside = false;
        } else if let (true, Some(frame)) = (inside, frames.last_mut()) {
            let address = u32::from_str_radix(&rest[2..10], 16).expect("an address");
            let (before, why) = rest.rsplit_once("  ").expect("reasons");
            let cycles = before.split_whitespace().last().expect("cycles");
            let cycles = cycles.parse().expect("cycles");
            frame.push((address, cycles, why.to_string()));
        }
    }
    frames
}

/// The words of a stroke, and the places (m) that they stand for, a line each.
fn stroke(file: &str) -> (Vec<u16>, String) {
    let model = common::instruments(file, &[]).remove(0).model;
    let device = Device::of(&model);
    let port = device.ports_of(&model)[0];
    let [up, down] = [0.0, 8e-3].map(|x| f64::from(port.word(x).0));
    let [rest, way, held] = TICKS;
    let place = |tick: usize| {
        let part = (tick.saturating_sub(rest) as f64 / way as f64).min(1.0);
        (up + part * (down - up)) as u16
    };
    let words: Vec<u16> = (0..rest + way + held).map(place).collect();
    let mut places = String::new();
    for word in &words {
        writeln!(places, "{}", port.sensed(*word)).expect("a text grows");
    }
    (words, places)
}

/// The words of all keys: at rest, then on the stroke. The first is read before the first tick.
fn words(stroke: &[u16], keys: usize) -> Vec<u8> {
    let rest = std::iter::repeat_n(stroke[0], REST + 1);
    let ticks = rest.chain(stroke.iter().copied());
    ticks
        .flat_map(|word| word.to_le_bytes().repeat(keys))
        .collect()
}

#[test]
fn they_are_those_that_emulate_traces() {
    for (file, board) in [
        ("virtual-spring.whip", "rp2350"),
        ("hammond.whip", "rp2040"),
    ] {
        let (stroke, places) = stroke(file);
        let shell = Shell::new().with("x.csv", &places);
        let program = bundled(file);
        let told = told(&shell, &program, board, "3");
        std::fs::write(shell.path("words.bin"), words(&stroke, 3)).expect("writable");
        let build = [
            "build", &program, "--board", board, "--keys", "3", "-o", "i.elf",
        ];
        shell.ends(0, &build);
        let emulate = ["emulate", "i.elf", "--board", board, "--keys", "3"];
        let traced = ["--sense", "words.bin", "--trace", "trace.txt"];
        // It prints the bytes of MIDI, which are no text.
        let done = shell.run(&[&emulate[..], &traced].concat());
        assert!(done.status.success(), "{file}: {done:?}");
        let trace = std::fs::read_to_string(shell.path("trace.txt")).expect("written");
        for core in 0..2 {
            let (own, all) = (told_rows(&told, core), traced_rows(&trace, core));
            assert!(
                own.iter().all(|rows| rows.len() > 50),
                "{file}: core {core}"
            );
            let same = |from: &usize| all[*from..*from + own.len()] == own[..];
            let found: Vec<usize> = (0..=all.len() - own.len()).filter(same).collect();
            // What the organ does there it does once.
            match file {
                "hammond.whip" => assert_eq!(found, [REST + TOLD.0], "{file}: core {core}"),
                _ => assert!(found.contains(&(REST + TOLD.0)), "{file}: {found:?}"),
            }
        }
    }
}
