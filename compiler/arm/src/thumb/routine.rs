//! Runtime routines: what ARMv6-M has no instruction for, and is called (`v6m/routines.s`).

/// The routines that code calls, by their names in `routines.s`: factors or the like in R0 and R1,
/// the result in R0.
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
}

impl Routine {
    pub(super) const ALL: [Routine; 5] = [
        Routine::MulTop,
        Routine::MulHigh,
        Routine::UmulHigh,
        Routine::Divide,
        Routine::LeadingZeros,
    ];

    /// Its name in `routines.s`.
    pub(super) fn name(self) -> &'static str {
        match self {
            Routine::MulTop => "mul_top",
            Routine::MulHigh => "mul_high",
            Routine::UmulHigh => "umul_high",
            Routine::Divide => "divide",
            Routine::LeadingZeros => "leading_zeros",
        }
    }
}

/// Registers that a routine does not keep, besides that of its result and those that nobody is
/// given.
pub(super) const LOST: [u8; 3] = [1, 2, 3];
