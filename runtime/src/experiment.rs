//! Experiments as data: what is played, what is drawn of it, what must hold.
//!
//! ```text
//!   text --file--> Experiment --bind (columns, events)--> Bound --judge (Trace)--> Verdict ..
//! ```
//!
//! An experiment is a TOML file whose words are few: instruments, a player, instants with names
//! (`t1`), a figure, and claims about the trace. A claim is one of a closed list, and each can
//! fail. Names and units are judged before anything runs ([`Bound::new`]).
//!
//! Not here: reading and compiling of programs, and what is printed (the command).

mod bind;
pub mod bundled;
mod claims;
mod columns;
mod figure;
mod file;
mod judge;
mod repeated;
mod steps;

pub use bind::Bound;
pub use columns::Part;
pub use file::{Experiment, Instrument, Mover, Repeated};
pub use judge::Verdict;
pub use repeated::Stretch;
