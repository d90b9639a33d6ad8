//! The flags: which combinations are possible, and what they say of values.

use whippen_isa::Cond;

use super::{Facts, Interval, NONE, Name};

/// A set of combinations of N, Z, C and V: bit `n << 3 | z << 2 | c << 1 | v`.
pub type Combinations = u16;

/// What is known of the flags.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FlagFacts {
    pub(super) possible: Combinations,
    /// They are those of the difference of two values; both [`NONE`] or neither... where one is,
    /// the other tells nothing.
    compared: [Name; 2],
    /// N and Z are those of this value.
    result: Name,
}

impl FlagFacts {
    /// Nothing.
    pub const UNKNOWN: Self = Self {
        possible: !0,
        compared: [NONE; 2],
        result: NONE,
    };

    /// Keeps the combinations in which a condition holds; false when there is none.
    pub fn keep_where(&mut self, cond: Cond) -> bool {
        self.possible &= combinations(|n, z, c, v| cond.holds(n, z, c, v));
        self.possible != 0
    }

    /// Forgets a comparison neither side of which is of interest, and a result that is not.
    pub fn forget_unless(&mut self, of_interest: impl Fn(Name) -> bool) {
        if !self
            .compared
            .iter()
            .any(|&name| name != NONE && of_interest(name))
        {
            self.compared = [NONE; 2];
        }
        if self.result != NONE && !of_interest(self.result) {
            self.result = NONE;
        }
    }

    /// The values that the flags speak of.
    pub fn names(&self) -> impl Iterator<Item = Name> {
        let [left, right] = self.compared;
        [left, right, self.result]
            .into_iter()
            .filter(|&name| name != NONE)
    }

    /// As they are stored, [`NONE`] included.
    pub fn names_mut(&mut self) -> impl Iterator<Item = &mut Name> {
        self.compared
            .iter_mut()
            .chain(std::iter::once(&mut self.result))
    }

    pub fn all_names(&self) -> [Name; 3] {
        [self.compared[0], self.compared[1], self.result]
    }

    /// Whether every combination of `other` is possible here.
    pub fn allows(&self, other: &Self) -> bool {
        other.possible & !self.possible == 0
    }

    /// The combinations of both, saying what `names` are, in the order of [`FlagFacts::all_names`].
    pub fn joined(&self, other: &Self, [left, right, result]: [Name; 3]) -> Self {
        let compared = if left == NONE || right == NONE {
            [NONE; 2]
        } else {
            [left, right]
        };
        Self {
            possible: self.possible | other.possible,
            compared,
            result,
        }
    }

    fn can(&self, wanted: impl Fn(bool, bool, bool, bool) -> bool) -> bool {
        self.possible & combinations(wanted) != 0
    }
}

fn combinations(wanted: impl Fn(bool, bool, bool, bool) -> bool) -> Combinations {
    let is = |bits: u16, flag: u16| bits & flag != 0;
    (0..16)
        .filter(|&b| wanted(is(b, 8), is(b, 4), is(b, 2), is(b, 1)))
        .fold(0, |set, b| set | 1 << b)
}

/// The flags of `a - b`.
fn of_difference(a: Interval, b: Interval, same: bool) -> Combinations {
    let (ua, ub) = (a.unsigned(), b.unsigned());
    let equal = !a.intersect(b).is_empty();
    let (less, greater) = (!same && a.low < b.high, !same && a.high > b.low);
    let (lower, higher) = (!same && ua.low < ub.high, !same && ua.high > ub.low);
    let difference = Interval {
        low: a.low - b.high,
        high: a.high - b.low,
    };
    let fits = !difference.intersect(Interval::ALL).is_empty();
    let overflows = !Interval::ALL.covers(difference);
    combinations(|n, z, c, v| match z {
        true => equal && !n && c && !v,
        false => {
            let signed = if n != v { less } else { greater };
            let unsigned = if c { higher } else { lower };
            signed && unsigned && if v { overflows } else { fits }
        }
    })
}

/// The flags of an instruction whose N and Z are those of its result.
fn of_result(value: Interval) -> Combinations {
    combinations(|n, z, _, _| match (n, z) {
        (true, true) => false,
        (false, true) => value.holds(0),
        (true, false) => value.low < 0,
        (false, false) => value.high > 0,
    })
}

impl Facts {
    /// The flags show the difference of two values, and the sign of a third unless it is [`NONE`].
    pub(super) fn set_compared(&mut self, left: Name, right: Name, result: Name) {
        self.flags = FlagFacts {
            possible: !0,
            compared: [left, right],
            result,
        };
        self.renew_flags();
    }

    /// N and Z show a value, unless it is [`NONE`]; nothing is known of C and V.
    pub(super) fn set_result(&mut self, result: Name) {
        self.flags = FlagFacts {
            possible: !0,
            compared: [NONE; 2],
            result,
        };
        self.renew_flags();
    }

    /// Takes out the combinations that the intervals exclude; false when none is left.
    pub(super) fn renew_flags(&mut self) -> bool {
        let [left, right] = self.flags.compared;
        if left != NONE && right != NONE {
            self.flags.possible &= of_difference(
                self.interval_of(left),
                self.interval_of(right),
                left == right,
            );
        }
        if self.flags.result != NONE {
            self.flags.possible &= of_result(self.interval_of(self.flags.result));
        }
        self.flags.possible != 0
    }

    /// What the possible combinations say of the values that were compared; false when they cannot
    /// be so.
    pub(super) fn narrow_compared(&mut self) -> bool {
        let [left, right] = self.flags.compared;
        if left == NONE || right == NONE || left == right {
            return true;
        }
        let less = self.flags.can(|n, z, _, v| !z && n != v);
        let greater = self.flags.can(|n, z, _, v| !z && n == v);
        let equal = self.flags.can(|_, z, _, _| z);
        let lower = self.flags.can(|_, z, c, _| !z && !c);
        let higher = self.flags.can(|_, z, c, _| !z && c);
        let (a, b) = (self.interval_of(left), self.interval_of(right));
        let strict = i64::from(!equal);
        let mut to = [a, b];
        if !greater {
            to = at_most(to, strict);
        }
        if !less {
            let [b, a] = at_most([to[1], to[0]], strict);
            to = [a, b];
        }
        if !higher && b.low >= 0 {
            to = at_most(
                [
                    to[0].intersect(Interval {
                        low: 0,
                        ..Interval::ALL
                    }),
                    to[1],
                ],
                strict,
            );
        }
        if !lower && a.low >= 0 {
            let [b, a] = at_most(
                [
                    to[1].intersect(Interval {
                        low: 0,
                        ..Interval::ALL
                    }),
                    to[0],
                ],
                strict,
            );
            to = [a, b];
        }
        if !equal {
            to = [without(to[0], to[1]), without(to[1], to[0])];
        }
        self.narrow(left, to[0]) && self.narrow(right, to[1])
    }

    /// What the possible combinations say of the value whose sign they show.
    pub(super) fn narrow_result(&mut self) -> bool {
        let result = self.flags.result;
        if result == NONE {
            return true;
        }
        let mut to = self.interval_of(result);
        if !self.flags.can(|n, _, _, _| n) {
            to.low = to.low.max(0);
        }
        if !self.flags.can(|n, _, _, _| !n) {
            to.high = to.high.min(-1);
        }
        if !self.flags.can(|_, z, _, _| !z) {
            to = to.intersect(Interval::point(0));
        }
        if !self.flags.can(|_, z, _, _| z) {
            to = to.without(0);
        }
        self.narrow(result, to)
    }
}

/// The first is at most the second, or `strict` less.
fn at_most([a, b]: [Interval; 2], strict: i64) -> [Interval; 2] {
    [
        Interval {
            high: a.high.min(b.high - strict),
            ..a
        },
        Interval {
            low: b.low.max(a.low + strict),
            ..b
        },
    ]
}

/// Without the other, where that is one word.
fn without(value: Interval, other: Interval) -> Interval {
    if other.low == other.high {
        value.without(other.low)
    } else {
        value
    }
}
