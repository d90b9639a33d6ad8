//! What only execution knows about an instruction.

/// What happened when an instruction executed, as far as its cycles depend on it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Outcome {
    /// Its condition failed: it did nothing. A branch that was not taken is this, or
    /// [`Outcome::NEXT`]; both cost the same.
    pub skipped: bool,
    /// Where it branched to, if it did.
    pub target: Option<Target>,
    /// Of a division, [`Outcome::quotient_bits`]; else any number.
    pub quotient_bits: i8,
    /// Cycles by which memory delayed it: wait states, and contention for a port or a bank.
    pub waits: u16,
    /// It read or wrote a device that is one cycle away from the core: the single-cycle IO port of
    /// a Cortex-M0+.
    pub near: bool,
    /// It may have accessed another memory than the load before it, under which it then does not
    /// start.
    pub apart: bool,
}

/// Where a branch went.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Target {
    /// The address, bit 0 clear.
    pub address: u32,
    /// Whether the instruction there is 32 bits long.
    pub wide: bool,
}

impl Outcome {
    /// It executed without delay, and the next instruction follows.
    pub const NEXT: Self = Self {
        skipped: false,
        target: None,
        quotient_bits: 0,
        waits: 0,
        near: false,
        apart: false,
    };
    /// Its condition failed.
    pub const SKIPPED: Self = Self {
        skipped: true,
        ..Self::NEXT
    };

    /// It branched to `address`, where there is a 32-bit instruction if `wide`.
    pub const fn taken(address: u32, wide: bool) -> Self {
        Self {
            target: Some(Target { address, wide }),
            ..Self::NEXT
        }
    }

    /// It divided.
    pub const fn divided(dividend: u32, divisor: u32, signed: bool) -> Self {
        Self {
            quotient_bits: Self::quotient_bits(dividend, divisor, signed),
            ..Self::NEXT
        }
    }

    /// Position of the most significant one of the dividend minus that of the divisor, of the
    /// absolute values when `signed`; a zero dividend counts as -1. A division by zero does not
    /// iterate: -1, whatever the dividend.
    pub const fn quotient_bits(dividend: u32, divisor: u32, signed: bool) -> i8 {
        if divisor == 0 {
            return -1;
        }
        top_bit(dividend, signed) - top_bit(divisor, signed)
    }
}

const fn top_bit(value: u32, signed: bool) -> i8 {
    let magnitude = if signed {
        (value as i32).unsigned_abs()
    } else {
        value
    };
    31 - magnitude.leading_zeros() as i8
}

impl Default for Outcome {
    fn default() -> Self {
        Self::NEXT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotient_bits_compares_top_bits() {
        assert_eq!(Outcome::quotient_bits(0x8000_0000, 1, false), 31);
        assert_eq!(Outcome::quotient_bits(0x8000_0000, 1, true), 31);
        assert_eq!(Outcome::quotient_bits((-6_i32) as u32, 3, true), 1);
        assert_eq!(Outcome::quotient_bits((-6_i32) as u32, 3, false), 30);
        assert!(Outcome::quotient_bits(3, 4, false) < 0 && Outcome::quotient_bits(0, 1, false) < 0);
        assert!(Outcome::quotient_bits(u32::MAX, 0, false) < 0);
    }
}
