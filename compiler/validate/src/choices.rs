//! What is chosen in a term, and what it is made of.

use std::collections::VecDeque;

use rustc_hash::FxHashSet;

use crate::stop::Told;
use crate::term::{Atom, Function, Kind, Term, Terms};
use crate::truth::{Truth, Variable};

fn is_quotient(kind: &Kind) -> bool {
    let Kind::Apply(function, _) = kind else {
        return false;
    };
    matches!(
        function,
        Function::DivideUnsigned
            | Function::DivideSigned
            | Function::DivideRound(_)
            | Function::SquareRoot
    )
}

impl Terms {
    /// What must be known before a term can be simpler: the innermost choice in it.
    pub fn question_in(&mut self, term: Term) -> Told<Option<Variable>> {
        self.question_beside(term, &mut FxHashSet::default())
    }

    /// The same, but for terms that have none.
    fn question_beside(
        &mut self,
        term: Term,
        plain: &mut FxHashSet<Term>,
    ) -> Told<Option<Variable>> {
        if plain.contains(&term) {
            return Ok(None);
        }
        let parts = self.sum(term).parts.clone();
        for (atom, _) in parts {
            let kind = self.kind(atom).clone();
            for inner in self.terms_in(&kind) {
                if let Some(asks) = self.question_beside(inner, plain)? {
                    return Ok(Some(asks));
                }
            }
            if let Some(asks) = self.choice_of(atom)? {
                return Ok(Some(asks));
            }
        }
        plain.insert(term);
        Ok(None)
    }

    /// The outermost choice in a term: what it is made of is left as it is, so that two values that
    /// choose otherwise of the same need no case of that.
    pub fn outer_question_in(&mut self, term: Term) -> Told<Option<Variable>> {
        let (mut left, mut seen) = (VecDeque::from([term]), FxHashSet::default());
        while let Some(term) = left.pop_front() {
            if !seen.insert(term) {
                continue;
            }
            for (atom, _) in self.sum(term).parts.clone() {
                if let Some(asks) = self.choice_of(atom)? {
                    return Ok(Some(asks));
                }
                let kind = self.kind(atom).clone();
                left.extend(self.terms_in(&kind));
            }
        }
        Ok(None)
    }

    /// What must be known before an atom can be simpler than what it is made of.
    fn choice_of(&mut self, atom: Atom) -> Told<Option<Variable>> {
        let truth = match *self.kind(atom) {
            Kind::Floor(inner, n) => match self.sign_of_floor(inner, n)? {
                Some(truth) => truth,
                None => return Ok(None),
            },
            Kind::Positive(inner) => self.at_least(inner, 1)?,
            Kind::Gate(truth, _) => self.settle(truth),
            _ => return Ok(None),
        };
        Ok(self.truths.split(truth).map(|(asks, ..)| asks))
    }

    /// Whether a quotient or a root is in a term.
    pub fn divides(&mut self, term: Term) -> bool {
        let (mut left, mut seen) = (vec![term], FxHashSet::default());
        while let Some(term) = left.pop() {
            if !seen.insert(term) {
                continue;
            }
            for (atom, _) in self.sum(term).parts.clone() {
                let kind = self.kind(atom).clone();
                if is_quotient(&kind) {
                    return true;
                }
                left.extend(self.terms_in(&kind));
            }
        }
        false
    }

    /// What is computed of other terms, of those, in order.
    fn terms_in(&mut self, kind: &Kind) -> Vec<Term> {
        match kind {
            Kind::Product(factors) => factors.iter().map(|f| self.single(*f)).collect(),
            Kind::Times(a, b) => vec![*a, *b],
            Kind::Floor(inner, _) | Kind::Positive(inner) | Kind::Gate(_, inner) => vec![*inner],
            Kind::Apply(_, args) => args.clone(),
            Kind::Base(_)
            | Kind::Register(_)
            | Kind::Unknown(_)
            | Kind::Integer
            | Kind::Key
            | Kind::Load(..) => Vec::new(),
        }
    }

    /// Which of two values a floor has, where it has only two.
    fn sign_of_floor(&mut self, inner: Term, n: u8) -> Told<Option<Truth>> {
        let (low, high) = self.bounds(inner);
        if (high >> n) - (low >> n) != 1 {
            return Ok(None);
        }
        self.at_least(inner, (high >> n) << n).map(Some)
    }
}
