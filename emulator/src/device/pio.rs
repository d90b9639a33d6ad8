//! PIO: four state machines with a memory of 32 instructions (RP2350 datasheet 11, RP2040
//! datasheet 3). Version 0 is RP2040's, version 1 RP2350's.
//!
//! ```text
//!   cycle t: machines see queues and flags as t began, pins as they were
//!            in t - 3 behind the synchronizers, in t - 1 past them
//!              |
//!   what they write is on the pins from t + 1 on; of two the machine of higher number wins
//! ```
//!
//! So a machine that looks at what it drives sees it after four cycles, or two, as the datasheet
//! says. Nothing happens while all machines stall: what they may wait for wakes them.

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices};
use crate::device::alias;
use crate::pins::Source;

mod divider;
mod execute;
mod fifo;
mod machine;
mod map;

use machine::{Does, Seen, StateMachine};

const MACHINES: usize = 4;
/// Cycles from a change of a pin until the last machine that looks has seen it.
const SETTLED: u64 = 3;

/// A block as its chip has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PioLayout {
    pub base: u32,
    /// The first of its two interrupts.
    pub interrupt: usize,
    pub version: u32,
}

/// Flags that a block beside this one has changed, and from which cycle on.
#[derive(Clone, Copy, Default)]
struct Incoming {
    from: u64,
    raised: u8,
    lowered: u8,
}

/// See the module.
pub(crate) struct Pio {
    block: usize,
    layout: PioLayout,
    /// The blocks before and after it.
    neighbours: [Option<DeviceId>; 2],
    memory: [u16; 32],
    machines: [StateMachine; MACHINES],
    levels: u32,
    directions: u32,
    flags: u8,
    /// Flags as the last cycle began.
    flags_before: u8,
    incoming: Option<Incoming>,
    debug: u32,
    bypass: u32,
    /// The first pin that it reaches: 0 or 16.
    first_pin: u32,
    enabled: [u32; 2],
    forced: [u32; 2],
    /// The first cycle that it has not been through.
    next: u64,
}

impl Pio {
    pub(crate) fn new(block: usize, layout: PioLayout) -> Self {
        Self {
            block,
            layout,
            neighbours: [None; 2],
            memory: [0; 32],
            machines: [0, 1, 2, 3].map(StateMachine::new),
            levels: 0,
            directions: 0,
            flags: 0,
            flags_before: 0,
            incoming: None,
            debug: 0,
            bypass: 0,
            first_pin: 0,
            enabled: [0; 2],
            forced: [0; 2],
            next: 0,
        }
    }

    /// Puts the blocks of a chip on the bus, each beside the others.
    pub(crate) fn attach(bus: &mut Bus, layouts: &[PioLayout]) -> Vec<DeviceId> {
        let attach = |(block, layout): (usize, &PioLayout)| {
            let pio = Box::new(Self::new(block, *layout));
            bus.attach(layout.base, alias::BLOCK, Default::default(), pio)
        };
        let ids: Vec<DeviceId> = layouts.iter().enumerate().map(attach).collect();
        for (block, id) in ids.iter().enumerate() {
            bus.watch(
                *id,
                Notices {
                    pins: true,
                    requests: false,
                },
            );
            let beside = |by| Some(ids[(block + by) % ids.len()]);
            if let Some(pio) = bus.device_mut::<Self>(*id) {
                pio.neighbours = [beside(ids.len() - 1), beside(1)];
            }
        }
        ids
    }

    /// Whether it requests a DMA's transfer: machines' transmitters 0 to 3, receivers 4 to 7.
    pub(crate) fn requests(&self, request: u32) -> bool {
        let machine = &self.machines[request as usize % MACHINES];
        if request < 4 {
            !machine.tx.is_full()
        } else {
            !machine.rx.is_empty()
        }
    }

    /// All machines look again at what they wait for, from a cycle on.
    fn stir(&mut self, cycle: u64) {
        self.machines.iter_mut().for_each(|m| m.stir(cycle));
    }

    /// Nothing has happened up to a cycle in which the block is accessed, if nothing was due.
    fn reach(&mut self, cycle: u64) {
        if self.due() > cycle {
            self.next = self.next.max(cycle + 1);
        }
    }

    /// The flags as a cycle began.
    fn flags_in(&self, cycle: u64) -> u8 {
        let been = self.next > cycle;
        if been { self.flags_before } else { self.flags }
    }

    fn inputs(&self, cycle: u64, bus: &Bus) -> u32 {
        let then = |ago: u64| (bus.pins.inputs(cycle.saturating_sub(ago)) >> self.first_pin) as u32;
        then(1) & self.bypass | then(SETTLED) & !self.bypass
    }

    /// One cycle of all machines.
    fn step(&mut self, cycle: u64, bus: &mut Bus) {
        if let Some(incoming) = self.incoming.take_if(|incoming| incoming.from <= cycle) {
            self.flags = self.flags & !incoming.lowered | incoming.raised;
            self.stir(cycle);
        }
        let beside = self.neighbours.map(|id| {
            let pio = id.and_then(|id| bus.device::<Self>(id));
            pio.map_or(0, |pio| pio.flags_in(cycle))
        });
        let seen = Seen {
            memory: &self.memory,
            inputs: self.inputs(cycle, bus),
            flags: [self.flags, beside[0], beside[1]],
            version: self.layout.version,
        };
        let mut all = Does::default();
        for machine in &mut self.machines {
            let mut does = Does::default();
            machine.run(cycle, &seen, &mut does);
            all.add(&does, machine.index);
        }
        self.flags_before = self.flags;
        self.next = cycle + 1;
        self.apply(&all, cycle, bus);
    }

    /// What machines did to what they share.
    fn apply(&mut self, all: &Does, cycle: u64, bus: &mut Bus) {
        self.levels = all.levels.of(self.levels);
        self.directions = all.directions.of(self.directions);
        self.drive(cycle, bus);
        self.debug |= all.debug;
        self.flags = self.flags & !all.lowered[0] | all.raised[0];
        for (side, id) in self.neighbours.into_iter().enumerate() {
            let (raised, lowered) = (all.raised[1 + side], all.lowered[1 + side]);
            if raised | lowered != 0 {
                Self::tell(id, raised, lowered, cycle, bus);
            }
        }
        if self.flags != self.flags_before || all.queued {
            self.changed(cycle, bus);
        }
        if cycle < bus.pins.last_change() + SETTLED {
            self.stir(cycle + 1);
        }
    }

    /// Queues or flags have changed: machines look again, in this block and beside it, and so do
    /// cores and the DMA.
    fn changed(&mut self, cycle: u64, bus: &mut Bus) {
        self.stir(cycle + 1);
        bus.requests_changed = true;
        self.interrupts(bus);
        if self.layout.version > 0 {
            for id in self.neighbours {
                Self::tell(id, 0, 0, cycle, bus);
            }
        }
    }

    /// A block beside another changes its flags, or only wakes it.
    fn tell(id: Option<DeviceId>, raised: u8, lowered: u8, cycle: u64, bus: &mut Bus) {
        let Some(id) = id else { return };
        if let Some(pio) = bus.device_mut::<Self>(id) {
            let old = pio.incoming.unwrap_or_default();
            pio.incoming = Some(Incoming {
                from: cycle + 1,
                raised: old.raised & !lowered | raised,
                lowered: old.lowered & !raised | lowered,
            });
            bus.reschedule(id);
        }
    }

    fn drive(&self, cycle: u64, bus: &mut Bus) {
        let [levels, enable] = [self.levels, self.directions].map(u64::from);
        let source = Source::Pio(self.block);
        let at = self.first_pin;
        bus.pins.set(source, levels << at, enable << at, cycle + 1);
    }

    /// INTR: receivers with words, transmitters with room, flags.
    fn raw(&self) -> u32 {
        let bit = |i: usize| {
            let machine = &self.machines[i];
            u32::from(!machine.rx.is_empty()) << i | u32::from(!machine.tx.is_full()) << (4 + i)
        };
        let flags = if self.layout.version == 0 { 0xf } else { 0xff };
        (0..MACHINES).map(bit).sum::<u32>() | (u32::from(self.flags) & flags) << 8
    }

    fn interrupts(&self, bus: &mut Bus) {
        let raw = self.raw();
        for line in 0..2 {
            let active = raw & self.enabled[line] | self.forced[line];
            bus.lines.set_all(self.layout.interrupt + line, active != 0);
        }
    }
}

impl Does {
    /// Adds what a machine of higher number does.
    fn add(&mut self, other: &Self, index: u32) {
        self.levels = self.levels.then(other.levels);
        self.directions = self.directions.then(other.directions);
        for side in 0..3 {
            self.raised[side] |= other.raised[side];
            self.lowered[side] |= other.lowered[side];
        }
        self.debug |= other.debug << index;
        self.queued |= other.queued;
    }
}

impl Device for Pio {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.reach(access.cycle);
        let at = alias::plain(access.offset) & !3;
        let word = self.register(at, access.cycle, bus).ok_or(BusError)?;
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.reach(access.cycle);
        let at = alias::plain(access.offset) & !3;
        let value = alias::written(access, value, self.held(at));
        self.set_register(at, value, access.cycle, bus)
            .ok_or(BusError)?;
        self.changed(access.cycle, bus);
        Ok(())
    }

    fn due(&self) -> u64 {
        let machines = self.machines.iter().map(|m| m.due(self.next));
        let incoming = self.incoming.map_or(u64::MAX, |incoming| incoming.from);
        let due = machines.min().unwrap_or(u64::MAX).min(incoming);
        due.max(self.next)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        if cycle >= self.next {
            // Pins may have changed without it.
            if cycle <= bus.pins.last_change() + SETTLED {
                self.stir(cycle);
            }
            self.step(cycle, bus);
        }
    }
}

#[cfg(test)]
mod tests;
