//! The table against disassemblers and assemblers that others wrote.
//!
//! * Capstone (Thumb, M class, with and without v8) reads every row with random operands, every
//!   halfword and random words: it decodes what we decode, and its text is ours after `normal`.
//! * GNU binutils, when installed, assemble our text to our bits, for each of the three cores;
//!   refuse what a core does not have and what is UNPREDICTABLE; and objdump finds no instruction
//!   where we find none.
//!
//! Capstone is also asked which registers are read and written, and whether the flags are.
//!
//! Every difference that remains is a line of `capstone::KNOWN`, of the lists in `binutils` or of
//! `registers`, with its reason; in the first two a line that no longer applies fails the test.

mod binutils;
mod capstone;
mod normal;
mod registers;
mod samples;

/// Every listed difference still exists.
fn assert_all_met(met: &[bool], reasons: impl Iterator<Item = &'static str>) {
    let stale: Vec<_> = reasons
        .zip(met)
        .filter(|(_, met)| !**met)
        .map(|(reason, _)| reason)
        .collect();
    assert!(stale.is_empty(), "no longer met: {stale:?}");
}
