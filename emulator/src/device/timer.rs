//! The timer: 64 bits of microseconds and four alarms (RP2350 datasheet 12.8, RP2040 datasheet
//! 4.6). It counts microseconds from the start, as if its tick generator had been set up as
//! start-up code does, or, where RP2350's SOURCE says so, cycles.

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

const ALARMS: usize = 4;

/// See the module.
pub(crate) struct Timer {
    clock_hz: u64,
    /// The interrupt of the first alarm; the others follow.
    interrupt: usize,
    /// Where INTR lies: RP2350 has two registers more before it.
    intr: u32,
    /// What is added to the count since the start.
    offset: u64,
    /// What the count was when it was paused.
    paused: Option<u64>,
    counts_cycles: bool,
    locked: bool,
    latched_high: u32,
    written_low: u32,
    debug_pause: u32,
    alarms: [u32; ALARMS],
    /// When each armed alarm goes off, in counts.
    armed: [Option<u64>; ALARMS],
    raised: u32,
    enabled: u32,
    forced: u32,
}

impl Timer {
    /// With INTR at `intr` and alarms from interrupt number `interrupt`.
    pub(crate) fn new(clock_hz: u32, interrupt: usize, intr: u32) -> Self {
        Self {
            clock_hz: u64::from(clock_hz.max(1)),
            interrupt,
            intr,
            offset: 0,
            paused: None,
            counts_cycles: false,
            locked: false,
            latched_high: 0,
            written_low: 0,
            debug_pause: 7,
            alarms: [0; ALARMS],
            armed: [None; ALARMS],
            raised: 0,
            enabled: 0,
            forced: 0,
        }
    }

    fn counts_per_second(&self) -> u64 {
        if self.counts_cycles {
            self.clock_hz
        } else {
            1_000_000
        }
    }

    /// The count in a cycle.
    fn count(&self, cycle: u64) -> u64 {
        let since =
            u128::from(cycle) * u128::from(self.counts_per_second()) / u128::from(self.clock_hz);
        self.paused
            .unwrap_or((since as u64).wrapping_add(self.offset))
    }

    /// The first cycle in which the count is reached.
    fn cycle_of(&self, count: u64) -> u64 {
        let since = u128::from(count.wrapping_sub(self.offset)) * u128::from(self.clock_hz);
        u64::try_from(since.div_ceil(u128::from(self.counts_per_second()))).unwrap_or(u64::MAX)
    }

    fn set_count(&mut self, cycle: u64, count: u64) {
        let paused = self.paused.take().is_some();
        self.offset = self
            .offset
            .wrapping_add(count.wrapping_sub(self.count(cycle)));
        self.paused = paused.then_some(count);
    }

    fn pause(&mut self, cycle: u64, pause: bool) {
        let count = self.count(cycle);
        self.paused = Some(count);
        if !pause {
            self.set_count(cycle, count);
            self.paused = None;
        }
    }

    /// An alarm goes off when the low word of the count is next equal to it.
    fn arm(&mut self, alarm: usize, value: u32, cycle: u64) {
        let count = self.count(cycle);
        self.alarms[alarm] = value;
        self.armed[alarm] = Some(count.wrapping_add(u64::from(value.wrapping_sub(count as u32))));
    }

    fn armed_bits(&self) -> u32 {
        (0..ALARMS)
            .map(|i| u32::from(self.armed[i].is_some()) << i)
            .sum()
    }

    fn interrupts(&self, bus: &mut Bus) {
        let active = self.raised & self.enabled | self.forced;
        (0..ALARMS).for_each(|i| bus.lines.set_all(self.interrupt + i, active >> i & 1 != 0));
    }

    fn word(&mut self, at: u32, cycle: u64) -> Option<u32> {
        let count = self.count(cycle);
        Some(match at {
            0x00 | 0x04 => 0,
            0x08 => self.latched_high,
            0x0c => {
                self.latched_high = (count >> 32) as u32;
                count as u32
            }
            0x10..0x20 => self.alarms[(at as usize - 0x10) / 4],
            0x20 => self.armed_bits(),
            0x24 => (count >> 32) as u32,
            0x28 => count as u32,
            0x2c => self.debug_pause,
            0x30 => u32::from(self.paused.is_some()),
            _ if at == self.intr => self.raised,
            _ if at == self.intr + 4 => self.enabled,
            _ if at == self.intr + 8 => self.forced,
            _ if at == self.intr + 12 => self.raised & self.enabled | self.forced,
            0x34 => u32::from(self.locked),
            0x38 => u32::from(self.counts_cycles),
            _ => return None,
        })
    }

    fn set_word(&mut self, at: u32, value: u32, cycle: u64) -> Option<()> {
        match at {
            0x00 => self.set_count(cycle, u64::from(value) << 32 | u64::from(self.written_low)),
            0x04 => self.written_low = value,
            0x10..0x20 => self.arm((at as usize - 0x10) / 4, value, cycle),
            0x20 => (0..ALARMS)
                .filter(|i| value >> i & 1 != 0)
                .for_each(|i| self.armed[i] = None),
            0x2c => self.debug_pause = value & 6,
            0x30 => self.pause(cycle, value & 1 != 0),
            _ if at == self.intr => self.raised &= !value,
            _ if at == self.intr + 4 => self.enabled = value & 0xf,
            _ if at == self.intr + 8 => self.forced = value & 0xf,
            0x34 => self.locked |= value & 1 != 0,
            0x38 => {
                let count = self.count(cycle);
                self.counts_cycles = value & 1 != 0;
                self.set_count(cycle, count);
            }
            _ => return None,
        }
        Some(())
    }

    /// What a write to one of the copies is about to change; registers whose write is an action
    /// count as zero.
    fn held(&self, at: u32) -> u32 {
        match at {
            0x2c => self.debug_pause,
            0x30 => u32::from(self.paused.is_some()),
            _ if at == self.intr + 4 => self.enabled,
            _ if at == self.intr + 8 => self.forced,
            _ => 0,
        }
    }
}

impl Device for Timer {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let word = self
            .word(alias::plain(access.offset) & !3, access.cycle)
            .ok_or(BusError)?;
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        let at = alias::plain(access.offset) & !3;
        if !(self.locked && at < 0x10) {
            self.set_word(
                at,
                alias::written(access, value, self.held(at)),
                access.cycle,
            )
            .ok_or(BusError)?;
        }
        self.interrupts(bus);
        Ok(())
    }

    fn keeps_to_itself(&self, offset: u32, write: bool) -> bool {
        matches!((alias::plain(offset) & !3, write), (0x24 | 0x28, false))
    }

    fn due(&self) -> u64 {
        let next = self
            .armed
            .iter()
            .flatten()
            .map(|count| self.cycle_of(*count))
            .min();
        next.filter(|_| self.paused.is_none()).unwrap_or(u64::MAX)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        let count = self.count(cycle);
        for i in 0..ALARMS {
            if self.armed[i].take_if(|when| *when <= count).is_some() {
                self.raised |= 1 << i;
            }
        }
        self.interrupts(bus);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, CoreKind};

    fn write(timer: &mut Timer, bus: &mut Bus, offset: u32, cycle: u64, value: u32) {
        timer
            .write(
                Access {
                    offset,
                    size: 4,
                    core: 0,
                    cycle,
                },
                value,
                bus,
            )
            .unwrap();
    }

    #[test]
    fn alarm_goes_off_in_the_first_cycle_of_its_microsecond() {
        let mut bus = Bus::new(&Board::generic(CoreKind::CortexM33)).unwrap();
        let mut timer = Timer::new(150_000_000, 0, 0x3c);
        write(&mut timer, &mut bus, 0x40, 0, 0b10);
        write(&mut timer, &mut bus, 0x14, 299, 3);
        assert_eq!(timer.word(0x28, 299), Some(1));
        assert_eq!(timer.due(), 450);
        timer.attend(449, &mut bus);
        assert!(!bus.lines.level(0, 1));
        timer.attend(450, &mut bus);
        assert!(bus.lines.level(0, 1) && timer.due() == u64::MAX);
        write(&mut timer, &mut bus, 0x3c, 500, 0b10);
        assert!(!bus.lines.level(0, 1));
    }

    #[test]
    fn count_can_be_set_paused_and_fed_by_cycles() {
        let mut bus = Bus::new(&Board::generic(CoreKind::CortexM33)).unwrap();
        let mut timer = Timer::new(150_000_000, 0, 0x3c);
        write(&mut timer, &mut bus, 0x04, 0, 0xffff_fffe);
        write(&mut timer, &mut bus, 0x00, 0, 1);
        assert_eq!(
            (timer.word(0x0c, 300), timer.word(0x08, 900)),
            (Some(0), Some(2)),
            "TIMELR latches TIMEHR"
        );
        write(&mut timer, &mut bus, 0x30, 300, 1);
        assert_eq!(timer.word(0x28, 90_000), Some(0));
        write(&mut timer, &mut bus, 0x3030, 90_000, 1);
        assert_eq!(timer.word(0x28, 90_150), Some(1));
        write(&mut timer, &mut bus, 0x38, 90_150, 1);
        assert_eq!(timer.word(0x28, 90_157), Some(8));
    }
}
