//! Code generation for a planned sum: a chain of shifts, additions and multiply-high-accumulates.

use super::Lowerer;
use super::format::{exp2, quantize};
use super::linear::{Factor, Live};
use super::real::{Real, power_of_two};
use whippen_kernel::{Op, OpError, Value};
use whippen_source::Span;

/// A sum as it is to be made, in units of its result.
pub(super) struct Plan {
    /// Constants that are chosen between.
    pub choices: Vec<Factor>,
    pub terms: Vec<PlannedTerm>,
    pub constant: f64,
    pub error: f64,
    /// Not added: part of what the result means.
    pub left: f64,
}

impl Plan {
    /// About how many operators it takes.
    pub fn steps(&self) -> usize {
        let of = |planned: &PlannedTerm| match planned.form {
            TermForm::Shift(_) => 1,
            TermForm::MulHigh {
                pre_shift,
                integer_part,
            } => 1 + usize::from(pre_shift > 0) + usize::from(integer_part != 0.0),
        };
        self.terms.iter().map(of).sum()
    }
}

/// A term of a planned sum.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlannedTerm {
    pub value: Value,
    pub gain: Factor,
    pub form: TermForm,
    pub place: Option<Span>,
}

/// How a term is added to a sum.
#[derive(Debug, Clone, Copy)]
pub(super) enum TermForm {
    /// A shifted addition: the gain is `2^n` up to sign.
    Shift(i32),
    /// The top word of a product with a coefficient, the value shifted left before; plus or minus
    /// the value itself where the gain is about one.
    MulHigh { pre_shift: i32, integer_part: f64 },
}

/// A sum under construction.
struct Chain {
    /// So far; none before the first term.
    total: Option<Value>,
    /// Not yet added.
    constant: i64,
    /// Error so far, in units of the result.
    error: f64,
}

impl Lowerer<'_> {
    /// The sum, its error and what was left of the constant, in units of the result.
    pub(super) fn emit_sum(&mut self, plan: Plan) -> Result<(Value, f64, f64), OpError> {
        let Plan {
            choices,
            mut terms,
            constant,
            error,
            left,
        } = plan;
        // First what all keys share, then what no decision of the tick has a part in, so that one
        // sum is all that waits for the decisions; of that, first what needs no negation, then in
        // the order in which operands come about.
        let rank = |w: &PlannedTerm| (!self.b.is_shared(w.value), self.b.is_decided(w.value));
        terms.sort_by_key(|w| (rank(w), w.form.starts_badly(&w.gain), w.value.0));
        let mut chain = Chain {
            total: None,
            constant: constant.round() as i64,
            error,
        };
        for choice in choices {
            let word = self.word(choice.map(f64::round))?;
            self.plus(&mut chain, word, 1.0)?;
        }
        for planned in terms {
            let mut add = |s: &mut Self| s.add_term(&mut chain, planned);
            match planned.place {
                Some(place) => self.from_place(place, None, add)?,
                None => add(self)?,
            }
        }
        let value = match (chain.total, chain.constant) {
            (Some(total), 0) => total,
            (None, constant) => self.constant(constant)?,
            (Some(total), constant) => {
                let constant = self.constant(constant)?;
                self.b.op(Op::Add, &[total, constant])?
            }
        };
        Ok((value, chain.error, left))
    }

    /// A factor of whole constants as a value.
    fn word(&mut self, factor: Factor) -> Result<Value, OpError> {
        match factor {
            Factor::One(word) => self.constant(word as i64),
            Factor::Either(condition, a, b) => {
                let (a, b) = (self.constant(a as i64)?, self.constant(b as i64)?);
                self.b.op(Op::Select, &[condition, a, b])
            }
            Factor::Live(live) => Ok(self.live_word(live)?.0),
        }
    }

    /// What live values make as a word, and what that rounds.
    fn live_word(&mut self, live: Live) -> Result<(Value, f64), OpError> {
        let word = self.rescaled(Real::new(live.value, live.unit, 0.0), 1.0)?;
        // On the way a sum may have needed coarser units.
        let coarser = power_of_two(word.lsb).unwrap_or(0);
        Ok((self.moved(word.value, coarser)?, word.error))
    }

    /// Largest absolute integer of a value.
    pub(super) fn magnitude(&self, value: Value) -> f64 {
        let range = self.b.range(value);
        range.low.unsigned_abs().max(range.high.unsigned_abs()) as f64
    }

    /// Adds a planned term to the chain.
    fn add_term(&mut self, chain: &mut Chain, planned: PlannedTerm) -> Result<(), OpError> {
        let PlannedTerm {
            value, gain, form, ..
        } = planned;
        let magnitude = self.magnitude(value);
        match form {
            TermForm::Shift(n) => {
                let [gain, _] = gain.both();
                let moved = self.moved(value, n)?;
                chain.error += magnitude * (gain.abs() - exp2(n)).abs();
                self.plus(chain, moved, gain)
            }
            TermForm::MulHigh {
                pre_shift,
                integer_part,
            } => {
                let moved = self.moved(value, pre_shift)?;
                if let Factor::Live(live) = gain {
                    let unit = live.unit * exp2(32 - pre_shift);
                    let moved_by = magnitude * exp2(pre_shift - 32);
                    let (word, rounded) = self.live_word(Live { unit, ..live })?;
                    chain.error += (live.error * unit.abs() + rounded) * moved_by;
                    return self.plus_product(chain, moved, word);
                }
                let parts = gain.map(|g| g * exp2(-pre_shift) - integer_part);
                let words = parts.map(|p| quantize(p, exp2(-32)) as f64);
                let rounded =
                    |p: f64, w: f64| (p - w * exp2(-32)).abs() * magnitude * exp2(pre_shift);
                let ([p, q], [v, w]) = (parts.both(), words.both());
                chain.error += rounded(p, v).max(rounded(q, w));
                if integer_part == 0.0 {
                    let word = self.word(words)?;
                    return self.plus_product(chain, moved, word);
                }
                let more = self.enlarged(moved, words.map(|w| integer_part * w))?;
                self.plus(chain, more, integer_part)
            }
        }
    }

    /// `x + x * words / 2^32`, which rises with `x`; intervals do not see that.
    fn enlarged(&mut self, x: Value, words: Factor) -> Result<Value, OpError> {
        let word = self.word(words)?;
        let sum = self.b.op(Op::MacTop, &[x, x, word])?;
        let range = self.b.range(x);
        let end = |x: i64, word: f64| x + ((i128::from(x) * word as i128 + (1 << 31)) >> 32) as i64;
        let [low, high] = [range.low, range.high].map(|x| words.both().map(|word| end(x, word)));
        self.b
            .op(Op::Assume(low[0].min(low[1]), high[0].max(high[1])), &[sum])
    }

    /// Adds or subtracts a word.
    fn plus(&mut self, chain: &mut Chain, value: Value, sign: f64) -> Result<(), OpError> {
        let op = if sign > 0.0 { Op::Add } else { Op::Sub };
        chain.total = Some(match chain.total {
            Some(total) => self.b.op(op, &[total, value])?,
            None if sign > 0.0 && chain.constant == 0 => value,
            None => {
                let start = self.constant(std::mem::take(&mut chain.constant))?;
                if sign > 0.0 {
                    self.b.op(op, &[value, start])?
                } else {
                    self.b.op(op, &[start, value])?
                }
            }
        });
        Ok(())
    }

    /// Adds the top word of a product with a constant.
    fn plus_product(
        &mut self,
        chain: &mut Chain,
        value: Value,
        word: Value,
    ) -> Result<(), OpError> {
        let constant = std::mem::take(&mut chain.constant);
        let start = if constant != 0 && chain.total.is_none() {
            Some(self.constant(constant)?)
        } else {
            chain.total
        };
        if chain.total.is_some() {
            chain.constant = constant;
        }
        chain.total = Some(match start {
            Some(total) => self.b.op(Op::MacTop, &[total, value, word])?,
            None => self.b.op(Op::MulTop, &[value, word])?,
        });
        Ok(())
    }

    /// `value * 2^n`, rounded down; made once.
    pub(super) fn moved(&mut self, value: Value, n: i32) -> Result<Value, OpError> {
        if n == 0 {
            return Ok(value);
        }
        if let Some(&known) = self.moved.get(&(value, n)) {
            return Ok(known);
        }
        let op = if n > 0 {
            Op::Shl(n as u8)
        } else {
            Op::Sar((-n).min(31) as u8)
        };
        let moved = self.b.op(op, &[value])?;
        self.moved.insert((value, n), moved);
        Ok(moved)
    }
}

impl TermForm {
    /// By how much, in the middle, rounding makes the sum too small.
    pub fn bias(self, gain: &Factor) -> f64 {
        match self {
            TermForm::Shift(n) if n < 0 => 0.5 * gain.both()[0].signum(),
            _ => 0.0,
        }
    }

    /// How far rounding may be from the middle, or from nothing where the sum is not centred.
    pub fn error(self, centred: bool) -> f64 {
        match self {
            TermForm::Shift(n) if n >= 0 => 0.0,
            TermForm::Shift(_) if !centred => 1.0,
            _ => 0.5,
        }
    }

    /// Whether a sum that begins with it would begin with a negation.
    fn starts_badly(self, gain: &Factor) -> bool {
        match self {
            TermForm::Shift(_) => gain.both()[0] < 0.0,
            TermForm::MulHigh { integer_part, .. } => integer_part < 0.0,
        }
    }
}
