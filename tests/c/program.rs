//! Many cases in one program: it reads the words of all from a file and writes everything it sees
//! to another.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::case::Case;
use crate::toolchain::Toolchain;

/// Compiles cases into one program, runs it, and compares what it writes with what the interpreter
/// says.
pub fn agree(toolchain: &Toolchain, cases: &[Case]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut input = Vec::new();
    cases.iter().for_each(|case| case.input(&mut input));
    std::fs::write(folder.path().join("input"), input).expect("writable");
    toolchain.run(folder.path(), &text(toolchain.frame(), cases));
    let output = std::fs::read(folder.path().join("output")).expect("written");
    compare(toolchain, cases, &output);
}

/// So many cases by number, `batch` of them in a program, on all processors.
pub fn agree_on(
    toolchain: &Toolchain,
    count: usize,
    batch: usize,
    case: impl Fn(usize) -> Case + Sync,
) {
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let first = next.fetch_add(batch, Ordering::Relaxed);
            if first >= count {
                return;
            }
            let cases: Vec<Case> = (first..count.min(first + batch)).map(&case).collect();
            agree(toolchain, &cases);
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..std::thread::available_parallelism().map_or(1, usize::from))
            .map(|_| scope.spawn(work))
            .collect();
        threads.into_iter().for_each(|thread| {
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        });
    });
    println!("{toolchain}: {count} cases agree");
}

const FEED: &str = include_str!("feed.c");

/// One state at a time is in memory.
fn text(frame: &str, cases: &[Case]) -> String {
    let (mut text, mut states) = (format!("{frame}{FEED}"), String::new());
    let (mut runs, mut calls) = (String::new(), String::new());
    for (number, case) in cases.iter().enumerate() {
        let (kernel, run) = case.program(number);
        text += &kernel;
        runs += &run;
        let _ = writeln!(states, "    {} s{number};", case.state(number));
        let _ = writeln!(
            calls,
            "    memset(&room, 0, sizeof room);\n    run_{number}(&room.s{number});"
        );
    }
    let _ = write!(
        text,
        "static union {{\n{states}}} room;\n{runs}static void play(void)\n{{\n{calls}}}\n"
    );
    text
}

fn compare(toolchain: &Toolchain, cases: &[Case], mut found: &[u8]) {
    for case in cases {
        let expected = case.expected();
        let (own, rest) = found.split_at(expected.len().min(found.len()));
        let differs = own.iter().zip(&expected).position(|(a, b)| a != b);
        assert!(
            differs.is_none() && own.len() == expected.len(),
            "{toolchain}: C and interp differ at byte {differs:?}, {} of {} written\n{case}",
            own.len(),
            expected.len(),
        );
        found = rest;
    }
    assert!(
        found.is_empty(),
        "{toolchain}: {} bytes too many",
        found.len()
    );
}
