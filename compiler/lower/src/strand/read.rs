//! What is read of a string at a place: the cubic through four points, and its slope.
//!
//! A displacement is the sum of what it grows by along the parts from where the string begins, in
//! 64 bits.

use super::super::Lowerer;
use super::super::format::{self, exp2};
use super::super::real::Real;
use super::Grids;
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{NodeId, Reading, Strand, StrandId};

/// Bits behind the point of a place in parts.
const PLACE: u8 = 20;
/// Bits behind the point of weights.
pub(super) const WEIGHT: u8 = 30;
/// What is in a word by a weight is so many bits coarser.
const COARSER: i32 = 32 - WEIGHT as i32;
/// Bits of a displacement that is read.
const DISPLACEMENT: i32 = 30;

/// Bits behind the point of the sum of their squares, whose coefficients reach past 2.
pub(super) const SPREAD_BITS: u8 = 29;
/// Most that an inner weight is, and that an outer one is below zero.
const INNER: i64 = (1 << WEIGHT) + 8;
const OUTER: i64 = (1 << (WEIGHT - 4)) + (1 << (WEIGHT - 8));

/// The sum of the squares of the weights as a cubic of `s = t^2`, with `t` from the middle between
/// two points, from the third power on.
const SPREAD: [f64; 4] = [5.0 / 9.0, -73.0 / 36.0, 275.0 / 144.0, 0.640625];

/// A place on a string.
#[derive(Debug, Clone, Copy)]
pub(super) enum Place {
    /// Known: the point before it (0 is the end), and how much of a part is between.
    Constant(u32, f64),
    /// The point before it, how far it is from the middle between that one and the next (a word is
    /// a part), and how far both are off (m).
    Computed {
        before: Value,
        centred: Value,
        error: f64,
    },
}

impl Lowerer<'_> {
    /// A place (m from where the string begins), held to two parts from either end.
    pub(super) fn place(&mut self, id: StrandId, place: NodeId) -> Result<Place, OpError> {
        let strand = &self.step.model.strands[id];
        if let Some(place) = self.step.model.dag.real(place) {
            let (before, part) = strand.cell(place);
            return Ok(Place::Constant(before, part));
        }
        let (parts, nearest) = (i64::from(strand.parts), i64::from(Strand::NEAREST));
        let unit = strand.part() * exp2(-i32::from(PLACE));
        let range = Range::new(nearest << PLACE, ((parts - nearest) << PLACE) - 1);
        let Real { value, error, .. } = self.word_of(place, unit, range)?;
        let before = self.b.op(Op::Sar(PLACE), &[value])?;
        // Whole parts leave the word.
        let part = self.b.op(Op::ShlWrap(32 - PLACE), &[value])?;
        let half = self.constant(i32::MIN.into())?;
        Ok(Place::Computed {
            before,
            centred: self.b.op(Op::AddWrap, &[part, half])?,
            error: error + unit,
        })
    }

    /// The part between the point before and a place, in [`WEIGHT`] bits.
    fn part_of(&mut self, centred: Value) -> Result<Value, OpError> {
        let half = self.constant(1 << (WEIGHT - 1))?;
        let part = self.b.op(Op::Sar(32 - WEIGHT), &[centred])?;
        self.b.op(Op::Add, &[part, half])
    }

    /// Index of the first of the four points around a place.
    pub(super) fn first_point(&mut self, place: Place) -> Result<Value, OpError> {
        match place {
            Place::Constant(before, _) => self.constant(i64::from(before) - 2),
            Place::Computed { before, .. } => {
                let two = self.constant(2)?;
                self.b.op(Op::Sub, &[before, two])
            }
        }
    }

    /// What the four points count, in [`WEIGHT`] bits: even and odd parts in `t`, with `s = t^2`.
    ///
    /// ```text
    ///   inner  (9 - 4 s)/16 -+ t (9 - 4 s)/8        outer  -(1 - 4 s)/16 +- t (1 - 4 s)/24
    /// ```
    pub(super) fn weights(&mut self, place: Place) -> Result<[Value; 4], OpError> {
        let t = match place {
            Place::Constant(_, part) => return self.constants(Strand::weights(part)),
            Place::Computed { centred, .. } => centred,
        };
        let square = self.squared(t)?;
        let (quarter, sixteenth) = (
            self.b.op(Op::Sar(34 - WEIGHT), &[square])?,
            self.constant(1 << (WEIGHT - 4))?,
        );
        let outer = self.b.op(Op::Sub, &[quarter, sixteenth])?;
        let half = self.constant(1 << (WEIGHT - 1))?;
        let inner = self.b.op(Op::Sub, &[half, outer])?;
        // The odd parts over -2.
        let third = self.constant(format::quantize(1.0 / 3.0, exp2(-32)))?;
        let outer_odd = self.b.op(Op::MulTop, &[outer, t])?;
        let outer_odd = self.b.op(Op::MulTop, &[outer_odd, third])?;
        let inner_odd = self.b.op(Op::MulTop, &[inner, t])?;
        let outer_odd = self.b.op(Op::Shl(1), &[outer_odd])?;
        let inner_odd = self.b.op(Op::Shl(1), &[inner_odd])?;
        let mut found = [t; 4];
        for (found, (op, even, odd)) in found.iter_mut().zip([
            (Op::Sub, outer, outer_odd),
            (Op::Sub, inner, inner_odd),
            (Op::Add, inner, inner_odd),
            (Op::Add, outer, outer_odd),
        ]) {
            let sum = self.b.op(op, &[even, odd])?;
            // Intervals do not see that both parts hang together.
            let known = match even == inner {
                true => Op::Assume(-8, INNER),
                false => Op::Assume(-OUTER, 8),
            };
            *found = self.b.op(known, &[sum])?;
        }
        Ok(found)
    }

    /// `t^2`, with 32 bits behind the point.
    fn squared(&mut self, t: Value) -> Result<Value, OpError> {
        let square = self.b.op(Op::MulTop, &[t, t])?;
        self.b.op(Op::Assume(0, 1 << 30), &[square])
    }

    /// `z = part (1 - part)`
    fn part_and_rest(&mut self, part: Value) -> Result<Value, OpError> {
        let one = self.constant((1 << WEIGHT) - 1)?;
        let rest = self.b.op(Op::Sub, &[one, part])?;
        let doubled = [
            self.b.op(Op::Shl(1), &[part])?,
            self.b.op(Op::Shl(1), &[rest])?,
        ];
        let both = self.b.op(Op::MulTop, &doubled)?;
        // A product of two parts of one.
        self.b.op(Op::Assume(0, 1 << (WEIGHT - 2)), &[both])
    }

    /// The sum of the squares of the weights at this distance from the middle, in [`SPREAD_BITS`]
    /// bits.
    pub(super) fn spread(&mut self, t: Value) -> Result<Value, OpError> {
        let unit = exp2(-i32::from(SPREAD_BITS));
        let square = self.squared(t)?;
        let [first, rest @ ..] = SPREAD;
        let mut sum = self.constant(format::quantize(first, unit))?;
        for next in rest {
            let next = self.constant(format::quantize(next, unit))?;
            sum = self.b.op(Op::MacTop, &[next, square, sum])?;
        }
        let ends = [Strand::SPREAD.low, Strand::SPREAD.high].map(|end| format::quantize(end, unit));
        // It grows from the middle outwards, and each step rounds by half a unit.
        self.b.op(Op::Assume(ends[0] - 8, ends[1] + 8), &[sum])
    }

    /// What the three differences between them count in the slope.
    fn slopes(&mut self, place: Place) -> Result<[Value; 3], OpError> {
        let part = match place {
            Place::Constant(_, part) => return self.constants(Strand::slopes(part)),
            Place::Computed { centred, .. } => self.part_of(centred)?,
        };
        let both = self.part_and_rest(part)?;
        let one_half = self.constant(1 << (WEIGHT - 1))?;
        // 1.5 z
        let half = self.b.op(Op::Sar(1), &[both])?;
        let bent = self.b.op(Op::Add, &[both, half])?;
        let half = self.b.op(Op::Sar(1), &[part])?;
        let first = self.b.op(Op::Sub, &[one_half, half])?;
        let first = self.b.op(Op::Sub, &[first, bent])?;
        let twice = self.b.op(Op::Shl(1), &[bent])?;
        let middle = self.b.op(Op::Add, &[one_half, twice])?;
        let last = self.b.op(Op::Sub, &[half, bent])?;
        Ok([first, middle, last])
    }

    fn constants<const N: usize>(&mut self, weights: [f64; N]) -> Result<[Value; N], OpError> {
        let mut values = [self.constant(0)?; N];
        for (value, weight) in values.iter_mut().zip(weights) {
            *value = self.constant(format::quantize(weight, exp2(-i32::from(WEIGHT))))?;
        }
        Ok(values)
    }

    /// A displacement, a rate or a slope at a place.
    pub(in super::super) fn read_string(
        &mut self,
        id: StrandId,
        reading: Reading,
        place: NodeId,
    ) -> Result<Real, OpError> {
        let strand = &self.step.model.strands[id];
        let known = self.step.model.dag.real(place);
        if reading == Reading::Slope
            && let Some(end) = known.and_then(|place| strand.is_end(place))
        {
            return self.slope_at_end(id, end);
        }
        let place = self.place(id, place)?;
        match reading {
            Reading::Rate => self.rate_at(id, place),
            Reading::Slope => self.slope_at(id, place),
            Reading::Displacement => self.displacement_at(id, place),
        }
    }

    /// By how much of the largest value at a point what is read or pushed may be off, because the
    /// place is.
    pub(super) fn off_by_place(&self, id: StrandId, place: Place) -> f64 {
        /// Slopes of the four weights, and what they are rounded by themselves.
        const STEEP: f64 = 4.0;
        const ROUNDED: f64 = 1.0 / 134_217_728.0;
        match place {
            Place::Constant(..) => 0.0,
            Place::Computed { error, .. } => {
                STEEP * error / self.step.model.strands[id].part() + ROUNDED
            }
        }
    }

    fn rate_at(&mut self, id: StrandId, place: Place) -> Result<Real, OpError> {
        let Grids { v, lsb, .. } = self.strands.grids[id];
        let first = self.first_point(place)?;
        let weights = self.weights(place)?;
        let mut sum = self.constant(0)?;
        // From the middle outwards no sum of what is there leaves its word.
        for at in [1, 2, 0, 3] {
            let point = self.offset(first, at)?;
            let rate = self.b.op(Op::GetAt(v), &[point])?;
            sum = self.b.op(Op::MacTop, &[sum, rate, weights[at as usize]])?;
        }
        let unit = lsb * exp2(COARSER) * f64::from(self.step.model.rate_hz);
        let reach = self.step.model.strands[id].rate;
        let error = 2.5 * unit + reach * self.off_by_place(id, place);
        Ok(Real::new(sum, unit, error))
    }

    pub(super) fn offset(&mut self, first: Value, by: i64) -> Result<Value, OpError> {
        let by = self.constant(by)?;
        self.b.op(Op::Add, &[first, by])
    }

    /// What the displacement grows by between four points.
    fn steps(&mut self, id: StrandId, first: Value) -> Result<[Value; 3], OpError> {
        let e = self.strands.grids[id].e;
        let mut steps = [first; 3];
        for (at, step) in steps.iter_mut().enumerate() {
            let part = self.offset(first, at as i64 + 1)?;
            *step = self.b.op(Op::GetAt(e), &[part])?;
        }
        Ok(steps)
    }

    /// A slope at an end, of the first or last part.
    fn slope_at_end(&mut self, id: StrandId, end: usize) -> Result<Real, OpError> {
        let Grids { e, points, lsb, .. } = self.strands.grids[id];
        let unit = 0.5 * lsb / self.step.model.strands[id].part();
        let part = self.constant([0, i64::from(points)][end])?;
        let value = self.b.op(Op::GetAt(e), &[part])?;
        Ok(Real::new(value, unit, 0.0))
    }

    fn slope_at(&mut self, id: StrandId, place: Place) -> Result<Real, OpError> {
        let lsb = self.strands.grids[id].lsb;
        let strand = &self.step.model.strands[id];
        let (part, reach) = (
            strand.part(),
            strand.reach(Reading::Slope, self.step.model.rate_hz),
        );
        let first = self.first_point(place)?;
        let slopes = self.slopes(place)?;
        let steps = self.steps(id, first)?;
        let mut sum = self.constant(0)?;
        for (step, slope) in steps.into_iter().zip(slopes) {
            sum = self.b.op(Op::MacTop, &[sum, step, slope])?;
        }
        let unit = 0.5 * lsb / part * exp2(COARSER);
        // The weights of a slope are half as steep again as those of a cubic, and reach as much
        // further.
        let moved = reach.magnitude() * self.off_by_place(id, place);
        Ok(Real::new(sum, unit, 2.5 * unit + moved))
    }

    fn displacement_at(&mut self, id: StrandId, place: Place) -> Result<Real, OpError> {
        let lsb = 0.5 * self.strands.grids[id].lsb;
        let strand = &self.step.model.strands[id];
        let range = strand.range;
        let rounds = match place {
            Place::Constant(before, _) => before,
            Place::Computed { .. } => strand.parts - Strand::NEAREST - 1,
        };
        let bend = strand.largest_bend(self.step.model.rate_hz);
        let sum = self.summed(id, place, rounds)?;
        let first = self.first_point(place)?;
        let weights = self.weights(place)?;
        let [before, here, after] = self.steps(id, first)?;
        // u_i - I_0 e_(i-1) + (I_2 + I_3) e_i + I_3 e_(i+1)
        let zero = self.constant(0)?;
        let outer = self.b.op(Op::Sub, &[zero, weights[0]])?;
        let inner = self.b.op(Op::Add, &[weights[2], weights[3]])?;
        let mut rest = zero;
        for (step, weight) in [(before, outer), (here, inner), (after, weights[3])] {
            rest = self.b.op(Op::MacTop, &[rest, step, weight])?;
        }
        let rest = self.b.op(Op::Widen, &[rest])?;
        let rest = self.b.op(Op::Shl(COARSER as u8), &[rest])?;
        let sum = self.b.op(Op::Add, &[sum, rest])?;
        // In a unit in which the whole range is a word.
        let shift = (0..32)
            .find(|n| range.magnitude() <= lsb * exp2(n + DISPLACEMENT))
            .unwrap_or(31);
        let unit = lsb * exp2(shift);
        let sum = self.b.op(Op::SarRound(shift as u8), &[sum])?;
        let ends = format::inside(range, unit);
        let sum = self.clamped(sum, ends)?;
        let value = self.b.op(Op::Narrow, &[sum])?;
        let error = 1.5 * unit + 2.0 * exp2(COARSER) * lsb + bend * self.off_by_place(id, place);
        Ok(Real::new(value, unit, error))
    }

    /// The displacement of the point before a place, in 64 bits.
    fn summed(&mut self, id: StrandId, place: Place, rounds: u32) -> Result<Value, OpError> {
        let e = self.strands.grids[id].e;
        let most = i64::from(rounds + 1) << 31;
        let range = Range::new(-most, most);
        let start = self.b.constant(Type::I64, 0)?;
        let limit = match place {
            Place::Constant(..) => None,
            Place::Computed { before, .. } => Some(before),
        };
        let results = self
            .b
            .repeat(rounds, &[(start, range)], |b, round, carried| {
                let mut step = b.op(Op::GetAt(e), &[round])?;
                if let Some(limit) = limit {
                    let is_before = b.op(Op::Lt, &[round, limit])?;
                    let none = b.constant(Type::I32, 0)?;
                    step = b.op(Op::Select, &[is_before, step, none])?;
                }
                let step = b.op(Op::Widen, &[step])?;
                let sum = b.op(Op::Add, &[carried[0], step])?;
                // So many steps of a word each.
                Ok(vec![b.op(Op::Assume(-most, most), &[sum])?])
            })?;
        Ok(results[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_is_a_cubic() {
        for step in 0..=100 {
            let part = f64::from(step) / 100.0;
            let s = (part - 0.5) * (part - 0.5);
            let found = SPREAD.into_iter().fold(0.0, |sum, next| sum * s + next);
            assert!((found - Strand::spread(part)).abs() < 1e-15, "{part}");
        }
    }
}
