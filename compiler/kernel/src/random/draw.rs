//! Random parts of kernels: types, ranges, and numbers at their edges.

use crate::{Range, Type};
use whippen_deterministic::Rng;

/// Parts of kernels drawn from a source of random numbers.
pub trait Draw {
    /// A number that is likely to be at an edge of something, within a range.
    fn interesting(&mut self, within: Range) -> i64;

    /// A range within another.
    fn range(&mut self, within: Range) -> Range;

    /// A type.
    fn ty(&mut self) -> Type;
}

impl Draw for Rng {
    fn interesting(&mut self, within: Range) -> i64 {
        let power = 1_i64 << self.below(63);
        let number = match self.below(8) {
            0 => within.low,
            1 => within.high,
            2 => self.below(5) as i64 - 2,
            3 => power,
            4 => -power,
            5 => (power - 1) * self.pick(&[1, -1]),
            6 => (self.next() as i64) >> self.below(64),
            _ => self.next() as i64,
        };
        number.clamp(within.low, within.high)
    }

    fn range(&mut self, within: Range) -> Range {
        let (a, b) = (self.interesting(within), self.interesting(within));
        Range::new(a.min(b), a.max(b))
    }

    fn ty(&mut self) -> Type {
        self.pick(&[
            Type::I1,
            Type::I32,
            Type::I32,
            Type::I32,
            Type::I64,
            Type::I64,
        ])
    }
}
