//! Sensed values: the word as accepted, and its differentiators, exact in integers and in O(1).
//!
//! Over the window `w_0 .. w_(N-1)` (oldest first) three sums are kept: `S0 = sum w_i`, `S1 = sum i w_i`,
//! `S2 = sum i^2 w_i`. When `w` enters and `o = w_0` leaves,
//!
//! ```text
//!   S2 <- S2 - 2 S1 + (S0 - o) + (N-1)^2 w      S1 <- S1 - (S0 - o) + (N-1) w      S0 <- S0 - o + w
//! ```
//!
//! With `m = (N-1)/2` the slope of the least-squares line is `(S1 - m S0) / sum j^2` per tick, and the second derivative of
//! the least-squares parabola `2 (S2 - 2m S1 + m^2 S0 - m(m+1)/3 S0) / sum p_j^2` with `p_j = j^2 - m(m+1)/3`. The
//! integers are exact, so nothing drifts. That the sums stay within what N words can add up to follows from what they
//! are, not from the recursion: they are `assume`d, and the checked interpreter tests it.

use super::Lowerer;
use super::format::exp2;
use super::real::Real;
use crate::kernel::{Op, OpError, Range, Type, Value};
use crate::model::{Node, Sense};

/// What the tick knows of all senses.
#[derive(Debug, Default)]
pub(super) struct Inputs {
    senses: Vec<Input>,
}

#[derive(Debug)]
struct Input {
    port: u32,
    accepted: Range,
    /// Cell of the last word, and how far a word may move from it.
    slew: Option<(u32, i64)>,
    window: Option<Window>,
    /// This tick's values.
    word: Option<Value>,
    slope: Option<Real>,
    curvature: Option<Real>,
}

#[derive(Debug)]
struct Window {
    line: u32,
    ticks: u32,
    /// Cells of S0, S1 and, where x'' is used, S2.
    sums: Vec<(u32, Type, Range)>,
}

/// `sum i^power` over the window.
fn weight(ticks: u32, power: u32) -> i64 {
    (0..i64::from(ticks)).map(|i| i.pow(power)).sum()
}

impl Lowerer<'_> {
    /// Declares ports, lines and sums, and writes the kernel's `init`: the window is filled with the first word.
    pub(super) fn declare_senses(&mut self) -> Result<(), OpError> {
        self.b.begin_init();
        for (index, sense) in self.step.model.senses.iter().enumerate() {
            let port = self.b.input(&sense.name, Range::new(0, 65_535));
            let (low, high) = self.scales.words_in(sense.range);
            let accepted = Range::new(low, high);
            let word = self.b.op(Op::In(port), &[])?;
            let word = self.clamped(word, accepted)?;
            let slew = sense.slew_per_s.map(|speed| {
                let cell = self.b.cell(&format!("{}.word", sense.name), Type::I32, accepted, low);
                (cell, self.scales.words_per_tick(speed, self.step.model.rate_hz))
            });
            if let Some((cell, _)) = slew {
                self.b.effect(Op::Set(cell), &[word])?;
            }
            let window = self.declare_window(index as u32, sense, accepted, word)?;
            let input = Input { port, accepted, slew, window, word: None, slope: None, curvature: None };
            self.inputs.senses.push(input);
        }
        Ok(())
    }

    fn declare_window(
        &mut self,
        index: u32,
        sense: &Sense,
        accepted: Range,
        first: Value,
    ) -> Result<Option<Window>, OpError> {
        let uses = |node: &Node| self.step.model.dag.nodes().any(|(_, n)| n == node);
        let curvature = uses(&Node::Curvature(index));
        if !curvature && !uses(&Node::Slope(index)) {
            return Ok(None);
        }
        let ticks = sense.window;
        let line = self.b.line(&format!("{}.history", sense.name), ticks, accepted);
        self.b.effect(Op::Fill(line), &[first])?;
        let mut sums = Vec::new();
        for power in 0..if curvature { 3 } else { 2 } {
            let total = weight(ticks, power);
            let range = Range::new(accepted.low * total, accepted.high * total);
            // The recursion passes through values a little larger.
            let ty = if range.high * 2 <= Type::I32.range().high { Type::I32 } else { Type::I64 };
            let cell = self.b.cell(&format!("{}.s{power}", sense.name), ty, range, range.low);
            let first = self.typed(first, ty)?;
            let total = self.b.constant(ty, total)?;
            let start = self.b.op(Op::Mul, &[first, total])?;
            self.b.effect(Op::Set(cell), &[start])?;
            sums.push((cell, ty, range));
        }
        Ok(Some(Window { line, ticks, sums }))
    }

    /// Reads the words of this tick and updates the differentiators.
    pub(super) fn tick_senses(&mut self) -> Result<(), OpError> {
        for index in 0..self.inputs.senses.len() {
            let input = &self.inputs.senses[index];
            let (port, accepted, slew) = (input.port, input.accepted, input.slew);
            let word = self.b.op(Op::In(port), &[])?;
            let mut word = self.clamped(word, accepted)?;
            if let Some((cell, step)) = slew {
                word = self.slewed(word, cell, step, accepted)?;
            }
            self.inputs.senses[index].word = Some(word);
            if self.inputs.senses[index].window.is_some() {
                self.differentiate(index, word)?;
            }
        }
        Ok(())
    }

    fn slewed(&mut self, word: Value, cell: u32, step: i64, accepted: Range) -> Result<Value, OpError> {
        let last = self.b.op(Op::Get(cell), &[])?;
        let step = self.constant(step)?;
        let (low, high) = (self.b.op(Op::Sub, &[last, step])?, self.b.op(Op::Add, &[last, step])?);
        let raised = self.b.op(Op::Max, &[word, low])?;
        let held = self.b.op(Op::Min, &[raised, high])?;
        // Between the last word and this one, both accepted.
        let held = self.b.op(Op::Assume(accepted.low, accepted.high), &[held])?;
        self.b.effect(Op::Set(cell), &[held])?;
        Ok(held)
    }

    fn differentiate(&mut self, index: usize, word: Value) -> Result<(), OpError> {
        let Some(window) = &self.inputs.senses[index].window else { return Ok(()) };
        let (line, ticks, sums) = (window.line, window.ticks, window.sums.clone());
        let oldest = self.b.op(Op::Delay(line, ticks), &[])?;
        let mut before = Vec::new();
        for &(cell, ..) in &sums {
            before.push(self.b.op(Op::Get(cell), &[])?);
        }
        let rest = self.b.op(Op::Sub, &[before[0], oldest])?;
        let last = i64::from(ticks) - 1;
        let s0 = self.b.op(Op::Add, &[rest, word])?;
        let mut after = vec![self.stored_sum(sums[0], s0)?];
        let s1 = self.recursion(sums[1], (before[1], rest), false, (word, last))?;
        after.push(self.stored_sum(sums[1], s1)?);
        if let Some(&third) = sums.get(2) {
            let kept = self.typed(before[2], third.1)?;
            let twice = self.typed(before[1], third.1)?;
            let twice = self.b.op(Op::Shl(1), &[twice])?;
            let kept = self.b.op(Op::Sub, &[kept, twice])?;
            let s2 = self.recursion(third, (kept, rest), true, (word, last * last))?;
            after.push(self.stored_sum(third, s2)?);
        }
        self.slope_and_curvature(index, &after)
    }

    /// `kept -+ rest + factor * word` in the type of the sum.
    fn recursion(
        &mut self,
        (_, ty, _): (u32, Type, Range),
        (kept, rest): (Value, Value),
        plus: bool,
        (word, factor): (Value, i64),
    ) -> Result<Value, OpError> {
        let (kept, rest, word) = (self.typed(kept, ty)?, self.typed(rest, ty)?, self.typed(word, ty)?);
        let moved = self.b.op(if plus { Op::Add } else { Op::Sub }, &[kept, rest])?;
        let factor = self.b.constant(ty, factor)?;
        let entering = self.b.op(Op::Mul, &[word, factor])?;
        self.b.op(Op::Add, &[moved, entering])
    }

    fn stored_sum(&mut self, (cell, _, range): (u32, Type, Range), value: Value) -> Result<Value, OpError> {
        let value = self.b.op(Op::Assume(range.low, range.high), &[value])?;
        self.b.effect(Op::Set(cell), &[value])?;
        Ok(value)
    }

    fn slope_and_curvature(&mut self, index: usize, sums: &[Value]) -> Result<(), OpError> {
        let sense = &self.step.model.senses[index];
        let (m, rate) = ((i64::from(sense.window) - 1) / 2, f64::from(self.step.model.rate_hz));
        let width = self.inputs.senses[index].accepted;
        let width = width.high - width.low;
        let squares: i64 = (-m..=m).map(|j| j * j).sum();
        let slope = self.centred(&[(sums[1], 1), (sums[0], -m)], width * (1..=m).sum::<i64>())?;
        let lsb = self.scales.sensor_lsb * rate / squares as f64;
        self.inputs.senses[index].slope = Some(self.differentiated(slope, lsb)?);
        if let [s0, s1, s2] = *sums {
            // Weights 3 j^2 - m (m + 1), or a third of that where it is whole.
            let third = if m * (m + 1) % 3 == 0 { 1 } else { 3 };
            let mean = third * m * (m + 1) / 3;
            let p = |j: i64| third * j * j - mean;
            let reach = width * (-m..=m).map(p).filter(|p| *p > 0).sum::<i64>();
            let bend = self.centred(&[(s2, third), (s1, -2 * third * m), (s0, p(m))], reach)?;
            let squares: i64 = (-m..=m).map(|j| p(j) * p(j)).sum();
            let lsb = 2.0 * third as f64 * self.scales.sensor_lsb * rate * rate / squares as f64;
            self.inputs.senses[index].curvature = Some(self.differentiated(bend, lsb)?);
        }
        Ok(())
    }

    /// `sum factor * value`, exactly; its weights add up to nothing, so it stays within `-reach .. reach`.
    fn centred(&mut self, terms: &[(Value, i64)], reach: i64) -> Result<Value, OpError> {
        let largest = |v: Value| self.b.range(v).high;
        let through: i64 = terms.iter().map(|&(v, f)| largest(v) * f.abs()).sum();
        let narrow = through <= Type::I32.range().high && terms.iter().all(|(v, _)| self.b.ty(*v) == Type::I32);
        let ty = if narrow { Type::I32 } else { Type::I64 };
        let mut total = None;
        for &(value, factor) in terms {
            let mut term = self.typed(value, ty)?;
            if factor != 1 {
                let factor = self.b.constant(ty, factor)?;
                term = self.b.op(Op::Mul, &[term, factor])?;
            }
            total = Some(match total {
                None => term,
                Some(so_far) => self.b.op(Op::Add, &[so_far, term])?,
            });
        }
        let total = total.map_or_else(|| self.b.constant(ty, 0), Ok)?;
        self.b.op(Op::Assume(-reach, reach), &[total])
    }

    /// A differentiator's integer as a 32-bit real; long windows lose low bits here and nowhere else.
    fn differentiated(&mut self, integer: Value, lsb: f64) -> Result<Real, OpError> {
        if self.b.ty(integer) == Type::I32 {
            return Ok(Real { value: integer, lsb, offset: 0.0, bits: None, error: 0.0 });
        }
        let reach = self.b.range(integer).high;
        let extra = (64 - reach.leading_zeros() as i32 - 30).max(0);
        let shifted = if extra > 0 { self.b.op(Op::SarRound(extra as u8), &[integer])? } else { integer };
        let value = self.b.op(Op::Narrow, &[shifted])?;
        let lsb = lsb * exp2(extra);
        let error = if extra > 0 { 0.5 * lsb } else { 0.0 };
        Ok(Real { value, lsb, offset: 0.0, bits: None, error })
    }

    /// Pushes this tick's words; nothing reads the lines any more.
    pub(super) fn tick_histories(&mut self) -> Result<(), OpError> {
        for index in 0..self.inputs.senses.len() {
            let input = &self.inputs.senses[index];
            if let (Some(window), Some(word)) = (&input.window, input.word) {
                let line = window.line;
                self.b.effect(Op::Push(line), &[word])?;
            }
        }
        Ok(())
    }

    pub(super) fn sensed(&self, sense: u32) -> Option<Real> {
        let value = self.inputs.senses[sense as usize].word?;
        let (lsb, offset) = (self.scales.sensor_lsb, self.scales.sensor_zero);
        Some(Real { value, lsb, offset, bits: None, error: 0.0 })
    }

    pub(super) fn slope(&self, sense: u32) -> Option<Real> {
        self.inputs.senses[sense as usize].slope
    }

    pub(super) fn curvature(&self, sense: u32) -> Option<Real> {
        self.inputs.senses[sense as usize].curvature
    }

    /// `value` in type `ty`, which is not narrower.
    fn typed(&mut self, value: Value, ty: Type) -> Result<Value, OpError> {
        if self.b.ty(value) == ty { Ok(value) } else { self.b.op(Op::Widen, &[value]) }
    }
}
