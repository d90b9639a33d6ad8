//! Intervals of words, read as signed.

/// From `low` to `high`, both included; empty where `low` is larger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    pub low: i64,
    pub high: i64,
}

impl Interval {
    /// Any word.
    pub const ALL: Self = Self {
        low: i32::MIN as i64,
        high: i32::MAX as i64,
    };

    /// One word.
    pub const fn point(value: i32) -> Self {
        Self {
            low: value as i64,
            high: value as i64,
        }
    }

    /// From `low` to `high`, or any word if these are no words: then the result has wrapped.
    pub fn of(low: i64, high: i64) -> Self {
        let all = Self::ALL;
        if low < all.low || high > all.high {
            all
        } else {
            Self { low, high }
        }
    }

    /// The sum, or any word where it may wrap.
    pub fn plus(self, other: Self) -> Self {
        Self::of(self.low + other.low, self.high + other.high)
    }

    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    pub fn as_point(self) -> Option<i32> {
        if self.low == self.high {
            i32::try_from(self.low).ok()
        } else {
            None
        }
    }

    pub fn holds(self, value: i64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Whether every word of `other` is here.
    pub fn covers(self, other: Self) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    pub fn intersect(self, other: Self) -> Self {
        Self {
            low: self.low.max(other.low),
            high: self.high.min(other.high),
        }
    }

    pub fn hull(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Without a word, where that leaves an interval.
    pub fn without(self, value: i64) -> Self {
        Self {
            low: self.low + i64::from(self.low == value),
            high: self.high - i64::from(self.high == value),
        }
    }

    /// The words read as unsigned; all of them where the sign is not known.
    pub fn unsigned(self) -> Self {
        match (self.low < 0, self.high < 0) {
            (false, false) => self,
            (true, true) => Self {
                low: self.low + (1 << 32),
                high: self.high + (1 << 32),
            },
            _ => Self {
                low: 0,
                high: u32::MAX as i64,
            },
        }
    }

    /// The most significant bit that the absolute value (or, not `signed`, the value) may have, -1
    /// for none.
    pub fn top_bit_max(self, signed: bool) -> i32 {
        let magnitude = match signed {
            true => self.low.abs().max(self.high.abs()),
            false => self.unsigned().high,
        };
        63 - magnitude.leading_zeros() as i32
    }

    /// The least of those bits, zero left out: who divides by zero is done at once.
    pub fn top_bit_min(self, signed: bool) -> i32 {
        let least = match signed {
            true if self.low <= 0 && self.high >= 0 => 1,
            true => self.low.abs().min(self.high.abs()),
            false => self.unsigned().low,
        };
        63 - least.max(1).leading_zeros() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIN: i64 = i32::MIN as i64;
    const MAX: i64 = i32::MAX as i64;

    fn of(low: i64, high: i64) -> Interval {
        Interval { low, high }
    }

    /// What is no word has wrapped, and may be any.
    #[test]
    fn what_may_wrap_is_any_word() {
        assert_eq!(Interval::of(MIN, MAX), Interval::ALL);
        assert_eq!(Interval::of(MIN, 5), of(MIN, 5));
        assert_eq!(Interval::of(-5, MAX), of(-5, MAX));
        let wraps = [Interval::of(MIN - 1, 5), Interval::of(-5, MAX + 1)];
        assert_eq!(wraps, [Interval::ALL; 2]);
        assert_eq!(of(-1, 2).plus(of(10, 20)), of(9, 22));
        assert_eq!(of(-1, 2).plus(of(0, MAX)), Interval::ALL);
    }

    #[test]
    fn words_in_and_out_of_an_interval() {
        let some = of(-3, 4);
        assert_eq!(
            [-4, -3, 4, 5].map(|word| some.holds(word)),
            [false, true, true, false]
        );
        assert!(of(1, 0).is_empty() && !of(1, 1).is_empty());
        assert_eq!([of(3, 3).as_point(), some.as_point()], [Some(3), None]);
        let others = [some, of(-2, 3), of(-4, 4), of(-3, 5)];
        assert_eq!(
            others.map(|other| some.covers(other)),
            [true, true, false, false]
        );
        assert_eq!(
            [some.intersect(of(0, 9)), some.hull(of(0, 9))],
            [of(0, 4), of(-3, 9)]
        );
        let without = [-3, 4, 0, 7].map(|word| some.without(word));
        assert_eq!(without, [of(-2, 4), of(-3, 3), some, some]);
        assert!(Interval::point(3).without(3).is_empty());
    }

    /// The words read as unsigned, and the top bits by which a division takes its time.
    #[test]
    fn words_as_magnitudes() {
        const WORDS: i64 = 1 << 32;
        let found = [of(0, 5), of(-2, -1), of(-1, 0)].map(Interval::unsigned);
        assert_eq!(
            found,
            [of(0, 5), of(WORDS - 2, WORDS - 1), of(0, WORDS - 1)]
        );
        let some = [
            of(-8, 3),
            of(3, 8),
            of(-9, -4),
            of(0, 0),
            of(MIN, 0),
            of(-1, 7),
            of(0, 9),
        ];
        assert_eq!(some.map(|i| i.top_bit_max(true)), [3, 3, 3, -1, 31, 2, 3]);
        assert_eq!(
            some.map(|i| i.top_bit_max(false)),
            [31, 3, 31, -1, 31, 31, 3]
        );
        assert_eq!(some.map(|i| i.top_bit_min(true)), [0, 1, 2, 0, 0, 0, 0]);
        assert_eq!(some.map(|i| i.top_bit_min(false)), [0, 1, 31, 0, 0, 0, 0]);
        assert_eq!(of(-7, 0).top_bit_min(true), 0);
    }
}
