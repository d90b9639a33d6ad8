//! What is known of terms on a path: an interval for each, from what is assumed, from what the
//! Kernel declares of its values, and from the intervals of their parts.

use rustc_hash::FxHashMap;

use crate::stop::{Stop, Told};
use crate::term::{Atom, Base, Function, Kind, Term, Terms};
use crate::truth::{Truth, Variable};

/// A closed interval.
pub(crate) type Interval = (i128, i128);

/// How often a sum is taken apart.
const DEPTH_MAX: usize = 3;

/// How many sums with the same last atom are looked at, the latest.
const SUMS_MAX: usize = 6;

/// Beyond all that can be.
pub(crate) const FAR: i128 = 1 << 120;

/// The interval of a signed word.
pub(crate) const WORD: Interval = (-(1 << 31), (1 << 31) - 1);

/// What is known.
#[derive(Clone, Default)]
pub(crate) struct Known {
    /// By primitive: on this path.
    facts: FxHashMap<Term, Interval>,
    /// By primitive: always, by what the term is.
    always: FxHashMap<Term, Interval>,
    /// By the last atom of it: primitives of several atoms of which something is known.
    sums: FxHashMap<Atom, Vec<Term>>,
    /// By primitive, found before.
    found: FxHashMap<Term, Interval>,
    /// By diagram: what it is on this path.
    pub settled: FxHashMap<Truth, Truth>,
}

impl Known {
    /// Has intervals found anew, from all that is known by now.
    pub fn refresh(&mut self) {
        self.found.clear();
        self.settled.clear();
    }

    /// Forgets what holds on a path.
    pub fn forget(&mut self) {
        self.facts.clear();
        self.sums.clear();
        self.found.clear();
        self.settled.clear();
    }
}

pub(crate) fn meet(a: Interval, b: Interval) -> Interval {
    (a.0.max(b.0), a.1.min(b.1))
}

fn hull(a: Interval, b: Interval) -> Interval {
    (a.0.min(b.0), a.1.max(b.1))
}

fn scaled((low, high): Interval, by: i128) -> Interval {
    let mul = |end: i128| end.saturating_mul(by).clamp(-FAR, FAR);
    if by < 0 {
        (mul(high), mul(low))
    } else {
        (mul(low), mul(high))
    }
}

pub(crate) fn times(a: Interval, b: Interval) -> Interval {
    let all = [(a.0, b.0), (a.0, b.1), (a.1, b.0), (a.1, b.1)];
    let all = all.map(|(x, y)| x.saturating_mul(y).clamp(-FAR, FAR));
    let (low, high) = (all.iter().min(), all.iter().max());
    (*low.unwrap_or(&-FAR), *high.unwrap_or(&FAR))
}

impl Terms {
    /// Where a term lies.
    pub fn bounds(&mut self, term: Term) -> Interval {
        if let Some(number) = self.number(term) {
            return (number, number);
        }
        let (factor, primitive, constant) = self.primitive(term);
        let (low, high) = scaled(self.bounds_of_primitive(primitive), factor);
        (low + constant, high + constant)
    }

    fn bounds_of_primitive(&mut self, primitive: Term) -> Interval {
        if let Some(found) = self.known.found.get(&primitive) {
            return *found;
        }
        let all = self.bounds_by_parts(primitive, DEPTH_MAX);
        self.known.found.insert(primitive, all);
        all
    }

    /// From atoms, from what is known of the whole, and from what is known of a part of it and of
    /// the rest.
    fn bounds_by_parts(&mut self, primitive: Term, depth: usize) -> Interval {
        let parts = self.sum(primitive).parts.clone();
        let mut all = (0, 0);
        for (atom, by) in &parts {
            let single = self.single(*atom);
            let own = self.bounds_of_atom(*atom);
            let (low, high) = scaled(self.met_with_facts(single, own), *by);
            all = ((all.0 + low).max(-FAR), (all.1 + high).min(FAR));
        }
        all = self.met_with_facts(primitive, all);
        if depth == 0 || parts.len() < 3 {
            return all;
        }
        for (atom, by) in parts.iter().rev() {
            let sums = self.known.sums.get(atom).cloned().unwrap_or_default();
            for sum in sums.into_iter().rev().take(SUMS_MAX) {
                let own = self.sum(sum).parts.last().map_or(1, |(_, own)| *own);
                if sum == primitive || by % own != 0 {
                    continue;
                }
                let Ok(rest) = self.add_scaled(primitive, sum, -(by / own)) else {
                    continue;
                };
                if self.sum(rest).parts.len() >= parts.len() {
                    continue;
                }
                let (low, high) = scaled(self.met_with_facts(sum, (-FAR, FAR)), by / own);
                let (factor, rest, constant) = self.primitive(rest);
                let of_rest = match self.number(rest) {
                    Some(number) => (number, number),
                    None => {
                        let (low, high) = scaled(self.bounds_by_parts(rest, depth - 1), factor);
                        (low + constant, high + constant)
                    }
                };
                let sum = (low + of_rest.0, high + of_rest.1);
                all = meet(all, (sum.0.max(-FAR), sum.1.min(FAR)));
            }
        }
        all
    }

    fn met_with_facts(&self, primitive: Term, mut all: Interval) -> Interval {
        for facts in [&self.known.facts, &self.known.always] {
            if let Some(fact) = facts.get(&primitive) {
                all = meet(all, *fact);
            }
        }
        all
    }

    /// Remembers that something is known of a sum of several atoms.
    fn remember_sum(&mut self, primitive: Term) {
        let parts = &self.sum(primitive).parts;
        let last = parts
            .last()
            .filter(|_| parts.len() > 1)
            .map(|(atom, _)| *atom);
        if let Some(last) = last {
            let sums = self.known.sums.entry(last).or_default();
            if !sums.contains(&primitive) {
                sums.push(primitive);
            }
        }
    }

    fn bounds_of_atom(&mut self, atom: Atom) -> Interval {
        match self.kind(atom).clone() {
            Kind::Base(
                Base::State | Base::Record | Base::Samples | Base::History | Base::Stack,
            ) => WORD,
            Kind::Register(_) | Kind::Unknown(_) | Kind::Key => WORD,
            Kind::Integer => (-FAR, FAR),
            Kind::Load(_, bytes) if bytes < 4 => (0, (1 << (8 * bytes)) - 1),
            Kind::Load(..) => WORD,
            Kind::Product(factors) => self.bounds_of_product(&factors),
            Kind::Times(a, b) => times(self.bounds(a), self.bounds(b)),
            Kind::Floor(term, n) => {
                let (low, high) = self.bounds(term);
                (low >> n, high >> n)
            }
            Kind::Positive(term) => {
                let (low, high) = self.bounds(term);
                (low.max(0), high.max(0))
            }
            Kind::Gate(_, term) => hull((0, 0), self.bounds(term)),
            Kind::Apply(function, args) => self.bounds_of_result(function, &args),
        }
    }

    fn bounds_of_product(&mut self, factors: &[Atom]) -> Interval {
        let mut all = (1, 1);
        let mut at = 0;
        while at < factors.len() {
            let one = self.single(factors[at]);
            let range = self.bounds(one);
            if factors.get(at + 1) == Some(&factors[at]) {
                let square = times(range, range);
                let low = if range.0 <= 0 && range.1 >= 0 {
                    0
                } else {
                    square.0.max(0)
                };
                all = times(all, (low, square.1));
                at += 2;
            } else {
                all = times(all, range);
                at += 1;
            }
        }
        all
    }

    fn bounds_of_result(&mut self, function: Function, args: &[Term]) -> Interval {
        match (function, args) {
            (Function::LeadingZeros, _) => (0, 32),
            (Function::SquareRoot, [a]) => {
                let (low, high) = self.bounds(*a);
                (low.max(0).isqrt(), high.max(0).isqrt())
            }
            (Function::DivideUnsigned, [a, b]) => match (self.bounds(*a), self.bounds(*b)) {
                (a, b) if a.0 >= 0 && b.0 > 0 => (a.0 / b.1, a.1 / b.0),
                (a, _) if a.0 >= 0 => (0, a.1),
                _ => WORD,
            },
            (Function::And, [a, b]) => {
                let (a, b) = (self.bounds(*a), self.bounds(*b));
                match (a.0 >= 0, b.0 >= 0) {
                    (true, true) => (0, a.1.min(b.1)),
                    (true, false) => (0, a.1),
                    (false, true) => (0, b.1),
                    (false, false) => WORD,
                }
            }
            _ => WORD,
        }
    }

    /// On this path the term lies in an interval.
    pub fn learn(&mut self, term: Term, (low, high): Interval) -> Told<()> {
        if let Some(number) = self.number(term) {
            return if low <= number && number <= high {
                Ok(())
            } else {
                Err(Stop::Impossible)
            };
        }
        let (factor, primitive, constant) = self.primitive(term);
        let range = within(factor, (low - constant, high - constant));
        let old = self.bounds_of_primitive(primitive);
        let new = meet(old, range);
        if new.0 > new.1 {
            return Err(Stop::Impossible);
        }
        if new == old {
            return Ok(());
        }
        let fact = self.known.facts.entry(primitive).or_insert(new);
        *fact = meet(*fact, new);
        self.remember_sum(primitive);
        // What was found of others may be less than is known now, and is as true.
        self.known.found.insert(primitive, new);
        self.learn_below(primitive, new)
    }

    /// What the interval of an atom says of what it is made of.
    fn learn_below(&mut self, primitive: Term, (low, high): Interval) -> Told<()> {
        let Some(atom) = self.only_atom(primitive) else {
            return Ok(());
        };
        match self.kind(atom).clone() {
            Kind::Floor(term, n) => {
                let high = high
                    .checked_add(1)
                    .and_then(|high| high.checked_mul(1 << n));
                let low = low.checked_mul(1 << n);
                match (low, high) {
                    (Some(low), Some(high)) => self.learn(term, (low, high - 1)),
                    _ => Ok(()),
                }
            }
            Kind::Positive(term) => {
                let low = if low > 0 { low } else { -FAR };
                self.learn(term, (low, high))
            }
            _ => Ok(()),
        }
    }

    /// Whatever is assumed, the term lies in an interval.
    pub fn learn_always(&mut self, term: Term, (low, high): Interval) {
        if self.number(term).is_some() {
            return;
        }
        let (factor, primitive, constant) = self.primitive(term);
        let range = within(factor, (low - constant, high - constant));
        let fact = self.known.always.entry(primitive).or_insert(range);
        *fact = meet(*fact, range);
        let fact = *fact;
        self.remember_sum(primitive);
        if let Some(found) = self.known.found.get_mut(&primitive) {
            *found = meet(*found, fact);
        }
    }

    /// From here on something holds, or does not.
    pub fn assume(&mut self, variable: Variable, holds: bool) -> Told<()> {
        let range = match holds {
            true => (variable.least, FAR),
            false => (-FAR, variable.least - 1),
        };
        self.learn(variable.primitive, range)
    }
}

/// Where `x` lies if `factor * x` lies in an interval.
fn within(factor: i128, (low, high): Interval) -> Interval {
    let (low, high) = if factor < 0 {
        (-high, -low)
    } else {
        (low, high)
    };
    let by = factor.abs();
    (-((-low).div_euclid(by)), high.div_euclid(by))
}
