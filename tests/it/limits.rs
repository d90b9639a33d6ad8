//! Large inputs and long runs: work grows with the text and no faster, inputs end where their kind
//! ends, and an hour takes no more memory than a minute.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::source::SourceMap;

use crate::cli::{Shell, bundled};

#[test]
fn unclosed_brackets_are_read_in_linear_time() {
    for bracket in [
        "(",
        "[",
        "{",
        "instrument a {\n",
        "state {\n",
        "} sense { ",
        "when (",
    ] {
        let mut map = SourceMap::default();
        map.add("deep.whip", bracket.repeat(50_000));
        let start = Instant::now();
        let (program, found) = compile_front(&mut map, &Options::default());
        // It takes a fraction of a second; squares of 50 000 took one minute.
        let took = start.elapsed();
        assert!(took < Duration::from_secs(10), "{took:?} for {bracket:?}");
        assert!(program.is_none() && !found.is_empty(), "{bracket:?}");
    }
}

#[cfg(unix)]
#[test]
fn inputs_without_end_are_refused_with_their_limit() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let zero = "/dev/zero";
    let cases: [(&[&str], &str); 8] = [
        (&["check", zero], "longer than 4 MiB, the most a program"),
        (
            &["run", &grand, "--motion", zero],
            "a line is longer than 64 KiB",
        ),
        (
            &["run", &grand, "--motion", zero, "--rate", "2000"],
            "a line is longer than 64 KiB",
        ),
        (
            &[
                "run",
                &grand,
                "--motion",
                zero,
                "--rate",
                "2000",
                "--calibration",
                zero,
            ],
            "a calibration table",
        ),
        (
            &["run", &grand, "--force", zero],
            "a line is longer than 64 KiB",
        ),
        (
            &["run", &grand, "--device", zero],
            "longer than 1 MiB, the most a description",
        ),
        (
            &["run", &grand, "--midi", zero],
            "longer than 16 MiB, the most a MIDI file",
        ),
        (&["emulate", zero], "longer than 64 MiB, the most an image"),
    ];
    for (args, words) in cases {
        shell.refuses(2, args, &[words]);
    }
}

/// The most memory that a process took while it ran (kB).
#[cfg(target_os = "linux")]
fn most_memory_kb(child: &mut Child) -> u64 {
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0;
    while child.try_wait().expect("a child").is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
        most = most.max(kb.unwrap_or(0));
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(child.wait().expect("a child").success());
    most
}

#[cfg(target_os = "linux")]
#[test]
fn a_long_run_takes_no_more_memory_than_a_short_one() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let memory_kb = |seconds: &str, outputs: &[&str]| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_whippen"))
            .args(["run", &grand, "--seconds", seconds])
            .args(outputs)
            .current_dir(shell.path(""))
            .stdout(Stdio::null())
            .spawn()
            .expect("the command starts");
        most_memory_kb(&mut child)
    };
    // A run that keeps every tick takes 7 MB a second.
    let short = memory_kb("4", &[]);
    let tables = ["--out", "t.csv", "--every", "100", "--events", "e.csv"];
    let long = memory_kb("60", &tables);
    assert!(long < short + 30_000, "{short} kB for 4 s, {long} for 60 s");
    let drawn = memory_kb("60", &["--plot", "p.svg", "--report", "r.html"]);
    assert!(drawn < 250_000, "{drawn} kB");
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_a_run_and_leaves_what_was_there() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    std::os::unix::fs::symlink("/dev/full", shell.path("full.csv")).expect("a link");
    let run = ["run", &grand, "--seconds", "3600", "--out", "full.csv"];
    let start = Instant::now();
    shell.refuses(2, &run, &["full.csv: cannot be written: "]);
    let took = start.elapsed();
    assert!(
        took < Duration::from_secs(20),
        "it did not wait for the end: {took:?}"
    );
}

#[test]
fn many_strikes_are_a_line_and_a_file() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let (few, _) = shell.ends(0, &["run", &grand, "--seconds", "4.2"]);
    assert_eq!(few.matches("  note  speed_m_per_s ").count(), 7, "{few}");
    let run = ["run", &grand, "--seconds", "42", "--events", "e.csv"];
    let (many, _) = shell.ends(0, &run);
    assert!(
        many.contains("70 times note between 1.9134 and ")
            && many.contains("speed 1.200 .. 4.228 m/s")
            && many.contains("--events FILE.csv lists them"),
        "{many}"
    );
    assert!(many.lines().count() < 8, "{many}");
    let events = std::fs::read_to_string(shell.path("e.csv")).expect("written");
    assert_eq!(events.lines().filter(|l| l.contains(",note,")).count(), 70);
}
