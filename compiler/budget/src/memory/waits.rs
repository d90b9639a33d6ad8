//! Cycles of waiting for memory, by what is waited for, and what an instruction accesses.

use std::ops::{Add, AddAssign};

/// Cycles that an instruction waits, at most.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Waits {
    /// For the memory or the device itself, which takes more than a cycle: also alone.
    pub access: u16,
    /// For own fetches in the bank of own data.
    pub fetches: u16,
    /// For other managers of the bus.
    pub others: u16,
    /// For a DMA.
    pub dma: u16,
}

impl Waits {
    /// All of them.
    pub fn cycles(self) -> u16 {
        self.access
            .saturating_add(self.fetches)
            .saturating_add(self.others)
            .saturating_add(self.dma)
    }

    /// The larger of two; of equal ones the first.
    pub fn max(self, other: Self) -> Self {
        if other.cycles() > self.cycles() {
            other
        } else {
            self
        }
    }

    /// So many times.
    pub fn times(self, count: u16) -> Self {
        Self {
            access: self.access.saturating_mul(count),
            fetches: self.fetches.saturating_mul(count),
            others: self.others.saturating_mul(count),
            dma: self.dma.saturating_mul(count),
        }
    }
}

impl Add for Waits {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            access: self.access.saturating_add(other.access),
            fetches: self.fetches.saturating_add(other.fetches),
            others: self.others.saturating_add(other.others),
            dma: self.dma.saturating_add(other.dma),
        }
    }
}

impl AddAssign for Waits {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// What an instruction's data are, as far as is known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Accessed {
    /// It accesses none.
    #[default]
    Nothing,
    /// A constant beside the code.
    Constant,
    /// What is at an address, or near it.
    At(u32),
    /// What a register points into of which that is known.
    By(u8),
    /// Own data at an address that is not known.
    Unknown,
}
