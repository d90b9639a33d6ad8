//! Normal forms: what constructors make of their operands before a term is kept.

use crate::bounds::{Interval, WORD};
use crate::stop::{Stop, Told};
use crate::term::{Atom, Kind, Sum, Term, Terms, too_large};
use crate::truth::{Truth, Variable};

impl Terms {
    /// `floor(term / 2^n)`
    pub fn floor(&mut self, term: Term, n: u32) -> Told<Term> {
        if n == 0 {
            return Ok(term);
        }
        if n > 100 {
            return Err(too_large());
        }
        // More may be known of the whole than of what is left of it.
        let (low, high) = self.bounds(term);
        if low >> n == high >> n {
            return Ok(self.constant(low >> n));
        }
        let (whole, rest) = self.divide(term, n);
        let floor = self.floor_of_rest(rest, n)?;
        self.add(whole, floor)
    }

    /// The term as `2^n * whole + rest`: no coefficient of the rest is more than `2^(n-1)`.
    fn divide(&mut self, term: Term, n: u32) -> (Term, Term) {
        let Sum { parts, constant } = self.sum(term).clone();
        let (mut whole, mut rest) = (Sum::default(), Sum::default());
        for (atom, by) in parts {
            let up = (by + (1 << (n - 1)) - 1) >> n;
            let left = by - (up << n);
            if up != 0 {
                whole.parts.push((atom, up));
            }
            if left != 0 {
                rest.parts.push((atom, left));
            }
        }
        whole.constant = constant >> n;
        rest.constant = constant - (whole.constant << n);
        (self.intern(whole), self.intern(rest))
    }

    fn floor_of_rest(&mut self, rest: Term, n: u32) -> Told<Term> {
        let (low, high) = self.bounds(rest);
        if low >> n == high >> n {
            return Ok(self.constant(low >> n));
        }
        let Sum { parts, constant } = self.sum(rest).clone();
        let zeros = parts.iter().map(|(_, by)| by.trailing_zeros()).min();
        let zeros = zeros.unwrap_or(0).min(n);
        if zeros > 0 {
            let parts = parts
                .iter()
                .map(|(atom, by)| (*atom, by >> zeros))
                .collect();
            let constant = constant >> zeros;
            let less = self.intern(Sum { parts, constant });
            return self.floor(less, n - zeros);
        }
        if let Some(inner) = self.floor_of_floor(rest, n)? {
            return Ok(inner);
        }
        if parts.first().is_some_and(|(_, by)| *by < 0) {
            let negative = self.scale(rest, -1)?;
            let negative = self.plus(negative, (1 << n) - 1)?;
            let floor = self.floor(negative, n)?;
            return self.scale(floor, -1);
        }
        Ok(self.of(Kind::Floor(rest, n as u8)))
    }

    /// `floor((floor(a / 2^m) + b) / 2^n) = floor((a + 2^m b) / 2^(m + n))`
    fn floor_of_floor(&mut self, rest: Term, n: u32) -> Told<Option<Term>> {
        let parts = self.sum(rest).parts.clone();
        for (atom, by) in parts {
            let Kind::Floor(inner, m) = *self.kind(atom) else {
                continue;
            };
            if by.abs() != 1 || u32::from(m) + n > 100 {
                continue;
            }
            let floor = self.single(atom);
            let others = self.add_scaled(rest, floor, -by)?;
            // -floor(a / 2^m) = floor((-a + 2^m - 1) / 2^m), where that takes up all others.
            let inner = match by {
                1 => inner,
                _ if self.has_atoms_of(inner, others) => {
                    let negative = self.scale(inner, -1)?;
                    self.plus(negative, (1 << m) - 1)?
                }
                _ => continue,
            };
            let sum = self.add_scaled(inner, others, 1 << m)?;
            return self.floor(sum, n + u32::from(m)).map(Some);
        }
        Ok(None)
    }

    /// Whether a term has all atoms of another one, and that has some.
    fn has_atoms_of(&self, term: Term, other: Term) -> bool {
        let (own, others) = (&self.sum(term).parts, &self.sum(other).parts);
        let has = |atom: &Atom| own.iter().any(|(known, _)| known == atom);
        !others.is_empty() && others.iter().all(|(atom, _)| has(atom))
    }

    /// The signed number of so many bits that agrees with the term in its low bits.
    pub fn wrap(&mut self, term: Term, bits: u32) -> Told<Term> {
        let half = 1 << (bits - 1);
        let (low, high) = self.bounds(term);
        if -half <= low && high < half {
            return Ok(term);
        }
        if let Some(whole) = self.whole_of(term, bits) {
            return self.wrap(whole, bits);
        }
        let up = self.plus(term, half)?;
        let floor = self.floor(up, bits)?;
        let wrapped = self.add_scaled(term, floor, -(1 << bits))?;
        // Of this case alone: in another one the floor may be another number.
        self.learn(wrapped, (-half, half - 1))?;
        self.remember_whole(wrapped, term, bits);
        Ok(wrapped)
    }

    fn remember_whole(&mut self, outcome: Term, whole: Term, bits: u32) {
        if outcome != whole {
            self.wrapped.insert(outcome, (whole, bits));
        }
    }

    /// What was wrapped to so many bits or more where this term is the outcome: its low bits are
    /// the same, and more may be known of it.
    fn whole_of(&self, term: Term, bits: u32) -> Option<Term> {
        let (whole, kept) = *self.wrapped.get(&term)?;
        (bits <= kept).then_some(whole)
    }

    /// The low bits, so many, as an unsigned number.
    pub fn low_bits(&mut self, term: Term, bits: u32) -> Told<Term> {
        let (low, high) = self.bounds(term);
        if 0 <= low && high < 1 << bits {
            return Ok(term);
        }
        if let Some(whole) = self.whole_of(term, bits) {
            return self.low_bits(whole, bits);
        }
        let floor = self.floor(term, bits)?;
        let result = self.add_scaled(term, floor, -(1 << bits))?;
        self.learn(result, (0, (1 << bits) - 1))?;
        self.remember_whole(result, term, bits);
        Ok(result)
    }

    /// A word, signed.
    pub fn word(&mut self, term: Term) -> Told<Term> {
        self.wrap(term, 32)
    }

    /// A word, unsigned.
    pub fn unsigned(&mut self, term: Term) -> Told<Term> {
        self.low_bits(term, 32)
    }

    /// `max(term, 0)`
    pub fn positive(&mut self, term: Term) -> Told<Term> {
        let (low, high) = self.bounds(term);
        if low >= 0 {
            return Ok(term);
        }
        if high <= 0 {
            return Ok(self.constant(0));
        }
        let (factor, primitive, constant) = self.primitive(term);
        // max(max(x, 0) - k, 0) = max(x - k, 0)
        if let (1, Some(atom), ..=0) = (factor, self.only_atom(primitive), constant)
            && let Kind::Positive(inner) = *self.kind(atom)
        {
            let less = self.plus(inner, constant)?;
            return self.positive(less);
        }
        if factor < 0 && constant % factor != 0 {
            let negative = self.scale(term, -1)?;
            let positive = self.of(Kind::Positive(negative));
            return self.add(term, positive);
        }
        if constant % factor != 0 {
            return Ok(self.of(Kind::Positive(term)));
        }
        // max(-x, 0) = max(x, 0) - x
        let one = self.plus(primitive, constant / factor)?;
        let positive = self.of(Kind::Positive(one));
        let result = self.scale(positive, factor.abs())?;
        if factor > 0 {
            return Ok(result);
        }
        self.add_scaled(result, one, -factor.abs())
    }

    pub fn max(&mut self, a: Term, b: Term) -> Told<Term> {
        let over = self.sub(a, b)?;
        let over = self.positive(over)?;
        self.add(b, over)
    }

    pub fn min(&mut self, a: Term, b: Term) -> Told<Term> {
        let over = self.sub(a, b)?;
        let over = self.positive(over)?;
        self.sub(a, over)
    }

    /// The nearest number of an interval.
    pub fn clamp(&mut self, term: Term, (low, high): Interval) -> Told<Term> {
        let (low, high) = (self.constant(low), self.constant(high));
        let term = self.max(term, low)?;
        self.min(term, high)
    }

    /// The word that is nearest.
    pub fn saturate(&mut self, term: Term) -> Told<Term> {
        self.clamp(term, WORD)
    }

    /// `holds ? a : b`
    pub fn select(&mut self, holds: Truth, a: Term, b: Term) -> Told<Term> {
        let difference = self.sub(a, b)?;
        let gate = self.gate(holds, difference)?;
        self.add(b, gate)
    }

    /// `holds ? term : 0`
    pub fn gate(&mut self, holds: Truth, term: Term) -> Told<Term> {
        let holds = self.settle(holds);
        match holds.settled() {
            Some(true) => return Ok(term),
            Some(false) => return Ok(self.constant(0)),
            None if self.number(term) == Some(0) => return Ok(term),
            None => {}
        }
        let opposite = self.truths.not(holds);
        if opposite < holds {
            let gate = self.gate(opposite, term)?;
            return self.sub(term, gate);
        }
        if let Some(simple) = self.simple_gate(holds, term)? {
            return Ok(simple);
        }
        let inside = self.inside(holds, term)?;
        if inside != term {
            return self.gate(holds, inside);
        }
        let (factor, primitive, constant) = self.primitive(term);
        if self.number(term).is_some() {
            let one = self.constant(1);
            let gate = self.of(Kind::Gate(holds, one));
            return self.scale(gate, constant);
        }
        if constant % factor != 0 {
            return Ok(self.of(Kind::Gate(holds, term)));
        }
        let one = self.plus(primitive, constant / factor)?;
        let gate = self.of(Kind::Gate(holds, one));
        self.scale(gate, factor)
    }

    /// A gate that is a limit, or a number that is 0 or 1 itself.
    fn simple_gate(&mut self, holds: Truth, term: Term) -> Told<Option<Term>> {
        let Some((variable, yes, no)) = self.truths.split(holds) else {
            return Ok(None);
        };
        let is_plain = (yes, no) == (Truth::YES, Truth::NO);
        if !is_plain && (yes, no) != (Truth::NO, Truth::YES) {
            return Ok(None);
        }
        let Variable { primitive, least } = variable;
        let zero = self.constant(0);
        let above = if let Some(number) = self.number(term) {
            match self.bounds(primitive) == (0, 1) && least == 1 {
                true => self.scale(primitive, number)?,
                false => return Ok(None),
            }
        } else {
            let (factor, own, constant) = self.primitive(term);
            let at = |number: i128| {
                let product = number.checked_mul(factor)?.checked_add(constant)?;
                product.checked_mul(factor.signum())
            };
            // Where it begins to hold, the term goes through 0.
            let ends = [at(least), at(least - 1)];
            if own != primitive || !matches!(ends, [Some(0..), Some(..=0)]) {
                return Ok(None);
            }
            let upwards = self.scale(term, factor.signum())?;
            let positive = self.positive(upwards)?;
            self.add_scaled(zero, positive, factor.signum())?
        };
        if is_plain {
            Ok(Some(above))
        } else {
            self.sub(term, above).map(Some)
        }
    }

    /// A term where something holds: gates that ask the same are open or shut.
    fn inside(&mut self, holds: Truth, term: Term) -> Told<Term> {
        let parts = self.sum(term).parts.clone();
        let opposite = self.truths.not(holds);
        let mut result = term;
        for (atom, by) in parts {
            let (is_open, inner) = match *self.kind(atom) {
                Kind::Gate(asks, inner) if asks == holds || asks == opposite => {
                    (asks == holds, inner)
                }
                Kind::Positive(inner) => match self.sign_where(holds, inner) {
                    Some(is_positive) => (is_positive, inner),
                    None => continue,
                },
                _ => continue,
            };
            let single = self.single(atom);
            result = self.add_scaled(result, single, -by)?;
            if is_open {
                result = self.add_scaled(result, inner, by)?;
            }
        }
        Ok(result)
    }

    /// Whether a term is at least 0, or at most 0, where a comparison of the same primitive holds.
    fn sign_where(&mut self, holds: Truth, term: Term) -> Option<bool> {
        let (Variable { primitive, least }, yes, no) = self.truths.split(holds)?;
        let (factor, own, constant) = self.primitive(term);
        let is_plain = yes.settled().is_some() && no.settled().is_some();
        if own != primitive || !is_plain {
            return None;
        }
        // The end of where it holds, and whether the term rises from there on.
        let holds_above = yes == Truth::YES;
        let end = if holds_above { least } else { least - 1 };
        let at_end = end.checked_mul(factor)?.checked_add(constant)?;
        match (factor > 0) == holds_above {
            true => (at_end >= 0).then_some(true),
            false => (at_end <= 0).then_some(false),
        }
    }

    /// `term >= least`
    pub fn at_least(&mut self, term: Term, least: i128) -> Told<Truth> {
        let (low, high) = self.bounds(term);
        if low >= least {
            return Ok(Truth::YES);
        }
        if high < least {
            return Ok(Truth::NO);
        }
        let (factor, primitive, constant) = self.primitive(term);
        let over = least - constant;
        if factor > 0 {
            let least = -((-over).div_euclid(factor));
            return self.primitive_at_least(primitive, least);
        }
        let above = (-over).div_euclid(-factor) + 1;
        let truth = self.primitive_at_least(primitive, above)?;
        Ok(self.truths.not(truth))
    }

    fn primitive_at_least(&mut self, primitive: Term, least: i128) -> Told<Truth> {
        if let Some(atom) = self.only_atom(primitive) {
            match self.kind(atom).clone() {
                Kind::Floor(term, n) => {
                    let least = least.checked_mul(1 << n).ok_or_else(too_large)?;
                    return self.at_least(term, least);
                }
                Kind::Positive(_) if least <= 0 => return Ok(Truth::YES),
                Kind::Positive(term) => return self.at_least(term, least),
                Kind::Gate(holds, term) => {
                    let open = self.at_least(term, least)?;
                    let holds = self.settle(holds);
                    return Ok(self.truths.choose(holds, open, Truth::of(least <= 0)));
                }
                _ => {}
            }
        }
        Ok(self.truths.variable(Variable { primitive, least }))
    }

    /// `a == b`
    pub fn equal(&mut self, a: Term, b: Term) -> Told<Truth> {
        let difference = self.sub(a, b)?;
        let (factor, _, constant) = self.primitive(difference);
        if self.number(difference).is_none() && constant % factor != 0 {
            return Ok(Truth::NO);
        }
        let low = self.at_least(difference, 0)?;
        let high = self.at_least(difference, 1)?;
        let high = self.truths.not(high);
        Ok(self.truths.and(low, high))
    }

    /// What is left of a truth on this path.
    pub fn settle(&mut self, truth: Truth) -> Truth {
        if let Some(known) = self.known.settled.get(&truth) {
            return *known;
        }
        let Some((variable, yes, no)) = self.truths.split(truth) else {
            return truth;
        };
        let (low, high) = self.bounds(variable.primitive);
        let result = if low >= variable.least {
            self.settle(yes)
        } else if high < variable.least {
            self.settle(no)
        } else {
            let (yes, no) = (self.settle(yes), self.settle(no));
            let asks = self.truths.variable(variable);
            self.truths.choose(asks, yes, no)
        };
        if result.settled().is_some() {
            self.known.settled.insert(truth, result);
        }
        result
    }

    /// Whether it holds on this path.
    ///
    /// # Errors
    /// It must be told by a case.
    pub fn decide(&mut self, truth: Truth) -> Told<bool> {
        let truth = self.settle(truth);
        match (truth.settled(), self.truths.split(truth)) {
            (Some(holds), _) => Ok(holds),
            (None, Some((variable, ..))) => {
                if !self.takes_sides {
                    return Err(Stop::Split(variable));
                }
                self.taken.push((variable, true));
                self.assume(variable, true)?;
                self.decide(truth)
            }
            (None, None) => Err(Stop::Impossible),
        }
    }

    /// A truth as 0 or 1.
    pub fn bit(&mut self, truth: Truth) -> Told<Term> {
        let one = self.constant(1);
        self.gate(truth, one)
    }
}
