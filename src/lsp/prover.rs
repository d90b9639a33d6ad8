//! Proves costs beside the conversation with the editor: a proof takes longer than a keystroke.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::panic::catch_unwind;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use whippen_compiler::Memo;

use super::cost::{Cost, KNOWN_MAX, cost};
use crate::beside::Source;

/// A document whose cost is asked for.
#[derive(Debug)]
pub struct Job {
    pub uri: String,
    /// Which state of all documents it is of.
    pub state: u64,
    pub program: Vec<Source>,
    pub board: OsString,
}

/// What came of a job.
#[derive(Debug)]
pub struct Proven {
    pub uri: String,
    pub state: u64,
    pub cost: Result<Cost, String>,
}

/// Does jobs in a thread of its own, of each document only the last that waits, and hands on what
/// came of them for as long as somebody wants it.
pub fn start(done: impl Fn(Proven) -> bool + Send + 'static) -> Sender<Job> {
    let (sender, jobs) = channel();
    thread::spawn(move || work(&jobs, done));
    sender
}

fn work(jobs: &Receiver<Job>, done: impl Fn(Proven) -> bool) {
    let mut waiting: BTreeMap<String, Job> = BTreeMap::new();
    let known = Memo::new(KNOWN_MAX);
    while let Ok(job) = jobs.recv() {
        waiting.insert(job.uri.clone(), job);
        while let Some((uri, job)) = {
            jobs.try_iter().for_each(|job| {
                waiting.insert(job.uri.clone(), job);
            });
            waiting.pop_first()
        } {
            let found = catch_unwind(|| cost(&job.program, &job.board, &known));
            let cost = found.unwrap_or_else(|_| Err(format!("a defect in Whippen: {uri}")));
            let state = job.state;
            if !done(Proven { uri, state, cost }) {
                return;
            }
        }
    }
}
