//! Which keys of a keyboard one call runs.
//!
//! ```text
//!   sixteen at once:  0 .. 15 | 16 .. 31 | ..  | 80 .. 87           what is left with a mask around it
//!   and key 20 alone: 0 .. 15 | 16 .. 19 | 20 | 21 .. 31 | ..       its group in two parts
//!   four at once:     0 .. 3  | ..             | 84 .. 87           what is left one by one
//! ```

use crate::compile::{Function, Several};
use crate::{avx512, lanes};

/// Keys that one call runs: from the first on and before the end; of part of a group the end is
/// which keys from the first on, a bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stretch {
    pub function: Function,
    pub first: usize,
    pub end: usize,
}

impl Stretch {
    fn new(function: Function, first: usize, end: usize) -> Stretch {
        Stretch {
            function,
            first,
            end,
        }
    }

    fn has_keys(&self) -> bool {
        match self.function {
            Function::Part => self.end != 0,
            _ => self.first < self.end,
        }
    }
}

/// What a tick calls, in the order of the keys.
pub(super) fn stretches(keys: usize, several: &Several, observed: Option<usize>) -> Vec<Stretch> {
    let all = match several {
        Several::Never => vec![Stretch::new(Function::Single, 0, keys)],
        Several::Four(_) => by_four(keys, observed),
        Several::Sixteen(_) => by_sixteen(keys, observed),
    };
    all.into_iter().filter(Stretch::has_keys).collect()
}

/// Whole groups of sixteen run at once, the others with a mask around what an observed key leaves
/// of its group and around what is left of the keyboard.
fn by_sixteen(keys: usize, observed: Option<usize>) -> Vec<Stretch> {
    let width = avx512::WIDTH;
    let whole = keys / width * width;
    // Keys of the group that begins with the first.
    let part = |first: usize, from: usize, end: usize| {
        let below = |key: usize| (1_usize << (key - first)) - 1;
        Stretch::new(Function::Part, first, below(end) & !below(from))
    };
    let tail = |from: usize| part(whole, from.max(whole), keys);
    let Some(key) = observed else {
        return vec![Stretch::new(Function::Whole, 0, whole), tail(0)];
    };
    let first = key / width * width;
    let after = (first + width).min(keys);
    vec![
        Stretch::new(Function::Whole, 0, first),
        part(first, first, key),
        Stretch::new(Function::Single, key, key + 1),
        part(first, key + 1, after),
        Stretch::new(Function::Whole, after, whole),
        tail(after),
    ]
}

/// Whole groups of four run at once, but for the group of an observed key.
fn by_four(keys: usize, observed: Option<usize>) -> Vec<Stretch> {
    let grouped = keys / lanes::WIDTH * lanes::WIDTH;
    let alone = observed
        .filter(|key| *key < grouped)
        .map_or(grouped, |key| key / lanes::WIDTH * lanes::WIDTH);
    let after = (alone + lanes::WIDTH).min(grouped.max(alone));
    vec![
        Stretch::new(Function::Lanes, 0, alone),
        Stretch::new(Function::Single, alone, after),
        Stretch::new(Function::Lanes, after, grouped),
        Stretch::new(Function::Single, grouped, keys),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(all: Vec<Stretch>) -> Vec<(Function, usize, usize)> {
        let all = all.into_iter().filter(Stretch::has_keys);
        all.map(|s| (s.function, s.first, s.end)).collect()
    }

    #[test]
    fn whole_groups_run_in_four_lanes() {
        use Function::{Lanes, Single};
        let shape = |keys, observed| shape(by_four(keys, observed));
        assert_eq!(shape(88, None), [(Lanes, 0, 88)]);
        assert_eq!(shape(10, None), [(Lanes, 0, 8), (Single, 8, 10)]);
        assert_eq!(
            shape(12, Some(5)),
            [(Lanes, 0, 4), (Single, 4, 8), (Lanes, 8, 12)]
        );
        assert_eq!(
            shape(10, Some(0)),
            [(Single, 0, 4), (Lanes, 4, 8), (Single, 8, 10)]
        );
        assert_eq!(shape(10, Some(9)), [(Lanes, 0, 8), (Single, 8, 10)]);
    }

    #[test]
    fn groups_of_sixteen_leave_out_an_observed_key() {
        use Function::{Part, Single, Whole};
        let shape = |keys, observed| shape(by_sixteen(keys, observed));
        assert_eq!(shape(88, None), [(Whole, 0, 80), (Part, 80, 0xFF)]);
        assert_eq!(shape(32, None), [(Whole, 0, 32)]);
        assert_eq!(shape(5, None), [(Part, 0, 0b1_1111)]);
        assert_eq!(
            shape(50, Some(17)),
            [
                (Whole, 0, 16),
                (Part, 16, 1),
                (Single, 17, 18),
                (Part, 16, 0xFFFC),
                (Whole, 32, 48),
                (Part, 48, 0b11)
            ]
        );
        assert_eq!(
            shape(36, Some(35)),
            [(Whole, 0, 32), (Part, 32, 0b111), (Single, 35, 36)]
        );
        assert_eq!(
            shape(36, Some(32)),
            [(Whole, 0, 32), (Single, 32, 33), (Part, 32, 0b1110)]
        );
    }
}
