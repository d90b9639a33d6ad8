//! Random operands: values in sight, constants, and values brought into a range.

use super::Draw;
use super::Generator;
use crate::{Builder, Op, OpError, Range, Type, Value};

impl Generator {
    /// A value of this type.
    pub(super) fn value(&mut self, b: &mut Builder, ty: Type) -> Result<Value, OpError> {
        let found: Vec<Value> = self
            .pool
            .iter()
            .copied()
            .filter(|value| b.ty(*value) == ty)
            .collect();
        // What was defined last is taken most, so that chains grow.
        let recent = &found[found.len().saturating_sub(4)..];
        match self.rng.below(8) {
            0..=2 if !found.is_empty() => Ok(self.rng.pick(&found)),
            3..=5 if !recent.is_empty() => Ok(self.rng.pick(recent)),
            6 => self.constant(b, ty.range(), ty),
            _ => self.source(b, ty),
        }
    }

    /// A constant of this type within a range.
    pub(super) fn constant(
        &mut self,
        b: &mut Builder,
        within: Range,
        ty: Type,
    ) -> Result<Value, OpError> {
        let value = self.rng.interesting(within);
        b.constant(ty, value)
    }

    /// A value that comes from outside or from another type.
    fn source(&mut self, b: &mut Builder, ty: Type) -> Result<Value, OpError> {
        match ty {
            Type::I32 => {
                let port = self.rng.below(b.kernel().inputs.len() as u64) as u32;
                b.op(Op::In(port), &[])
            }
            Type::I64 => {
                let word = self.value(b, Type::I32)?;
                b.op(Op::Widen, &[word])
            }
            Type::I1 => {
                let word = self.value(b, Type::I32)?;
                let around = b.range(word);
                let level = self.constant(b, around, Type::I32)?;
                let op = self.rng.pick(&[Op::Lt, Op::Le, Op::Eq]);
                b.op(op, &[word, level])
            }
        }
    }

    /// The value, brought into the range.
    pub(super) fn fit(
        &mut self,
        b: &mut Builder,
        value: Value,
        range: Range,
    ) -> Result<Value, OpError> {
        let (ty, mut value) = (b.ty(value), value);
        if range.contains(b.range(value)) {
            return Ok(value);
        }
        if ty == Type::I1 {
            return self.constant(b, range, ty);
        }
        if self.rng.chance(1, 2) {
            value = self.shrink(b, value, range)?;
        }
        let (low, high) = (b.constant(ty, range.low)?, b.constant(ty, range.high)?);
        let raised = if b.range(value).low < range.low {
            b.op(Op::Max, &[value, low])?
        } else {
            value
        };
        if b.range(raised).high > range.high {
            b.op(Op::Min, &[raised, high])
        } else {
            Ok(raised)
        }
    }

    /// Shifts right until the value is about as wide as the range.
    fn shrink(&mut self, b: &mut Builder, value: Value, range: Range) -> Result<Value, OpError> {
        let bits = |range: Range| {
            64 - range
                .low
                .unsigned_abs()
                .max(range.high.unsigned_abs())
                .leading_zeros()
        };
        let excess = bits(b.range(value))
            .saturating_sub(bits(range))
            .min(b.ty(value).bits() - 1) as u8;
        let op = self.rng.pick(&[Op::Sar(excess), Op::SarRound(excess)]);
        b.op(op, &[value])
    }

    /// A smaller value made of this one.
    pub(super) fn squeeze(&mut self, b: &mut Builder, value: Value) -> Result<Value, OpError> {
        let ty = b.ty(value);
        if ty == Type::I1 {
            return Ok(value);
        }
        let bits = 1 + self.rng.below(u64::from(ty.bits()) / 2 - 1);
        self.fit(b, value, Range::new(-(1 << bits), (1 << bits) - 1))
    }
}
