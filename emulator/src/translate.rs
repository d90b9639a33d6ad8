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

mod apart;
mod bits;
mod branch;
mod data;
mod emitter;
mod flags;
mod host;
mod kept;
mod leave;
mod memory;
mod multiple;
mod multiply;
mod unit;

pub(crate) use host::{Host, Native};
pub(crate) use unit::{Node, Time};

use crate::block::Block;
use emitter::Emitter;

/// Instructions of a block that are interpreted before it is translated, which takes about as
/// long. Tests translate nearly everything.
const HOT: usize = if cfg!(test) { 1 << 10 } else { 1 << 15 };
/// Translations of a block at most: one for each mode and state of the pipeline.
const CODES_MAX: usize = 8;

/// Where memory accesses of translated code are made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum RunMode {
    /// The only core: in plain memory.
    Alone,
    /// A core that runs apart.
    Apart,
}

/// What units that begin with a block have been translated to, by mode and state of the pipeline,
/// and how many instructions of it were interpreted since.
#[derive(Default)]
pub(crate) struct Translated {
    interpreted: usize,
    codes: Vec<(RunMode, u16, Native)>,
}

impl Translated {
    /// The code for a mode and the number of a state of the pipeline.
    #[inline(always)]
    pub fn code(&self, mode: RunMode, pipe: u16) -> Option<Native> {
        let mut codes = self.codes.iter();
        let found = codes.find(|code| code.0 == mode && code.1 == pipe)?;
        Some(found.2)
    }

    /// How many there are for a mode.
    #[cfg(test)]
    pub fn count(&self, mode: RunMode) -> usize {
        self.codes.iter().filter(|code| code.0 == mode).count()
    }

    /// Counts a run by the interpreter; whether the block has become hot.
    #[inline(always)]
    pub fn is_due(&mut self, instructions: usize) -> bool {
        self.interpreted += instructions;
        self.interpreted >= HOT && self.codes.len() < CODES_MAX
    }
}

/// Translates what begins with a block.
pub(crate) fn translate(host: &mut Host, blocks: &mut [Block], first: Node, mode: RunMode) {
    blocks[first.block].translated.interpreted = 0;
    let code = host.define(|builder, helpers, config| {
        Emitter::new(builder, helpers, mode, blocks).unit(first, config);
    });
    if let Some(code) = code {
        let codes = &mut blocks[first.block].translated.codes;
        codes.push((mode, first.pipe, code));
    }
}
