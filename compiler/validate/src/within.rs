//! Cases of a value by itself: whether two values are one is settled for each of their choices
//! here, so that choices of one word and those of another one add up and are not multiplied.
//!
//! A case of all of a path runs mode and code again, with what it assumes; here only the difference
//! of two values is made again, by the same constructors. What is not shown so is a case of the
//! path as ever.

use rustc_hash::FxHashMap;

use crate::alu::{and, exclusive_or, or};
use crate::stop::{Stop, Told};
use crate::term::{Atom, Function, Kind, Term, Terms};
use crate::truth::{Truth, Variable};

/// Cases of a value, at most.
const CASES_MAX: usize = 64;

/// Terms that a case of a value may make, and those of all values of a mode: what is not shown with
/// these is a case of the path, for which there must be room.
const TERMS_MAX: usize = 500;
const ALL_TERMS_MAX: usize = 100_000;

/// What terms and truths are where more is known than when they were made.
#[derive(Default)]
pub(crate) struct Anew {
    terms: FxHashMap<Term, Term>,
    truths: FxHashMap<Truth, Truth>,
}

impl Terms {
    /// Whether a term is 0 whatever it chooses, in the case that is assumed.
    pub fn is_nothing(&mut self, term: Term) -> Told<bool> {
        if !self.by_value || self.within >= ALL_TERMS_MAX {
            return Ok(false);
        }
        let (mut left, before) = (CASES_MAX, self.count());
        let kept = self.known.clone();
        let told = self.is_nothing_within(term, &[], &mut left);
        self.known = kept;
        self.within += self.count() - before;
        told
    }

    /// The same; leaves what it has learnt.
    fn is_nothing_within(&mut self, term: Term, assumed: &[Term], left: &mut usize) -> Told<bool> {
        if self.bounds(term) == (0, 0) {
            return Ok(true);
        }
        let Some(asks) = self.outer_question_in(term)? else {
            return Ok(false);
        };
        let kept = self.known.clone();
        for holds in [true, false] {
            let Some(less) = left.checked_sub(1) else {
                return Ok(false);
            };
            *left = less;
            self.known.clone_from(&kept);
            match self.is_nothing_where(term, assumed, (asks, holds), left) {
                // No numbers come here.
                Ok(true) | Err(Stop::Impossible) => {}
                Ok(false) | Err(Stop::Split(_) | Stop::Unproven(_)) => return Ok(false),
            }
        }
        Ok(true)
    }

    fn is_nothing_where(
        &mut self,
        term: Term,
        assumed: &[Term],
        (asks, holds): (Variable, bool),
        left: &mut usize,
    ) -> Told<bool> {
        let before = self.count();
        self.assume(asks, holds)?;
        self.known.refresh();
        let mut made = Anew::default();
        // What was assumed of a sum is known of it as it is now, which may be impossible.
        let mut all = Vec::with_capacity(assumed.len() + 1);
        for sum in assumed.iter().chain([&asks.primitive]) {
            all.push(self.anew(*sum, &mut made)?);
        }
        let term = self.anew(term, &mut made)?;
        if self.count() > before + TERMS_MAX {
            *left = 0;
        }
        self.is_nothing_within(term, &all, left)
    }

    /// The same number, made again from its atoms by what is known now.
    pub(crate) fn anew(&mut self, term: Term, made: &mut Anew) -> Told<Term> {
        if self.number(term).is_some() {
            return Ok(term);
        }
        if let Some(known) = made.terms.get(&term) {
            return Ok(*known);
        }
        let sum = self.sum(term).clone();
        let mut all = self.constant(sum.constant);
        for (atom, by) in sum.parts {
            let own = self.atom_anew(atom, made)?;
            all = self.add_scaled(all, own, by)?;
        }
        // What is known of it is known of it as it is now.
        let range = self.bounds(term);
        self.learn(all, range)?;
        made.terms.insert(term, all);
        Ok(all)
    }

    fn atom_anew(&mut self, atom: Atom, made: &mut Anew) -> Told<Term> {
        match self.kind(atom).clone() {
            Kind::Product(factors) => {
                let mut all = self.constant(1);
                for factor in factors {
                    let factor = self.single(factor);
                    let factor = self.anew(factor, made)?;
                    all = self.mul(all, factor)?;
                }
                Ok(all)
            }
            Kind::Times(a, b) => {
                let (a, b) = (self.anew(a, made)?, self.anew(b, made)?);
                self.mul(a, b)
            }
            Kind::Floor(inner, n) => {
                let inner = self.anew(inner, made)?;
                self.floor(inner, n.into())
            }
            Kind::Positive(inner) => {
                let inner = self.anew(inner, made)?;
                self.positive(inner)
            }
            Kind::Gate(truth, inner) => {
                let truth = self.truth_anew(truth, made)?;
                let inner = self.anew(inner, made)?;
                self.gate(truth, inner)
            }
            Kind::Apply(function, args) => {
                let args: Told<Vec<Term>> = args.iter().map(|arg| self.anew(*arg, made)).collect();
                self.function_anew(function, args?)
            }
            Kind::Base(_)
            | Kind::Register(_)
            | Kind::Unknown(_)
            | Kind::Integer
            | Kind::Key
            | Kind::Load(..) => Ok(self.single(atom)),
        }
    }

    fn function_anew(&mut self, function: Function, args: Vec<Term>) -> Told<Term> {
        match (function, &args[..]) {
            (Function::And, [a, b]) => and(self, *a, *b),
            (Function::Or, [a, b]) => or(self, *a, *b),
            (Function::ExclusiveOr, [a, b]) => exclusive_or(self, *a, *b),
            _ => Ok(self.apply(function, args)),
        }
    }

    fn truth_anew(&mut self, truth: Truth, made: &mut Anew) -> Told<Truth> {
        let Some((Variable { primitive, least }, yes, no)) = self.truths.split(truth) else {
            return Ok(truth);
        };
        if let Some(known) = made.truths.get(&truth) {
            return Ok(*known);
        }
        let primitive = self.anew(primitive, made)?;
        let asks = self.at_least(primitive, least)?;
        let (yes, no) = (self.truth_anew(yes, made)?, self.truth_anew(no, made)?);
        let result = self.truths.choose(asks, yes, no);
        made.truths.insert(truth, result);
        Ok(result)
    }
}
