//! The form of a core's table: lines and numbers, each with its source and how sure it is.

use crate::arch::Arch;
use crate::class::Class;
use crate::table::Op;
use core::fmt;

/// How sure a number is. The three are never averaged: a sum is as sure as its least sure part.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub enum Evidence {
    /// A published count that contains it is reproduced.
    Exact,
    /// A documented rule, without an independent count.
    Rule,
    /// By analogy, or a bound.
    Estimate,
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Exact => "exact",
            Self::Rule => "rule",
            Self::Estimate => "estimate",
        })
    }
}

/// A number of cycles, with its source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fact {
    /// The number.
    pub cycles: u8,
    /// How sure it is.
    pub evidence: Evidence,
    /// Where it is from.
    pub source: &'static str,
}

impl Fact {
    pub(crate) const fn new(cycles: u8, evidence: Evidence, source: &'static str) -> Self {
        Self {
            cycles,
            evidence,
            source,
        }
    }
}

/// Those that use a register: a set, by the way they use it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Takers(pub(super) u8);

impl Takers {
    /// Nobody.
    pub const NONE: Self = Self(0);
    /// A source operand that is none of the following.
    pub const OPERAND: Self = Self(1);
    /// Part of the address of a load or store.
    pub const ADDRESS: Self = Self(2);
    /// The accumulator of a multiply-add.
    pub const ACCUMULATOR: Self = Self(4);
    /// The addend of an extend-and-add.
    pub const ADDEND: Self = Self(8);
    /// Everybody, but for the data of a store.
    pub const ALL: Self = Self(15);

    /// Those that are not in `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Those of both.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether nobody is in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Which instructions of a class a line is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// All of them.
    Any,
    /// One instruction of the manual.
    Op(Op),
    /// With an operand shifted by other than LSL #0 to #3.
    ShiftedRegister,
    /// With such an operand, setting the flags.
    ShiftedRegisterFlags,
    /// With a modified immediate that is not one of the four repeating forms.
    ShiftedConstant,
    /// With such an immediate, setting the flags.
    ShiftedConstantFlags,
    /// Setting the flags.
    Flags,
    /// With a register as offset.
    RegisterOffset,
    /// Of a double-precision register.
    Double,
    /// Writing PC.
    WritesPc,
}

/// One line of a core's table: the first that fits an instruction counts it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Line {
    /// The classes it is about.
    pub classes: &'static [Class],
    /// Which instructions of those.
    pub kind: Kind,
    /// Cycles. Of an instruction that writes PC, without its refill.
    pub cycles: u8,
    /// Cycles for each register of a list, on top.
    pub each: u8,
    /// Cycles more, at most, that the sources leave open; see [`Rules::at_worst`].
    pub worst: u8,
    /// Who has to wait one cycle for its result; of a load of several, for the last.
    pub late_for: Takers,
    /// A base that a load writes back is as late as what it loads.
    pub late_base: bool,
    /// It starts under a load before it, where loads take more than a cycle.
    pub overlaps: bool,
    /// What may start so may start under it.
    pub overlapped: bool,
    /// Cycles that the floating-point unit is taken.
    pub float_hold: u8,
    /// Cycles from then until its floating-point result is there.
    pub float_delay: u8,
    /// How sure it is.
    pub evidence: Evidence,
    /// Where it is from.
    pub source: &'static str,
}

impl Line {
    /// A line with this number of cycles and nothing late.
    pub(crate) const fn new(classes: &'static [Class], kind: Kind, cycles: u8) -> Self {
        let (evidence, source) = (Evidence::Estimate, "");
        let (late_for, late_base) = (Takers::NONE, false);
        let (overlaps, overlapped) = (false, false);
        let (each, worst) = (0, 0);
        let (float_hold, float_delay) = (0, 0);
        Self {
            classes,
            kind,
            cycles,
            each,
            worst,
            late_for,
            late_base,
            overlaps,
            overlapped,
            float_hold,
            float_delay,
            evidence,
            source,
        }
    }

    /// And these for each register.
    pub(crate) const fn each(self, each: u8) -> Self {
        Self { each, ..self }
    }

    /// At worst, these more.
    pub(crate) const fn worst(self, worst: u8) -> Self {
        Self { worst, ..self }
    }

    /// Its result is one cycle late for these.
    pub(crate) const fn late(self, late_for: Takers) -> Self {
        Self { late_for, ..self }
    }

    /// And so is a base that it writes back.
    pub(crate) const fn late_base(self) -> Self {
        Self {
            late_base: true,
            ..self
        }
    }

    /// It may start under a load before it.
    pub(crate) const fn overlaps(self) -> Self {
        Self {
            overlaps: true,
            ..self
        }
    }

    /// The next may start under it.
    pub(crate) const fn overlapped(self) -> Self {
        Self {
            overlapped: true,
            ..self
        }
    }

    /// It holds the floating-point unit, and its result comes some cycles after.
    pub(crate) const fn float(self, float_hold: u8, float_delay: u8) -> Self {
        Self {
            float_hold,
            float_delay,
            ..self
        }
    }

    /// Where it is from, and how sure.
    pub(crate) const fn from(self, evidence: Evidence, source: &'static str) -> Self {
        Self {
            evidence,
            source,
            ..self
        }
    }
}

/// What branches cost, and folding.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Branches {
    /// A taken one, besides its own cycles.
    pub taken: Fact,
    /// One that is not taken.
    pub not_taken: Fact,
    /// More when the target comes from memory.
    pub from_load: Fact,
    /// More when the target is a 32-bit instruction that is not word aligned.
    pub split_target: Fact,
    /// Less when folded: a branch or NOP into the instruction before, or an instruction into the
    /// NOP or IT before.
    pub folded: Fact,
    /// Less for an IT that is folded into the instruction before.
    pub folded_it: Fact,
}

/// What divisions cost, besides the cycles of their line, by
/// [`Outcome::quotient_bits`](super::Outcome::quotient_bits).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Division {
    /// More when the quotient is not trivially zero.
    pub start: Fact,
    /// One more for every so many quotient bits.
    pub bits_per_cycle: Fact,
}

/// What the sources leave open, at its worst: cycles more, at most. They count where
/// [`Rules::at_worst`] says so.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Worst {
    /// For a 32-bit instruction that is not word aligned: sources show that some stall, and give no
    /// rule for which.
    pub misaligned: Fact,
    /// For a load right after a store.
    pub load_after_store: Fact,
    /// For a load whose address the load before it made.
    pub dependent_load: Fact,
    /// For a division, beyond the cycles of its line and instead of those by its quotient.
    pub divide: Fact,
}

impl Worst {
    /// Nothing is open.
    pub(crate) const fn nothing(source: &'static str) -> Self {
        let none = Fact::new(0, Evidence::Rule, source);
        Self {
            misaligned: none,
            load_after_store: none,
            dependent_load: none,
            divide: none,
        }
    }
}

/// What exceptions cost, when memory does not wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Exceptions {
    /// From the request to the first instruction of the handler.
    pub entry: Fact,
    /// From the return of one handler to the first instruction of the next, without unstacking
    /// between them.
    pub tail_chain: Fact,
    /// From the return to the first instruction after it.
    pub exit: Fact,
}

/// Where the sources disagree: the side to take.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Rules {
    /// Cycles of a Cortex-M33 instruction with a shifted register that sets the flags. 2: the
    /// datasheet of RP2350. 1: measurements of jnk0le, in which the flags then come one cycle
    /// later. Any other number counts as 2.
    pub shifted_register_flags: u8,
    /// Whether what the sources leave open is counted at its worst: `Line::worst` and
    /// [`Core::worst`]. A bound does, an emulator does not.
    pub at_worst: bool,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            shifted_register_flags: 2,
            at_worst: false,
        }
    }
}

impl Core {
    /// The same core with what the sources leave open at its worst: what a bound counts with.
    pub const fn at_worst(self) -> Self {
        Self {
            rules: Rules {
                at_worst: true,
                ..self.rules
            },
            ..self
        }
    }
}

/// A core: a table, its numbers and the side taken in disputes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Core {
    /// As in `cortex-m33`.
    pub name: &'static str,
    /// Its architecture.
    pub arch: Arch,
    /// The lines; for every instruction of the architecture one fits.
    pub lines: &'static [Line],
    /// Branches.
    pub branches: Branches,
    /// An instruction whose condition fails.
    pub skipped: Fact,
    /// Waiting for a result that is late.
    pub late: Fact,
    /// Divisions.
    pub divide: Division,
    /// Less for what starts under the load before it.
    pub overlap: Fact,
    /// What the sources leave open, between instructions.
    pub worst: Worst,
    /// Less for a load or store whose data is one cycle away: the single-cycle IO port of a
    /// Cortex-M0+.
    pub near: Fact,
    /// Exceptions.
    pub exceptions: Exceptions,
    /// The side taken in disputes.
    pub rules: Rules,
}
