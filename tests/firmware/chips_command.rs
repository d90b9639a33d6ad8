//! The commands for several chips: files, budgets, two boards that play at once.

use std::path::Path;
use std::process::{Command, Output};

use midly::MidiMessage;
use tempfile::TempDir;
use whippen_compiler::kernel::Interp;
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;

use crate::midi::messages;
use crate::rig::{KEYS, kernel};

const PIANO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");
const SPLIT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/split.whip");
const RATE_HZ: u32 = 44_100;
/// Ticks with all keys at rest: force is up, and hammers lie where they lie.
const REST: usize = 2500;

fn whippen(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    let command = command.current_dir(folder).args(args);
    command.output().expect("the command runs")
}

/// What it says where it succeeds.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = whippen(folder, args);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// All keys at rest, then all of them stroked over and over, each at a phase of its own.
fn dense(ticks: usize) -> Vec<u16> {
    let device = Device::mikey();
    // Its last strokes, which are fast, from where the key rests before them.
    let gesture = default_gesture().positions(RATE_HZ);
    let gesture = &gesture[3 * RATE_HZ as usize..];
    let motion: Vec<u16> = gesture
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    let word = |tick: usize, key: usize| {
        let begins = REST + 11 * (KEYS - key);
        motion[4 * tick.saturating_sub(begins) % motion.len()]
    };
    (0..ticks)
        .flat_map(|tick| (0..KEYS).map(move |key| word(tick, key)))
        .collect()
}

fn bytes(words: &[u16]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// A core begins to play in one of the first ticks.
const BEGINS: usize = 5;

/// The reference's drive words of all keys, which begin in that tick.
fn desktop(words: &[u16], begin: usize) -> Vec<i16> {
    let kernel = kernel("grand-piano.whip");
    let mut interp = Interp::new(&kernel, KEYS).expect("it verifies");
    interp.init(&words[..KEYS]);
    let mut all = vec![0; begin * KEYS];
    let mut drive = vec![0; KEYS];
    for row in words.chunks(KEYS).skip(begin) {
        interp.tick(row, &mut drive);
        all.extend(&drive);
    }
    all
}

/// 88 grands on two chips: each key's drive words are those of the reference on all 88 keys, no
/// tick is missed, and the notes of both come out of the second chip.
#[test]
fn two_chips_play_88_grands_as_the_desktop() {
    let folder = TempDir::new().expect("a folder");
    let at = folder.path();
    said(
        at,
        &["build", PIANO, "--board", "rp2350*2", "-o", "piano.elf"],
    );
    let ticks = 6000;
    let words = dense(ticks);
    std::fs::write(at.join("words.bin"), bytes(&words)).expect("it is written");
    let told = whippen(
        at,
        &[
            "emulate",
            "piano.elf",
            "--board",
            "rp2350 * 2",
            "--sense",
            "words.bin",
            "--drive",
            "drive.bin",
        ],
    );
    let errors = String::from_utf8_lossy(&told.stderr);
    assert!(told.status.success(), "{errors}");
    let text = told.stdout.windows(9).position(|own| own == b"  chip 1 ");
    let (midi, text) = told
        .stdout
        .split_at(text.expect("what is said behind the bytes"));
    let text = String::from_utf8_lossy(text);
    println!("{text}");
    let in_time = "ticks of 44 keys, 0 overruns, 0 missed\n";
    assert_eq!(text.matches(in_time).count(), 2, "{text}");
    let drive = std::fs::read(at.join("drive.bin")).expect("drive words");
    let drive: Vec<i16> = drive
        .chunks_exact(2)
        .map(|pair| i16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    let played: Vec<Vec<i16>> = (0..BEGINS).map(|begin| desktop(&words, begin)).collect();
    let mut full = 0;
    for core in 0..4 {
        let keys = 22 * core..22 * (core + 1);
        let of_core = |all: &[i16]| -> Vec<i16> {
            let rows = all.chunks(KEYS).skip(REST);
            rows.flat_map(|row| &row[keys.clone()]).copied().collect()
        };
        let found = of_core(&drive);
        let begin = played.iter().position(|all| of_core(all) == found);
        println!("core {core} plays as the desktop that begins in tick {begin:?}");
        assert!(begin.is_some(), "core {core}");
        full += found.iter().filter(|word| **word != 0).count();
    }
    println!("{} drive words, {full} of them forces", 88 * (ticks - REST));
    assert!(full > 22 * (ticks - REST));
    let notes: Vec<u8> = messages(midi)
        .into_iter()
        .filter_map(|message| match message {
            MidiMessage::NoteOn { key, .. } => Some(key.as_int()),
            _ => None,
        })
        .collect();
    let of_first = notes.iter().filter(|note| **note < 21 + 44).count();
    println!(
        "{of_first} notes of chip 1, {} of chip 2",
        notes.len() - of_first
    );
    assert!(of_first > 5 && notes.len() - of_first > 5, "{notes:?}");
}

/// Each chip is proven by itself.
#[test]
fn the_budget_tells_both_chips() {
    let folder = TempDir::new().expect("a folder");
    let args = ["budget", PIANO, "--board", "rp2350*2"];
    let text = said(folder.path(), &args);
    for (chip, keys) in [(1, "A0 .. E4"), (2, "F4 .. C8")] {
        let line = format!("chip {chip} of 2, keys {keys}");
        assert!(text.lines().any(|own| own == line), "{text}");
    }
    assert_eq!(text.matches("44 keys at 44100 Hz").count(), 2);
    let json = said(folder.path(), &[&args[..], &["--json"]].concat());
    let chips: Vec<serde_json::Value> = json
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let keys: Vec<&serde_json::Value> = chips.iter().map(|own| &own["chip"]["keys"]).collect();
    assert_eq!(
        keys,
        [&serde_json::json!([0, 43]), &serde_json::json!([44, 87])]
    );
}

/// What several chips cannot have is told, and nothing is written.
#[test]
fn what_several_chips_cannot_have() {
    let folder = TempDir::new().expect("a folder");
    let at = folder.path();
    for (args, why) in [
        (
            vec!["build", PIANO, "--board", "rp2350*0", "-o", "a.elf"],
            "1 to 16",
        ),
        (
            vec!["build", PIANO, "--board", "rp2350*2", "-o", "a.o"],
            "whole images",
        ),
        (
            vec![
                "build",
                PIANO,
                "--board",
                "rp2350*2",
                "--monitor",
                "-o",
                "a.elf",
            ],
            "the monitor takes",
        ),
        (
            vec![
                "build", PIANO, "--board", "rp2350*2", "--keys", "3", "-o", "a.elf",
            ],
            "give 4 or more",
        ),
        (
            vec!["budget", PIANO, "--board", "rp2350*2", "--most-keys"],
            "of one chip",
        ),
        (
            vec!["emulate", "a.elf", "--board", "rp2350*2", "--call", "f"],
            "of one chip",
        ),
        (
            vec!["emulate", "a.elf", "--board", "rp235*2"],
            "known boards are",
        ),
        (
            vec!["emulate", "a.elf", "--board", "rp2350*2"],
            "a.chip1.elf",
        ),
        (
            vec!["build", SPLIT, "--board", "rp2350*4", "-o", "a.elf"],
            "live parameters",
        ),
    ] {
        let output = whippen(at, &args);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {errors}");
        assert!(errors.contains(why), "{args:?}: {errors}");
    }
    // The second chip's file cannot be written: nor is the first one's.
    std::fs::create_dir(at.join("b.chip2.elf")).expect("a folder");
    let output = whippen(at, &["build", PIANO, "--board", "rp2350*2", "-o", "b.elf"]);
    assert_eq!(output.status.code(), Some(2));
    let left: Vec<_> = std::fs::read_dir(at).expect("a folder").collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

/// A keyboard that says how many chips it is on.
const ON_TWO: &str = "keyboard desk { board rp2350 * 2 rate 44100 Hz keys A0 .. C8 \
                      programs virtual_spring }\n";

#[test]
fn a_keyboard_says_on_how_many_chips_it_is() {
    let folder = TempDir::new().expect("a folder");
    let at = folder.path();
    let spring = include_str!("../../instruments/virtual-spring.whip");
    std::fs::write(at.join("desk.whip"), format!("{ON_TWO}{spring}")).expect("it is written");
    let chips = |args: &[&str]| {
        let out = TempDir::new().expect("a folder");
        let to = out.path().join(args[0]);
        let all = [
            &["build", "desk.whip", "-o", to.to_str().expect("a name")],
            &args[1..],
        ];
        said(at, &all.concat());
        let made = std::fs::read_dir(out.path()).expect("a folder");
        let names = made.map(|file| file.expect("a file").file_name());
        let of_chips = names.filter(|name| name.to_string_lossy().contains("chip"));
        of_chips.count()
    };
    assert_eq!(chips(&["d.elf"]), 2);
    // What the command line says wins, and what is for no chip has none.
    assert_eq!(chips(&["d.elf", "--board", "rp2350"]), 0);
    assert_eq!(chips(&["d.o"]), 0);
    assert_eq!(chips(&["d.c"]), 0);
    let told = said(at, &["budget", "desk.whip"]);
    assert_eq!(
        told.matches("chip 2 of 2, keys F4 .. C8").count(),
        1,
        "{told}"
    );
    for (args, why) in [
        (
            &["budget", "desk.whip", "--most-keys"][..],
            "`--board rp2350`",
        ),
        (&["run", "desk.whip", "--engine", "emulated"], "on 2 chips"),
    ] {
        let output = whippen(at, args);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {errors}");
        assert!(errors.contains(why), "{args:?}: {errors}");
    }
}
