//! Conversion of integers from one unit to another.

use super::Lowerer;
use super::format::{TOP, exp2, exponent, powers};
use super::real::{Real, Scale, floored, power_of_two};
use whippen_kernel::{Op, OpError, Range, Type, Value};

/// An offset that is no more than this part of a value's reach counts as an error where it would
/// cost an addition.
pub(super) const NEGLIGIBLE: f64 = 1.0 / 4_194_304.0;

/// Units of a value that are nothing at the ends of its range.
const FEW: i64 = 2;

/// A real as an integer of another scale, limited.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    pub value: Value,
    /// Bound on what one tick's roundings add to it where the limits leave it alone (SI).
    pub error: f64,
    /// How far inside the limits that were asked for it is limited (SI).
    pub beside: f64,
}

impl Kept {
    /// What no limit has touched.
    pub fn unlimited(value: Value, error: f64) -> Kept {
        Kept {
            value,
            error,
            beside: 0.0,
        }
    }
}

impl Lowerer<'_> {
    /// The same value without offset.
    pub(super) fn plain(&mut self, real: Real) -> Result<Real, OpError> {
        if real.offset == 0.0 {
            return Ok(real);
        }
        let range = self.b.range(real.value);
        let ends = [range.low, range.high].map(|word| (real.lsb * word as f64 + real.offset).abs());
        if real.offset.abs() <= NEGLIGIBLE * ends[0].max(ends[1]) {
            return Ok(Real {
                offset: 0.0,
                error: real.error + real.offset.abs(),
                ..real
            });
        }
        let room = exponent(TOP * real.lsb / ends[0].max(ends[1]).max(real.lsb)).clamp(0, 30);
        self.rescaled(real, real.lsb * exp2(-room))
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

    /// A real as an integer of `scale`, kept within `range` (of those integers) whatever it is.
    pub(super) fn saturated(
        &mut self,
        real: Real,
        scale: Scale,
        range: Range,
    ) -> Result<Kept, OpError> {
        self.kept(real, scale, range, 0)
    }

    /// The same for what is clamped once more: where the real is coarser, the limit is up to
    /// [`FEW`] of its units beside the ends, if that makes it one saturation.
    pub(super) fn nearly(
        &mut self,
        real: Real,
        scale: Scale,
        range: Range,
    ) -> Result<Kept, OpError> {
        self.kept(real, scale, range, FEW)
    }

    fn kept(&mut self, real: Real, scale: Scale, range: Range, few: i64) -> Result<Kept, OpError> {
        if real.scale() == scale {
            return Ok(Kept {
                value: self.clamped(real.value, range)?,
                error: real.error,
                beside: 0.0,
            });
        }
        if few > 0
            && let Some(kept) = self.coarse(real, scale, range, few)?
        {
            return Ok(kept);
        }
        let shift = Scale::plain(scale.lsb).quantize(-scale.offset);
        let kept = match self.shifted(real, scale.lsb, range, few, shift) {
            Err(OpError::Overflow { .. }) => self.shifted_first(real, scale.lsb, range, shift)?,
            kept => kept?,
        };
        Ok(Kept {
            error: kept.error + (scale.offset + shift as f64 * scale.lsb).abs(),
            ..kept
        })
    }

    /// A real in units of `lsb`, `shift` of them higher, kept within `range`.
    fn shifted(
        &mut self,
        real: Real,
        lsb: f64,
        range: Range,
        few: i64,
        shift: i64,
    ) -> Result<Kept, OpError> {
        let below = Range::new(range.low - shift, range.high - shift);
        let counted = self.counted(real, lsb, below, few)?;
        if shift == 0 {
            return Ok(counted);
        }
        let shift = self.constant(shift)?;
        let value = self.b.op(Op::Add, &[counted.value, shift])?;
        Ok(Kept { value, ..counted })
    }

    /// The same of a coarser real, where `range` without the shift is no word: what is whole of the
    /// shift in the real's own units is added there.
    fn shifted_first(
        &mut self,
        real: Real,
        lsb: f64,
        range: Range,
        shift: i64,
    ) -> Result<Kept, OpError> {
        let real = self.in_powers(real, lsb)?;
        let n = power_of_two(real.lsb / lsb).unwrap_or(0).clamp(0, 31);
        let whole = shift >> n;
        let rest = shift - (whole << n);
        let ends = Range::new(-(-range.low >> n), (range.high - rest) >> n);
        let own = Range::new(ends.low - whole, ends.high - whole);
        let kept = self.clamped(real.value, own)?;
        let (whole, part) = (self.constant(whole)?, self.constant(rest)?);
        let kept = self.b.op(Op::Add, &[kept, whole])?;
        let moved = self.moved(kept, n)?;
        let value = self.b.op(Op::Add, &[moved, part])?;
        let above = range.high - (ends.high << n) - rest;
        let below = (ends.low << n) + rest - range.low;
        Ok(Kept {
            value,
            error: real.error,
            beside: above.max(below).max(0) as f64 * lsb,
        })
    }

    /// A real without offset whose unit is a power of two times `lsb`.
    fn in_powers(&mut self, real: Real, lsb: f64) -> Result<Real, OpError> {
        if power_of_two(real.lsb / lsb).is_some() {
            self.plain(real)
        } else {
            self.rescaled(real, lsb)
        }
    }

    /// A real that is coarser than `scale`, and whose offset is no more than a few of its units
    /// away: it is put right by whole units of its own before it is clamped, so that one saturation
    /// is enough.
    fn coarse(
        &mut self,
        real: Real,
        scale: Scale,
        range: Range,
        few: i64,
    ) -> Result<Option<Kept>, OpError> {
        let difference = Scale::plain(scale.lsb).quantize(real.offset - scale.offset);
        let n = power_of_two(real.lsb / scale.lsb).unwrap_or(0);
        if !(1..=20).contains(&n) || difference == 0 || !(0..=few << n).contains(&difference) {
            return Ok(None);
        }
        let units = self.constant(difference >> n)?;
        let left = real.offset - scale.offset - (difference >> n) as f64 * real.lsb;
        match self.b.op(Op::Add, &[real.value, units]) {
            Ok(value) => self
                .counted(
                    Real {
                        value,
                        offset: 0.0,
                        error: real.error + left.abs(),
                        ..real
                    },
                    scale.lsb,
                    range,
                    few,
                )
                .map(Some),
            Err(_) => Ok(None),
        }
    }

    /// A real in units of `lsb`, kept within `range`, as far as `few` of the real's own units.
    fn counted(&mut self, real: Real, lsb: f64, range: Range, few: i64) -> Result<Kept, OpError> {
        let real = self.in_powers(real, lsb)?;
        let n = power_of_two(real.lsb / lsb).unwrap_or(0);
        if n <= 0 {
            let value = self.moved(real.value, n)?;
            return Ok(Kept {
                value: self.clamped(value, range)?,
                error: real.error + lsb * floored(n),
                beside: 0.0,
            });
        }
        // Coarser than wanted: clamped where nothing overflows, then moved up.
        let n = n.min(31);
        let word = Type::I32.range();
        let (above, below) = (-(-range.high >> n), range.low >> n);
        let high = if above << n <= word.high {
            above
        } else {
            range.high >> n
        };
        let low = if below << n >= word.low {
            below
        } else {
            -(-range.low >> n)
        };
        let ends = powers(Range::new(low, high), few);
        let kept = self.clamped(real.value, ends)?;
        let value = self.moved(kept, n)?;
        // What is a word with room is left to who clamps in any case.
        let room = Range::new(
            range.low.min(0) - (few << n),
            range.high.max(0) + (few << n),
        );
        let value = if word.contains(room) && ends != Range::new(low, high) {
            value
        } else {
            self.clamped(value, range)?
        };
        let inside = (range.high - (ends.high << n)).max((ends.low << n) - range.low);
        Ok(Kept {
            value,
            error: real.error,
            beside: inside.max(0) as f64 * lsb,
        })
    }
}
