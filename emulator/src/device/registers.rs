//! Blocks of registers that hold what is written, as tables, with the status bits that start-up
//! code waits for.
//!
//! What they control (oscillators, PLLs, pins) has no effect: an oscillator is stable as soon as it
//! is enabled. So those polls of a real start-up end at their first look; `clocks` has what takes
//! time.

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

/// What a read gives.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reads {
    /// What is held.
    Held,
    /// What is held, with bits set while `mask` of the register at `of` is `value`.
    When {
        of: u32,
        mask: u32,
        value: u32,
        bits: u32,
    },
    /// These bits of the register at `of`, inverted.
    Not { of: u32, mask: u32 },
    /// What is held, with these bits of the register at `of` moved up to where they are
    /// acknowledged.
    Follow { of: u32, mask: u32, up: u32 },
}

/// A run of equal registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// The offset of the first.
    pub at: u32,
    /// How many.
    pub count: u32,
    /// Bytes from one to the next.
    pub stride: u32,
    /// What they hold after reset.
    pub reset: u32,
    /// The bits that can be written.
    pub writable: u32,
    /// What a read gives; offsets in it are for the first of the run and move along.
    pub reads: Reads,
}

/// One register that holds what is written.
pub(crate) const fn held(at: u32, reset: u32, writable: u32) -> Row {
    Row {
        at,
        count: 1,
        stride: 0,
        reset,
        writable,
        reads: Reads::Held,
    }
}

/// One register that is only read.
pub(crate) const fn status(at: u32, reads: Reads) -> Row {
    Row {
        reads,
        ..held(at, 0, 0)
    }
}

/// The same register `count` times, `stride` bytes apart.
pub(crate) const fn times(count: u32, stride: u32, row: Row) -> Row {
    Row {
        count,
        stride,
        ..row
    }
}

/// Words that hold what is written, whatever it is.
pub(crate) const fn words(at: u32, count: u32) -> Row {
    times(count, 4, held(at, 0, u32::MAX))
}

/// A block of such registers.
pub(crate) struct Registers {
    rows: &'static [Row],
    held: Vec<u32>,
}

impl Registers {
    pub(crate) fn new(rows: &'static [Row]) -> Self {
        let held = rows
            .iter()
            .flat_map(|row| (0..row.count).map(|_| row.reset))
            .collect();
        Self { rows, held }
    }

    /// The row, the place in `held` and how far the register is from the first of its row.
    fn find(&self, offset: u32) -> Option<(&'static Row, usize, u32)> {
        let mut first = 0;
        for row in self.rows {
            let from = offset.wrapping_sub(row.at);
            let index = from.checked_div(row.stride).unwrap_or(0);
            if index < row.count && from == index * row.stride {
                return Some((row, first + index as usize, from));
            }
            first += row.count as usize;
        }
        None
    }

    /// What a register holds; 0 where there is none.
    pub(crate) fn holds(&self, offset: u32) -> u32 {
        self.find(offset)
            .map_or(0, |(_, place, _)| self.held[place])
    }

    fn word(&self, offset: u32) -> Option<u32> {
        let (row, place, from) = self.find(offset)?;
        let held = self.held[place];
        Some(match row.reads {
            Reads::Held => held,
            Reads::When {
                of,
                mask,
                value,
                bits,
            } => {
                held | if self.holds(of + from) & mask == value {
                    bits
                } else {
                    0
                }
            }
            Reads::Not { of, mask } => !self.holds(of + from) & mask,
            Reads::Follow { of, mask, up } => held | (self.holds(of + from) & mask) << up,
        })
    }
}

impl Device for Registers {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let word = self
            .word(alias::plain(access.offset) & !3)
            .ok_or(BusError)?;
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        let (row, place, _) = self
            .find(alias::plain(access.offset) & !3)
            .ok_or(BusError)?;
        let old = self.held[place];
        self.held[place] = old & !row.writable | alias::written(access, value, old) & row.writable;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: &[Row] = &[
        held(0, 0x1f, 0x1f),
        status(8, Reads::Not { of: 0, mask: 0x1f }),
        times(2, 0x10, held(0x20, 0, 3)),
        times(2, 0x10, status(0x24, Reads::Not { of: 0x20, mask: 3 })),
        Row {
            reads: Reads::Follow {
                of: 0x60,
                mask: 3,
                up: 2,
            },
            ..held(0x60, 0, 0xf3)
        },
        Row {
            reads: Reads::When {
                of: 0x50,
                mask: 1,
                value: 1,
                bits: 2,
            },
            ..held(0x50, 0, 1)
        },
    ];

    #[test]
    fn status_follows_control() {
        let mut block = Registers::new(ROWS);
        assert_eq!(block.word(8), Some(0));
        block.held[0] = 0x1e;
        assert_eq!(block.word(8), Some(1));
        assert_eq!((block.word(0x24), block.word(0x34)), (Some(3), Some(3)));
        let (_, place, from) = block.find(0x30).unwrap();
        assert_eq!((place, from), (3, 0x10));
        block.held[place] = 2;
        assert_eq!((block.word(0x24), block.word(0x34)), (Some(3), Some(1)));
        assert_eq!(block.word(0x50), Some(0));
        *block.held.last_mut().unwrap() = 1;
        assert_eq!(block.word(0x50), Some(3));
        assert_eq!(block.word(0x44), None);
        assert_eq!(block.word(0x28), None);
    }
}
