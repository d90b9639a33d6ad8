//! Switching core 1 off and on (PSM), and the watchdog (RP2350 datasheet 7.3, 8.5, 12.9; RP2040
//! datasheet 2.13, 4.7).
//!
//! ```text
//!   clk_ref --/ CYCLES--> ticks --> watchdog --bite--> the stages that PSM's WDSEL selects
//! ```
//!
//! The stages of the power-on state machine are its bits, lowest first, and the processors are the
//! last: whichever stage is reset, those behind it are too. After reset none is selected, and a
//! bite does nothing.

use crate::bus::{Access, Bus, BusError, Device, DeviceId};
use crate::device::alias;
use crate::device::clocks::Clocks;
use crate::device::registers::Registers;
use crate::device::sio::Sio;
use crate::lines::Start;

/// Which bits mean what.
#[derive(Clone, Copy)]
pub(crate) struct Stages {
    pub core1: u32,
    /// All bits.
    pub mask: u32,
    /// The stages up to RESETS, which resets the peripherals.
    pub peripherals: u32,
}

/// The power-on state machine: of it, the processors. A core that is forced off halts; let go, it
/// starts in the boot ROM.
pub(crate) struct Power {
    /// The bit of core 1 in each register.
    core1: u32,
    /// All bits.
    mask: u32,
    /// The stages up to the one that peripherals are reset with.
    peripherals: u32,
    sio: DeviceId,
    wakes: Start,
    force_on: u32,
    force_off: u32,
    watchdog: u32,
}

impl Power {
    pub(crate) fn new(stages: Stages, sio: DeviceId, wakes: Start) -> Self {
        let Stages {
            core1,
            mask,
            peripherals,
        } = stages;
        Self {
            core1,
            mask,
            peripherals,
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
            wake_core1(self.sio, self.wakes, bus);
        }
    }
}

/// Core 1 begins in the boot ROM.
fn wake_core1(sio: DeviceId, wakes: Start, bus: &mut Bus) {
    if let Some(sio) = bus.device_mut::<Sio>(sio) {
        sio.reset_core(1);
    }
    bus.lines.start(1, wakes);
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
/// Of RP2040's register TICK.
const TICK_ENABLE: u32 = 1 << 9;
const TICK_CYCLES: u32 = 0x1ff;

/// Where the ticks of a watchdog come from.
#[derive(Clone, Copy)]
pub(crate) enum Ticks {
    /// Its own register TICK (RP2040).
    Own,
    /// A generator of this block: CTRL at this offset, then CYCLES (RP2350).
    Block(DeviceId, u32),
}

/// What a watchdog is connected to.
#[derive(Clone, Copy)]
pub(crate) struct Wiring {
    pub power: DeviceId,
    pub clocks: DeviceId,
    pub ticks: Ticks,
}

/// The watchdog: counts down in ticks (by two on RP2040, its erratum E1). It takes the length of a
/// tick when it is loaded or enabled.
pub(crate) struct Watchdog {
    clock_hz: u64,
    counts_per_tick: u64,
    wiring: Wiring,
    control: u32,
    /// Cycles that this many counts take; none while there are no ticks.
    pace: Option<(u64, u64)>,
    /// The cycle in which it reaches zero.
    expires: u64,
    left: u32,
    scratch: [u32; 8],
    tick: u32,
}

impl Watchdog {
    pub(crate) fn new(clock_hz: u32, counts_per_tick: u32, wiring: Wiring) -> Self {
        Self {
            clock_hz: u64::from(clock_hz),
            counts_per_tick: u64::from(counts_per_tick),
            wiring,
            control: 0x0700_0000,
            pace: None,
            expires: u64::MAX,
            left: 0,
            scratch: [0; 8],
            tick: TICK_ENABLE,
        }
    }

    /// Cycles that so many counts take, while there are ticks.
    fn pace(&self, bus: &Bus) -> Option<(u64, u64)> {
        let (enabled, cycles) = match self.wiring.ticks {
            Ticks::Own => (self.tick & TICK_ENABLE != 0, self.tick & TICK_CYCLES),
            Ticks::Block(id, at) => {
                let block = bus.device::<Registers>(id)?;
                (block.holds(at) & 1 != 0, block.holds(at + 4))
            }
        };
        let ref_hz = bus.device::<Clocks>(self.wiring.clocks)?.ref_hz()?;
        let ticks = enabled && cycles != 0;
        ticks.then(|| {
            (
                u64::from(cycles) * self.clock_hz,
                ref_hz * self.counts_per_tick,
            )
        })
    }

    fn load(&mut self, count: u32, cycle: u64, bus: &Bus) {
        self.left = count & 0xff_ffff;
        self.pace = self.pace(bus).filter(|_| self.control & ENABLE != 0);
        self.expires = self.pace.map_or(u64::MAX, |(cycles, counts)| {
            cycle + u64::from(self.left) * cycles / counts
        });
    }

    fn counts_left(&self, cycle: u64) -> u32 {
        self.pace.map_or(self.left, |(cycles, counts)| {
            (self.expires.saturating_sub(cycle) * counts / cycles) as u32
        })
    }

    /// Resets what PSM's WDSEL selects.
    fn bite(&self, bus: &mut Bus) {
        let Some(power) = bus.device::<Power>(self.wiring.power) else {
            return;
        };
        let (selected, core1, sio, wakes) = (power.watchdog, power.core1, power.sio, power.wakes);
        if selected & power.peripherals != 0 {
            bus.lines.reset();
        } else if selected & !core1 != 0 {
            bus.lines.reset_cores();
        } else if selected != 0 {
            wake_core1(sio, wakes, bus);
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
            0x2c => self.tick | (self.tick & TICK_ENABLE) << 1,
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
                self.load(left, access.cycle, bus);
                if control & TRIGGER != 0 {
                    self.bite(bus);
                }
            }
            0x04 => self.load(alias::lanes(access.size, value), access.cycle, bus),
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
            (self.expires, self.pace, self.left) = (u64::MAX, None, 0);
            self.bite(bus);
        }
    }
}
