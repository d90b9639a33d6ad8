//! What happened in a block, packed into a word: one bit per condition, a few per division, below a
//! leading one.
//!
//! Together with the state of the pipeline this is all that the cycles of a straight run depend on,
//! so it is the key under which they are remembered.

use crate::block::Info;
use whippen_isa::timing::{Outcome, Target};

/// Bits that a division pushes: its `quotient_bits` plus 32.
pub(crate) const DIVIDE_BITS: u32 = 6;

/// Reads outcomes back in the order in which they were pushed.
pub(crate) struct Outcomes {
    word: u64,
    left: u32,
}

impl Outcomes {
    pub fn new(word: u64) -> Self {
        Self {
            word,
            left: 63 - word.leading_zeros().min(63),
        }
    }

    fn take(&mut self, bits: u32) -> u64 {
        self.left = self.left.saturating_sub(bits);
        self.word >> self.left & ((1 << bits) - 1)
    }

    /// The outcome of the next instruction; `target` when it is the one that branched.
    pub fn next(&mut self, info: &Info, target: Option<Target>) -> Outcome {
        let mut outcome = Outcome {
            target,
            ..Outcome::NEXT
        };
        if info.conditional {
            outcome.skipped = self.take(1) == 0;
        }
        if info.divides && !outcome.skipped {
            outcome.quotient_bits = (self.take(DIVIDE_BITS) as i32 - 32) as i8;
        }
        outcome
    }
}
