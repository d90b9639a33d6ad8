//! Spending time on the targets.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use whippen_compiler::kernel::random::Rng;

use crate::targets::{TARGETS, Target};
use crate::{SLOW, mutate, seeds};

/// An input that went wrong, and how.
#[derive(Debug)]
pub struct Finding {
    /// The target's name.
    pub target: &'static str,
    /// What went wrong.
    pub what: String,
    /// The input, cut down.
    pub input: Vec<u8>,
}

/// Hands a target an input; what went wrong, if anything.
pub fn attempt(target: &'static Target, input: &[u8]) -> Option<String> {
    let (done, ended) = mpsc::channel();
    let owned = input.to_vec();
    let worker = std::thread::Builder::new()
        .stack_size(8 << 20)
        .spawn(move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| (target.try_it)(&owned)));
            let _ = done.send(outcome.unwrap_or_else(|panic| {
                let text = panic.downcast_ref::<String>().cloned();
                Err(format!(
                    "panic: {}",
                    text.or(panic.downcast_ref::<&str>().map(|s| s.to_string()))
                        .unwrap_or_default()
                ))
            }));
        });
    if worker.is_err() {
        return Some("no thread could be started".to_string());
    }
    match ended.recv_timeout(SLOW) {
        Ok(outcome) => outcome.err(),
        Err(_) => Some(format!(
            "took more than {} s, or overflowed its stack",
            SLOW.as_secs()
        )),
    }
}

/// All inputs that once failed, of all targets.
pub fn old_findings() -> (usize, Vec<Finding>) {
    let (mut tried, mut found) = (0, Vec::new());
    for target in TARGETS {
        for (name, input) in seeds::findings(target) {
            tried += 1;
            let failed = attempt(target, &input);
            found.extend(failed.map(|what| Finding {
                target: target.name,
                what: format!("{name}: {what}"),
                input,
            }));
        }
    }
    (tried, found)
}

/// Mutated inputs for so long, and at most so many of a target, on the targets in turn (or one of
/// them); how many of each, and the first finding of each.
pub fn spend(
    time: Duration,
    inputs_max: fn(&Target) -> u64,
    seed: u64,
    only: Option<&str>,
) -> (Vec<(&'static str, u64)>, Vec<Finding>) {
    let (mut tried, mut found) = (Vec::new(), Vec::new());
    let targets: Vec<&'static Target> = TARGETS
        .iter()
        .filter(|t| only.is_none_or(|name| name == t.name))
        .collect();
    for target in &targets {
        let seeds = seeds::of(target);
        let mut rng = Rng::new(seed);
        let until = Instant::now() + time / targets.len() as u32;
        let mut count = 0;
        while count < inputs_max(target) && Instant::now() < until {
            let input = mutate::mutate(&mut rng, &seeds);
            count += 1;
            if let Some(what) = attempt(target, &input) {
                found.push(Finding {
                    target: target.name,
                    what,
                    input: smaller(target, input),
                });
                break;
            }
        }
        tried.push((target.name, count));
    }
    (tried, found)
}

/// Without the lines that do not matter.
fn smaller(target: &'static Target, input: Vec<u8>) -> Vec<u8> {
    let mut lines: Vec<Vec<u8>> = input
        .split_inclusive(|b| *b == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    let until = Instant::now() + SLOW;
    let mut size = lines.len().div_ceil(2).max(1);
    while Instant::now() < until {
        let mut at = 0;
        while at < lines.len() && Instant::now() < until {
            let mut fewer = lines.clone();
            fewer.drain(at..(at + size).min(fewer.len()));
            if attempt(target, &fewer.concat()).is_some() {
                lines = fewer
            } else {
                at += size
            }
        }
        if size == 1 {
            break;
        }
        size /= 2;
    }
    lines.concat()
}
