//! Whether a term is 0 in all cases of the choices in it, by itself: what else a mode chooses need
//! not be told apart meanwhile. So cases of several words add up and are not multiplied.
//!
//! In each case the term is built anew, by the constructors that made it, from what is known there.

use rustc_hash::FxHashMap;

use crate::alu::{and, exclusive_or, or};
use crate::stop::{Stop, Told};
use crate::term::{Atom, Function, Kind, Term, Terms};
use crate::truth::Truth;

/// Cases of a term, at most.
const CASES_MAX: usize = 100;

/// What atoms are in a case.
type Anew = FxHashMap<Atom, Term>;

impl Terms {
    /// Whether the term is 0, in each case of what is chosen in it; if not, it may be all the same.
    pub fn is_zero_in_cases(&mut self, term: Term) -> Told<bool> {
        let mut left = CASES_MAX;
        match self.is_zero(term, &mut left) {
            Err(Stop::Unproven(_)) => Ok(false),
            told => told,
        }
    }

    fn is_zero(&mut self, term: Term, left: &mut usize) -> Told<bool> {
        if self.bounds(term) == (0, 0) {
            return Ok(true);
        }
        let Some(less) = left.checked_sub(1) else {
            return Ok(false);
        };
        *left = less;
        let Some(asks) = self.question_in(term)? else {
            return Ok(false);
        };
        for holds in [false, true] {
            let known = self.known.clone();
            let told = self.assume(asks, holds).and_then(|()| {
                self.known.refresh();
                let term = self.anew(term, &mut Anew::default())?;
                self.is_zero(term, left)
            });
            self.known = known;
            match told {
                Ok(true) | Err(Stop::Impossible) => {}
                other => return other,
            }
        }
        Ok(true)
    }

    /// The same term, as it is built where more is known.
    fn anew(&mut self, term: Term, done: &mut Anew) -> Told<Term> {
        let range = self.bounds(term);
        let sum = self.sum(term).clone();
        let mut all = self.constant(sum.constant);
        for (atom, by) in sum.parts {
            let own = self.atom_anew(atom, done)?;
            all = self.add_scaled(all, own, by)?;
        }
        self.learn(all, range)?;
        Ok(all)
    }

    fn atom_anew(&mut self, atom: Atom, done: &mut Anew) -> Told<Term> {
        if let Some(own) = done.get(&atom) {
            return Ok(*own);
        }
        let old = self.single(atom);
        let range = self.bounds(old);
        let own = match self.kind(atom).clone() {
            Kind::Product(factors) => {
                let mut all = self.constant(1);
                for factor in factors {
                    let factor = self.atom_anew(factor, done)?;
                    all = self.mul(all, factor)?;
                }
                all
            }
            Kind::Times(a, b) => {
                let (a, b) = (self.anew(a, done)?, self.anew(b, done)?);
                self.mul(a, b)?
            }
            Kind::Floor(term, n) => {
                let term = self.anew(term, done)?;
                self.floor(term, n.into())?
            }
            Kind::Positive(term) => {
                let term = self.anew(term, done)?;
                self.positive(term)?
            }
            Kind::Gate(holds, term) => {
                let holds = self.truth_anew(holds, done)?;
                let term = self.anew(term, done)?;
                self.gate(holds, term)?
            }
            Kind::Apply(function, args) => {
                let args = args.into_iter().map(|arg| self.anew(arg, done));
                let args = args.collect::<Told<Vec<Term>>>()?;
                match (function, &args[..]) {
                    (Function::And, [a, b]) => and(self, *a, *b)?,
                    (Function::Or, [a, b]) => or(self, *a, *b)?,
                    (Function::ExclusiveOr, [a, b]) => exclusive_or(self, *a, *b)?,
                    _ => self.apply(function, args),
                }
            }
            Kind::Base(_)
            | Kind::Register(_)
            | Kind::Unknown(_)
            | Kind::Integer
            | Kind::Key
            | Kind::Load(..) => old,
        };
        self.learn(own, range)?;
        done.insert(atom, own);
        Ok(own)
    }

    fn truth_anew(&mut self, truth: Truth, done: &mut Anew) -> Told<Truth> {
        let truth = self.settle(truth);
        let Some((asks, yes, no)) = self.truths.split(truth) else {
            return Ok(truth);
        };
        let term = self.anew(asks.primitive, done)?;
        let holds = self.at_least(term, asks.least)?;
        let (yes, no) = (self.truth_anew(yes, done)?, self.truth_anew(no, done)?);
        Ok(self.truths.choose(holds, yes, no))
    }
}
