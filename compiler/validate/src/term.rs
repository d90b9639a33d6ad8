//! Terms: integers as sums of products over atoms, each kept once.
//!
//! ```text
//!   a + b         { a: 1, b: 1 } + 0
//!   wrap32 a      a - 2^32 floor((a + 2^31) / 2^32)
//!   a mod 2^32    a - 2^32 floor(a / 2^32)
//!   max(a, b)     b + positive(a - b)
//!   c ? a : b     b + gate(c, a - b)
//! ```
//!
//! Numbers are exact: nothing wraps by itself, and what a processor does to a word is written with
//! [`Kind::Floor`]. So the two halves of a 64-bit number, or a sum that left a word in between,
//! fall together again by adding up coefficients. Two terms that are one have one number.
//!
//! Not here: rewriting (`normal`), truth (`truth`), what is known of a term (`bounds`).

use rustc_hash::{FxHashMap, FxHashSet};

use crate::stop::{Doubt, Reason, Stop, Told};
use crate::truth::Truth;

/// An integer that is no sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Atom(pub u32);

/// A sum, kept once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Term(pub u32);

/// What code of keys finds its memory by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Base {
    State,
    Record,
    Samples,
    History,
    Stack,
}

/// What nobody says more of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Function {
    And,
    Or,
    ExclusiveOr,
    LeadingZeros,
    /// Quotient of unsigned words, 0 by 0.
    DivideUnsigned,
    /// Quotient of signed words towards zero, 0 by 0.
    DivideSigned,
    ShiftLeft,
    ShiftRight,
    ShiftRightSigned,
    /// The operators of the Kernel that no instruction has.
    DivideRound(u8),
    SquareRoot,
    /// The word at an address: the last of these stores, an address and a word each, that is there,
    /// else the word below them. Address, word below, then the stores.
    Held,
}

/// What an atom is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    Base(Base),
    /// A register as it was at the beginning.
    Register(u8),
    /// A word of which nothing is known, by its number.
    Unknown(u32),
    /// An integer of which nothing is known but what is learnt.
    Integer,
    /// The number of a key.
    Key,
    /// What memory holds at the beginning at an address: so many bytes, unsigned, but for words.
    Load(Term, u8),
    /// A product, in order.
    Product(Vec<Atom>),
    /// A product of sums that were too long to multiply out.
    Times(Term, Term),
    /// `floor(term / 2^n)`
    Floor(Term, u8),
    /// The term where it is positive, else 0.
    Positive(Term),
    /// The term where something holds, else 0.
    Gate(Truth, Term),
    Apply(Function, Vec<Term>),
}

/// A sum.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub(crate) struct Sum {
    /// Coefficients, none zero, by atom.
    pub parts: Vec<(Atom, i128)>,
    pub constant: i128,
}

/// All terms, and what is known of them.
#[derive(Clone, Default)]
pub(crate) struct Terms {
    kinds: Vec<Kind>,
    atoms: FxHashMap<Kind, Atom>,
    sums: Vec<Sum>,
    terms: FxHashMap<Sum, Term>,
    /// What was computed before, which cases have in common.
    added: FxHashMap<(Term, Term, i128), Term>,
    multiplied: FxHashMap<(Term, Term), Term>,
    /// What was wrapped, and to how many bits, by the outcome.
    pub(crate) wrapped: FxHashMap<Term, (Term, u32)>,
    primitives: FxHashMap<Term, (i128, Term, i128)>,
    pub(crate) truths: crate::truth::Truths,
    pub(crate) known: crate::bounds::Known,
    /// Whether a run goes on with one side of what must be known, and the sides that it took.
    pub(crate) takes_sides: bool,
    pub(crate) taken: Vec<(crate::truth::Variable, bool)>,
    /// Whether what a value chooses is settled value by value (`within`), and flags are chosen by
    /// what holds; else both are cases of the path.
    pub(crate) by_value: bool,
    /// How many terms cases of single values have made.
    pub(crate) within: usize,
    /// Addresses of words that are pointers into regions of their own.
    pub(crate) pointers: FxHashSet<Term>,
    /// Routines of which it is shown what they give.
    pub(crate) contracts: Vec<crate::contract::Contract>,
    /// Loops of which it is shown that they find a root.
    pub(crate) roots: Vec<crate::root::RootLoop>,
    /// The numbers that memory holds at the beginning, in a run with numbers.
    pub(crate) sample: Option<crate::sample::Sample>,
}

/// How many products a product of sums may become.
const PRODUCTS_MAX: usize = 36;

pub(crate) fn too_large() -> Stop {
    Stop::Unproven(Doubt::new(Reason::Code, "a number leaves 128 bits"))
}

impl Terms {
    /// How many terms there are.
    pub fn count(&self) -> usize {
        self.sums.len()
    }

    /// How many of them paths have made.
    pub fn of_paths(&self) -> usize {
        self.sums.len() - self.within
    }

    pub fn intern(&mut self, sum: Sum) -> Term {
        if let Some(term) = self.terms.get(&sum) {
            return *term;
        }
        let term = Term(self.sums.len() as u32);
        self.sums.push(sum.clone());
        self.terms.insert(sum, term);
        term
    }

    pub fn atom(&mut self, kind: Kind) -> Atom {
        if let Some(atom) = self.atoms.get(&kind) {
            return *atom;
        }
        let atom = Atom(self.kinds.len() as u32);
        self.kinds.push(kind.clone());
        self.atoms.insert(kind, atom);
        atom
    }

    pub fn kind(&self, atom: Atom) -> &Kind {
        &self.kinds[atom.0 as usize]
    }

    /// All that was read of memory as it is at the beginning: addresses, bytes.
    pub fn loads(&self) -> Vec<(Term, u8)> {
        let loads = self.kinds.iter().filter_map(|kind| match kind {
            Kind::Load(address, bytes) => Some((*address, *bytes)),
            _ => None,
        });
        loads.collect()
    }

    pub fn sum(&self, term: Term) -> &Sum {
        &self.sums[term.0 as usize]
    }

    pub fn constant(&mut self, constant: i128) -> Term {
        self.intern(Sum {
            parts: Vec::new(),
            constant,
        })
    }

    pub fn single(&mut self, atom: Atom) -> Term {
        self.intern(Sum {
            parts: vec![(atom, 1)],
            constant: 0,
        })
    }

    pub fn of(&mut self, kind: Kind) -> Term {
        let atom = self.atom(kind);
        self.single(atom)
    }

    /// The number, if the term is one.
    pub fn number(&self, term: Term) -> Option<i128> {
        let sum = self.sum(term);
        sum.parts.is_empty().then_some(sum.constant)
    }

    /// The atom, if the term is one.
    pub fn only_atom(&self, term: Term) -> Option<Atom> {
        match self.sum(term) {
            Sum { parts, constant: 0 } => match parts[..] {
                [(atom, 1)] => Some(atom),
                _ => None,
            },
            _ => None,
        }
    }

    /// `a + b * by`
    pub fn add_scaled(&mut self, a: Term, b: Term, by: i128) -> Told<Term> {
        if let Some(sum) = self.added.get(&(a, b, by)) {
            return Ok(*sum);
        }
        let sum = self.sum_of(a, b, by)?;
        self.added.insert((a, b, by), sum);
        Ok(sum)
    }

    fn sum_of(&mut self, a: Term, b: Term, by: i128) -> Told<Term> {
        let (one, other) = (self.sum(a), self.sum(b));
        let mut parts = Vec::with_capacity(one.parts.len() + other.parts.len());
        let (mut left, mut right) = (&one.parts[..], &other.parts[..]);
        loop {
            match (left, right) {
                ([], []) => break,
                ([(x, c), rest @ ..], [(y, d), other @ ..]) if x == y => {
                    let d = d.checked_mul(by).ok_or_else(too_large)?;
                    let sum = c.checked_add(d).ok_or_else(too_large)?;
                    if sum != 0 {
                        parts.push((*x, sum));
                    }
                    (left, right) = (rest, other);
                }
                ([(x, c), rest @ ..], [(y, _), ..]) if x < y => {
                    parts.push((*x, *c));
                    left = rest;
                }
                ([first, rest @ ..], []) => {
                    parts.push(*first);
                    left = rest;
                }
                (_, [(y, d), other @ ..]) => {
                    let d = d.checked_mul(by).ok_or_else(too_large)?;
                    if d != 0 {
                        parts.push((*y, d));
                    }
                    right = other;
                }
            }
        }
        let constant = other.constant.checked_mul(by);
        let constant = constant.and_then(|k| k.checked_add(one.constant));
        let constant = constant.ok_or_else(too_large)?;
        Ok(self.intern(Sum { parts, constant }))
    }

    pub fn add(&mut self, a: Term, b: Term) -> Told<Term> {
        self.add_scaled(a, b, 1)
    }

    pub fn sub(&mut self, a: Term, b: Term) -> Told<Term> {
        self.add_scaled(a, b, -1)
    }

    pub fn scale(&mut self, a: Term, by: i128) -> Told<Term> {
        let zero = self.constant(0);
        self.add_scaled(zero, a, by)
    }

    pub fn plus(&mut self, a: Term, constant: i128) -> Told<Term> {
        let constant = self.constant(constant);
        self.add(a, constant)
    }

    /// The term as `factor * primitive + constant`: the coefficients of the primitive have no
    /// common factor, the first is positive, and it has no constant.
    pub fn primitive(&mut self, term: Term) -> (i128, Term, i128) {
        if let Some(found) = self.primitives.get(&term) {
            return *found;
        }
        let found = self.find_primitive(term);
        self.primitives.insert(term, found);
        found
    }

    fn find_primitive(&mut self, term: Term) -> (i128, Term, i128) {
        let Sum { parts, constant } = self.sum(term).clone();
        let common = parts
            .iter()
            .fold(0, |all, (_, c)| gcd(all, c.unsigned_abs()));
        let Some((_, first)) = parts.first() else {
            return (1, term, constant);
        };
        let factor = common as i128 * first.signum();
        let parts = parts.iter().map(|(a, c)| (*a, c / factor)).collect();
        let primitive = self.intern(Sum { parts, constant: 0 });
        (factor, primitive, constant)
    }

    /// The product, multiplied out where that is short.
    pub fn mul(&mut self, a: Term, b: Term) -> Told<Term> {
        if let Some(by) = self.number(a) {
            return self.scale(b, by);
        }
        if let Some(by) = self.number(b) {
            return self.scale(a, by);
        }
        let result = match self.multiplied.get(&(a, b)) {
            Some(product) => *product,
            None => {
                let product = self.product_of(a, b)?;
                self.multiplied.insert((a, b), product);
                product
            }
        };
        let range = crate::bounds::times(self.bounds(a), self.bounds(b));
        self.learn(result, range)?;
        Ok(result)
    }

    fn product_of(&mut self, a: Term, b: Term) -> Told<Term> {
        let (one, other) = (self.sum(a).clone(), self.sum(b).clone());
        let result = if (one.parts.len() + 1) * (other.parts.len() + 1) > PRODUCTS_MAX {
            self.long_product(a, b)?
        } else {
            let mut all = self.constant(
                one.constant
                    .checked_mul(other.constant)
                    .ok_or_else(too_large)?,
            );
            for (x, c) in &one.parts {
                let x = self.single(*x);
                all =
                    self.add_scaled(all, x, c.checked_mul(other.constant).ok_or_else(too_large)?)?;
            }
            for (y, d) in &other.parts {
                let single = self.single(*y);
                all = self.add_scaled(
                    all,
                    single,
                    d.checked_mul(one.constant).ok_or_else(too_large)?,
                )?;
                for (x, c) in &one.parts {
                    let product = self.product(*x, *y);
                    all =
                        self.add_scaled(all, product, c.checked_mul(*d).ok_or_else(too_large)?)?;
                }
            }
            all
        };
        Ok(result)
    }

    fn long_product(&mut self, a: Term, b: Term) -> Told<Term> {
        let mut factor = 1;
        let mut factors = [a, b];
        for term in &mut factors {
            let (by, primitive, constant) = self.primitive(*term);
            if constant % by == 0 {
                *term = self.plus(primitive, constant / by)?;
                factor *= by;
            }
        }
        factors.sort();
        let product = self.of(Kind::Times(factors[0], factors[1]));
        self.scale(product, factor)
    }

    fn product(&mut self, a: Atom, b: Atom) -> Term {
        let mut all = Vec::new();
        for atom in [a, b] {
            match self.kind(atom) {
                Kind::Product(factors) => all.extend(factors),
                _ => all.push(atom),
            }
        }
        all.sort();
        self.of(Kind::Product(all))
    }
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}
