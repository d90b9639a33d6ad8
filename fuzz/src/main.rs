//! `cargo run --release -p whippen-fuzz -- [--seconds N] [--seed N] [--target NAME]`: fuzzing at
//! length. Findings are written to `fuzz/findings/`; once mended they move to
//! `fuzz/corpus/TARGET/`, where every run of the tests tries them.

use std::process::ExitCode;
use std::time::Duration;

use whippen_fuzz::run::spend;
use whippen_fuzz::seeds::root;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| {
        words
            .iter()
            .position(|w| w == name)
            .and_then(|at| words.get(at + 1))
    };
    let number =
        |name: &str, default: u64| value(name).and_then(|n| n.parse().ok()).unwrap_or(default);
    let time = Duration::from_secs(number("--seconds", 60));
    let (tried, found) = spend(
        time,
        |_| u64::MAX,
        number("--seed", 1),
        value("--target").map(String::as_str),
    );
    tried
        .iter()
        .for_each(|(target, count)| println!("{target}: {count} inputs"));
    let folder = root().join("fuzz/findings");
    for (index, finding) in found.iter().enumerate() {
        let path = folder.join(format!("{}-{index}", finding.target));
        let written =
            std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, &finding.input));
        println!(
            "{}: {}\n  {} {written:?}",
            finding.target,
            finding.what,
            path.display()
        );
    }
    if found.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
