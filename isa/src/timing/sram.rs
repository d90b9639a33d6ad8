//! The SRAM of RP2350: which bank an address is in, and when fetching and data meet there. The
//! other boards' banks ([`Chip`]).
//!
//! ```text
//!   0x20000000  SRAM0 to 3   striped by word: address bits 3:2
//!   0x20040000  SRAM4 to 7   striped by word
//!   0x20080000  SRAM8        4 KiB
//!   0x20081000  SRAM9        4 KiB
//! ```
//!
//! Each bank is a port of the crossbar and serves one access a cycle. The core fetches and accesses
//! data through separate ports of its own, and fetches about two words ahead; data in the bank that
//! is being fetched from "can sometimes" cost a cycle (RP2350 datasheet, 3.7.4.9.12). Sometimes: a
//! program of 16-bit instructions fetches every other cycle, and waiting costs nothing while
//! instructions are at hand. The published loops are exact without it, among them one that reads a
//! literal 8 bytes ahead and one that loads from all four banks of the code's own group. So nobody
//! is charged by default; a bound that must hold charges [`PREFETCH`] for every access that
//! [`may_meet_prefetch`].

use super::facts::{Evidence, Fact};
use crate::arch::Arch;

/// What an access costs more that meets the prefetch.
pub const PREFETCH: Fact = Fact::new(1, Evidence::Rule, "RP2350 datasheet 3.7.4.9.12");

/// How many banks there are, at most.
pub const BANKS: u8 = 10;

/// Whose memory it is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum Chip {
    /// As above.
    #[default]
    Rp2350,
    /// SRAM0 to 3, striped by word from 0x20000000 and one after the other from 0x21000000; SRAM4
    /// and SRAM5 of 4 KiB (RP2040 datasheet 2.6.2).
    Rp2040,
    /// SRAM1 (112 KiB, also at address 0), SRAM2 and the memory beside the core (RM0090, 2.3.1 and
    /// 2.4).
    Stm32f4,
}

impl Chip {
    /// The chip of our boards that has this architecture.
    pub const fn of(arch: Arch) -> Self {
        match arch {
            Arch::V6M => Self::Rp2040,
            Arch::V7EM => Self::Stm32f4,
            Arch::V8M => Self::Rp2350,
        }
    }

    /// The bank of an address, or nothing outside SRAM.
    pub const fn bank(self, address: u32) -> Option<u8> {
        match (self, address) {
            (Self::Rp2350, _) => bank(address),
            (Self::Rp2040, 0x2000_0000..=0x2003_ffff) => Some((address >> 2 & 3) as u8),
            (Self::Rp2040, 0x2100_0000..=0x2103_ffff) => Some((address >> 16 & 3) as u8),
            (Self::Rp2040, 0x2004_0000..=0x2004_0fff) => Some(4),
            (Self::Rp2040, 0x2004_1000..=0x2004_1fff) => Some(5),
            (Self::Stm32f4, 0..=0x0001_bfff | 0x2000_0000..=0x2001_bfff) => Some(0),
            (Self::Stm32f4, 0x2001_c000..=0x2001_ffff) => Some(1),
            (Self::Stm32f4, 0x1000_0000..=0x1000_ffff) => Some(2),
            _ => None,
        }
    }

    /// Whether the core fetches through a port of its own, so that its fetches can be in the way of
    /// its data.
    pub const fn fetches_apart(self) -> bool {
        !matches!(self, Self::Rp2040)
    }
}

/// The bank of an address, 0 to 9, or nothing outside SRAM.
pub const fn bank(address: u32) -> Option<u8> {
    let in_stripe = (address >> 2 & 3) as u8;
    match address {
        0x2000_0000..=0x2003_ffff => Some(in_stripe),
        0x2004_0000..=0x2007_ffff => Some(4 + in_stripe),
        0x2008_0000..=0x2008_0fff => Some(8),
        0x2008_1000..=0x2008_1fff => Some(9),
        _ => None,
    }
}

/// Whether the access to `data` by the instruction at `at` hits the bank two words ahead of it: the
/// datasheet's case, which can cost [`PREFETCH`].
pub const fn meets_prefetch(at: u32, data: u32) -> bool {
    same_bank((at & !3).wrapping_add(8), data)
}

/// Whether that access may hit a bank that is being fetched from, wherever "about two words ahead"
/// is: one to three.
pub const fn may_meet_prefetch(at: u32, data: u32) -> bool {
    let word = at & !3;
    meets_prefetch(at, data)
        || same_bank(word.wrapping_add(4), data)
        || same_bank(word.wrapping_add(12), data)
}

const fn same_bank(a: u32, b: u32) -> bool {
    match (bank(a), bank(b)) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_striped_by_word_and_small_banks_are_not() {
        assert_eq!(
            [0, 4, 8, 12, 16].map(|offset| bank(0x2000_0000 + offset)),
            [0, 1, 2, 3, 0].map(Some)
        );
        assert_eq!(bank(0x2007_fffc), Some(7));
        assert_eq!(
            (bank(0x2008_0ffc), bank(0x2008_1000), bank(0x2008_2000)),
            (Some(8), Some(9), None)
        );
        assert_eq!(bank(0x1000_0000), None);
    }

    #[test]
    fn other_chips_have_their_own_banks() {
        let rp2040 = [
            0x2000_0008,
            0x2102_0008,
            0x2004_0ffc,
            0x2004_1000,
            0x2004_2000,
        ];
        assert_eq!(
            rp2040.map(|at| Chip::Rp2040.bank(at)),
            [Some(2), Some(2), Some(4), Some(5), None]
        );
        let stm32f4 = [0x100, 0x2000_0100, 0x2001_c000, 0x1000_fffc, 0x0800_0000];
        assert_eq!(
            stm32f4.map(|at| Chip::Stm32f4.bank(at)),
            [Some(0), Some(0), Some(1), Some(2), None]
        );
        assert_eq!(Chip::of(Arch::V8M).bank(0x2008_0000), bank(0x2008_0000));
    }

    #[test]
    fn the_datasheets_example_meets_the_prefetch() {
        // LDR R8, [PC, #32], a 32-bit instruction: 40 bytes ahead.
        assert!(meets_prefetch(0x2000_0100, 0x2000_0128));
        assert!(!meets_prefetch(0x2000_0100, 0x2000_0120));
        assert!(
            !may_meet_prefetch(0x2000_0100, 0x2000_0120)
                && may_meet_prefetch(0x2000_0100, 0x2000_0124)
        );
    }

    #[test]
    fn other_groups_and_flash_never_do() {
        assert!(!may_meet_prefetch(0x2000_0100, 0x2004_0108));
        assert!(!may_meet_prefetch(0x1000_0100, 0x2000_0108));
        assert!(may_meet_prefetch(0x2008_0100, 0x2008_0f00));
    }
}
