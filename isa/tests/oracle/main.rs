//! The table against disassemblers and assemblers that others wrote.
//!
//! * Capstone (Thumb, M class, with and without v8) reads every row with random operands, every halfword and random words:
//!   it decodes what we decode, and its text is ours after `normal`.
//! * GNU binutils, when installed, assemble our text to our bits, for each of the three cores; refuse what a core does not
//!   have and what is UNPREDICTABLE; and objdump finds no instruction where we find none.
//!
//! Every difference that remains is a line of `capstone::KNOWN` or of the lists in `binutils`, with its reason; a line
//! that no longer applies fails the test.

mod binutils;
mod capstone;
mod normal;
mod samples;
