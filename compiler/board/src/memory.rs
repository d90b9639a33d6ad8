//! Memories and peripheral buses: where they lie, how long an access takes, which banks serve it.
//!
//! A bank is a port of the bus fabric that serves one access at a time, so managers that use one
//! bank may wait for each other. Memories may have banks in common: two halves of one striped
//! group, for example.

/// What kind of memory it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MemoryKind {
    /// Keeps its contents; the image is stored there.
    Flash,
    /// Holds nothing at the start: what must be there is copied from flash first, unless there is
    /// none.
    Ram,
}

/// How long an access takes when nobody else is at the bank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AccessTime {
    /// So many cycles, at least 1.
    Cycles(u16),
    /// Nobody can say: there is a cache, or wait states that depend on what came before.
    NotBounded,
    /// No such access can be made: this is not connected.
    Impossible,
}

impl AccessTime {
    /// Cycles beyond the first, where the time is known.
    pub fn extra_cycles(self) -> Option<u16> {
        match self {
            AccessTime::Cycles(cycles) => Some(cycles.saturating_sub(1)),
            AccessTime::NotBounded | AccessTime::Impossible => None,
        }
    }
}

/// A set of banks: bit n for bank n of [`Board::banks`](crate::Board::banks).
pub type BankSet = u32;

/// How many banks a board may have.
pub const BANKS_MAX: usize = 32;

/// A run of memory.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Memory {
    /// Its name in the board's file.
    pub name: String,
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// What kind.
    pub kind: MemoryKind,
    /// How long a load or store takes.
    pub access: AccessTime,
    /// How long fetching a word of instructions takes.
    pub fetch: AccessTime,
    /// The banks that serve it, by their numbers; none where its time is not bounded.
    pub banks: Vec<u8>,
    /// Whether neighbouring words are in neighbouring banks; else each bank is one run of
    /// addresses.
    pub striped: bool,
}

impl Memory {
    /// Whether an address lies inside.
    pub fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.size
    }

    /// The bank of an address that lies inside.
    pub fn bank(&self, address: u32) -> Option<u8> {
        let count = u32::try_from(self.banks.len()).ok().filter(|n| *n > 0)?;
        let offset = address.checked_sub(self.base)?;
        let index = if self.striped {
            offset / 4 % count
        } else {
            offset / (self.size / count).max(1)
        };
        self.banks.get(index as usize).copied()
    }

    /// All of its banks.
    pub fn bank_set(&self) -> BankSet {
        self.banks.iter().fold(0, |set, bank| set | 1 << bank)
    }

    /// The banks of a range of its addresses.
    pub fn banks_between(&self, from: u32, bytes: u32) -> BankSet {
        let end = from.saturating_add(bytes.max(1));
        if self.striped && bytes >= 4 * self.banks.len() as u32 {
            return self.bank_set();
        }
        let run = if self.striped {
            4
        } else {
            (self.size / (self.banks.len() as u32).max(1)).max(4)
        };
        let inner = (from & !3..end).step_by(run as usize);
        inner
            .chain([end - 1])
            .filter_map(|at| self.bank(at))
            .fold(0, |set, bank| set | 1 << bank)
    }

    /// Whether code in it and data in it can be bounded.
    pub fn is_bounded(&self) -> bool {
        self.access.extra_cycles().is_some() && self.fetch.extra_cycles().is_some()
    }
}

/// A range of addresses behind which devices are.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Bus {
    /// Its name in the board's file.
    pub name: String,
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Cycles of a read, at most.
    pub read_cycles: u16,
    /// Cycles of a write, at most.
    pub write_cycles: u16,
}

impl Bus {
    /// Whether an address lies inside.
    pub fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(banks: Vec<u8>, striped: bool) -> Memory {
        Memory {
            name: "own".into(),
            base: 0x2000_0000,
            size: 0x1000,
            kind: MemoryKind::Ram,
            access: AccessTime::Cycles(1),
            fetch: AccessTime::Cycles(1),
            banks,
            striped,
        }
    }

    #[test]
    fn striped_banks_change_with_every_word() {
        let striped = memory(vec![4, 5, 6, 7], true);
        let banks = [0, 3, 4, 8, 12, 16].map(|offset| striped.bank(0x2000_0000 + offset));
        assert_eq!(banks, [4, 4, 5, 6, 7, 4].map(Some));
        assert_eq!(striped.banks_between(0x2000_0004, 8), 0b0110_0000);
        assert_eq!(striped.banks_between(0x2000_0004, 100), 0b1111_0000);
        assert_eq!(striped.banks_between(0x2000_000f, 2), 0b1001_0000);
    }

    #[test]
    fn other_banks_are_one_behind_the_other() {
        let two = memory(vec![0, 1], false);
        let banks = [0, 0x7ff, 0x800, 0xfff].map(|offset| two.bank(0x2000_0000 + offset));
        assert_eq!(banks, [0, 0, 1, 1].map(Some));
        assert_eq!(two.banks_between(0x2000_07fc, 8), 0b11);
        assert_eq!(two.banks_between(0x2000_0000, 0x1000), 0b11);
        assert_eq!(two.banks_between(0x2000_0800, 4), 0b10);
    }
}
