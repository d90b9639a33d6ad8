//! The independent watchdog of an STM32 (RM0090, chapter 21): counts down from RLR at 32 kHz
//! divided by 4 to 256, and asks for a reset of the chip. A chip's oscillator is between 17 and 47
//! kHz; this one is what the manual calls typical.

use crate::bus::{Access, Bus, BusError, Device};

const LSI_HZ: u32 = 32_000;
/// What is written to KR: PR and RLR may be written; the count begins anew; it begins.
const UNLOCK: u32 = 0x5555;
const FEED: u32 = 0xaaaa;
const START: u32 = 0xcccc;

/// See the module.
pub(crate) struct Iwdg {
    clock_hz: u32,
    unlocked: bool,
    running: bool,
    prescaler: u32,
    reload: u32,
    /// The cycle in which it reaches zero.
    expires: u64,
}

impl Iwdg {
    pub(crate) fn new(clock_hz: u32) -> Self {
        Self {
            clock_hz,
            unlocked: false,
            running: false,
            prescaler: 0,
            reload: 0xfff,
            expires: u64::MAX,
        }
    }

    fn feed(&mut self, cycle: u64) {
        let divided = 4_u64 << self.prescaler.min(6);
        let cycles =
            u64::from(self.reload) * divided * u64::from(self.clock_hz) / u64::from(LSI_HZ);
        self.expires = if self.running {
            cycle + cycles
        } else {
            u64::MAX
        };
    }
}

impl Device for Iwdg {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        match access.offset & !3 {
            // SR: every change is made at once.
            0x0 | 0xc => Ok(0),
            0x4 => Ok(self.prescaler),
            0x8 => Ok(self.reload),
            _ => Err(BusError),
        }
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        match (access.offset & !3, value & 0xffff) {
            (0x0, key) => {
                self.unlocked = key == UNLOCK;
                self.running |= key == START;
                if key == FEED || key == START {
                    self.feed(access.cycle);
                }
            }
            (0x4, _) if self.unlocked => self.prescaler = value & 7,
            (0x8, _) if self.unlocked => self.reload = value & 0xfff,
            (0x4 | 0x8 | 0xc, _) => {}
            _ => return Err(BusError),
        }
        Ok(())
    }

    fn due(&self) -> u64 {
        self.expires
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        if self.expires <= cycle {
            self.expires = u64::MAX;
            bus.lines.reset();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, CoreKind};

    #[test]
    fn it_bites_ten_milliseconds_after_the_last_food() {
        let (mut dog, mut bus) = (
            Iwdg::new(168_000_000),
            Bus::new(&Board::generic(CoreKind::CortexM4)).unwrap(),
        );
        let mut write = |offset, cycle, value| {
            dog.write(
                Access {
                    offset,
                    size: 4,
                    core: 0,
                    cycle,
                },
                value,
                &mut bus,
            )
            .unwrap();
            dog.due()
        };
        assert_eq!(write(8, 0, 80), u64::MAX, "locked");
        write(0, 0, UNLOCK);
        write(4, 0, 0);
        write(8, 0, 80);
        assert_eq!(write(0, 1000, FEED), u64::MAX, "it does not run");
        assert_eq!(write(0, 2000, START), 2000 + 1_680_000);
        assert_eq!(write(0, 5000, FEED), 5000 + 1_680_000);
    }
}
