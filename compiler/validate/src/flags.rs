//! The condition flags, and what conditions say of them.
//!
//! Where an instruction took place only where something holds, the flags are its there and what
//! they were before elsewhere: a chain of comparisons, as of the limits of a number, is no case.

use whippen_isa::Cond;

use crate::bounds::WORD;
use crate::stop::{Told, unproven};
use crate::term::{Term, Terms};
use crate::truth::Truth;

/// The condition flags that an instruction has set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Flags {
    /// The signed word whose sign and zero they are.
    pub result: Option<Term>,
    /// The exact sum or difference of which V and C are told, signed.
    pub exact: Option<Term>,
    /// Whether the result is the word of that sum.
    pub is_of_exact: bool,
    /// 0 or 1.
    pub carry: Option<Term>,
    /// Where there is one, what is at least 0 where C is set: an unsigned difference.
    pub unsigned: Option<Term>,
}

/// The condition flags: of one instruction, or of one where something holds and of others
/// elsewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Status {
    Of(Flags),
    Either(Truth, Box<[Status; 2]>),
}

impl Default for Status {
    fn default() -> Status {
        Status::Of(Flags::default())
    }
}

impl Status {
    /// These where something holds, else others.
    pub fn or_else(self, others: Status, holds: Truth) -> Status {
        if self == others {
            return self;
        }
        Status::Either(holds, Box::new([self, others]))
    }

    /// Changes some of the flags.
    pub fn change(&mut self, change: &impl Fn(&mut Flags)) {
        match self {
            Status::Of(flags) => change(flags),
            Status::Either(_, sides) => {
                for side in sides.iter_mut() {
                    side.change(change);
                }
            }
        }
    }

    /// Whether a condition holds.
    pub fn holds(&self, terms: &mut Terms, cond: Cond) -> Told<Truth> {
        match self {
            Status::Of(flags) => flags.holds(terms, cond),
            Status::Either(holds, sides) => {
                let own = sides[0].holds(terms, cond)?;
                let others = sides[1].holds(terms, cond)?;
                Ok(terms.truths.choose(*holds, own, others))
            }
        }
    }

    /// C as 0 or 1.
    pub fn carry(&self, terms: &mut Terms) -> Told<Term> {
        match self {
            Status::Of(flags) => match flags.carry {
                Some(carry) => Ok(carry),
                None => unproven("a carry that nobody has set"),
            },
            Status::Either(holds, sides) => {
                let own = sides[0].carry(terms)?;
                let others = sides[1].carry(terms)?;
                terms.select(*holds, own, others)
            }
        }
    }
}

impl Flags {
    /// Whether a condition holds.
    fn holds(&self, terms: &mut Terms, cond: Cond) -> Told<Truth> {
        let opposite = match cond {
            Cond::NE => Cond::EQ,
            Cond::CC => Cond::CS,
            Cond::PL => Cond::MI,
            Cond::VC => Cond::VS,
            Cond::LS => Cond::HI,
            Cond::LT => Cond::GE,
            Cond::LE => Cond::GT,
            _ => return self.plain_condition(terms, cond),
        };
        let truth = self.plain_condition(terms, opposite)?;
        Ok(terms.truths.not(truth))
    }

    fn plain_condition(&self, terms: &mut Terms, cond: Cond) -> Told<Truth> {
        let zero = terms.constant(0);
        match cond {
            Cond::EQ => {
                let result = known(self.result)?;
                let exact = self.exact.filter(|_| self.is_of_exact);
                match exact.map(|exact| (exact, terms.bounds(exact))) {
                    // A multiple of 2^32 that is less is zero.
                    Some((exact, (low, high))) if -(1 << 32) < low && high < 1 << 32 => {
                        terms.equal(exact, zero)
                    }
                    _ => terms.equal(result, zero),
                }
            }
            Cond::MI => {
                let result = known(self.result)?;
                let plus = terms.at_least(result, 0)?;
                Ok(terms.truths.not(plus))
            }
            Cond::CS => match self.unsigned {
                Some(difference) => terms.at_least(difference, 0),
                None => {
                    let carry = known(self.carry)?;
                    terms.at_least(carry, 1)
                }
            },
            Cond::VS => {
                let exact = known(self.exact)?;
                let low = terms.at_least(exact, WORD.0)?;
                let high = terms.at_least(exact, WORD.1 + 1)?;
                Ok(terms.truths.choose(low, high, Truth::YES))
            }
            Cond::HI => {
                // Where C is set, the difference is a word: it is the result.
                if let (true, Some(difference)) = (self.is_of_exact, self.unsigned) {
                    return terms.at_least(difference, 1);
                }
                let carry = self.plain_condition(terms, Cond::CS)?;
                let zero = self.plain_condition(terms, Cond::EQ)?;
                let other = terms.truths.not(zero);
                Ok(terms.truths.and(carry, other))
            }
            Cond::GE | Cond::GT => self.signed_condition(terms, cond),
            _ => Ok(Truth::YES),
        }
    }

    /// GE or GT: N is V, and, for the second, not zero.
    fn signed_condition(&self, terms: &mut Terms, cond: Cond) -> Told<Truth> {
        let not_less = match (self.is_of_exact, self.exact) {
            (true, Some(exact)) => {
                return terms.at_least(exact, i128::from(cond == Cond::GT));
            }
            _ => {
                let (n, v) = (
                    self.plain_condition(terms, Cond::MI)?,
                    self.plain_condition(terms, Cond::VS)?,
                );
                let not = terms.truths.not(v);
                terms.truths.choose(n, v, not)
            }
        };
        if cond == Cond::GE {
            return Ok(not_less);
        }
        let zero = self.plain_condition(terms, Cond::EQ)?;
        let other = terms.truths.not(zero);
        Ok(terms.truths.and(not_less, other))
    }
}

fn known(of: Option<Term>) -> Told<Term> {
    match of {
        Some(term) => Ok(term),
        None => unproven("a flag that nobody has set"),
    }
}
