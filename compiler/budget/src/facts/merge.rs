//! Comparison and join of the facts of two paths.

use smallvec::{SmallVec, smallvec};

use super::{FEW, Facts, NONE, Name};

impl Facts {
    /// Every place that has a name, in one order for all facts.
    fn places(&self) -> impl Iterator<Item = Name> + '_ {
        let registers = self.registers.iter().copied();
        registers.chain(self.flags.all_names()).chain(self.counted)
    }

    /// Whether all that is known here is known there too: whatever is possible there is possible
    /// here.
    pub fn covers(&self, other: &Self) -> bool {
        let mut images: SmallVec<[Name; 4 * FEW]> = smallvec![NONE; self.values.len()];
        let agrees = |(mine, theirs): (Name, Name)| {
            let Some(value) = self.values.get(usize::from(mine)) else {
                return true;
            };
            let image = &mut images[usize::from(mine)];
            let same = theirs != NONE && (*image == NONE || *image == theirs);
            *image = theirs;
            same && value.covers(other.interval_of(theirs))
        };
        self.flags.allows(&other.flags) && self.places().zip(other.places()).all(agrees)
    }

    /// The facts that hold on both paths.
    pub fn join(&self, other: &Self) -> Self {
        let mut pairs: Vec<(Name, Name)> = Vec::new();
        let mut joined = Self::nothing();
        let mut name = |mine: Name, theirs: Name| {
            if mine == NONE || theirs == NONE {
                return NONE;
            }
            let at = pairs
                .iter()
                .position(|pair| *pair == (mine, theirs))
                .unwrap_or_else(|| {
                    joined
                        .values
                        .push(self.interval_of(mine).hull(other.interval_of(theirs)));
                    pairs.push((mine, theirs));
                    pairs.len() - 1
                });
            at as Name
        };
        let mut names = self
            .places()
            .zip(other.places())
            .map(|(mine, theirs)| name(mine, theirs));
        let registers: [Name; 16] = std::array::from_fn(|_| names.next().unwrap_or(NONE));
        let flags: [Name; 3] = std::array::from_fn(|_| names.next().unwrap_or(NONE));
        let counted: [Name; 2] = std::array::from_fn(|_| names.next().unwrap_or(NONE));
        drop(names);
        joined.registers = registers;
        joined.flags = self.flags.joined(&other.flags, flags);
        joined.counted = match counted.contains(&NONE) {
            true => [NONE; 2],
            false => counted,
        };
        joined
    }
}
