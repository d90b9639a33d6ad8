//! Stretches of pure instructions at random, for tests: results that do not fit are left out.

use whippen_kernel::random::Rng;
use whippen_kernel::{Builder, Op, Type, Value};

/// What is made.
pub(crate) struct RandomInsts {
    pub b: Builder,
    pub values: Vec<Value>,
}

impl RandomInsts {
    /// Adds an instruction whose result fits.
    pub fn add(&mut self, op: Op, args: &[Value]) -> Option<Value> {
        let value = self.b.op(op, args).ok()?;
        if self.b.ty(value) == Type::I32 {
            self.values.push(value);
        }
        Some(value)
    }

    /// A value, of which those that were made last are the likeliest.
    pub fn any(&self, rng: &mut Rng) -> Value {
        let newest = self.values.len() as u64 - 1;
        let back = if rng.below(3) > 0 { 6 } else { newest + 1 };
        self.values[(newest - rng.below(back.min(newest + 1))) as usize]
    }

    /// Adds an instruction at random, whose result fits.
    pub fn any_op(&mut self, rng: &mut Rng) {
        let [a, b, c] = std::array::from_fn(|_| self.any(rng));
        let n = rng.below(31) as u8;
        let same = self.b.range(a);
        let (op, args): (Op, &[Value]) = match rng.below(14) {
            0..=2 => (Op::MulTop, &[a, b]),
            3 | 4 => (Op::MacTop, &[a, b, c]),
            5 => (Op::Add, &[a, b]),
            6 => (Op::Sub, &[a, b]),
            7 | 8 => (Op::Shl(n), &[a]),
            9 => (Op::SarRound(n), &[a]),
            10 => (Op::Max, &[a, b]),
            11 => (Op::Quot(n), &[a, b]),
            12 => (Op::DivRound(n), &[a, b]),
            _ => (Op::Assume(same.low, same.high), &[a]),
        };
        self.add(op, args);
    }
}
