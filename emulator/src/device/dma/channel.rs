//! One channel: two addresses, a count, and how to step.

use crate::bus::Bus;

/// Where the fields of CTRL lie.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Bits {
    increment_read: u32,
    increment_write: u32,
    /// Steps backwards instead; a shift that leaves nothing where there is no such bit.
    reverse: Option<[u32; 2]>,
    ring: u32,
    ring_write: u32,
    chain: u32,
    request: u32,
    quiet: u32,
    swap: u32,
    busy: u32,
    /// Whether the top four bits of the count are a mode.
    modes: bool,
}

pub(crate) const RP2350: Bits = Bits {
    increment_read: 4,
    increment_write: 6,
    reverse: Some([5, 7]),
    ring: 8,
    ring_write: 12,
    chain: 13,
    request: 17,
    quiet: 23,
    swap: 24,
    busy: 26,
    modes: true,
};

pub(crate) const RP2040: Bits = Bits {
    increment_read: 4,
    increment_write: 5,
    reverse: None,
    ring: 6,
    ring_write: 10,
    chain: 11,
    request: 15,
    quiet: 21,
    swap: 22,
    busy: 24,
    modes: false,
};

/// The registers of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Field {
    Read,
    Write,
    Count,
    Control,
}

/// The four orders in which they appear; the last of each four starts the channel.
const FIELDS: [Field; 16] = {
    use Field::{Control as C, Count as N, Read as R, Write as W};
    [R, W, N, C, C, R, W, N, C, N, R, W, C, W, N, R]
};

const WRITE_ERROR: u32 = 1 << 29;
const READ_ERROR: u32 = 1 << 30;
const BUS_ERROR: u32 = 1 << 31;
const ERRORS: u32 = WRITE_ERROR | READ_ERROR;
/// Modes of the count: start again by itself, and never end.
const AGAIN: u32 = 1;
const ENDLESS: u32 = 15;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    bits: Bits,
    read: u32,
    write: u32,
    /// What is left, and what the next start begins with.
    left: u32,
    reload: u32,
    control: u32,
    pub busy: bool,
    /// Requests that came as pulses and have had no transfer.
    pub credits: u32,
    /// The first cycle in which its pacing timer lets it go on.
    pub paced_from: u64,
}

impl Channel {
    /// At reset it chains to itself, which means to none.
    pub(crate) fn new(bits: Bits, index: usize) -> Self {
        let control = (index as u32) << bits.chain;
        Self {
            bits,
            read: 0,
            write: 0,
            left: 0,
            reload: 0,
            control,
            busy: false,
            credits: 0,
            paced_from: 0,
        }
    }

    pub(crate) fn read(&self, place: u32) -> u32 {
        match FIELDS[place as usize & 15] {
            Field::Read => self.read,
            Field::Write => self.write,
            Field::Count => self.left,
            Field::Control => {
                let error = if self.control & ERRORS != 0 {
                    BUS_ERROR
                } else {
                    0
                };
                self.control | error | u32::from(self.busy) << self.bits.busy
            }
        }
    }

    pub(crate) fn write(&mut self, place: u32, value: u32) {
        match FIELDS[place as usize & 15] {
            Field::Read => self.read = value,
            Field::Write => self.write = value,
            Field::Count => {
                self.reload = value;
                self.left = if self.busy { self.left } else { value };
            }
            Field::Control => {
                let errors = self.control & ERRORS & !value;
                self.control = value & !(BUS_ERROR | ERRORS | 1 << self.bits.busy) | errors;
            }
        }
    }

    /// Whether it goes on: without EN one that is under way pauses (RP2350 datasheet 12.6.10,
    /// CTRL).
    pub(crate) fn is_enabled(&self) -> bool {
        self.control & 1 != 0
    }

    /// Begins, if it is enabled and not under way.
    pub(crate) fn start(&mut self) {
        if self.is_enabled() && !self.busy && self.control & ERRORS == 0 {
            self.left = self.reload;
            self.busy = self.count() != 0;
            self.credits = 0;
        }
    }

    fn field(&self, shift: u32, bits: u32) -> u32 {
        self.control >> shift & ((1 << bits) - 1)
    }

    pub(crate) fn request(&self) -> u32 {
        self.field(self.bits.request, 6)
    }

    pub(crate) fn chain_to(&self) -> usize {
        self.field(self.bits.chain, 4) as usize
    }

    pub(crate) fn quiet(&self) -> bool {
        self.field(self.bits.quiet, 1) != 0
    }

    pub(crate) fn high_priority(&self) -> bool {
        self.field(1, 1) != 0
    }

    fn mode(&self) -> u32 {
        if self.bits.modes { self.left >> 28 } else { 0 }
    }

    fn count(&self) -> u32 {
        if self.bits.modes {
            self.left & 0x0fff_ffff
        } else {
            self.left
        }
    }

    /// One transfer. Whether it was the last.
    pub(crate) fn transfer(&mut self, cycle: u64, bus: &mut Bus) -> bool {
        let size = 1 << self.field(2, 2).min(2);
        let error = match bus.read(self.read & !(size - 1), size, cycle) {
            Err(_) => READ_ERROR,
            Ok(word) => match bus.write(
                self.write & !(size - 1),
                size,
                self.swapped(word, size),
                cycle,
            ) {
                Err(_) => WRITE_ERROR,
                Ok(()) => 0,
            },
        };
        if error != 0 {
            self.control |= error;
            self.busy = false;
            return false;
        }
        self.read = self.stepped(self.read, size, false);
        self.write = self.stepped(self.write, size, true);
        self.count_down()
    }

    fn count_down(&mut self) -> bool {
        let mode = self.mode();
        if mode == ENDLESS {
            return false;
        }
        self.left = self.left & !0x0fff_ffff | (self.count() - 1);
        if !self.bits.modes {
            self.left &= 0x0fff_ffff;
        }
        let ended = self.count() == 0;
        if ended {
            self.busy = mode == AGAIN && self.reload & 0x0fff_ffff != 0;
            self.left = if self.busy { self.reload } else { self.left };
        }
        ended
    }

    fn swapped(&self, word: u32, size: u32) -> u32 {
        match size {
            _ if self.field(self.bits.swap, 1) == 0 => word,
            4 => word.swap_bytes(),
            2 => u32::from((word as u16).swap_bytes()),
            _ => word,
        }
    }

    /// The next address: forwards, backwards or the same, inside a ring of 2^n bytes if one is
    /// chosen for this side.
    fn stepped(&self, address: u32, size: u32, write: bool) -> u32 {
        let enable = if write {
            self.bits.increment_write
        } else {
            self.bits.increment_read
        };
        let reverse = self
            .bits
            .reverse
            .is_some_and(|bits| self.field(bits[usize::from(write)], 1) != 0);
        let step = match (self.field(enable, 1) != 0, reverse) {
            (true, false) => size,
            (true, true) => size.wrapping_neg(),
            // RP2350: reversed without being incremented is twice the step.
            (false, true) => 2 * size,
            (false, false) => 0,
        };
        let next = address.wrapping_add(step);
        let ring = self.field(self.bits.ring, 4);
        let rings = ring != 0 && (self.field(self.bits.ring_write, 1) != 0) == write;
        let inside = if rings { (1 << ring) - 1 } else { u32::MAX };
        address & !inside | next & inside
    }
}
