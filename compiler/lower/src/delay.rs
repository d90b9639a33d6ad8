//! Delay lines: what is fed in 24 bits, read at whole ticks, between them, or by an allpass.
//!
//! ```text
//!   fed     x -> a word of 31 bits -> 24 bits, towards zero, and past it by what a tick may have rounded
//!   d(t)    whole ticks i, part f:  x_i + f (x_(i+1) - x_i), 5 bits finer
//!   tuned   whole ticks i, fraction 0.3 .. 1.3:  y = x_(i+1) + eta (x_i - y1), the product towards zero
//! ```
//!
//! Words are cut towards zero, and by what a tick may have rounded up to a quarter of the last bit.
//! So one value in a loop with a gain below 1 is less in every round, and the loop ends in silence
//! instead of humming in its last bits; with an allpass in the loop that is seen, not proven.

use super::Lowerer;
use super::format::{self, exp2};
use super::real::{Real, Scale};
use super::recurrence::OverTime;
use whippen_ids::IdMap;
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{Delay, DelayId, Interval, Node, NodeId, TunedId};

/// Bits of a word that is fed, finer than those that are kept.
const GUARD: u8 = 31 - Delay::BITS as u8 + 1;
/// Bits that what is read between ticks has more than what was fed.
const BETWEEN: u8 = 5;
/// Bits that the values of an allpass have more than what was fed.
const ALLPASS: u8 = 4;
/// Cells of the table of an allpass' coefficients.
const ETA_CELLS: u8 = 4;
/// Times as whole ticks that differ by less (ticks) are the same.
const WHOLE: f64 = 1e-9;

/// The Kernel's delay lines and the memory of allpasses.
#[derive(Debug, Default)]
pub(super) struct Lines {
    lines: IdMap<DelayId, Line>,
    /// Cells of allpasses.
    tuned: IdMap<TunedId, u32>,
    /// What allpasses gave in this tick: cell and value.
    allpasses: Vec<(u32, Value)>,
    /// What is fed, as told.
    pub fed: Vec<Fed>,
}

/// A delay line of the Kernel.
#[derive(Debug, Clone, Copy)]
struct Line {
    line: u32,
    /// Value of one unit of what was fed (SI).
    lsb: f64,
    /// Integers that are fed.
    range: Range,
    /// Ticks that it lasts.
    ticks: u32,
}

/// What is fed to a delay line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fed {
    /// The line.
    pub delay: DelayId,
    /// Its last bit (SI).
    pub lsb: f64,
    /// Bound on what one tick rounds of it, the cut towards zero included (SI).
    pub error: f64,
    /// What the errors of what the line holds come to.
    pub over_time: OverTime,
}

/// A time as the Kernel has it: whole ticks and a part.
#[derive(Debug, Clone, Copy)]
enum Ago {
    /// Known: whole ticks, and the part.
    Constant(u32, f64),
    /// The integer counts `2^-bits` ticks.
    Computed { word: Value, bits: u8, error: f64 },
}

impl Lowerer<'_> {
    /// Declares the lines, which hold a tick more than they last, so that every time lies between
    /// two ticks.
    pub(super) fn declare_delays(&mut self) {
        for delay in &self.step.model.delays {
            let kept = delay.range.union(Interval::point(0.0));
            let bits = format::fraction_bits(kept);
            let lsb = exp2(i32::from(GUARD) - bits);
            // Towards zero, as what is fed.
            let range = Range::new(
                (kept.low / lsb).ceil() as i64,
                (kept.high / lsb).floor() as i64,
            );
            let name = format!("{}.history", delay.name);
            let line = Line {
                line: self.b.line(&name, delay.ticks + 1, range),
                lsb,
                range,
                ticks: delay.ticks,
            };
            self.lines.lines.push(line);
        }
        for (own, &delay) in self.step.model.tuned.enumerated() {
            let reach = self.allpass_reach(delay);
            let name = format!("{}.is{}", self.step.model.delays[delay].name, own.0);
            let cell = self.b.cell(&name, Type::I32, reach, 0);
            self.lines.tuned.push(cell);
        }
    }

    /// Integers of an allpass.
    fn allpass_reach(&self, delay: DelayId) -> Range {
        let lsb = self.lines.lines[delay].lsb * exp2(-i32::from(ALLPASS));
        let reach = (self.step.model.delays[delay].tuned_reach() / lsb).ceil() as i64;
        Range::new(-reach, reach)
    }

    /// What is to be fed in this tick.
    pub(super) fn fed(&mut self) -> Result<Vec<Value>, OpError> {
        let delays = self.step.model.delays.enumerated();
        delays
            .map(|(id, delay)| {
                let name = format!("feed {}", delay.name);
                self.from_item(&name, |s| s.fed_word(id, delay.feed))
            })
            .collect()
    }

    fn fed_word(&mut self, id: DelayId, node: NodeId) -> Result<Value, OpError> {
        let line = self.lines.lines[id];
        let fine = line.lsb * exp2(-i32::from(GUARD));
        let ends = Range::new(line.range.low << GUARD, line.range.high << GUARD);
        let real = self.real(node)?;
        let kept = self.saturated(real, Scale::plain(fine), ends)?;
        // At least what a tick rounds is taken away, but no more than a quarter of what is kept.
        let rounded = (kept.error / fine).ceil().min(exp2(i32::from(GUARD) - 2));
        let word = self.cut(kept.value, rounded as i64, GUARD)?;
        let error = kept.error.max(kept.beside) + rounded * fine + line.lsb;
        self.lines.fed.push(Fed {
            delay: id,
            lsb: line.lsb,
            error,
            over_time: match self.is_remembered(node) {
                // What was kept has errors of its own, which this tick's do not tell.
                true => OverTime::FedBack(error * f64::from(self.step.model.rate_hz)),
                false => OverTime::Bounded(error),
            },
        });
        Ok(word)
    }

    /// Whether a value is made of what is kept from tick to tick.
    fn is_remembered(&self, node: NodeId) -> bool {
        let dag = &self.step.model.dag;
        let is_kept = |id: &NodeId| {
            let node = dag.get(*id);
            matches!(
                node,
                Node::Cell(_) | Node::Tap(..) | Node::Tuned(..) | Node::Read(..)
            )
        };
        dag.below(node).iter().any(is_kept)
    }

    /// `(|value| - less) / 2^n` towards zero, with the value's sign; 0 where nothing is left.
    fn cut(&mut self, value: Value, less: i64, n: u8) -> Result<Value, OpError> {
        let range = self.b.range(value);
        let zero = self.constant(0)?;
        let mut parts = Vec::new();
        if range.high > 0 {
            let less = self.constant(less)?;
            let above = self.b.op(Op::Sub, &[value, less])?;
            let above = self.b.op(Op::Max, &[above, zero])?;
            parts.push(self.b.op(Op::Sar(n), &[above])?);
        }
        if range.low < 0 {
            let more = self.constant(less + (1 << n) - 1)?;
            let below = self.b.op(Op::Add, &[value, more])?;
            let below = self.b.op(Op::Min, &[below, zero])?;
            parts.push(self.b.op(Op::Sar(n), &[below])?);
        }
        match parts[..] {
            [] => Ok(zero),
            [one] => Ok(one),
            [a, b, ..] => {
                // One of the two is zero.
                let sum = self.b.op(Op::Add, &[a, b])?;
                let ends = Range::new(self.b.range(b).low, self.b.range(a).high);
                self.b.op(Op::Assume(ends.low, ends.high), &[sum])
            }
        }
    }

    /// Feeds the lines; nothing reads them any more.
    pub(super) fn feed(&mut self, words: &[Value]) -> Result<(), OpError> {
        for ((id, delay), &word) in self.step.model.delays.enumerated().zip(words) {
            let Line { line, range, .. } = self.lines.lines[id];
            self.from_item(&format!("feed {}", delay.name), |s| {
                let word = s.clamped(word, range)?;
                s.b.effect(Op::Push(line), &[word])
            })?;
        }
        Ok(())
    }

    /// `d(t)`
    pub(super) fn tap(&mut self, delay: DelayId, ticks: NodeId) -> Result<Real, OpError> {
        let line = self.lines.lines[delay];
        let width = (line.range.high - line.range.low) as f64 * line.lsb;
        match self.ago(line, ticks)? {
            Ago::Constant(whole, part) if part < WHOLE => {
                let value = self.b.op(Op::Delay(line.line, whole), &[])?;
                Ok(Real::new(value, line.lsb, part * width))
            }
            Ago::Constant(whole, part) => {
                let near = self.b.op(Op::Delay(line.line, whole), &[])?;
                let far = self.b.op(Op::Delay(line.line, whole + 1), &[])?;
                let word = self.constant(format::quantize(part, exp2(-31)).min(i32::MAX.into()))?;
                self.between(line, [near, far], word, width * exp2(-32))
            }
            Ago::Computed { word, bits, error } => {
                let (whole, part) = self.split(word, bits, line.ticks)?;
                let one = self.constant(1)?;
                let last = self.b.op(Op::Sub, &[whole, one])?;
                let near = self.b.op(Op::DelayAt(line.line), &[last])?;
                let far = self.b.op(Op::DelayAt(line.line), &[whole])?;
                let part = self.b.op(Op::Shl(31 - bits), &[part])?;
                self.between(line, [near, far], part, error * width)
            }
        }
    }

    /// `near + part (far - near)` with the part in 31 bits.
    fn between(
        &mut self,
        line: Line,
        [near, far]: [Value; 2],
        part: Value,
        inherited: f64,
    ) -> Result<Real, OpError> {
        let step = self.b.op(Op::Sub, &[far, near])?;
        let step = self.b.op(Op::Shl(BETWEEN + 1), &[step])?;
        let near = self.b.op(Op::Shl(BETWEEN), &[near])?;
        let value = self.b.op(Op::MacTop, &[near, step, part])?;
        // It lies between the two.
        let ends = self.b.range(near);
        let value = self.b.op(Op::Assume(ends.low, ends.high), &[value])?;
        let lsb = line.lsb * exp2(-i32::from(BETWEEN));
        Ok(Real::new(value, lsb, inherited + 0.5 * lsb))
    }

    /// `tuned(d, t)`
    pub(super) fn tuned(
        &mut self,
        delay: DelayId,
        ticks: NodeId,
        own: TunedId,
    ) -> Result<Real, OpError> {
        let line = self.lines.lines[delay];
        let (cell, reach) = (self.lines.tuned[own], self.allpass_reach(delay));
        let lsb = line.lsb * exp2(-i32::from(ALLPASS));
        let ([now, before], eta, inherited) = match self.ago(line, ticks)? {
            Ago::Constant(whole, part) => {
                let ticks = f64::from(whole) + part;
                let whole = (ticks - Delay::FRACTION_MIN).floor();
                let near = self.b.op(Op::Delay(line.line, whole as u32), &[])?;
                let far = self.b.op(Op::Delay(line.line, whole as u32 + 1), &[])?;
                let eta = Delay::allpass(ticks - whole);
                let eta = self.constant(format::quantize(eta, exp2(-31)))?;
                ([near, far], eta, reach.high as f64 * lsb * exp2(-31))
            }
            Ago::Computed { word, bits, error } => {
                let least = self.constant(format::quantize(
                    Delay::FRACTION_MIN,
                    exp2(-i32::from(bits)),
                ))?;
                let rest = self.b.op(Op::Sub, &[word, least])?;
                let (whole, part) = self.split(rest, bits, line.ticks)?;
                let one = self.constant(1)?;
                let last = self.b.op(Op::Sub, &[whole, one])?;
                let near = self.b.op(Op::DelayAt(line.line), &[last])?;
                let far = self.b.op(Op::DelayAt(line.line), &[whole])?;
                let eta = self.coefficient(part, bits)?;
                // As for a branch, both engines read the same ticks.
                let off = eta.error + error * Delay::allpass_slope();
                let width = line.range.high.max(-line.range.low) as f64 * line.lsb;
                let most = width + reach.high as f64 * lsb;
                ([near, far], eta.value, off * most)
            }
        };
        let [now, before] = [
            self.b.op(Op::Shl(ALLPASS), &[now])?,
            self.b.op(Op::Shl(ALLPASS), &[before])?,
        ];
        let last = self.load(cell)?;
        let difference = self.b.op(Op::Sub, &[now, last])?;
        let difference = self.b.op(Op::Shl(1), &[difference])?;
        let product = self.b.op(Op::MulTop, &[difference, eta])?;
        let product = self.cut(product, 1, 0)?;
        let value = self.b.op(Op::Add, &[before, product])?;
        let value = self.clamped(value, reach)?;
        self.lines.allpasses.push((cell, value));
        Ok(Real::new(value, lsb, inherited + 1.5 * lsb))
    }

    /// Coefficient of the allpass for a fraction of 0.3 and the part, in 31 bits.
    fn coefficient(&mut self, part: Value, bits: u8) -> Result<Real, OpError> {
        let shift = bits - ETA_CELLS;
        let cells = 1 << ETA_CELLS;
        let cell = self.b.op(Op::SarRound(shift), &[part])?;
        let place = self.b.op(Op::ShlWrap(32 - shift), &[part])?;
        let at = |k: f64| Delay::allpass(Delay::FRACTION_MIN + k / f64::from(cells));
        self.allpass_coefficient(&at, cell, place, i64::from(cells) + 1)
    }

    /// Whole ticks, at least 1 and at most so many, and the part.
    fn split(&mut self, word: Value, bits: u8, most: u32) -> Result<(Value, Value), OpError> {
        let whole = self.b.op(Op::Sar(bits), &[word])?;
        let whole = self.clamped(whole, Range::new(1, most.into()))?;
        let back = self.b.op(Op::Shl(bits), &[whole])?;
        let part = self.b.op(Op::Sub, &[word, back])?;
        // What is left of whole ticks.
        let part = self.b.op(Op::Assume(0, (1 << bits) - 1), &[part])?;
        Ok((whole, part))
    }

    /// A time in ticks.
    fn ago(&mut self, line: Line, ticks: NodeId) -> Result<Ago, OpError> {
        let most = line.ticks;
        if let Some(ticks) = self.step.model.dag.real(ticks) {
            let ticks = ticks.clamp(1.0, most.into());
            let (whole, part) = ((ticks + WHOLE).floor(), ticks - (ticks + WHOLE).floor());
            return Ok(Ago::Constant(whole as u32, part.max(0.0)));
        }
        // Up to 2^30 for the longest time.
        let bits = (most + 1).leading_zeros().min(20) as u8 - 2;
        let real = self.real(ticks)?;
        let unit = exp2(-i32::from(bits));
        let range = Range::new(1 << bits, i64::from(most) << bits);
        let kept = self.saturated(real, Scale::plain(unit), range)?;
        Ok(Ago::Computed {
            word: kept.value,
            bits,
            error: kept.error.max(kept.beside),
        })
    }

    /// Allpasses keep what they gave.
    pub(super) fn keep_allpasses(&mut self) -> Result<(), OpError> {
        for (cell, value) in std::mem::take(&mut self.lines.allpasses) {
            self.b.effect(Op::Set(cell), &[value])?;
        }
        Ok(())
    }
}
