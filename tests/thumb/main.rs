//! Generated code on the emulator against the interpreter: every drive word, event, probe and cell,
//! bit for bit.

#[path = "../it/common.rs"]
#[expect(dead_code, reason = "other tests want more of it")]
mod common;
mod flags;
mod frame;
mod instruments;
mod listing;
mod minute;
mod programs;
#[path = "../it/random_programs/progress.rs"]
mod progress;
mod random;
mod string;
mod target;
#[path = "../it/random_programs/text.rs"]
mod text;
#[path = "../it/minute/words.rs"]
mod words;
