//! Ranges of neighbouring keys.

use std::ops::Range;

/// Neighbouring keys, counted from 0 at the lowest key of the keyboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct KeyRange {
    /// The lowest.
    pub first: u32,
    /// Behind the highest.
    pub end: u32,
}

impl KeyRange {
    /// The keys from one on and below another.
    pub fn new(first: u32, end: u32) -> KeyRange {
        KeyRange { first, end }
    }

    /// How many keys it has.
    pub fn count(self) -> u32 {
        self.end.saturating_sub(self.first)
    }

    /// Whether a key is one of them.
    pub fn contains(self, key: u32) -> bool {
        (self.first..self.end).contains(&key)
    }

    /// The keys that are in both, if there are any.
    pub fn intersection(self, other: KeyRange) -> Option<KeyRange> {
        let both = KeyRange::new(self.first.max(other.first), self.end.min(other.end));
        (both.first < both.end).then_some(both)
    }

    /// The keys as indices of a list.
    pub fn indices(self) -> Range<usize> {
        self.first as usize..self.end as usize
    }
}
