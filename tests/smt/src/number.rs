//! What meanings of operators are run with: integers without bounds, and words wide enough for the
//! interval in which a value lies.

use std::ops::{Add, Mul, Shl, Shr, Sub};

use whippen_kernel::{Range, Type, op::Integer};

use crate::term::{Sort, Term};

/// An integer without bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unbounded(pub Term);

impl Unbounded {
    fn with(self, name: &'static str, other: Self) -> Self {
        Unbounded(Term::apply(name, &[self.0, other.0]))
    }

    /// `2^self`, where that is a number.
    fn power(self) -> Self {
        let by = self.0.number().expect("shifts are by numbers");
        Unbounded::of(1 << by)
    }

    fn truth(holds: Term) -> Self {
        Unbounded(holds.choose(Term::integer(1), Term::integer(0)))
    }

    /// Whether it is at most another one.
    pub fn at_most(self, other: Self) -> Term {
        self.with("<=", other).0
    }
}

macro_rules! operators_of {
    ($type:ident: $($trait:ident $method:ident $own:ident),+) => {
        $( impl $trait for $type {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                self.$own(other)
            }
        } )+
    };
}

impl Unbounded {
    fn plus(self, other: Self) -> Self {
        self.with("+", other)
    }

    fn minus(self, other: Self) -> Self {
        self.with("-", other)
    }

    fn times(self, other: Self) -> Self {
        self.with("*", other)
    }

    fn up(self, by: Self) -> Self {
        self.with("*", by.power())
    }

    fn down(self, by: Self) -> Self {
        self.with("div", by.power())
    }
}

operators_of!(Unbounded: Add add plus, Sub sub minus, Mul mul times, Shl shl up, Shr shr down);

impl Integer for Unbounded {
    fn of(number: i128) -> Self {
        Unbounded(Term::integer(number))
    }

    fn least(self, other: Self) -> Self {
        Unbounded(self.at_most(other).choose(self.0, other.0))
    }

    fn most(self, other: Self) -> Self {
        Unbounded(self.at_most(other).choose(other.0, self.0))
    }

    fn equal(self, other: Self) -> Self {
        Unbounded::truth(self.0.equals(other.0))
    }

    fn less(self, other: Self) -> Self {
        Unbounded::truth(self.with("<", other).0)
    }

    fn choose(self, yes: Self, no: Self) -> Self {
        Unbounded(self.0.equals(Term::integer(1)).choose(yes.0, no.0))
    }

    fn floor_quotient(self, divisor: Self) -> Self {
        Unbounded(Term::such_that("quotient", Sort::Integer, |quotient| {
            let quotient = Unbounded(quotient);
            let next = (quotient + Unbounded::of(1)) * divisor;
            let is_below = (quotient * divisor).at_most(self);
            is_below.and(self.with("<", next).0)
        }))
    }

    fn root(self) -> Self {
        let of = self.most(Unbounded::of(0));
        Unbounded(Term::such_that("root", Sort::Integer, |root| {
            let root = Unbounded(root);
            let next = root + Unbounded::of(1);
            let is_below = (root * root).at_most(of);
            let is_next_above = of.with("<", next * next).0;
            Term::all([Unbounded::of(0).at_most(root), is_below, is_next_above])
        }))
    }

    /// Anything: its steps are of words.
    fn quot(self, _: Self, _: Self) -> Self {
        Unbounded(Term::such_that("quot", Sort::Integer, |_| {
            Term::truth(true)
        }))
    }
}

/// An integer between two bounds, as a signed word that is wide enough for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounded {
    word: Term,
    low: i128,
    high: i128,
}

/// How many bits a signed word has in which all numbers of an interval have room. A processor has
/// words of the same widths, so what both do is often the same term.
fn bits_for(low: i128, high: i128) -> u32 {
    let bits = |end: i128| 129 - (if end < 0 { !end } else { end }).leading_zeros();
    match bits(low).max(bits(high)) {
        ..=32 => 32,
        33..=64 => 64,
        _ => 128,
    }
}

impl Bounded {
    /// Any number of a range, by a name, as a word of so many bits; and what is assumed of it.
    pub fn free(name: &str, bits: u32, range: Range) -> (Bounded, Term) {
        let word = Term::free(name, Sort::Word(bits));
        let bound = |end: i64| Term::word(end.into(), bits);
        let assumed = Term::all([
            Term::apply("bvsle", &[bound(range.low), word]),
            Term::apply("bvsle", &[word, bound(range.high)]),
        ]);
        (
            Bounded::known(word, range.low.into(), range.high.into()),
            assumed,
        )
    }

    /// A signed word, with room for it, of which it is known where it lies.
    pub fn known(word: Term, low: i128, high: i128) -> Bounded {
        let bits = bits_for(low, high);
        Bounded {
            word: word.resized(bits),
            low,
            high,
        }
    }

    /// The signed word of so many bits with its low bits, or of more.
    pub fn word(self, bits: u32) -> Term {
        self.word.resized(bits)
    }

    /// The number, if it is one.
    pub fn number(self) -> Option<i128> {
        let bits = self.word.bits();
        self.word
            .number()
            .map(|number| crate::term::signed(number, bits))
    }

    /// Where it lies.
    pub fn bounds(self) -> (i128, i128) {
        (self.low, self.high)
    }

    /// The value of a type that agrees in its low bits.
    #[must_use]
    pub fn wrapped(self, ty: Type) -> Bounded {
        let Range { low, high } = ty.range();
        if i128::from(low) <= self.low && self.high <= i128::from(high) {
            return self;
        }
        Bounded::known(self.word(ty.bits()), low.into(), high.into())
    }

    /// The same where it is promised to lie within a range; and the promise.
    pub fn promised(self, range: Range) -> (Bounded, Term) {
        let bits = self
            .word
            .bits()
            .max(bits_for(range.low.into(), range.high.into()));
        let (own, bound) = (self.word(bits), |end: i64| Term::word(end.into(), bits));
        let promise = Term::all([
            Term::apply("bvsle", &[bound(range.low), own]),
            Term::apply("bvsle", &[own, bound(range.high)]),
        ]);
        let low = self.low.max(range.low.into());
        let high = self.high.min(range.high.into());
        (Bounded::known(own, low, high), promise)
    }

    /// One of two values.
    pub fn either(condition: Term, yes: Bounded, no: Bounded) -> Bounded {
        let (low, high) = (yes.low.min(no.low), yes.high.max(no.high));
        let bits = bits_for(low, high);
        Bounded {
            word: condition.choose(yes.word(bits), no.word(bits)),
            low,
            high,
        }
    }

    /// Whether it is 1.
    pub fn holds(self) -> Term {
        self.word.equals(Term::word(1, self.word.bits()))
    }

    fn truth(holds: Term) -> Bounded {
        Bounded::either(holds, Bounded::of(1), Bounded::of(0))
    }

    /// The interval of what is monotone in each operand.
    fn corners(self, other: Self, of: impl Fn(i128, i128) -> i128) -> (i128, i128) {
        let ends = [(self.low, other.low), (self.low, other.high)];
        let others = [(self.high, other.low), (self.high, other.high)];
        let all = ends.into_iter().chain(others).map(|(a, b)| of(a, b));
        all.fold((i128::MAX, i128::MIN), |(low, high), one| {
            (low.min(one), high.max(one))
        })
    }

    /// A function of words that is right where nothing overflows.
    fn with(self, name: &'static str, other: Self, (low, high): (i128, i128)) -> Self {
        let bits = bits_for(low, high)
            .max(self.word.bits())
            .max(other.word.bits());
        let word = Term::apply(name, &[self.word(bits), other.word(bits)]);
        Bounded::known(word, low, high)
    }

    fn compared(self, name: &'static str, other: Self) -> Term {
        let bits = self.word.bits().max(other.word.bits());
        Term::apply(name, &[self.word(bits), other.word(bits)])
    }

    fn shift(self) -> u32 {
        u32::try_from(self.low).expect("shifts are by numbers")
    }

    fn plus(self, other: Self) -> Self {
        self.with("bvadd", other, self.corners(other, |a, b| a + b))
    }

    fn minus(self, other: Self) -> Self {
        self.with("bvsub", other, self.corners(other, |a, b| a - b))
    }

    fn times(self, other: Self) -> Self {
        self.with("bvmul", other, self.corners(other, |a, b| a * b))
    }

    fn up(self, by: Self) -> Self {
        let by = by.shift();
        let (low, high) = (self.low << by, self.high << by);
        let bits = bits_for(low, high).max(self.word.bits());
        let word = Term::apply("bvshl", &[self.word(bits), Term::word(by.into(), bits)]);
        Bounded::known(word, low, high)
    }

    fn down(self, by: Self) -> Self {
        let (by, bits) = (by.shift(), self.word.bits());
        let by_most = Term::word(by.min(bits - 1).into(), bits);
        let word = Term::apply("bvashr", &[self.word, by_most]);
        Bounded::known(word, self.low >> by, self.high >> by)
    }
}

operators_of!(Bounded: Add add plus, Sub sub minus, Mul mul times, Shl shl up, Shr shr down);

impl Integer for Bounded {
    fn of(number: i128) -> Self {
        Bounded {
            word: Term::word(number, bits_for(number, number)),
            low: number,
            high: number,
        }
    }

    fn least(self, other: Self) -> Self {
        let is_less = self.compared("bvslt", other);
        let high = self.high.min(other.high);
        let either = Bounded::either(is_less, self, other);
        Bounded::known(either.word, self.low.min(other.low), high)
    }

    fn most(self, other: Self) -> Self {
        let is_less = self.compared("bvslt", other);
        let low = self.low.max(other.low);
        let either = Bounded::either(is_less, other, self);
        Bounded::known(either.word, low, self.high.max(other.high))
    }

    fn equal(self, other: Self) -> Self {
        Bounded::truth(self.compared("=", other))
    }

    fn less(self, other: Self) -> Self {
        Bounded::truth(self.compared("bvslt", other))
    }

    fn choose(self, yes: Self, no: Self) -> Self {
        Bounded::either(self.holds(), yes, no)
    }

    fn floor_quotient(self, divisor: Self) -> Self {
        let bits = self.word.bits().max(divisor.word.bits());
        let (a, b) = (self.word(bits), divisor.word(bits));
        let [quotient, rest] = ["bvsdiv", "bvsrem"].map(|name| Term::apply(name, &[a, b]));
        let is_below = Term::apply("bvslt", &[rest, Term::word(0, bits)]);
        let less = Term::apply("bvsub", &[quotient, Term::word(1, bits)]);
        let (low, high) = (self.low.min(-1), self.high.max(0));
        Bounded::known(is_below.choose(less, quotient), low, high)
    }

    fn root(self) -> Self {
        let of = self.most(Bounded::of(0));
        let high = of.high.isqrt();
        let bits = bits_for(0, (high + 1) * (high + 1));
        let root = Term::such_that("root", Sort::Word(bits), |root| {
            let one = Term::word(1, bits);
            let next = Term::apply("bvadd", &[root, one]);
            let [own, above] = [root, next].map(|side| Term::apply("bvmul", &[side, side]));
            let ends = [Term::word(0, bits), Term::word(high, bits)];
            Term::all([
                Term::apply("bvsle", &[ends[0], root]),
                Term::apply("bvsle", &[root, ends[1]]),
                Term::apply("bvsle", &[own, of.word(bits)]),
                Term::apply("bvslt", &[of.word(bits), above]),
            ])
        });
        Bounded::known(root, 0, high)
    }

    fn quot(self, divisor: Self, n: Self) -> Self {
        let (a, b) = (self.word(32), divisor.word(32));
        let zero = Term::word(0, 32);
        let apply = |name: &'static str, x: Term, y: Term| Term::apply(name, &[x, y]);
        let twice = apply("bvshl", a, Term::word(1, 32));
        let up = apply("bvxor", a, twice).leading_zeros();
        let up_divisor = b.leading_zeros();
        let dividend = apply("bvshl", a, up);
        let own = apply("bvlshr", apply("bvshl", b, up_divisor), Term::word(16, 32));
        let top = apply("bvsdiv", dividend.resized(64), own.widened(64));
        let top = apply("bvshl", top, Term::word(15, 64));
        let down = apply("bvsub", up, up_divisor);
        let down = apply("bvadd", down, Term::word(31 - i128::from(n.shift()), 32));
        let is_up = apply("bvslt", down, zero);
        let down = is_up.choose(zero, down).resized(64);
        let quotient = Bounded::known(apply("bvashr", top, down), i64::MIN.into(), i64::MAX.into());
        let held = quotient
            .most(Bounded::of(-(1 << 29)))
            .least(Bounded::of((1 << 29) - 1));
        let is_positive = apply("bvslt", zero, b);
        Bounded::either(is_positive, held, Bounded::of(0))
    }
}
