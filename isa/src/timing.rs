//! Cycles: what each instruction costs on each core, and why.
//!
//! ```text
//!   cores::*        facts: one line per kind of instruction, with its source and how sure it is
//!      |
//!   Core::prepare   Inst -> Timed      everything that the instruction alone decides; once per instruction
//!      |
//!   Core::issue     Pipe, Timed, address, Outcome -> Pipe, Cost      a pure function; once per execution
//! ```
//!
//! [`Core::issue`] is all there is: whoever executes tells what only execution knows (the
//! [`Outcome`]: was the condition met, where did the branch go, how long was the division, how long
//! did the bus wait) and keeps the [`Pipe`], which is what the pipeline remembers between two
//! instructions. Nothing else does it depend on, so an emulator, a static bound and a scheduler
//! count the same cycles by the same lines, and a block may be counted once per entry [`Pipe`].
//!
//! ```
//! use whippen_isa::timing::{Core, Outcome, Pipe};
//! use whippen_isa::{Arch, ItState, decode};
//!
//! let core = Core::cortex_m33();
//! let load = decode(0x6808, 0, Arch::V8M, ItState::OUTSIDE).unwrap(); // ldr r0, [r1]
//! let add = decode(0x1840, 0, Arch::V8M, ItState::OUTSIDE).unwrap(); // adds r0, r0, r1
//! let (pipe, cost) = core.issue(Pipe::default(), &core.prepare(&load), 0x2000_0000, &Outcome::NEXT);
//! assert_eq!(cost.cycles(), 1);
//! let (_, cost) = core.issue(pipe, &core.prepare(&add), 0x2000_0002, &Outcome::NEXT);
//! assert_eq!(cost.to_string(), "2: 1 issue, 1 late r0");
//! ```
//!
//! # How an instruction is counted
//!
//! A timeline of issue cycles. An instruction issues when its operands are there and its unit is
//! free; it takes its own cycles; a taken branch then waits for the first instruction from its
//! target. Two 16-bit instructions share a cycle when the second is *folded* into the first.
//! Folding looks back, never ahead: a NOP or IT is charged its cycle, and the 16-bit instruction
//! after it then costs one less. The sum is the manual's, in which the NOP is the one that costs
//! nothing.
//!
//! [`programs`] reads the little programs, with a count on paper, by which every number of a table
//! is tested; a self-test runs them on a chip.
//!
//! # What is not here
//!
//! Waiting for memory: it depends on the device and on who else uses it, and arrives as
//! [`Outcome::waits`]. Exceptions: [`Core::exceptions`] has their cycles; when they happen is the
//! emulator's.

mod cost;
mod facts;
mod issue;
mod outcome;
mod pipe;
mod program;
mod sources;
mod timed;

pub use cost::{Cost, Reason};
pub use facts::{
    Branches, Core, Division, Evidence, Exceptions, Fact, Kind, Line, Rules, Takers, Worst,
};
pub use outcome::{Outcome, Target};
pub use pipe::Pipe;
pub use program::{APSR, CODE, DATA, Program, Run, programs, rules};
pub use timed::Timed;
