//! The registers of a block: what lies where.

use crate::bus::Bus;

use super::{MACHINES, Pio};

const CTRL: u32 = 0;
const FSTAT: u32 = 4;
const FDEBUG: u32 = 8;
const FLEVEL: u32 = 0xc;
const TXF: u32 = 0x10;
const RXF: u32 = 0x20;
const IRQ: u32 = 0x30;
const IRQ_FORCE: u32 = 0x34;
const BYPASS: u32 = 0x38;
const PADOUT: u32 = 0x3c;
const PADOE: u32 = 0x40;
const CFGINFO: u32 = 0x44;
const MEMORY: u32 = 0x48;
const MACHINE: u32 = 0xc8;
const MACHINES_END: u32 = 0x128;
/// From one machine's registers to the next.
const STRIDE: u32 = 0x18;
/// The storage of receiving queues, of version 1; its pins and interrupts follow, which on version
/// 0 are here.
const PUTGET: u32 = 0x128;
const GPIOBASE: u32 = 0x168;

/// Bits of FDEBUG: reads of an empty queue, writes to a full one.
const RXUNDER: u32 = 1 << 8;
const TXOVER: u32 = 1 << 16;

impl Pio {
    fn intr(&self) -> u32 {
        if self.layout.version == 0 {
            0x128
        } else {
            0x16c
        }
    }

    /// The register of an interrupt line: which line, and 0 for INTE, 1 for INTF, 2 for INTS.
    fn line(&self, at: u32) -> Option<(usize, u32)> {
        let from = at
            .checked_sub(self.intr() + 4)
            .filter(|from| *from < 0x18)?
            / 4;
        Some((from as usize / 3, from % 3))
    }

    /// A read of a register, with what it does.
    pub(super) fn register(&mut self, at: u32, cycle: u64, bus: &mut Bus) -> Option<u32> {
        let version = self.layout.version;
        Some(match at {
            CTRL => self.enables(),
            FSTAT => self.status(),
            FDEBUG => self.debug,
            FLEVEL => self.fill_levels(),
            TXF..RXF | IRQ_FORCE => 0,
            RXF..IRQ => self.receive(((at - RXF) / 4) as usize, cycle, bus),
            IRQ => u32::from(self.flags),
            BYPASS => self.bypass,
            PADOUT => self.levels,
            PADOE => self.directions,
            CFGINFO => version << 28 | 32 << 16 | 4 << 8 | 4,
            MEMORY..MACHINE => 0,
            MACHINE..MACHINES_END => self.of_machine(at),
            PUTGET..GPIOBASE if version > 0 => self.storage(at, false).copied().unwrap_or(0),
            GPIOBASE if version > 0 => self.first_pin,
            _ if at == self.intr() => self.raw(),
            _ => match self.line(at)? {
                (line, 0) => self.enabled[line],
                (line, 1) => self.forced[line],
                (line, _) => self.raw() & self.enabled[line] | self.forced[line],
            },
        })
    }

    /// A write of a whole register, with what it does.
    pub(super) fn set_register(
        &mut self,
        at: u32,
        value: u32,
        cycle: u64,
        bus: &mut Bus,
    ) -> Option<()> {
        let version = self.layout.version;
        match at {
            CTRL => self.control(value, cycle, bus),
            FDEBUG => self.debug &= !value,
            TXF..RXF => {
                let index = ((at - TXF) / 4) as usize;
                if !self.machines[index].tx.push(value) {
                    self.debug |= TXOVER << index;
                }
            }
            IRQ => self.flags &= !(value as u8),
            IRQ_FORCE => self.flags |= value as u8,
            BYPASS => self.bypass = value,
            MEMORY..MACHINE => self.memory[((at - MEMORY) / 4) as usize] = value as u16,
            MACHINE..MACHINES_END => self.set_of_machine(at, value, cycle),
            PUTGET..GPIOBASE if version > 0 => {
                if let Some(word) = self.storage(at, true) {
                    *word = value;
                }
            }
            GPIOBASE if version > 0 => {
                self.first_pin = value & 16;
                self.drive(cycle, bus);
            }
            FSTAT | FLEVEL | RXF..IRQ | PADOUT | PADOE | CFGINFO => {}
            _ if at == self.intr() => {}
            _ => match self.line(at)? {
                (line, 0) => self.enabled[line] = value & self.all_interrupts(),
                (line, 1) => self.forced[line] = value & self.all_interrupts(),
                _ => {}
            },
        }
        Some(())
    }

    fn all_interrupts(&self) -> u32 {
        if self.layout.version == 0 {
            0xfff
        } else {
            0xffff
        }
    }

    /// What a write to one of the copies changes; where a write is an action, zero.
    pub(super) fn held(&self, at: u32) -> u32 {
        match at {
            CTRL => self.enables(),
            BYPASS => self.bypass,
            MACHINE..MACHINES_END if (at - MACHINE) % STRIDE != 0x10 => self.of_machine(at),
            GPIOBASE if self.layout.version > 0 => self.first_pin,
            _ => match self.line(at) {
                Some((line, 0)) => self.enabled[line],
                Some((line, 1)) => self.forced[line],
                _ => 0,
            },
        }
    }

    fn enables(&self) -> u32 {
        let bit = |i: usize| u32::from(self.machines[i].enabled) << i;
        (0..MACHINES).map(bit).sum()
    }

    fn status(&self) -> u32 {
        let bits = |i: usize| {
            let (rx, tx) = (&self.machines[i].rx, &self.machines[i].tx);
            let four = [rx.is_full(), rx.is_empty(), tx.is_full(), tx.is_empty()];
            let bit = |(byte, on): (usize, &bool)| u32::from(*on) << (8 * byte + i);
            four.iter().enumerate().map(bit).sum::<u32>()
        };
        (0..MACHINES).map(bits).sum()
    }

    pub(super) fn fill_levels(&self) -> u32 {
        let levels = |i: usize| {
            let machine = &self.machines[i];
            (machine.tx.len() as u32 | (machine.rx.len() as u32) << 4) << (8 * i)
        };
        (0..MACHINES).map(levels).sum()
    }

    fn receive(&mut self, index: usize, cycle: u64, bus: &mut Bus) -> u32 {
        let word = self.machines[index].rx.pop();
        match word {
            Some(_) => self.changed(cycle, bus),
            None => self.debug |= RXUNDER << index,
        }
        word.unwrap_or(0)
    }

    /// A word of a queue's storage, where the system may reach it.
    fn storage(&mut self, at: u32, write: bool) -> Option<&mut u32> {
        let word = (at - PUTGET) / 4;
        let machine = &mut self.machines[word as usize / 4];
        // Only one of the two is the system's: it reads what the machine puts.
        let [puts, gets] = [15, 14].map(|bit| machine.shiftctrl >> bit & 1 != 0);
        let reaches = puts != gets && gets == write;
        reaches.then(|| machine.rx.register(word))
    }

    fn of_machine(&self, at: u32) -> u32 {
        let machine = &self.machines[((at - MACHINE) / STRIDE) as usize];
        match (at - MACHINE) % STRIDE {
            0 => machine.clkdiv,
            4 => machine.execctrl(),
            8 => machine.shiftctrl,
            0xc => machine.pc,
            0x10 => {
                let of_memory = self.memory[machine.pc as usize];
                u32::from(machine.latched.unwrap_or(of_memory))
            }
            _ => machine.pinctrl,
        }
    }

    fn set_of_machine(&mut self, at: u32, value: u32, cycle: u64) {
        let version = self.layout.version;
        let machine = &mut self.machines[((at - MACHINE) / STRIDE) as usize];
        match (at - MACHINE) % STRIDE {
            0 => {
                machine.clkdiv = value & 0xffff_ff00;
                machine.divider.set(value, cycle + 1);
            }
            4 => machine.set_execctrl(value),
            8 => machine.set_shiftctrl(value, version),
            0xc => {}
            0x10 => machine.force(value as u16),
            _ => machine.pinctrl = value,
        }
    }

    fn control(&mut self, value: u32, cycle: u64, bus: &mut Bus) {
        self.command(value & 0xf, value >> 4 & 0xf, value >> 8 & 0xf, cycle);
        if self.layout.version == 0 {
            return;
        }
        let [enable, disable, restart] = [24, 25, 26].map(|bit| value >> bit & 1 != 0);
        for (id, shift) in self.neighbours.into_iter().flatten().zip([16, 20]) {
            let chosen = value >> shift & 0xf;
            let Some(pio) = bus.device_mut::<Self>(id) else {
                continue;
            };
            pio.reach(cycle);
            let mut enables = pio.enables();
            enables |= if enable { chosen } else { 0 };
            enables &= !if disable { chosen } else { 0 };
            pio.command(enables, 0, if restart { chosen } else { 0 }, cycle);
            bus.reschedule(id);
        }
    }

    /// Which machines run, start afresh, and begin their clocks anew.
    fn command(&mut self, enable: u32, restart: u32, clocks: u32, cycle: u64) {
        for (i, machine) in self.machines.iter_mut().enumerate() {
            let is = |mask: u32| mask >> i & 1 != 0;
            if is(clocks) {
                machine.divider.restart(cycle + 1);
            }
            if is(restart) {
                machine.restart();
            }
            let starts = is(enable) && !machine.enabled;
            machine.enabled = is(enable);
            if starts {
                machine.wake = machine.wake.max(cycle + 1);
                if machine.wake != u64::MAX {
                    machine.wake = machine.divider.at_or_after(machine.wake);
                }
            }
            machine.stir(cycle + 1);
        }
    }
}
