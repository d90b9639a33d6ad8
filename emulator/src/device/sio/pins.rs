//! Pins: outputs, enables, and inputs that read as what is driven.

use super::Chip;

/// Two banks of outputs and enables.
pub(super) struct Pins {
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

impl Pins {
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

    pub(super) fn read(&self, at: u32) -> Option<u32> {
        if let 0x04 | 0x08 = at {
            let bank = (at as usize - 4) / 4;
            return Some(self.out[bank] & self.enable[bank]);
        }
        let place = self.place(at)?;
        Some(if place.enable {
            self.enable[place.bank]
        } else {
            self.out[place.bank]
        })
    }

    pub(super) fn write(&mut self, at: u32, value: u32) -> Option<()> {
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
            let mut pins = Pins::new(chip);
            pins.write(set, 0b110).unwrap();
            pins.write(enable, 0b011).unwrap();
            pins.write(second, 5).unwrap();
            assert_eq!(
                (pins.read(0x10), pins.read(0x04), pins.read(second)),
                (Some(0b110), Some(0b010), Some(5))
            );
            pins.write(flip, 0b010).unwrap();
            assert_eq!(pins.read(0x04), Some(0));
            assert_eq!((pins.read(0x0c), pins.write(0x50, 0)), (None, None));
        }
    }
}
