//! Fixed-point linear combinations, `c0 + sum c_i * x_i`, planned for one 32-bit accumulator.
//!
//! In units of the result each term is `gain * integer`. A gain that is a power of two is a shifted
//! addition; any other is the top word of a product with a 32-bit coefficient, `floor(integer *
//! coefficient / 2^32 + 1/2)`, which multiply-accumulates take for nothing. A small integer is
//! shifted left as far as it goes before that. The mean rounding error of right shifts is folded
//! into the constant term, where there is one.

use super::Lowerer;
use super::chain::{Plan, PlannedTerm, TermForm};
use super::convert::NEGLIGIBLE;
use super::format::{self, exp2};
use super::real::{Real, Scale, power_of_two};
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{Node, NodeId};
use whippen_source::Span;

/// Largest gain whose coefficient is a word.
pub(super) const HALF: f64 = 0.499_999;
/// Part of it that what live values make may be: as a word it is rounded, and may be a little more.
const NEARLY: f64 = 0.96;
/// Guard bits of a sum that ends in a word of 16 bits, at most.
const GUARD: i32 = 14;
/// As many are enough for the roundings of ten terms to stay below a third of the word's unit.
const ENOUGH: i32 = 4;

/// What a term is multiplied by.
#[derive(Debug, Clone, Copy)]
pub(super) enum Factor {
    One(f64),
    /// One of two constants.
    Either(Value, f64, f64),
    /// What live values make: it is the same for all keys.
    Live(Live),
}

/// An integer made of live values, as a factor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Live {
    pub value: Value,
    /// What a unit of it counts.
    pub unit: f64,
    /// Where it lies, in units.
    pub ends: [f64; 2],
    /// Bound on what is wrong of it, in units.
    pub error: f64,
}

impl Factor {
    /// Each constant by itself; what live values make can only be scaled.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Factor {
        match self {
            Factor::One(x) => Factor::One(f(x)),
            Factor::Either(c, x, y) => Factor::Either(c, f(x), f(y)),
            Factor::Live(live) => Factor::Live(Live {
                unit: f(live.unit),
                ..live
            }),
        }
    }

    /// The constants it may be.
    pub fn both(self) -> [f64; 2] {
        match self {
            Factor::One(x) => [x, x],
            Factor::Either(_, x, y) => [x, y],
            Factor::Live(live) => live.ends.map(|end| live.unit * end),
        }
    }

    pub fn largest(self) -> f64 {
        self.both().into_iter().map(f64::abs).fold(0.0, f64::max)
    }
}

/// A term: a factor times a value, or the factor alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub factor: Factor,
    pub operand: Option<Real>,
    place: Option<Span>,
}

/// What becomes of the constant of a sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Constant {
    /// It is added, rounded to a unit; next to nothing where it comes from offsets, it is left out.
    Added,
    /// It is added however small it is: over many ticks it is not nothing.
    Kept,
    /// It is left to those who use the sum: comparisons take it for nothing, and sums of sums add
    /// once.
    Left,
}

impl Lowerer<'_> {
    /// `c * node` as a term. Constants that are chosen between are part of the factor.
    pub(super) fn term(&mut self, c: f64, node: NodeId) -> Result<Term, OpError> {
        let (factor, operand) = match *self.step.model.dag.get(node) {
            Node::Mul(a, b) => match (self.choice(a)?, self.choice(b)?) {
                (_, Some(factor)) => (factor, Some(a)),
                (Some(factor), _) => (factor, Some(b)),
                _ => match (self.live_factor(a, b)?, self.live_factor(b, a)?) {
                    (Some(factor), _) => (factor, Some(b)),
                    (_, Some(factor)) => (factor, Some(a)),
                    _ => (Factor::One(1.0), Some(node)),
                },
            },
            _ => self
                .choice(node)?
                .map_or((Factor::One(1.0), Some(node)), |factor| (factor, None)),
        };
        let operand = operand.map(|node| self.real(node)).transpose()?;
        Ok(Term {
            factor: factor.map(|f| c * f),
            operand,
            place: None,
        })
    }

    /// What live values alone make, as a factor of something that varies by key and counts from
    /// zero.
    fn live_factor(&mut self, node: NodeId, other: NodeId) -> Result<Option<Factor>, OpError> {
        let (real, other) = (self.real(node)?, self.real(other)?);
        if !self.b.is_shared(real.value)
            || self.b.is_shared(other.value)
            || real.offset != 0.0
            || other.offset != 0.0
        {
            return Ok(None);
        }
        let range = self.b.range(real.value);
        let ends = [range.low as f64, range.high as f64];
        Ok(Some(Factor::Live(Live {
            value: real.value,
            unit: real.lsb,
            ends,
            error: real.error / real.lsb,
        })))
    }

    /// `if condition then constant else constant`
    fn choice(&mut self, node: NodeId) -> Result<Option<Factor>, OpError> {
        let dag = &self.step.model.dag;
        let Node::Select(condition, a, b) = *dag.get(node) else {
            return Ok(None);
        };
        let (Some(a), Some(b)) = (dag.real(a), dag.real(b)) else {
            return Ok(None);
        };
        Ok(Some(Factor::Either(self.bool(condition)?, a, b)))
    }

    /// The sum in such integers, or in units of the next power of two above with which nothing
    /// overflows.
    pub(super) fn sum(
        &mut self,
        c0: f64,
        terms: &[Term],
        scale: Scale,
        constant: Constant,
    ) -> Result<Real, OpError> {
        let Scale { mut lsb, offset } = scale;
        loop {
            let plan = self.planned(c0 - offset, terms, lsb, 0.0, constant);
            match plan.map(|plan| self.emit_sum(plan)).transpose() {
                Ok(Some((value, error, left))) => {
                    return Ok(Real {
                        value,
                        lsb,
                        offset: offset + left * lsb,
                        error: error * lsb,
                    });
                }
                Ok(None) | Err(OpError::Overflow { .. }) if lsb < 1e30 => lsb *= 2.0,
                Ok(None) => return Err(OpError::Misused { op: Op::Add }),
                Err(error) => return Err(error),
            }
        }
    }

    /// One value in units of `lsb`, or of a power of two above it.
    pub(super) fn rescaled(&mut self, real: Real, lsb: f64) -> Result<Real, OpError> {
        if real.lsb == lsb && real.offset == 0.0 {
            return Ok(real);
        }
        self.sum(
            0.0,
            &[Term {
                factor: Factor::One(1.0),
                operand: Some(real),
                place: None,
            }],
            Scale::plain(lsb),
            Constant::Added,
        )
    }

    /// The sum in units of `lsb`, rounded half up and kept within `range`, which is one of 16 bits;
    /// each term was asked for at a place, where that is known.
    pub(super) fn sum_within(
        &mut self,
        c0: f64,
        terms: &[Term],
        places: &[Option<Span>],
        lsb: f64,
        range: Range,
    ) -> Result<Value, OpError> {
        let terms: Vec<Term> = terms
            .iter()
            .zip(places)
            .map(|(term, &place)| Term { place, ..*term })
            .collect();
        let plan = |s: &Self, guard: i32| {
            let half = if guard > 0 { exp2(guard - 1) } else { 0.0 };
            s.planned(c0, &terms, lsb * exp2(-guard), half, Constant::Added)
        };
        let mut fits = None;
        for guard in (0..=GUARD).rev() {
            match plan(self, guard)
                .map(|plan| self.emit_sum(plan))
                .transpose()
            {
                Ok(Some(_)) => fits = Some(guard),
                Ok(None) | Err(OpError::Overflow { .. }) => continue,
                Err(error) => return Err(error),
            }
            break;
        }
        // Fewer bits may make a value and product a product alone.
        let steps = |guard: &i32| plan(self, *guard).map_or(usize::MAX, |plan| plan.steps());
        let cheapest = fits.and_then(|fits| (ENOUGH.min(fits)..=fits).rev().min_by_key(steps));
        let Some((guard, plan)) = cheapest.and_then(|guard| Some((guard, plan(self, guard)?)))
        else {
            // More than 32 bits of drive words: the sum in units that hold it, then the words.
            let coarse = self.sum(c0, &terms, Scale::plain(2.0 * lsb), Constant::Added)?;
            return Ok(self.saturated(coarse, Scale::plain(lsb), range)?.value);
        };
        let (value, ..) = self.emit_sum(plan)?;
        let word = if guard > 0 {
            self.b.op(Op::Sar(guard as u8), &[value])?
        } else {
            value
        };
        self.clamped(word, range)
    }

    /// A plan of the sum in units of `lsb`, with `more` added (in units); none if a term has no
    /// form.
    pub(super) fn planned(
        &self,
        c0: f64,
        terms: &[Term],
        lsb: f64,
        more: f64,
        keep: Constant,
    ) -> Option<Plan> {
        let mut plan = Plan {
            choices: chosen_constants(terms, lsb),
            terms: self.plan_terms(terms, lsb)?,
            constant: constant_of(c0 / lsb + more, terms, lsb),
            error: terms
                .iter()
                .filter_map(|t| Some(t.factor.largest() * t.operand?.error / lsb))
                .sum(),
            left: 0.0,
        };
        plan.settle_choices();
        self.settle(&mut plan, c0 == 0.0 && more == 0.0, keep);
        let largest = plan
            .choices
            .iter()
            .map(|c| c.largest())
            .fold(plan.constant.abs(), f64::max);
        (largest <= format::TOP).then_some(plan)
    }

    /// The forms of all products; none if one has no form.
    fn plan_terms(&self, terms: &[Term], lsb: f64) -> Option<Vec<PlannedTerm>> {
        let products = terms.iter().filter_map(|term| Some((term, term.operand?)));
        products
            .map(|(term, real)| {
                let gain = term.factor.map(|f| f * real.lsb / lsb);
                Some(PlannedTerm {
                    value: real.value,
                    gain,
                    form: self.term_form(gain, real.value)?,
                    place: term.place,
                })
            })
            .collect()
    }

    /// Settles what is done with the constant and with what shifts round down.
    fn settle(&self, plan: &mut Plan, only_offsets: bool, keep: Constant) {
        let reach: f64 = plan
            .terms
            .iter()
            .map(|w| w.gain.largest() * self.magnitude(w.value))
            .sum();
        let small = plan.constant.abs() <= NEGLIGIBLE * reach && plan.constant.abs() > 0.75;
        if keep == Constant::Added && only_offsets && plan.choices.is_empty() && small {
            plan.error += std::mem::take(&mut plan.constant).abs();
        }
        let centred = !only_offsets
            || plan.constant != 0.0
            || !plan.choices.is_empty()
            || keep == Constant::Left;
        plan.error += plan
            .terms
            .iter()
            .map(|w| w.form.error(centred))
            .sum::<f64>();
        if centred {
            plan.constant += plan.terms.iter().map(|w| w.form.bias(&w.gain)).sum::<f64>();
        }
        if let Some(first) = plan.choices.first_mut() {
            *first = first.map(|f| f + plan.constant);
            plan.constant = 0.0;
        }
        if keep == Constant::Left {
            plan.left = std::mem::take(&mut plan.constant);
        }
        let rounded = |c: f64| (c - c.round()).abs();
        let chosen = |c: &Factor| match c.both() {
            [a, b] if !matches!(c, Factor::Live(_)) => rounded(a).max(rounded(b)),
            _ => 0.5,
        };
        plan.error += rounded(plan.constant) + plan.choices.iter().map(chosen).sum::<f64>();
    }

    /// The form in which a value with this gain is added to a sum; none if only a coarser unit
    /// helps.
    fn term_form(&self, gain: Factor, value: Value) -> Option<TermForm> {
        let headroom = self.headroom(value);
        if let Factor::One(gain) = gain
            && let Some(n) = power_of_two(gain.abs())
        {
            return (n <= headroom).then_some(TermForm::Shift(n));
        }
        let mul_high = |pre_shift: i32, integer_part: f64| TermForm::MulHigh {
            pre_shift,
            integer_part,
        };
        if let Factor::Live(_) = gain {
            let is_word = |up: &i32| gain.largest() * exp2(-up) < NEARLY * HALF;
            return (0..=headroom).find(is_word).map(|up| mul_high(up, 0.0));
        }
        let is_word = |up: &i32| gain.largest() * exp2(-up) < HALF;
        if let Some(up) = (0..=headroom).find(is_word) {
            return Some(mul_high(up, 0.0));
        }
        let moved = gain.map(|g| g * exp2(-headroom));
        let is_about = |whole: f64| moved.both().iter().all(|g| (g - whole).abs() < HALF);
        [1.0, -1.0]
            .into_iter()
            .find(|&whole| is_about(whole))
            .map(|whole| mul_high(headroom, whole))
    }

    /// By how many places the value may be moved up.
    pub(super) fn headroom(&self, value: Value) -> i32 {
        let range = self.b.range(value);
        let magnitude = range
            .low
            .unsigned_abs()
            .max(range.high.unsigned_abs())
            .max(1);
        (0..31)
            .rev()
            .find(|&n| magnitude << n < 1 << 31)
            .unwrap_or(0)
    }

    /// A constant as such an integer.
    pub(super) fn constant_real(&mut self, value: f64, scale: Scale) -> Result<Real, OpError> {
        let Scale { lsb, offset } = scale;
        let quantized = scale.quantize(value);
        let error = (value - offset - quantized as f64 * lsb).abs();
        Ok(Real {
            value: self.b.constant(Type::I32, quantized)?,
            lsb,
            offset,
            error,
        })
    }
}

impl Plan {
    /// Adds up what one condition chooses, and takes the middle of constants of which one is as
    /// good as the other.
    fn settle_choices(&mut self) {
        merge(&mut self.choices);
        self.choices.retain(|choice| {
            let [a, b] = choice.both();
            if (a - b).abs() < 1.0 {
                self.constant += 0.5 * (a + b);
                self.error += 0.5 * (a - b).abs();
            }
            (a - b).abs() >= 1.0
        });
    }
}

/// The constants of a sum that are chosen between: chosen factors without an operand, and such
/// factors times their operand's offset.
fn chosen_constants(terms: &[Term], lsb: f64) -> Vec<Factor> {
    let chosen = terms
        .iter()
        .filter(|t| t.operand.is_none() || (t.offset() != 0.0 && !t.fixed()));
    chosen
        .map(|t| {
            t.factor
                .map(|f| f * t.operand.map_or(1.0, |r| r.offset) / lsb)
        })
        .collect()
}

/// The constant of a sum: `start` and what offsets under fixed factors add.
fn constant_of(start: f64, terms: &[Term], lsb: f64) -> f64 {
    let fixed = terms.iter().filter(|t| t.operand.is_some() && t.fixed());
    fixed.fold(start, |sum, t| sum + t.factor.both()[0] * t.offset() / lsb)
}

/// Adds up what one condition chooses.
fn merge(choices: &mut Vec<Factor>) {
    let mut merged: Vec<Factor> = Vec::new();
    for &choice in choices.iter() {
        let Factor::Either(condition, a, b) = choice else {
            continue;
        };
        let same = merged.iter_mut().find_map(|m| match m {
            Factor::Either(c, x, y) if *c == condition => Some((x, y)),
            _ => None,
        });
        match same {
            Some((x, y)) => (*x, *y) = (*x + a, *y + b),
            None => merged.push(choice),
        }
    }
    *choices = merged;
}

impl Term {
    pub(super) fn of(c: f64, operand: Real) -> Term {
        Term {
            factor: Factor::One(c),
            operand: Some(operand),
            place: None,
        }
    }

    /// The offset of its operand.
    fn offset(&self) -> f64 {
        self.operand.map_or(0.0, |real| real.offset)
    }

    /// Whether its factor is one constant.
    fn fixed(&self) -> bool {
        matches!(self.factor, Factor::One(_))
    }
}
