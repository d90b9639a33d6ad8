//! The independent watchdog of an STM32 (RM0090, chapter 21): counts down at 32 kHz divided by 4 to
//! 256, and asks for a reset of the chip. A chip's oscillator is between 17 and 47 kHz; this one is
//! what the manual calls typical.
//!
//! Started it counts from 0xfff; only food loads RLR. What is written to PR and RLR arrives five
//! cycles of its oscillator later, which runs once the watchdog is started; SR tells while it is
//! under way, and food in that time is of the old values.

use crate::bus::{Access, Bus, BusError, Device};

const LSI_HZ: u32 = 32_000;
/// Cycles of the oscillator until a value arrives.
const ARRIVES: u64 = 5;
/// What is written to KR: PR and RLR may be written; the count begins anew; it begins.
const UNLOCK: u32 = 0x5555;
const FEED: u32 = 0xaaaa;
const START: u32 = 0xcccc;

/// A register on the oscillator's side, and what is on its way there.
#[derive(Clone, Copy)]
struct Far {
    value: u32,
    /// The value, and the cycle in which it arrives; none before the oscillator runs.
    coming: Option<(u32, Option<u64>)>,
}

impl Far {
    fn new(value: u32) -> Self {
        let coming = None;
        Self { value, coming }
    }

    fn settle(&mut self, cycle: u64) {
        if let Some((value, Some(arrives))) = self.coming
            && arrives <= cycle
        {
            *self = Self::new(value);
        }
    }

    /// What a program reads: what it wrote.
    fn written(&self) -> u32 {
        self.coming.map_or(self.value, |(value, _)| value)
    }
}

/// See the module.
pub(crate) struct Iwdg {
    clock_hz: u32,
    unlocked: bool,
    running: bool,
    prescaler: Far,
    reload: Far,
    /// The cycle in which it reaches zero.
    expires: u64,
}

impl Iwdg {
    pub(crate) fn new(clock_hz: u32) -> Self {
        Self {
            clock_hz,
            unlocked: false,
            running: false,
            prescaler: Far::new(0),
            reload: Far::new(0xfff),
            expires: u64::MAX,
        }
    }

    /// Cycles of the core.
    fn cycles(&self, of_oscillator: u64) -> u64 {
        of_oscillator * u64::from(self.clock_hz) / u64::from(LSI_HZ)
    }

    /// Counts down from here.
    fn count(&mut self, from: u32, cycle: u64) {
        let divided = 4_u64 << self.prescaler.value.min(6);
        self.expires = cycle + self.cycles(u64::from(from) * divided);
    }

    fn settle(&mut self, cycle: u64) {
        self.prescaler.settle(cycle);
        self.reload.settle(cycle);
    }

    /// A value begins its way, if the oscillator runs.
    fn arrives(&self, cycle: u64) -> Option<u64> {
        self.running.then(|| cycle + self.cycles(ARRIVES))
    }

    fn key(&mut self, key: u32, cycle: u64) {
        self.unlocked = key == UNLOCK;
        match key {
            START if !self.running => {
                self.running = true;
                self.count(0xfff, cycle);
                let arrives = self.arrives(cycle);
                for far in [&mut self.prescaler, &mut self.reload] {
                    far.coming = far.coming.map(|(value, _)| (value, arrives));
                }
            }
            FEED if self.running => self.count(self.reload.value, cycle),
            _ => {}
        }
    }
}

impl Device for Iwdg {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        self.settle(access.cycle);
        let coming = |far: &Far| u32::from(far.coming.is_some());
        match access.offset & !3 {
            0x0 => Ok(0),
            0x4 => Ok(self.prescaler.written()),
            0x8 => Ok(self.reload.written()),
            0xc => Ok(coming(&self.prescaler) | coming(&self.reload) << 1),
            _ => Err(BusError),
        }
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        self.settle(access.cycle);
        let arrives = self.arrives(access.cycle);
        match access.offset & !3 {
            0x0 => self.key(value & 0xffff, access.cycle),
            0x4 if self.unlocked => self.prescaler.coming = Some((value & 7, arrives)),
            0x8 if self.unlocked => self.reload.coming = Some((value & 0xfff, arrives)),
            0x4 | 0x8 | 0xc => {}
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

    const MS: u64 = 168_000;

    /// Writes (offset, cycle, value); when it bites after each.
    fn bites(writes: &[(u32, u64, u32)]) -> Vec<u64> {
        let mut dog = Iwdg::new(168_000_000);
        let mut bus = Bus::new(&Board::generic(CoreKind::CortexM4)).unwrap();
        let write = |(offset, cycle, value): &(u32, u64, u32)| {
            let access = Access {
                offset: *offset,
                size: 4,
                core: 0,
                cycle: *cycle,
            };
            dog.write(access, *value, &mut bus).unwrap();
            dog.due()
        };
        writes.iter().map(write).collect()
    }

    #[test]
    fn it_bites_ten_milliseconds_after_food() {
        let start = [
            (8, 0, 80),
            (0, 0, FEED),
            (0, 0, START),
            (0, 0, UNLOCK),
            (4, 0, 0),
            (8, 0, 80),
        ];
        let late = start.iter().copied().chain([(0, 26_250, FEED)]);
        let early = start.iter().copied().chain([(0, 26_249, FEED)]);
        let never = u64::MAX;
        let first = 4095 * 21_000;
        let late = bites(&late.collect::<Vec<_>>());
        assert_eq!(late[..6], [never, never, first, first, first, first]);
        assert_eq!(late[6], 26_250 + 10 * MS);
        let early = bites(&early.collect::<Vec<_>>());
        assert_eq!(early[6], 26_249 + first, "RLR has not arrived");
    }

    #[test]
    fn values_wait_for_the_oscillator() {
        let writes = [
            (0, 0, UNLOCK),
            (8, 0, 80),
            (0, MS, START),
            (0, MS, FEED),
            (0, 2 * MS, FEED),
        ];
        let never = u64::MAX;
        let first = MS + 4095 * 21_000;
        assert_eq!(bites(&writes), [never, never, first, first, 12 * MS]);
    }
}
