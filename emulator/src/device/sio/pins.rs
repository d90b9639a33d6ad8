//! Pins: outputs and enables that SIO drives, and inputs, two cycles behind the pins. Those of the
//! flash (and of USB), which have no other side here, read as what is driven.

use super::Chip;
use crate::pins::{Pins, Source};

/// Cycles that the flip-flops before an input hold a level back.
const SYNCHRONIZED: u64 = 2;

/// Two banks of outputs and enables.
pub(super) struct SioPins {
    chip: Chip,
    /// Outputs and enables of bank 0, then of the second one.
    out: [u32; 2],
    enable: [u32; 2],
}

/// Which register, and what a write does to it.
struct Place {
    enable: bool,
    bank: usize,
    /// 0 writes, 1 sets, 2 clears, 3 exclusive-ors.
    action: u32,
}

impl SioPins {
    pub(super) fn new(chip: Chip) -> Self {
        Self {
            chip,
            out: [0; 2],
            enable: [0; 2],
        }
    }

    /// From 0x10 on: on RP2350 the two banks alternate, on RP2040 they follow each other.
    fn place(&self, at: u32) -> Option<Place> {
        let word = at.checked_sub(0x10).filter(|from| *from < 0x40)? / 4;
        Some(match self.chip {
            Chip::Rp2350 => Place {
                enable: word >= 8,
                bank: (word % 2) as usize,
                action: word / 2 % 4,
            },
            Chip::Rp2040 => Place {
                enable: word / 4 % 2 == 1,
                bank: (word / 8) as usize,
                action: word % 4,
            },
        })
    }

    /// The pins that are no GPIO, in the second bank: a mask.
    fn own(&self) -> u32 {
        match self.chip {
            Chip::Rp2350 => 0xffff_0000,
            Chip::Rp2040 => u32::MAX,
        }
    }

    /// Both banks as the pins are numbered.
    fn both(&self, banks: [u32; 2]) -> u64 {
        u64::from(banks[1] & !self.own()) << 32 | u64::from(banks[0])
    }

    pub(super) fn read(&self, at: u32, pins: &Pins, cycle: u64) -> Option<u32> {
        let inputs = || pins.inputs(cycle.saturating_sub(SYNCHRONIZED));
        match at {
            0x04 => return Some(inputs() as u32),
            0x08 => {
                let own = self.out[1] & self.enable[1] & self.own();
                return Some((inputs() >> 32) as u32 | own);
            }
            _ => {}
        }
        let place = self.place(at)?;
        Some(if place.enable {
            self.enable[place.bank]
        } else {
            self.out[place.bank]
        })
    }

    pub(super) fn write(&mut self, at: u32, value: u32, pins: &mut Pins, cycle: u64) -> Option<()> {
        let place = self.place(at)?;
        let register = if place.enable {
            &mut self.enable[place.bank]
        } else {
            &mut self.out[place.bank]
        };
        *register = match place.action {
            0 => value,
            1 => *register | value,
            2 => *register & !value,
            _ => *register ^ value,
        };
        let (levels, enable) = (self.both(self.out), self.both(self.enable));
        pins.set(Source::Sio, levels, enable, cycle + 1);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_chips_have_their_own_order() {
        // (chip, GPIO_OUT_SET, GPIO_OE_SET, GPIO_OUT_XOR, the second bank's OUT)
        let orders = [
            (Chip::Rp2350, 0x18, 0x38, 0x28, 0x14),
            (Chip::Rp2040, 0x14, 0x24, 0x1c, 0x30),
        ];
        for (chip, set, enable, flip, second) in orders {
            let (mut sio, mut pins) = (SioPins::new(chip), Pins::none());
            let mut write = |sio: &mut SioPins, at, value| sio.write(at, value, &mut pins, 0);
            write(&mut sio, set, 0b110).unwrap();
            write(&mut sio, enable, 0b011).unwrap();
            write(&mut sio, second, 5).unwrap();
            write(&mut sio, flip, 0b010).unwrap();
            assert_eq!(write(&mut sio, 0x50, 0), None);
            let read = |at| sio.read(at, &pins, 10);
            assert_eq!(
                (read(0x10), read(second), read(0x0c)),
                (Some(0b100), Some(5), None)
            );
        }
    }
}
