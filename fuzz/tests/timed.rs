//! The corpus of old findings, then new inputs from a fixed seed: so many of each target that every
//! machine tries the same, cut off after two minutes. `WHIPPEN_FUZZ_SECONDS` takes as many as fit
//! in that time.

use std::time::Duration;

use whippen_fuzz::run::{Finding, old_findings, spend};
use whippen_fuzz::targets::Target;

fn told(found: &[Finding]) -> String {
    let one = |f: &Finding| {
        format!(
            "{}: {}\n{}\n",
            f.target,
            f.what,
            String::from_utf8_lossy(&f.input)
        )
    };
    found.iter().map(one).collect()
}

#[test]
fn nothing_panics_hangs_or_is_a_defect() {
    let (old, found) = old_findings();
    assert!(found.is_empty(), "{}", told(&found));
    let seconds = whippen_need::asked("WHIPPEN_FUZZ_SECONDS");
    let inputs_max: fn(&Target) -> u64 = if seconds.is_some() {
        |_| u64::MAX
    } else {
        |target| target.inputs
    };
    let (tried, found) = spend(
        Duration::from_secs(seconds.unwrap_or(120)),
        inputs_max,
        20,
        None,
    );
    println!("{old} old findings; new inputs: {tried:?}");
    assert!(found.is_empty(), "{}", told(&found));
    assert!(tried.iter().all(|(_, count)| *count > 0), "{tried:?}");
}
