//! Registers: numbers, names, sets.

use core::fmt;

/// Number of the stack pointer.
pub const SP: u8 = 13;
/// Number of the link register.
pub const LR: u8 = 14;
/// Number of the program counter.
pub const PC: u8 = 15;

/// The UAL name of core register `number` (0 to 15).
pub const fn core_name(number: u8) -> &'static str {
    const NAMES: [&str; 16] = [
        "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "sp",
        "lr", "pc",
    ];
    NAMES[(number & 15) as usize]
}

/// A set of core registers R0 to R15 and single-precision registers S0 to S31. A double register is
/// its two halves.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RegSet(u64);

const FIRST_SINGLE: u8 = 16;

impl RegSet {
    /// The empty set.
    pub const EMPTY: Self = Self(0);

    /// Core register `number`, 0 to 15.
    pub const fn core(number: u8) -> Self {
        Self(1 << (number & 15))
    }

    /// The core registers of a list, bit n for Rn.
    pub const fn core_list(list: u16) -> Self {
        Self(list as u64)
    }

    /// `count` single-precision registers from S`first` on; what goes beyond S31 is left out.
    pub const fn singles(first: u8, count: u8) -> Self {
        let all = 0xffff_ffff_u64;
        let run = if count >= 32 { all } else { (1 << count) - 1 };
        Self(((run << (first & 31)) & all) << FIRST_SINGLE)
    }

    /// The single-precision registers of a set, bit n for Sn.
    pub const fn singles_of(bits: u32) -> Self {
        Self((bits as u64) << FIRST_SINGLE)
    }

    /// `count` double-precision registers from D`first` on.
    pub const fn doubles(first: u8, count: u8) -> Self {
        Self::singles((first & 15) * 2, if count > 16 { 32 } else { count * 2 })
    }

    /// The members of both sets.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The members that are not in `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether the sets share a register.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether every register of `other` is in the set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The core registers, bit n for Rn.
    pub const fn core_bits(self) -> u16 {
        self.0 as u16
    }

    /// The single-precision registers, bit n for Sn.
    pub const fn single_bits(self) -> u32 {
        (self.0 >> FIRST_SINGLE) as u32
    }
}

impl fmt::Debug for RegSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut set = f.debug_set();
        for n in 0..16 {
            if self.core_bits() >> n & 1 != 0 {
                set.entry(&format_args!("{}", core_name(n)));
            }
        }
        for n in 0..32 {
            if self.single_bits() >> n & 1 != 0 {
                set.entry(&format_args!("s{n}"));
            }
        }
        set.finish()
    }
}

/// A special register of MRS and MSR: its SYSm number, its name, and the first architecture that
/// has it.
type Special = (u8, &'static str, crate::Arch);

/// The special registers; 0 to 3 are views of the program status register.
const SPECIAL: &[Special] = {
    use crate::Arch::{V6M, V7EM, V8M};
    &[
        (0, "apsr", V6M),
        (1, "iapsr", V6M),
        (2, "eapsr", V6M),
        (3, "xpsr", V6M),
        (5, "ipsr", V6M),
        (6, "epsr", V6M),
        (7, "iepsr", V6M),
        (8, "msp", V6M),
        (9, "psp", V6M),
        (10, "msplim", V8M),
        (11, "psplim", V8M),
        (16, "primask", V6M),
        (17, "basepri", V7EM),
        (18, "basepri_max", V7EM),
        (19, "faultmask", V7EM),
        (20, "control", V6M),
        (0x88, "msp_ns", V8M),
        (0x89, "psp_ns", V8M),
        (0x8a, "msplim_ns", V8M),
        (0x8b, "psplim_ns", V8M),
        (0x90, "primask_ns", V8M),
        (0x91, "basepri_ns", V8M),
        (0x93, "faultmask_ns", V8M),
        (0x94, "control_ns", V8M),
        (0x98, "sp_ns", V8M),
    ]
};

/// The name of special register `sysm`, or nothing when there is none with that number.
pub fn special_name(sysm: u8) -> Option<&'static str> {
    SPECIAL.iter().find(|s| s.0 == sysm).map(|s| s.1)
}

/// Whether `arch` has special register `sysm`.
pub fn has_special(arch: crate::Arch, sysm: u8) -> bool {
    SPECIAL.iter().any(|s| s.0 == sysm && s.2 <= arch)
}

/// Whether special register `sysm` is a stack pointer, and so perhaps the one in use.
pub const fn is_stack_pointer(sysm: u8) -> bool {
    matches!(sysm, 8 | 9 | 0x88 | 0x89 | 0x98)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_double_is_its_two_singles() {
        assert_eq!(RegSet::doubles(3, 2), RegSet::singles(6, 4));
        assert_eq!(RegSet::doubles(0, 16).single_bits(), u32::MAX);
        assert_eq!(RegSet::singles(31, 2).single_bits(), 1 << 31);
        assert!(!RegSet::singles(0, 1).intersects(RegSet::core(0)));
    }

    #[test]
    fn special_registers_belong_to_architectures() {
        use crate::Arch::*;
        assert_eq!(special_name(20), Some("control"));
        assert!(!has_special(V6M, 17) && has_special(V7EM, 17));
        assert!(!has_special(V7EM, 10) && has_special(V8M, 10) && !has_special(V8M, 4));
    }
}
