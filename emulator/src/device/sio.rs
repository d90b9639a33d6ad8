//! SIO: what each core reaches in one cycle. The core number, a mailbox of FIFOs between the two
//! cores, 32 spinlocks, pins; on RP2350 doorbells (datasheet 3.1), on RP2040 a divider (datasheet
//! 2.3.1.5).
//!
//! Not here: the interpolators, the TMDS encoder and the platform timer of RP2350; their registers
//! answer with a bus fault.

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

mod divider;
mod pins;

use divider::Divider;
use pins::SioPins;

/// In what the SIO of the two chips differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Chip {
    /// FIFOs of 8 words with one interrupt number for both cores.
    Rp2040,
    /// FIFOs of 4 words, doorbells.
    Rp2350,
}

impl Chip {
    fn fifo_words(self) -> usize {
        if self == Self::Rp2040 { 8 } else { 4 }
    }

    /// The interrupt of a core's FIFO.
    fn fifo_interrupt(self, core: usize) -> usize {
        if self == Self::Rp2040 { 15 + core } else { 25 }
    }
}

/// The interrupt of a core's doorbells on RP2350.
const BELL: usize = 26;
const CORES: usize = 2;

/// One core's end of the mailbox: what the other one sent to it.
#[derive(Default)]
struct Mailbox {
    words: VecDeque<u32>,
    read_empty: bool,
    wrote_full: bool,
}

/// See the module.
pub(crate) struct Sio {
    chip: Chip,
    pins: SioPins,
    inbox: [Mailbox; CORES],
    /// One bit per spinlock, set while it is taken.
    locks: u32,
    /// Doorbells that ring at each core.
    bells: [u32; CORES],
    dividers: [Divider; CORES],
}

impl Sio {
    pub(crate) fn new(chip: Chip) -> Self {
        let (inbox, dividers) = Default::default();
        Self {
            chip,
            pins: SioPins::new(chip),
            inbox,
            locks: 0,
            bells: [0; CORES],
            dividers,
        }
    }

    /// Empties the mailbox of a core and everything it sent: the core is being reset.
    pub(crate) fn reset_core(&mut self, core: usize) {
        self.inbox[core % CORES] = Mailbox::default();
    }

    fn fifo_status(&self, core: usize) -> u32 {
        let (mine, other) = (&self.inbox[core], &self.inbox[1 - core]);
        let room = other.words.len() < self.chip.fifo_words();
        let bits = [
            !mine.words.is_empty(),
            room,
            mine.wrote_full,
            mine.read_empty,
        ];
        bits.iter()
            .enumerate()
            .map(|(i, b)| u32::from(*b) << i)
            .sum()
    }

    /// A word for the other core, and the event that wakes it.
    fn send(&mut self, core: usize, word: u32, bus: &mut Bus) {
        let other = 1 - core;
        if self.inbox[other].words.len() < self.chip.fifo_words() {
            self.inbox[other].words.push_back(word);
            bus.lines.event(other);
        } else {
            self.inbox[core].wrote_full = true;
        }
    }

    fn receive(&mut self, core: usize) -> u32 {
        let inbox = &mut self.inbox[core];
        inbox.read_empty |= inbox.words.is_empty();
        inbox.words.pop_front().unwrap_or(0)
    }

    /// Takes a spinlock: its bit when it was free, else 0.
    fn claim(&mut self, lock: u32) -> u32 {
        let bit = !self.locks & 1 << lock;
        self.locks |= bit;
        bit
    }

    /// Interrupts follow what is in the mailboxes and which bells ring.
    fn interrupts(&self, bus: &mut Bus) {
        for core in 0..CORES {
            let inbox = &self.inbox[core];
            let fifo = !inbox.words.is_empty() || inbox.read_empty || inbox.wrote_full;
            bus.lines.set(core, self.chip.fifo_interrupt(core), fifo);
            if self.chip == Chip::Rp2350 {
                bus.lines.set(core, BELL, self.bells[core] != 0);
            }
        }
    }

    fn ring(&mut self, at: u32, core: usize, value: u32) {
        let (mine, other) = (core, 1 - core);
        match at {
            0x180 => self.bells[other] |= value & 0xff,
            0x184 => self.bells[other] &= !value,
            0x188 => self.bells[mine] |= value & 0xff,
            _ => self.bells[mine] &= !value,
        }
    }
}

impl Device for Sio {
    fn keeps_to_itself(&self, offset: u32, write: bool) -> bool {
        matches!(
            (offset & !3, write),
            (0x50 | 0x100..0x180, _) | (0x54, true) | (0x58, false)
        )
    }

    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        // Another bus manager than a core (a DMA) cannot reach SIO.
        let core = Some(access.core).filter(|c| *c < CORES).ok_or(BusError)?;
        let at = access.offset & !3;
        let two = self.chip == Chip::Rp2350;
        let word = match at {
            0x00 => core as u32,
            0x50 => self.fifo_status(core),
            0x58 => self.receive(core),
            0x5c => self.locks,
            0x60..0x7c if !two => self.dividers[core].read(at, access.cycle).ok_or(BusError)?,
            0x100..0x180 => self.claim((at - 0x100) / 4),
            0x180 | 0x184 if two => self.bells[1 - core],
            0x188 | 0x18c if two => self.bells[core],
            _ => self
                .pins
                .read(at, &bus.pins, access.cycle)
                .ok_or(BusError)?,
        };
        self.interrupts(bus);
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        let core = Some(access.core).filter(|c| *c < CORES).ok_or(BusError)?;
        let (at, value) = (access.offset & !3, alias::lanes(access.size, value));
        let two = self.chip == Chip::Rp2350;
        match at {
            0x50 => {
                self.inbox[core].wrote_full &= value & 4 == 0;
                self.inbox[core].read_empty &= value & 8 == 0;
            }
            0x54 => self.send(core, value, bus),
            0x60..0x7c if !two => self.dividers[core]
                .write(at, value, access.cycle)
                .ok_or(BusError)?,
            0x100..0x180 => self.locks &= !(1 << ((at - 0x100) / 4)),
            0x180..0x190 if two => self.ring(at, core, value),
            _ => self
                .pins
                .write(at, value, &mut bus.pins, access.cycle)
                .ok_or(BusError)?,
        }
        self.interrupts(bus);
        Ok(())
    }
}
