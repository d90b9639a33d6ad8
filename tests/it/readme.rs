//! The commands of the README, one after the other in one folder, as somebody types them who reads
//! it from the top.

use std::os::unix::fs::symlink;
use std::path::Path;

use crate::cli::Shell;
use crate::import::recorded;

/// Commands that are not run here: what they hold, and who runs the like.
const ELSEWHERE: &[(&str, &str)] = &[
    ("cargo ", "the check builds and runs everything with it"),
    ("tests/run", "this is a part of it"),
    (
        "firmware.elf",
        "firmware of the reader's own: tests/it/emulate",
    ),
];

/// A key that goes down and up again within a second.
fn recording() -> String {
    let row = |i: u32| {
        let t_s = f64::from(i) / 1000.0;
        let x_mm = 5.0 - 5.0 * (std::f64::consts::TAU * t_s).cos();
        format!("{t_s},{x_mm:.4}\n")
    };
    "t_s,x_mm\n".to_string() + &(0..1000).map(row).collect::<String>()
}

/// A note of a second, as a MIDI file of one track with 96 steps a half second.
const SONG: &[u8] =
    b"MThd\0\0\0\x06\0\0\0\x01\0\x60MTrk\0\0\0\x0d\0\x90\x3c\x40\x81\x40\x80\x3c\x40\0\xff\x2f\0";

/// The lines of all `sh` blocks, without comments.
fn commands(document: &str) -> Vec<String> {
    let blocks = document.split("```sh\n").skip(1);
    let lines = blocks.flat_map(|block| block.split("```").next().unwrap_or("").lines());
    lines
        .map(|line| line.split('#').next().unwrap_or("").trim().to_string())
        .filter(|line| !line.is_empty())
        .collect()
}

#[test]
fn every_command_of_the_readme_does_what_it_is_there_for() {
    let readme = include_str!("../../README.md");
    let program = readme
        .split("```whip\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next());
    let shell = Shell::new()
        .with("click.whip", program.expect("a program"))
        .with("key.csv", &recording())
        .with("my-switch.csv", &recorded(None));
    std::fs::write(shell.path("song.mid"), SONG).expect("writable");
    let instruments = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments");
    std::fs::copy(
        instruments.join("hardware/mikey.toml"),
        shell.path("key.toml"),
    )
    .expect("a copy");
    symlink(instruments, shell.path("instruments")).expect("a link");
    let (mut ran, mut not_run) = (0, 0);
    for line in commands(readme) {
        if ELSEWHERE.iter().any(|(part, _)| line.contains(part)) {
            not_run += 1;
            continue;
        }
        // What goes on until it is stopped is run once.
        let line = line.replace(" --watch", "");
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[0], "whippen", "{line}");
        shell.ends(0, &words[1..]);
        for pair in words.windows(2) {
            let is_file = |flag: &str| {
                ["--plot", "--report", "--out", "--events", "-o", "--listing"].contains(&flag)
            };
            assert!(!is_file(pair[0]) || shell.path(pair[1]).exists(), "{line}");
        }
        ran += 1;
    }
    assert!(ran >= 16 && not_run <= 7, "{ran} {not_run}");
}
