//! Conditions and the IT block.

use core::fmt;

/// A condition code, with the manual's value.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[repr(u8)]
pub enum Cond {
    /// Equal: Z.
    EQ,
    /// Not equal: !Z.
    NE,
    /// Carry set, unsigned higher or same: C.
    CS,
    /// Carry clear, unsigned lower: !C.
    CC,
    /// Minus: N.
    MI,
    /// Plus or zero: !N.
    PL,
    /// Overflow: V.
    VS,
    /// No overflow: !V.
    VC,
    /// Unsigned higher: C and !Z.
    HI,
    /// Unsigned lower or same: !C or Z.
    LS,
    /// Signed greater than or equal: N == V.
    GE,
    /// Signed less than: N != V.
    LT,
    /// Signed greater than: !Z and N == V.
    GT,
    /// Signed less than or equal: Z or N != V.
    LE,
    /// Always.
    AL,
}

impl Cond {
    /// All conditions by value.
    pub const ALL: [Self; 15] = [
        Self::EQ,
        Self::NE,
        Self::CS,
        Self::CC,
        Self::MI,
        Self::PL,
        Self::VS,
        Self::VC,
        Self::HI,
        Self::LS,
        Self::GE,
        Self::LT,
        Self::GT,
        Self::LE,
        Self::AL,
    ];

    /// The condition with this 4-bit value; none has the value 15.
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if (bits as usize) < Self::ALL.len() {
            Some(Self::ALL[bits as usize])
        } else {
            None
        }
    }

    /// The 4-bit value.
    pub const fn bits(self) -> u8 {
        self as u8
    }

    /// The opposite condition; `AL` has none.
    pub const fn invert(self) -> Option<Self> {
        match self {
            Self::AL => None,
            _ => Self::from_bits(self.bits() ^ 1),
        }
    }

    /// `ConditionHolds()` of the manual.
    pub const fn holds(self, n: bool, z: bool, c: bool, v: bool) -> bool {
        match self {
            Self::EQ => z,
            Self::NE => !z,
            Self::CS => c,
            Self::CC => !c,
            Self::MI => n,
            Self::PL => !n,
            Self::VS => v,
            Self::VC => !v,
            Self::HI => c && !z,
            Self::LS => !c || z,
            Self::GE => n == v,
            Self::LT => n != v,
            Self::GT => !z && n == v,
            Self::LE => z || n != v,
            Self::AL => true,
        }
    }

    /// The two letters of UAL, `al` included.
    pub const fn name(self) -> &'static str {
        [
            "eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le",
            "al",
        ][self as usize]
    }
}

/// The suffix of a mnemonic: nothing for `AL`.
impl fmt::Display for Cond {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::AL { "" } else { self.name() })
    }
}

/// The ITSTATE register: outside an IT block, or the condition of the next instruction and what
/// follows.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct ItState(u8);

impl ItState {
    /// Not in an IT block.
    pub const OUTSIDE: Self = Self(0);

    /// The state after `IT` with this first condition and mask (`mask` is 1 to 15, as encoded), or
    /// nothing when the pair is UNPREDICTABLE: condition 15, or `AL` with an else.
    pub const fn after_it(firstcond: u8, mask: u8) -> Option<Self> {
        let always_with_else = firstcond == Cond::AL as u8 && mask.count_ones() != 1;
        if firstcond >= 15 || mask == 0 || mask > 15 || always_with_else {
            return None;
        }
        Some(Self(firstcond << 4 | mask))
    }

    /// The state that the register has with these bits, as [`ItState::bits`] gives them; nothing
    /// where they are UNPREDICTABLE.
    pub const fn from_bits(bits: u8) -> Option<Self> {
        match bits {
            0 => Some(Self::OUTSIDE),
            _ => Self::after_it(bits >> 4, bits & 15),
        }
    }

    /// `InITBlock()`.
    pub const fn inside(self) -> bool {
        self.0 & 15 != 0
    }

    /// `LastInITBlock()`: the next instruction is the block's last.
    pub const fn last(self) -> bool {
        self.0 & 15 == 8
    }

    /// The condition of the next instruction, or nothing outside a block.
    pub const fn cond(self) -> Option<Cond> {
        if self.inside() {
            Cond::from_bits(self.0 >> 4)
        } else {
            None
        }
    }

    /// `ITAdvance()`: the state after one more instruction.
    pub const fn advance(self) -> Self {
        if self.0 & 7 == 0 {
            Self(0)
        } else {
            Self(self.0 & 0xe0 | (self.0 << 1) & 0x1f)
        }
    }

    /// The 8 bits of the register.
    pub const fn bits(self) -> u8 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn itte_walks_through_its_block() {
        // ITTE NE: the mask repeats the lowest bit of NE for "then", inverts it for "else", and
        // ends with a 1.
        let mut it = ItState::after_it(Cond::NE.bits(), 0b1010).unwrap();
        let mut seen = [None; 4];
        for slot in &mut seen {
            *slot = it.cond();
            it = it.advance();
        }
        assert_eq!(seen, [Some(Cond::NE), Some(Cond::NE), Some(Cond::EQ), None]);
        assert_eq!(it, ItState::OUTSIDE);
    }

    #[test]
    fn unpredictable_blocks_have_no_state() {
        assert_eq!(ItState::after_it(15, 8), None);
        assert_eq!(ItState::after_it(14, 0b1100), None);
        assert_eq!(ItState::after_it(0, 0), None);
        assert!(ItState::after_it(14, 4).is_some());
    }

    #[test]
    fn a_condition_and_its_inverse_never_both_hold() {
        for flags in 0..16 {
            let at = |c: Cond| {
                c.holds(
                    flags & 8 != 0,
                    flags & 4 != 0,
                    flags & 2 != 0,
                    flags & 1 != 0,
                )
            };
            for cond in Cond::ALL {
                if let Some(inverse) = cond.invert() {
                    assert_ne!(at(cond), at(inverse));
                }
            }
        }
    }
}
