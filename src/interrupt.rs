//! Signals that end the command: Ctrl-C, a request to terminate, a terminal that is closed.
//!
//! Files that are being written are removed, and the command ends with 130, as shells count a
//! Ctrl-C. Whoever has something to end in order first takes the first signal ([`take_first`]).
//! Where the caller has the signals ignored (`nohup`) they stay ignored.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

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

/// Begins to listen.
#[cfg(not(target_family = "wasm"))]
pub fn listen() {
    // That somebody else decides about the signals is no error.
    let _ = ctrlc::try_set_handler(|| match replace_first(None) {
        Some(job) => job(),
        None => end(),
    });
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
