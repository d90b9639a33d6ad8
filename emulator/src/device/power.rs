//! Switching core 1 off and on (PSM), and the watchdog (RP2350 datasheet 7.3, 12.9; RP2040
//! datasheet 2.13, 4.7).

use crate::bus::{Access, Bus, BusError, Device, DeviceId};
use crate::device::alias;
use crate::device::sio::Sio;
use crate::lines::Start;

/// The power-on state machine: of it, the processors. A core that is forced off halts; let go, it
/// starts in the boot ROM.
pub(crate) struct Power {
    /// The bit of core 1 in each register.
    core1: u32,
    /// All bits.
    mask: u32,
    sio: DeviceId,
    wakes: Start,
    force_on: u32,
    force_off: u32,
    watchdog: u32,
}

impl Power {
    pub(crate) fn new(core1: u32, mask: u32, sio: DeviceId, wakes: Start) -> Self {
        Self {
            core1,
            mask,
            sio,
            wakes,
            force_on: 0,
            force_off: 0,
            watchdog: 0,
        }
    }

    fn switch(&mut self, off: u32, bus: &mut Bus) {
        let changed = (self.force_off ^ off) & self.core1 != 0;
        self.force_off = off;
        if !changed {
            return;
        }
        if off & self.core1 != 0 {
            bus.lines.halt(1);
        } else {
            if let Some(sio) = bus.device_mut::<Sio>(self.sio) {
                sio.reset_core(1);
            }
            bus.lines.start(1, self.wakes);
        }
    }
}

impl Device for Power {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        Ok(match alias::plain(access.offset) & !3 {
            0x0 => self.force_on,
            0x4 => self.force_off,
            0x8 => self.watchdog,
            0xc => !self.force_off & self.mask,
            _ => return Err(BusError),
        })
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        match alias::plain(access.offset) & !3 {
            0x0 => self.force_on = alias::written(access, value, self.force_on) & self.mask,
            0x4 => self.switch(
                alias::written(access, value, self.force_off) & self.mask,
                bus,
            ),
            0x8 => self.watchdog = alias::written(access, value, self.watchdog) & self.mask,
            0xc => {}
            _ => return Err(BusError),
        }
        Ok(())
    }
}

const ENABLE: u32 = 1 << 30;
const TRIGGER: u32 = 1 << 31;

/// The watchdog: counts down in microseconds (half of them on RP2040, by its erratum E1) and asks
/// for a reset of the chip.
pub(crate) struct Watchdog {
    cycles_per_count: u64,
    control: u32,
    /// The cycle in which it reaches zero.
    expires: u64,
    left: u32,
    scratch: [u32; 8],
    tick: u32,
}

impl Watchdog {
    /// With this many counts a microsecond.
    pub(crate) fn new(clock_hz: u32, counts_per_us: u32) -> Self {
        let cycles_per_count = u64::from(clock_hz / 1_000_000 / counts_per_us).max(1);
        Self {
            cycles_per_count,
            control: 0x0700_0000,
            expires: u64::MAX,
            left: 0,
            scratch: [0; 8],
            tick: 0x200,
        }
    }

    fn load(&mut self, count: u32, cycle: u64) {
        self.left = count & 0xff_ffff;
        let expires = cycle + u64::from(self.left) * self.cycles_per_count;
        self.expires = if self.control & ENABLE != 0 {
            expires
        } else {
            u64::MAX
        };
    }

    fn counts_left(&self, cycle: u64) -> u32 {
        let running = self.expires.saturating_sub(cycle) / self.cycles_per_count;
        if self.control & ENABLE != 0 {
            running as u32
        } else {
            self.left
        }
    }
}

impl Device for Watchdog {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let at = alias::plain(access.offset) & !3;
        let word = match at {
            0x00 => self.control | self.counts_left(access.cycle) & 0xff_ffff,
            // A reset ends the run, so no program ever sees that one came from here.
            0x04 | 0x08 => 0,
            0x0c..0x2c => self.scratch[(at as usize - 0xc) / 4],
            0x2c => self.tick | (self.tick & 0x200) << 1,
            _ => return Err(BusError),
        };
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        let at = alias::plain(access.offset) & !3;
        match at {
            0x00 => {
                let left = self.counts_left(access.cycle);
                let control = alias::written(access, value, self.control);
                self.control = control & 0x4700_0000;
                self.load(left, access.cycle);
                if control & TRIGGER != 0 {
                    bus.lines.reset();
                }
            }
            0x04 => self.load(alias::lanes(access.size, value), access.cycle),
            0x0c..0x2c => {
                let word = &mut self.scratch[(at as usize - 0xc) / 4];
                *word = alias::written(access, value, *word);
            }
            0x2c => self.tick = alias::written(access, value, self.tick) & 0x3ff,
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
