//! Generated code on the emulator against the interpreter: every drive word, event, probe and cell,
//! bit for bit.

mod flags;
mod frame;
mod instruments;
mod listing;
mod random;
mod string;
mod target;
