//! Abstract interpretation of registers and flags along a path: the facts by which paths are found
//! to be infeasible.
//!
//! ```text
//!   register --> name --> interval       registers with one name hold one value
//!   flags    --> which of the 16 combinations of N, Z, C, V are possible,
//!                what was compared (two names), whose sign and zero they show (a name)
//!   counted  --> a name, and that of how many zeros its value begins with
//! ```
//!
//! A branch keeps the combinations that satisfy its condition, and narrows the intervals of what
//! was compared; when no combination or an empty interval is left, no input takes that path.
//! Everything is an over-approximation: a fact holds for every execution that takes the path.

mod effect;
mod flags;
mod interval;
mod merge;
#[cfg(test)]
mod tests;

pub use interval::Interval;

use std::collections::BTreeMap;

use smallvec::{SmallVec, smallvec};
use whippen_isa::Cond;

use super::relevant::{FLAGS, Relevant};
use flags::FlagFacts;

/// As many values are known at most places; more take memory of their own.
const FEW: usize = 8;

/// Index of a value.
type Name = u16;

/// No name: nothing is known of it, and no other register is known to hold the same.
const NONE: Name = Name::MAX;

/// What is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Facts {
    registers: [Name; 16],
    values: SmallVec<[Interval; FEW]>,
    flags: FlagFacts,
    /// A value above 0, and its leading zeros: moved up by them its top bit is set, which no
    /// interval of either tells. The last one that was counted.
    counted: [Name; 2],
}

impl Facts {
    /// Nothing.
    pub fn nothing() -> Self {
        Self {
            registers: [NONE; 16],
            values: SmallVec::new(),
            flags: FlagFacts::UNKNOWN,
            counted: [NONE; 2],
        }
    }

    /// Each of these registers holds a word from the first to the last.
    pub fn of_registers(known: &BTreeMap<u8, [u32; 2]>) -> Self {
        let mut facts = Self::nothing();
        for (&register, ends) in known {
            let [low, high] = ends.map(|word| i64::from(word as i32));
            facts.registers[usize::from(register & 15)] = facts.new_value(Interval { low, high });
        }
        facts
    }

    /// Where a register lies.
    pub fn interval(&self, register: u8) -> Interval {
        self.interval_of(self.registers[usize::from(register & 15)])
    }

    fn interval_of(&self, name: Name) -> Interval {
        self.values
            .get(usize::from(name))
            .copied()
            .unwrap_or(Interval::ALL)
    }

    fn new_value(&mut self, interval: Interval) -> Name {
        self.values.push(interval);
        (self.values.len() - 1) as Name
    }

    /// The name of a register, which gets one if it has none.
    fn name(&mut self, register: u8) -> Name {
        let register = usize::from(register & 15);
        if self.registers[register] == NONE {
            self.registers[register] = self.new_value(Interval::ALL);
        }
        self.registers[register]
    }

    /// Narrows a value; false when nothing is left.
    fn narrow(&mut self, name: Name, to: Interval) -> bool {
        let Some(value) = self.values.get_mut(usize::from(name)) else {
            return true;
        };
        *value = value.intersect(to);
        !value.is_empty()
    }

    /// The condition holds; false when it cannot.
    pub fn assume(&mut self, cond: Cond) -> bool {
        self.flags.keep_where(cond)
            && self.narrow_compared()
            && self.narrow_result()
            && self.renew_flags()
    }

    /// A register is zero, or is not; false when it cannot be so.
    pub fn assume_zero(&mut self, register: u8, zero: bool) -> bool {
        let name = self.name(register);
        let to = if zero {
            Interval::point(0)
        } else {
            self.interval_of(name).without(0)
        };
        self.narrow(name, to)
    }

    /// Forgets what can no longer matter, and numbers values in the order of the registers: facts
    /// that mean the same are equal.
    pub fn keep(&mut self, relevant: Relevant) {
        let mut uses: SmallVec<[u8; 4 * FEW]> = smallvec![0; self.values.len()];
        for register in 0..16 {
            let name = &mut self.registers[register];
            if relevant >> register & 1 == 0 {
                *name = NONE;
            } else if *name != NONE {
                uses[usize::from(*name)] = uses[usize::from(*name)].saturating_add(1);
            }
        }
        if relevant & FLAGS == 0 {
            self.flags = FlagFacts::UNKNOWN;
        }
        self.flags
            .forget_unless(|name| uses[usize::from(name)] != 0);
        self.flags
            .names()
            .for_each(|name| uses[usize::from(name)] = uses[usize::from(name)].saturating_add(1));
        let mut renumbered: SmallVec<[Name; 4 * FEW]> = smallvec![NONE; self.values.len()];
        let mut kept = SmallVec::new();
        let (old, registers) = (&self.values, &mut self.registers);
        let mut renumber = |name: &mut Name| {
            let at = usize::from(*name);
            let tells = old
                .get(at)
                .is_some_and(|value| uses[at] > 1 || *value != Interval::ALL);
            if !tells {
                *name = NONE;
                return;
            }
            if renumbered[at] == NONE {
                renumbered[at] = kept.len() as Name;
                kept.push(old[at]);
            }
            *name = renumbered[at];
        };
        registers.iter_mut().for_each(&mut renumber);
        self.flags.names_mut().for_each(&mut renumber);
        self.values = kept;
        let now = |name: Name| renumbered.get(usize::from(name)).copied();
        let now = self.counted.map(|name| now(name).unwrap_or(NONE));
        self.counted = if now.contains(&NONE) { [NONE; 2] } else { now };
    }
}
