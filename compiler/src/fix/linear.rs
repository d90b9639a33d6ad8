//! Sums of scaled values: `c0 + sum c_i * x_i` with one rounding.

use super::format::{exp2, quantise};
use super::real::Real;
use super::{Lowerer, format};
use crate::kernel::{Op, OpError, Range, Type, Value};
use crate::source::Span;

/// Largest result of a sum: a word, less what coefficients and the final shift may round.
const WORD_TOP: f64 = 2_147_483_000.0;

/// A sum in units of its result: `constant + sum gain_i * integer_i`.
struct Scaled {
    constant: f64,
    /// Gain, integer, largest magnitude of the integer.
    terms: Vec<(f64, Value, f64)>,
    /// Error brought along by the operands, in units of the result.
    inherited: f64,
}

impl Scaled {
    /// Largest magnitude of a gain.
    fn gain(&self) -> f64 {
        self.terms.iter().map(|(gain, ..)| gain.abs()).fold(0.0, f64::max)
    }
}

impl Lowerer<'_> {
    /// The sum with so many fraction bits, or fewer: where the integers' range is wider than was thought, and where an
    /// operand is so much coarser than its range would allow (`min` of a small and a large value is) that its
    /// coefficient would not be a word.
    pub(super) fn sum(&mut self, c0: f64, terms: &[(f64, Real)], bits: i32) -> Result<Real, OpError> {
        let mut bits = bits;
        let mut scaled = self.scaled(c0, terms, exp2(-bits));
        while self.reach(&scaled) > WORD_TOP || scaled.gain() > format::TOP {
            bits -= 1;
            scaled = self.scaled(c0, terms, exp2(-bits));
        }
        let lsb = exp2(-bits);
        let (value, error) = match self.by_shifts(&scaled)? {
            Some(value) => (value, (scaled.constant - scaled.constant.round()).abs()),
            None => {
                let (wide, error) = self.accumulated(&scaled, &[])?;
                (self.b.op(Op::Narrow, &[wide])?, error)
            }
        };
        Ok(Real::fixed(value, bits, (error + scaled.inherited) * lsb))
    }

    /// The sum in units of `lsb`, kept within `range`; each term was asked for at a place, where that is known.
    pub(super) fn sum_within(
        &mut self,
        c0: f64,
        terms: &[(f64, Real)],
        places: &[Option<Span>],
        lsb: f64,
        range: Range,
    ) -> Result<Value, OpError> {
        let scaled = self.scaled(c0, terms, lsb);
        let (wide, _) = self.accumulated(&scaled, places)?;
        let word = Type::I32.range();
        let kept = self.clamped(wide, if word.contains(self.b.range(wide)) { word } else { range })?;
        let value = self.b.op(Op::Narrow, &[kept])?;
        self.clamped(value, range)
    }

    /// Largest magnitude of the sum, in units of its result.
    fn reach(&self, sum: &Scaled) -> f64 {
        let end = |high: bool| {
            let of = |&(gain, value, _): &(f64, Value, f64)| {
                let range = self.b.range(value);
                gain * if (gain > 0.0) == high { range.high } else { range.low } as f64
            };
            sum.constant + sum.terms.iter().map(of).sum::<f64>()
        };
        end(true).abs().max(end(false).abs())
    }

    fn scaled(&self, c0: f64, terms: &[(f64, Real)], lsb: f64) -> Scaled {
        let constant = terms.iter().fold(c0, |sum, (c, real)| sum + c * real.offset) / lsb;
        let inherited = terms.iter().map(|(c, real)| c.abs() * real.error / lsb).sum();
        let magnitude = |value| {
            let range = self.b.range(value);
            range.low.unsigned_abs().max(range.high.unsigned_abs()) as f64
        };
        let term = |(c, real): &(f64, Real)| (c * real.lsb / lsb, real.value, magnitude(real.value));
        Scaled { constant, terms: terms.iter().map(term).collect(), inherited }
    }

    /// Without a multiplication, where every gain is a whole power of two up to sign and no partial sum leaves 32 bits.
    fn by_shifts(&mut self, sum: &Scaled) -> Result<Option<Value>, OpError> {
        let Some(shifts) = sum.terms.iter().map(|&(gain, ..)| power_of_two(gain)).collect::<Option<Vec<u8>>>() else {
            return Ok(None);
        };
        match self.shifted(sum, &shifts) {
            Err(OpError::Overflow { .. }) => Ok(None),
            other => other.map(Some),
        }
    }

    /// Positive terms first, so that no sum begins with a negation; without any, from the constant downwards.
    fn shifted(&mut self, sum: &Scaled, shifts: &[u8]) -> Result<Value, OpError> {
        let terms = || sum.terms.iter().zip(shifts);
        let (plus, minus) = (terms().filter(|((g, ..), _)| *g > 0.0), terms().filter(|((g, ..), _)| *g <= 0.0));
        let mut constant = sum.constant.round() as i64;
        let mut total = None;
        for ((gain, value, _), &shift) in plus.chain(minus) {
            let term = if shift == 0 { *value } else { self.b.op(Op::Shl(shift), &[*value])? };
            total = Some(match total {
                None if *gain > 0.0 => term,
                None => {
                    let start = self.constant(std::mem::take(&mut constant))?;
                    self.b.op(Op::Sub, &[start, term])?
                }
                Some(so_far) => self.b.op(if *gain > 0.0 { Op::Add } else { Op::Sub }, &[so_far, term])?,
            });
        }
        match (total, constant) {
            (Some(total), 0) => Ok(total),
            (None, _) => self.constant(constant),
            (Some(total), _) => {
                let constant = self.constant(constant)?;
                self.b.op(Op::Add, &[total, constant])
            }
        }
    }

    /// By multiply-accumulate: every coefficient as a 32-bit integer over `2^shift`, half a unit added first, so that the
    /// final shift rounds half up. A shift by 32 takes the upper word for nothing; smaller ones leave room for large gains.
    /// Gives a 64-bit value in units of the result, and the error in those units.
    fn accumulated(&mut self, sum: &Scaled, places: &[Option<Span>]) -> Result<(Value, f64), OpError> {
        let gain = sum.gain();
        let reach: f64 = sum.constant.abs() + sum.terms.iter().map(|(g, _, m)| g.abs() * m).sum::<f64>();
        let room = |shift: i32| gain * exp2(shift) <= format::TOP && reach * exp2(shift) <= exp2(61);
        let shift = (0..=32).rev().find(|&s| room(s)).unwrap_or(0);
        let unit = exp2(-shift);
        let half = if shift > 0 { 1i64 << (shift - 1) } else { 0 };
        let mut total = self.b.constant(Type::I64, quantise(sum.constant, unit) + half)?;
        let mut error = 0.5 + unit;
        for (index, (gain, value, magnitude)) in sum.terms.iter().enumerate() {
            let coefficient = quantise(*gain, unit);
            error += (coefficient as f64 * unit - gain).abs() * magnitude;
            let add = |s: &mut Self| {
                let coefficient = s.constant(coefficient)?;
                s.b.op(Op::MacWide, &[total, *value, coefficient])
            };
            total = match places.get(index).copied().flatten() {
                Some(place) => self.from_place(place, None, add)?,
                None => add(self)?,
            };
        }
        Ok((self.b.op(Op::Sar(shift as u8), &[total])?, error))
    }
}

/// `n` where `gain` is plus or minus `2^n`, 0 <= n <= 30.
fn power_of_two(gain: f64) -> Option<u8> {
    (0..=30u8).find(|&n| gain.abs() == exp2(i32::from(n)))
}
