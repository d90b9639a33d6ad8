//! Runtime routines: what is called. ARMv6-M has no instruction for some operators
//! (`v6m/routines.s`, `v6m/saturate.s`); a string's tick is a routine of its own on every core
//! (`wave`).

use super::minst::Role;

/// The routines that code calls: factors or the like in R0 and R1, the result in R0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Routine {
    /// The top word of a product, rounded half up.
    MulTop,
    /// The top word of a product.
    MulHigh,
    /// The top word of a product without signs.
    UmulHigh,
    /// A quotient without signs; 0 where the divisor is 0.
    Divide,
    /// How many zeros a word begins with; its second operand is not read.
    LeadingZeros,
    /// A sum, or the end of the type nearest to it.
    AddSat,
    /// A difference, or the end of the type nearest to it.
    SubSat,
}

impl Routine {
    /// Its name in its text.
    pub(super) fn name(self) -> &'static str {
        match self {
            Routine::MulTop => "mul_top",
            Routine::MulHigh => "mul_high",
            Routine::UmulHigh => "umul_high",
            Routine::Divide => "divide",
            Routine::LeadingZeros => "leading_zeros",
            Routine::AddSat => "add_sat",
            Routine::SubSat => "sub_sat",
        }
    }
}

/// A tick of one string: `k0` to `k3` in R0 to R3, the points at RECORD.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct StringRoutine {
    /// The cells of the slopes and of the rates.
    pub cells: [u32; 2],
    /// Whether the ends are clamped, not pinned.
    pub clamped: [bool; 2],
}

impl StringRoutine {
    /// That of two cells whose ends are held so.
    pub(super) fn new(cells: [u32; 2], ends: [i64; 2]) -> StringRoutine {
        StringRoutine {
            cells,
            clamped: ends.map(|end| end != 0),
        }
    }
}

/// How something is called: operands are in R0 and up, the result is in R0.
pub(super) struct Convention {
    /// The roles that it reads, in order.
    pub reads: &'static [Role],
    /// The role that it writes.
    pub writes: Option<Role>,
    /// Registers that it does not keep, besides that of its result and those that nobody is given.
    pub lost: &'static [u8],
}

/// That of a [`Routine`].
pub(super) static OF_ROUTINES: Convention = Convention {
    reads: &[Role::N, Role::M],
    writes: Some(Role::D),
    lost: &[1, 2, 3],
};

/// That of a [`StringRoutine`].
pub(super) static OF_STRINGS: Convention = Convention {
    reads: &[Role::N, Role::M, Role::A, Role::T],
    writes: None,
    lost: &[0, 1, 2, 3, 14],
};
