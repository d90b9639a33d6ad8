//! From one format to another.

use super::format::exp2;
use super::real::Real;
use super::{Lowerer, format};
use crate::kernel::{Op, OpError, Range, Type, Value};

impl Lowerer<'_> {
    /// The same value with so many fraction bits, rounded half up where bits are dropped. The value must fit.
    pub(super) fn with_bits(&mut self, real: Real, bits: i32) -> Result<Real, OpError> {
        match real.bits {
            Some(own) if own == bits => Ok(real),
            Some(own) if own > bits => {
                let value = self.shift_right(real.value, own - bits)?;
                Ok(Real::fixed(value, bits, real.error + 0.5 * exp2(-bits)))
            }
            Some(own) => {
                let value = self.b.op(Op::Shl((bits - own).min(31) as u8), &[real.value])?;
                Ok(Real::fixed(value, bits, real.error))
            }
            None => self.sum(0.0, &[(1.0, real)], bits),
        }
    }

    /// The same value as a multiple of a power of two, as fine as its range allows.
    pub(super) fn fixed(&mut self, real: Real) -> Result<Real, OpError> {
        if real.bits.is_some() {
            return Ok(real);
        }
        let range = self.b.range(real.value);
        let ends = [range.low, range.high].map(|word| real.lsb * word as f64 + real.offset);
        let bits = format::fraction_bits(crate::model::Interval { low: ends[0], high: ends[1] });
        self.with_bits(real, bits)
    }

    /// `value / 2^n`, rounded half up; zero once nothing is left.
    pub(super) fn shift_right(&mut self, value: Value, n: i32) -> Result<Value, OpError> {
        if n > 31 {
            return self.constant(0);
        }
        self.b.op(Op::SarRound(n as u8), &[value])
    }

    /// `value` kept within `range`, with as many comparisons as its own range asks for.
    pub(super) fn clamped(&mut self, value: Value, range: Range) -> Result<Value, OpError> {
        let ty = self.b.ty(value);
        let mut value = value;
        if self.b.range(value).low < range.low {
            let low = self.b.constant(ty, range.low)?;
            value = self.b.op(Op::Max, &[value, low])?;
        }
        if self.b.range(value).high > range.high {
            let high = self.b.constant(ty, range.high)?;
            value = self.b.op(Op::Min, &[value, high])?;
        }
        Ok(value)
    }

    /// A real with so many fraction bits, kept within `range` (in units of that format) whatever it is.
    pub(super) fn saturated(&mut self, real: Real, bits: i32, range: Range) -> Result<Value, OpError> {
        let real = self.fixed(real)?;
        let own = real.bits.unwrap_or(bits);
        if own >= bits {
            let value = self.with_bits(real, bits)?.value;
            return self.clamped(value, range);
        }
        // Coarser than wanted: clamp where nothing overflows, in 64 bits.
        let wide = self.b.op(Op::Widen, &[real.value])?;
        let shifted = self.b.op(Op::Shl((bits - own).min(31) as u8), &[wide])?;
        let kept = self.clamped(shifted, range)?;
        self.b.op(Op::Narrow, &[kept])
    }

    /// `value` as a constant with so many fraction bits.
    pub(super) fn constant_real(&mut self, value: f64, bits: i32) -> Result<Real, OpError> {
        let quantised = format::quantise(value, exp2(-bits));
        let error = (value - quantised as f64 * exp2(-bits)).abs();
        Ok(Real::fixed(self.b.constant(Type::I32, quantised)?, bits, error))
    }
}
