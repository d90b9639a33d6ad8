//! Sensed values: the word as accepted, and its differentiators, exact in integers and in O(1).
//!
//! Over the window `w_-m .. w_m` (oldest first, N = 2m + 1) up to three sums tell all: `S = sum
//! w_j`, `D = sum j w_j`, `E = sum p_j w_j` with `p_j = j^2 - m(m+1)/3`. Where it fits a word, `F =
//! E + D - 2/3 m(m+1) S` is kept instead of E, because its recursion is one subtraction. When `w`
//! enters and `o` leaves,
//!
//! ```text
//!   S' <- (S + w) - o      D' <- D - (S + w) + (m+1)(o + w)      F' <- F - 2 D      E' = F' - D' + 2/3 m(m+1) S'
//!                                                            or  E' <- E - (D + D') + 2/3 m(m+1) (w - o)
//! ```
//!
//! The slope of the least-squares line is `D / sum j^2` per tick, the second derivative of the
//! least-squares parabola `2 E / sum p_j^2`. The weights `p_j` are kept threefold where a third
//! would not be whole. The integers are exact, so nothing drifts. That the sums stay within what N
//! words can add up to follows from what they are, not from the recursion: they are `assume`d, and
//! the checked interpreter tests it.

use super::Lowerer;
use super::format::exp2;
use super::real::Real;
use crate::scales::Scales;
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{Node, Sense};

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

/// A sum over the window: its cell, its type, where it stays.
#[derive(Debug, Clone, Copy)]
struct WindowSum {
    cell: u32,
    ty: Type,
    range: Range,
}

#[derive(Debug)]
struct Window {
    line: u32,
    weights: Weights,
    /// S, D and, where x'' is used, E or F.
    sums: Vec<WindowSum>,
    /// Where F is kept: where E stays.
    bend: Option<Range>,
}

/// The integers that belong to a window of N = 2m + 1 ticks.
#[derive(Debug, Clone, Copy)]
struct Weights {
    m: i64,
    /// 1, or 3 where a third of `m(m+1)` is not whole: the weights of E are that many times too
    /// large.
    third: i64,
}

impl Weights {
    fn new(ticks: u32) -> Weights {
        let m = (i64::from(ticks) - 1) / 2;
        Weights {
            m,
            third: if m * (m + 1) % 3 == 0 { 1 } else { 3 },
        }
    }

    fn ticks(self) -> i64 {
        2 * self.m + 1
    }

    /// Weight of `w_j` in E.
    fn bend(self, j: i64) -> i64 {
        self.third * j * j - self.third * self.m * (self.m + 1) / 3
    }

    /// What `w - o` counts in the recursion of E.
    fn step(self) -> i64 {
        self.third * 2 * self.m * (self.m + 1) / 3
    }

    /// `sum j^2` and `sum p_j^2`.
    fn squares(self) -> (i64, i64) {
        let all = || -self.m..=self.m;
        (
            all().map(|j| j * j).sum(),
            all().map(|j| self.bend(j) * self.bend(j)).sum(),
        )
    }

    /// Where S, D and E stay, and how large their recursions may get on the way; of F, and of E
    /// made of it, in the last place.
    fn reaches(self, accepted: Range) -> [(Range, i64); 4] {
        let (width, around) = (accepted.high - accepted.low, |reach: i64| {
            Range::new(-reach, reach)
        });
        let slope = width * (1..=self.m).sum::<i64>();
        let bend = width
            * (-self.m..=self.m)
                .map(|j| self.bend(j))
                .filter(|p| *p > 0)
                .sum::<i64>();
        let all = Range::new(accepted.low * self.ticks(), accepted.high * self.ticks());
        let other = self.third * slope + bend;
        let kept = Range::new(
            -other - self.step() * all.high,
            other - self.step() * all.low,
        );
        let most = kept.low.abs().max(kept.high.abs());
        [
            (all, all.high + accepted.high),
            (
                around(slope),
                slope + all.high + (2 * self.m + 3) * accepted.high,
            ),
            (
                around(bend),
                bend + 2 * self.third * slope + self.step() * width,
            ),
            (kept, most + 3 * self.third * slope + self.step() * all.high),
        ]
    }
}

/// Value (SI) of one unit of D, the sum behind the slope over so many ticks.
pub(super) fn slope_lsb(scales: Scales, rate_hz: f64, ticks: u32) -> f64 {
    let (lines, _) = Weights::new(ticks).squares();
    scales.sensor_lsb * rate_hz / lines as f64
}

/// Value (SI) of one unit of E, the sum behind the second derivative over so many ticks.
pub(super) fn curvature_lsb(scales: Scales, rate_hz: f64, ticks: u32) -> f64 {
    let weights = Weights::new(ticks);
    let (_, parabolas) = weights.squares();
    2.0 * weights.third as f64 * scales.sensor_lsb * rate_hz * rate_hz / parabolas as f64
}

impl Lowerer<'_> {
    /// Declares ports, lines and sums, and writes what `init` does for them: the window is filled
    /// with the first word.
    pub(super) fn declare_senses(&mut self) -> Result<(), OpError> {
        for (index, sense) in self.step.model.senses.iter().enumerate() {
            let port = self.b.input(&sense.name, Range::new(0, 65_535));
            let scales = self.scales[index];
            let (low, high) = scales.words_in(sense.range);
            let accepted = Range::new(low, high);
            let word = self.b.op(Op::In(port), &[])?;
            let word = self.clamped(word, accepted)?;
            let slew = sense.slew_per_s.map(|speed| {
                let cell = self
                    .b
                    .cell(&format!("{}.word", sense.name), Type::I32, accepted, low);
                (cell, scales.words_per_tick(speed, self.step.model.rate_hz))
            });
            if let Some((cell, _)) = slew {
                self.b.effect(Op::Set(cell), &[word])?;
            }
            let window = self.declare_window(index as u32, sense, accepted, word)?;
            let input = Input {
                port,
                accepted,
                slew,
                window,
                word: None,
                slope: None,
                curvature: None,
            };
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
        let weights = Weights::new(sense.window);
        let line = self
            .b
            .line(&format!("{}.history", sense.name), sense.window, accepted);
        self.b.effect(Op::Fill(line), &[first])?;
        let [total, slope, bend, kept] = weights.reaches(accepted);
        let keeps = kept.1 <= Type::I32.range().high;
        let third = curvature.then_some(if keeps { kept } else { bend });
        let mut sums = Vec::new();
        for (power, (range, through)) in [total, slope].into_iter().chain(third).enumerate() {
            let ty = if through <= Type::I32.range().high {
                Type::I32
            } else {
                Type::I64
            };
            let init = 0.clamp(range.low, range.high);
            let cell = self
                .b
                .cell(&format!("{}.s{power}", sense.name), ty, range, init);
            sums.push(WindowSum { cell, ty, range });
        }
        // Of equal words D and E are nothing, as declared.
        self.start(sums[0], first, weights.ticks())?;
        if let Some(&third) = sums.get(2).filter(|_| keeps) {
            self.start(third, first, -weights.step() * weights.ticks())?;
        }
        Ok(Some(Window {
            line,
            weights,
            sums,
            bend: keeps.then_some(bend.0),
        }))
    }

    /// A sum's first value, so many times the first word.
    fn start(&mut self, sum: WindowSum, first: Value, times: i64) -> Result<(), OpError> {
        let times = self.b.constant(sum.ty, times)?;
        let first = self.typed(first, sum.ty)?;
        let start = self.b.op(Op::Mul, &[first, times])?;
        self.b.effect(Op::Set(sum.cell), &[start])
    }

    /// Reads the words of this tick and updates the differentiators.
    pub(super) fn tick_senses(&mut self) -> Result<(), OpError> {
        for (index, sense) in self.step.model.senses.iter().enumerate() {
            self.from_place(sense.span, None, |s| s.tick_sense(index))?;
        }
        Ok(())
    }

    fn tick_sense(&mut self, index: usize) -> Result<(), OpError> {
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
        Ok(())
    }

    fn slewed(
        &mut self,
        word: Value,
        cell: u32,
        step: i64,
        accepted: Range,
    ) -> Result<Value, OpError> {
        let last = self.b.op(Op::Get(cell), &[])?;
        let step = self.constant(step)?;
        let (low, high) = (
            self.b.op(Op::Sub, &[last, step])?,
            self.b.op(Op::Add, &[last, step])?,
        );
        let raised = self.b.op(Op::Max, &[word, low])?;
        let held = self.b.op(Op::Min, &[raised, high])?;
        // Between the last word and this one, both accepted.
        let held = self
            .b
            .op(Op::Assume(accepted.low, accepted.high), &[held])?;
        self.b.effect(Op::Set(cell), &[held])?;
        Ok(held)
    }

    fn differentiate(&mut self, index: usize, word: Value) -> Result<(), OpError> {
        let Some(window) = &self.inputs.senses[index].window else {
            return Ok(());
        };
        let (line, weights, sums, kept) = (
            window.line,
            window.weights,
            window.sums.clone(),
            window.bend,
        );
        let oldest = self.b.op(Op::Delay(line, weights.ticks() as u32), &[])?;
        let mut before = Vec::new();
        for sum in &sums {
            before.push(self.b.op(Op::Get(sum.cell), &[])?);
        }
        let more = self.accumulate(sums[0].ty, before[0], word, 1)?;
        let all = self.accumulate(sums[0].ty, more, oldest, -1)?;
        let all = self.stored_sum(sums[0], all)?;

        let ty = sums[1].ty;
        let both = self.b.op(Op::Add, &[oldest, word])?;
        let moved = self.accumulate(ty, before[1], more, -1)?;
        let slope = self.accumulate(ty, moved, both, weights.m + 1)?;
        let slope = self.stored_sum(sums[1], slope)?;
        let mut bend = None;
        if let Some(&third) = sums.get(2) {
            bend = Some(match kept {
                Some(range) => {
                    let kept =
                        self.accumulate(third.ty, before[2], before[1], -2 * weights.third)?;
                    let kept = self.stored_sum(third, kept)?;
                    let moved = self.accumulate(third.ty, kept, slope, -weights.third)?;
                    let moved = self.accumulate(third.ty, moved, all, weights.step())?;
                    self.b.op(Op::Assume(range.low, range.high), &[moved])?
                }
                None => {
                    let change = self.b.op(Op::Sub, &[word, oldest])?;
                    let twice = self.accumulate(third.ty, before[1], slope, 1)?;
                    let moved = self.accumulate(third.ty, before[2], twice, -weights.third)?;
                    let moved = self.accumulate(third.ty, moved, change, weights.step())?;
                    self.stored_sum(third, moved)?
                }
            });
        }
        self.slope_and_curvature(index, weights, slope, bend)
    }

    /// `sum + factor * value` in this type.
    fn accumulate(
        &mut self,
        ty: Type,
        sum: Value,
        value: Value,
        factor: i64,
    ) -> Result<Value, OpError> {
        let (sum, mut value) = (self.typed(sum, ty)?, self.typed(value, ty)?);
        let magnitude = factor.unsigned_abs();
        if magnitude.is_power_of_two() && magnitude > 1 {
            value = self
                .b
                .op(Op::Shl(magnitude.trailing_zeros() as u8), &[value])?;
        } else if magnitude > 1 {
            let magnitude = self.b.constant(ty, magnitude as i64)?;
            value = self.b.op(Op::Mul, &[value, magnitude])?;
        }
        self.b
            .op(if factor < 0 { Op::Sub } else { Op::Add }, &[sum, value])
    }

    fn stored_sum(&mut self, sum: WindowSum, value: Value) -> Result<Value, OpError> {
        let value = self
            .b
            .op(Op::Assume(sum.range.low, sum.range.high), &[value])?;
        self.b.effect(Op::Set(sum.cell), &[value])?;
        Ok(value)
    }

    fn slope_and_curvature(
        &mut self,
        index: usize,
        weights: Weights,
        slope: Value,
        bend: Option<Value>,
    ) -> Result<(), OpError> {
        let rate = f64::from(self.step.model.rate_hz);
        let ticks = weights.ticks() as u32;
        let lsb = slope_lsb(self.scales[index], rate, ticks);
        self.inputs.senses[index].slope = Some(self.differentiated(slope, lsb)?);
        if let Some(bend) = bend {
            let lsb = curvature_lsb(self.scales[index], rate, ticks);
            self.inputs.senses[index].curvature = Some(self.differentiated(bend, lsb)?);
        }
        Ok(())
    }

    /// A differentiator's integer as a 32-bit real; long windows lose low bits here and nowhere
    /// else.
    fn differentiated(&mut self, integer: Value, lsb: f64) -> Result<Real, OpError> {
        if self.b.ty(integer) == Type::I32 {
            return Ok(Real::new(integer, lsb, 0.0));
        }
        let reach = self.b.range(integer).high;
        let extra = (64 - reach.leading_zeros() as i32 - 30).max(0);
        let shifted = if extra > 0 {
            self.b.op(Op::SarRound(extra as u8), &[integer])?
        } else {
            integer
        };
        let value = self.b.op(Op::Narrow, &[shifted])?;
        let lsb = lsb * exp2(extra);
        let error = if extra > 0 { 0.5 * lsb } else { 0.0 };
        Ok(Real::new(value, lsb, error))
    }

    /// Pushes this tick's words; nothing reads the lines any more.
    pub(super) fn tick_histories(&mut self) -> Result<(), OpError> {
        for (index, sense) in self.step.model.senses.iter().enumerate() {
            let input = &self.inputs.senses[index];
            if let (Some(window), Some(word)) = (&input.window, input.word) {
                let line = window.line;
                self.from_place(sense.span, None, |s| s.b.effect(Op::Push(line), &[word]))?;
            }
        }
        Ok(())
    }

    pub(super) fn sensed(&self, sense: u32) -> Option<Real> {
        let value = self.inputs.senses[sense as usize].word?;
        let scales = self.scales[sense as usize];
        let (lsb, offset) = (scales.sensor_lsb, scales.sensor_zero);
        Some(Real {
            value,
            lsb,
            offset,
            error: 0.0,
        })
    }

    pub(super) fn slope(&self, sense: u32) -> Option<Real> {
        self.inputs.senses[sense as usize].slope
    }

    pub(super) fn curvature(&self, sense: u32) -> Option<Real> {
        self.inputs.senses[sense as usize].curvature
    }

    /// `value` in type `ty`, which is not narrower.
    fn typed(&mut self, value: Value, ty: Type) -> Result<Value, OpError> {
        if self.b.ty(value) == ty {
            Ok(value)
        } else {
            self.b.op(Op::Widen, &[value])
        }
    }
}
