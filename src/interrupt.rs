//! Signals that end the command: Ctrl-C, a request to terminate, a terminal that is closed.
//!
//! Files that are being written are removed, and the command ends with 130, as shells count a
//! Ctrl-C. Whoever has something to end in order first takes the first signal ([`take_first`]).
//! A signal that the caller has ignored (a hangup under `nohup`) stays ignored, the others are
//! heard.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

#[cfg(not(target_family = "wasm"))]
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
#[cfg(not(target_family = "wasm"))]
use signal_hook::iterator::Signals;
#[cfg(not(target_family = "wasm"))]
use whippen_runtime::files::abandon_unfinished;

#[cfg(not(target_family = "wasm"))]
use crate::exit::INTERRUPTED;

/// Whether the first signal has come, where it stops work in order.
static STOPPED: AtomicBool = AtomicBool::new(false);

/// What the first signal does instead of ending the command.
type Job = Box<dyn FnOnce() + Send>;

static FIRST: Mutex<Option<Job>> = Mutex::new(None);

/// Begins to listen. Nobody sends signals to a module in a browser, which is ended from outside.
#[cfg(target_family = "wasm")]
pub fn listen() {}

/// Begins to listen. Where no handler can be installed, signals do what they do by themselves.
#[cfg(not(target_family = "wasm"))]
pub fn listen() {
    let (ends, ignored) = ([SIGINT, SIGTERM, SIGHUP], ignored());
    let heard = ends
        .into_iter()
        .filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let Ok(mut signals) = Signals::new(heard) else {
        return;
    };
    std::thread::spawn(move || {
        for _ in signals.forever() {
            match replace_first(None) {
                Some(job) => job(),
                None => end(),
            }
        }
    });
}

/// The signals that the caller has ignored, which a command inherits (POSIX, `execve`), a bit each
/// from signal 1 on; none where the system has no `/proc` to say so (proc_pid_status(5), `SigIgn`).
#[cfg(not(target_family = "wasm"))]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or_default()
}

/// The first signal does this; the next one ends the command at once.
pub fn take_first(job: impl FnOnce() + Send + 'static) {
    replace_first(Some(Box::new(job)));
}

/// The first signal turns this on, for work that then ends with what it has done; the next one ends
/// the command at once.
pub fn stops() -> &'static AtomicBool {
    take_first(|| STOPPED.store(true, Ordering::Relaxed));
    &STOPPED
}

fn replace_first(job: Option<Job>) -> Option<Job> {
    let mut first = FIRST.lock().unwrap_or_else(PoisonError::into_inner);
    std::mem::replace(&mut first, job)
}

#[cfg(not(target_family = "wasm"))]
fn end() {
    abandon_unfinished();
    std::process::exit(INTERRUPTED.into());
}
