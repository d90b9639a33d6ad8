//! Conversion of integers from one unit to another.

use super::Lowerer;
use super::format::{TOP, exp2, exponent, powers};
use super::real::{Real, Scale, power_of_two};
use whippen_kernel::{Op, OpError, Range, Type, Value};

/// An offset that is no more than this part of a value's reach counts as an error where it would
/// cost an addition.
pub(super) const NEGLIGIBLE: f64 = 1.0 / 4_194_304.0;

/// Units of a value that are nothing at the ends of its range.
const FEW: i64 = 2;

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
    ) -> Result<Value, OpError> {
        self.kept(real, scale, range, 0)
    }

    /// The same for what is clamped once more: where the real is coarser, the limit is up to
    /// [`FEW`] of its units beside the ends, if that makes it one saturation.
    pub(super) fn nearly(
        &mut self,
        real: Real,
        scale: Scale,
        range: Range,
    ) -> Result<Value, OpError> {
        self.kept(real, scale, range, FEW)
    }

    fn kept(&mut self, real: Real, scale: Scale, range: Range, few: i64) -> Result<Value, OpError> {
        if real.scale() == scale {
            return self.clamped(real.value, range);
        }
        if few > 0
            && let Some(value) = self.coarse(real, scale, range, few)?
        {
            return Ok(value);
        }
        let shift = Scale::plain(scale.lsb).quantize(-scale.offset);
        let counted = self.counted(
            real,
            scale.lsb,
            Range::new(range.low - shift, range.high - shift),
            few,
        )?;
        if shift == 0 {
            return Ok(counted);
        }
        let shift = self.constant(shift)?;
        self.b.op(Op::Add, &[counted, shift])
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
    ) -> Result<Option<Value>, OpError> {
        let difference = Scale::plain(scale.lsb).quantize(real.offset - scale.offset);
        let n = power_of_two(real.lsb / scale.lsb).unwrap_or(0);
        if !(1..=20).contains(&n) || difference == 0 || !(0..=few << n).contains(&difference) {
            return Ok(None);
        }
        let units = self.constant(difference >> n)?;
        match self.b.op(Op::Add, &[real.value, units]) {
            Ok(value) => self
                .counted(
                    Real {
                        value,
                        offset: 0.0,
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
    fn counted(&mut self, real: Real, lsb: f64, range: Range, few: i64) -> Result<Value, OpError> {
        let real = if power_of_two(real.lsb / lsb).is_some() {
            self.plain(real)?
        } else {
            self.rescaled(real, lsb)?
        };
        let n = power_of_two(real.lsb / lsb).unwrap_or(0);
        if n <= 0 {
            let value = self.moved(real.value, n)?;
            return self.clamped(value, range);
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
        if word.contains(room) && ends != Range::new(low, high) {
            Ok(value)
        } else {
            self.clamped(value, range)
        }
    }
}
