//! What an instruction reads and writes: the string `"d NZCV = n C"` of the table, parsed while the
//! crate is compiled.
//!
//! Left of `=` is written, right of it read. `d n m a t t2` are core registers, `Sd Sn Sm Dd Dm`
//! floating-point ones, `Sm2` the pair Sm, Sm+1, `Sall` S0 to S31; `list`, `Slist`, `Dlist` the
//! registers of a list; `lr` and `pc` themselves, `banked` the stack pointer if the special
//! register is one. Flags are written as runs of `N Z C V Q`, and `GE`, `F` (the flags of FPSCR);
//! `NZCV` only if the instruction sets flags. `c` is the shifter's carry: written to C when the
//! operand is shifted, else C stays. `C?` is C of a shift by register: kept when the amount is 0.
//! The base register of a load or store is written when it writes back, and is not spelled out.

use crate::words::{index_of, skip_blanks, word_end};
use core::ops::{BitOr, BitOrAssign};

/// A set of flags.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Flags(u16);

impl Flags {
    /// No flag.
    pub const NONE: Self = Self(0);
    /// Negative.
    pub const N: Self = Self(1);
    /// Zero.
    pub const Z: Self = Self(2);
    /// Carry.
    pub const C: Self = Self(4);
    /// Overflow.
    pub const V: Self = Self(8);
    /// Sticky saturation.
    pub const Q: Self = Self(16);
    /// The four greater-or-equal bits of the SIMD instructions.
    pub const GE: Self = Self(32);
    /// The condition flags of FPSCR (its cumulative exception bits and its modes are not tracked).
    pub const FPSCR: Self = Self(64);
    /// N, Z, C and V.
    pub const NZCV: Self = Self(15);
    const SHIFTER_CARRY: Self = Self(128);
    const CARRY_OR_KEPT: Self = Self(256);

    /// Whether no flag is in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the sets share a flag.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether every flag of `other` is in the set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The flags of both.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The flags that are not in `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

impl BitOr for Flags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl BitOrAssign for Flags {
    fn bitor_assign(&mut self, other: Self) {
        *self = self.union(other);
    }
}

/// The flags one instruction reads and writes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct FlagUse {
    /// Read: by its condition, as an operand, or because it may leave them as they are.
    pub reads: Flags,
    /// Written, or possibly written. `Q` is sticky: a write only ever sets it.
    pub writes: Flags,
}

/// An operand that is read or written; its number is its bit in [`Effects`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Operand {
    D,
    N,
    M,
    A,
    T,
    T2,
    List,
    Lr,
    Pc,
    SingleD,
    SingleN,
    SingleM,
    SinglePairM,
    DoubleD,
    DoubleM,
    SingleList,
    DoubleList,
    SingleAll,
    Banked,
}

impl Operand {
    /// All operands, in the order of their numbers.
    pub const ALL: [Self; 19] = [
        Self::D,
        Self::N,
        Self::M,
        Self::A,
        Self::T,
        Self::T2,
        Self::List,
        Self::Lr,
        Self::Pc,
        Self::SingleD,
        Self::SingleN,
        Self::SingleM,
        Self::SinglePairM,
        Self::DoubleD,
        Self::DoubleM,
        Self::SingleList,
        Self::DoubleList,
        Self::SingleAll,
        Self::Banked,
    ];
}

const OPERANDS: &[&str] = &[
    "d", "n", "m", "a", "t", "t2", "list", "lr", "pc", "Sd", "Sn", "Sm", "Sm2", "Dd", "Dm",
    "Slist", "Dlist", "Sall", "banked",
];

const FLAG_WORDS: &[&str] = &["NZCV", "NZC", "NZ", "C", "Q", "GE", "F", "c", "C?"];
const FLAG_SETS: &[u16] = &[15, 7, 3, 4, 16, 32, 64, 128, 256];

/// The parsed string.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effects {
    writes: u32,
    reads: u32,
    flag_writes: Flags,
    flag_reads: Flags,
}

/// A set of operands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Operands(u32);

impl Operands {
    /// Whether the operand is in the set.
    pub const fn has(self, operand: Operand) -> bool {
        self.0 >> operand as u32 & 1 != 0
    }

    /// Those that are no fields of core registers: all from `list` on.
    pub fn others(self) -> impl Iterator<Item = Operand> {
        let mut bits = self.0 >> (Operand::List as u32) << (Operand::List as u32);
        core::iter::from_fn(move || {
            let first = *Operand::ALL.get(bits.trailing_zeros() as usize)?;
            bits &= bits - 1;
            Some(first)
        })
    }
}

impl Effects {
    /// Parses the string; panics, which is a build error in a constant, at an unknown word.
    pub const fn parse(text: &str) -> Self {
        let text = text.as_bytes();
        let mut e = Self {
            writes: 0,
            reads: 0,
            flag_writes: Flags::NONE,
            flag_reads: Flags::NONE,
        };
        let (mut from, mut right) = (skip_blanks(text, 0), false);
        while from < text.len() {
            let end = word_end(text, from);
            if text[from] == b'=' {
                right = true;
            } else {
                e.add(text, from, end, right);
            }
            from = skip_blanks(text, end);
        }
        assert!(right, "effects have a left and a right side");
        e
    }

    const fn add(&mut self, text: &[u8], from: usize, end: usize, right: bool) {
        match (
            index_of(OPERANDS, text, from, end),
            index_of(FLAG_WORDS, text, from, end),
            right,
        ) {
            (Some(i), _, false) => self.writes |= 1 << i,
            (Some(i), _, true) => self.reads |= 1 << i,
            (_, Some(i), false) => self.flag_writes = self.flag_writes.union(Flags(FLAG_SETS[i])),
            (_, Some(i), true) => self.flag_reads = self.flag_reads.union(Flags(FLAG_SETS[i])),
            _ => panic!("unknown operand or flag"),
        }
    }

    /// The operands that are written.
    pub const fn writes(&self) -> Operands {
        Operands(self.writes)
    }

    /// The operands that are read.
    pub const fn reads(&self) -> Operands {
        Operands(self.reads)
    }

    /// The flags, given whether the instruction sets them, whether its shifter gives a carry and
    /// whether that carry comes from the carry flag itself (RRX).
    pub const fn flags(&self, sets: bool, shifter_carry: bool, rrx: bool) -> FlagUse {
        let mut reads = if rrx {
            self.flag_reads.union(Flags::C)
        } else {
            self.flag_reads
        };
        let mut writes = self
            .flag_writes
            .without(Flags::SHIFTER_CARRY)
            .without(Flags::CARRY_OR_KEPT);
        if self.flag_writes.contains(Flags::SHIFTER_CARRY) && shifter_carry {
            writes = writes.union(Flags::C);
        }
        if self.flag_writes.contains(Flags::CARRY_OR_KEPT) {
            writes = writes.union(Flags::C);
            reads = if sets { reads.union(Flags::C) } else { reads };
        }
        FlagUse {
            reads,
            writes: if sets {
                writes
            } else {
                writes.without(Flags::NZCV)
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adc_reads_carry_and_sets_flags_only_with_s() {
        let e = Effects::parse("d NZCV = n m C");
        let of = |operands: Operands| {
            Operand::ALL
                .into_iter()
                .filter(move |operand| operands.has(*operand))
        };
        assert!(of(e.writes()).eq([Operand::D]) && of(e.reads()).eq([Operand::N, Operand::M]));
        assert_eq!(
            e.flags(true, false, false),
            FlagUse {
                reads: Flags::C,
                writes: Flags::NZCV
            }
        );
        assert_eq!(
            e.flags(false, false, false),
            FlagUse {
                reads: Flags::C,
                writes: Flags::NONE
            }
        );
    }

    #[test]
    fn a_shift_by_register_may_keep_carry() {
        let e = Effects::parse("d NZ C? = n m");
        let nzc = Flags::N | Flags::Z | Flags::C;
        assert_eq!(
            e.flags(true, false, false),
            FlagUse {
                reads: Flags::C,
                writes: nzc
            }
        );
        assert_eq!(e.flags(false, false, false), FlagUse::default());
    }
}
