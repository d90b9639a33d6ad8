//! Atomic register access: every peripheral block appears four times, and a write to the second,
//! third or fourth copy exclusive-ors, sets or clears bits (RP2350 datasheet 2.1.3, RP2040
//! datasheet 2.1.2).

use crate::bus::Access;

/// Bytes from one copy of a block to the next.
pub(crate) const COPY: u32 = 0x1000;
/// A block with its copies.
pub(crate) const BLOCK: u32 = 4 * COPY;

/// The offset inside the block.
pub(crate) fn plain(offset: u32) -> u32 {
    offset % COPY
}

/// What a write means for a register that holds `old`. A byte or halfword is written to all lanes
/// of the word, as the bridge to these peripherals does.
pub(crate) fn written(access: Access, value: u32, old: u32) -> u32 {
    let value = lanes(access.size, value);
    match access.offset / COPY {
        0 => value,
        1 => old ^ value,
        2 => old | value,
        _ => old & !value,
    }
}

/// A value as the bus carries it: repeated until it fills the word.
pub(crate) fn lanes(size: u32, value: u32) -> u32 {
    match size {
        1 => (value & 0xff) * 0x0101_0101,
        2 => (value & 0xffff) * 0x0001_0001,
        _ => value,
    }
}

/// The part of a register that a narrow read sees.
pub(crate) fn part(offset: u32, word: u32) -> u32 {
    word >> (8 * (offset % 4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_of_a_block_change_bits() {
        let write = |offset, size, value| {
            written(
                Access {
                    offset,
                    size,
                    core: 0,
                    cycle: 0,
                },
                value,
                0b1100,
            )
        };
        assert_eq!(
            [0x8, 0x1008, 0x2008, 0x3008].map(|at| write(at, 4, 0b1010)),
            [0b1010, 0b0110, 0b1110, 0b0100]
        );
        assert_eq!(write(8, 1, 0x1ab), 0xabab_abab);
        assert_eq!(write(8, 2, 0x1_abcd), 0xabcd_abcd);
        assert_eq!(part(6, 0x1122_3344), 0x1122);
    }
}
