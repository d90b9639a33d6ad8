//! Boot RAM of RP2350: one KiB that the boot ROM and programs share, two write-once words and eight
//! locks (RP2350 datasheet 4.3, 5.4.4).

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

const WORDS: usize = 256;
const WRITE_ONCE: u32 = 0x800;
const LOCK_STATUS: u32 = 0x808;
const LOCKS: u32 = 0x80c;

/// See the module.
pub(crate) struct BootRam {
    words: [u32; WORDS],
    once: [u32; 2],
    /// One bit per lock, set while it is free.
    free: u32,
}

impl BootRam {
    pub(crate) fn new() -> Self {
        Self {
            words: [0; WORDS],
            once: [0; 2],
            free: 0xff,
        }
    }

    /// Takes the lock: its bit when it was free, else 0.
    fn claim(&mut self, lock: u32) -> u32 {
        let bit = self.free & 1 << lock;
        self.free &= !bit;
        bit
    }
}

impl Device for BootRam {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let at = alias::plain(access.offset) & !3;
        let word = match at {
            0..0x400 => self.words[at as usize / 4],
            WRITE_ONCE..LOCK_STATUS => self.once[(at - WRITE_ONCE) as usize / 4],
            LOCK_STATUS => self.free,
            LOCKS..0x82c => self.claim((at - LOCKS) / 4),
            _ => return Err(BusError),
        };
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        let at = alias::plain(access.offset) & !3;
        match at {
            0..0x400 => {
                let word = &mut self.words[at as usize / 4];
                *word = alias::written(access, value, *word);
            }
            WRITE_ONCE..LOCK_STATUS => {
                self.once[(at - WRITE_ONCE) as usize / 4] |= alias::lanes(access.size, value)
            }
            LOCK_STATUS => self.free = alias::written(access, value, self.free) & 0xff,
            LOCKS..0x82c => self.free |= 1 << ((at - LOCKS) / 4),
            _ => return Err(BusError),
        }
        Ok(())
    }
}
