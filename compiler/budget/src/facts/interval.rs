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
