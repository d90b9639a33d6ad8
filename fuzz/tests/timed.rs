//! The corpus of old findings, then a minute of new inputs from a fixed seed. `WHIPPEN_FUZZ_SECONDS` changes the minute.

use std::time::Duration;

use whippen_fuzz::run::{Finding, old_findings, spend};

fn told(found: &[Finding]) -> String {
    let one = |f: &Finding| format!("{}: {}\n{}\n", f.target, f.what, String::from_utf8_lossy(&f.input));
    found.iter().map(one).collect()
}

#[test]
fn nothing_panics_hangs_or_is_a_defect() {
    let (old, found) = old_findings();
    assert!(found.is_empty(), "{}", told(&found));
    let seconds = std::env::var("WHIPPEN_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(60);
    let (tried, found) = spend(Duration::from_secs(seconds), 20, None);
    println!("{old} old findings; new inputs: {tried:?}");
    assert!(found.is_empty(), "{}", told(&found));
    assert!(tried.iter().all(|(_, count)| *count > 0), "{tried:?}");
}
