//! Dynamic binary translation: a block that runs often becomes a function of the host, made by
//! Cranelift.
//!
//! ```text
//!   block, counted while it is interpreted --hot--> emit: one piece per instruction
//!      |                                              |   native: registers in SSA values
//!      |                                              |   else: a call of the interpreter's function
//!   (op.run)(cpu, bus, op) per instruction        machine code: (cpu, bus, maps) -> flow, done
//! ```
//!
//! Only what instructions do is translated. Cycles, the state of the pipeline and the next block
//! follow from what happened in the block, as after interpreting it (`memo`).
//!
//! Registers are read once and written through, so that memory always holds them; flags and
//! outcomes are written where the function is left. Loads and stores of plain memory are made in
//! place. Whatever they are refused for (alignment, devices, decoded code, a limit of the stack)
//! calls the interpreter's function for that instruction, before anything of it has been done.

mod bits;
mod branch;
mod data;
mod emitter;
mod flags;
mod host;
mod memory;
mod multiple;
mod multiply;

pub(crate) use host::{Code, Host};

use crate::block::Block;
use emitter::Emitter;

/// Instructions of a block that are interpreted before it is translated, which takes about as
/// long. Tests translate nearly everything.
const HOT: u32 = if cfg!(test) { 1 << 6 } else { 1 << 14 };

/// Where memory accesses of translated code are made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mode {
    /// The only core: in plain memory.
    Alone,
    /// A core that runs apart.
    Apart,
}

/// What a block has been translated to, and how often it ran without.
#[derive(Default)]
pub(crate) struct Translated {
    runs: [u32; 2],
    code: [Option<Code>; 2],
}

impl Translated {
    /// The function for a mode.
    #[inline(always)]
    pub fn code(&self, mode: Mode) -> Option<Code> {
        self.code[mode as usize]
    }

    /// Counts a run by the interpreter; whether it was the one that makes the block hot.
    #[inline(always)]
    pub fn is_due(&mut self, mode: Mode, instructions: usize) -> bool {
        let runs = &mut self.runs[mode as usize];
        let before = *runs;
        *runs = before.saturating_add(instructions as u32);
        before < HOT && *runs >= HOT
    }
}

/// Translates a block.
#[cold]
#[inline(never)]
pub(crate) fn translate(host: &mut Host, block: &mut Block, mode: Mode) {
    let code = host.define(|builder, helpers, config| {
        Emitter::new(builder, helpers, mode).block(&block.ops, &block.infos, config);
    });
    block.translated.code[mode as usize] = code;
}
