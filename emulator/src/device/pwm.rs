//! PWM: slices that count, and compare (RP2350 datasheet 12.5, RP2040 datasheet 4.5).
//!
//! ```text
//!   p = 0 .. period - 1      period is TOP + 1: the counter is p
//!                            phase-correct, twice that: p, then back from TOP to 0
//!   an output is high        while the counter is less than its compare value
//!   p comes to 0 again       a wrap: interrupt, request; TOP and CC are taken over
//! ```
//!
//! Nothing costs time between the cycles in which an output changes or a counter wraps. An output
//! is on its pins from the cycle on that follows its counter's. Not here: counting edges or levels
//! of an input (DIVMODE), which counts as always.

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;
use crate::pins::Source;

mod slice;

use slice::Slice;

/// In what chips differ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PwmLayout {
    pub base: u32,
    pub slices: usize,
    /// The first of its interrupts, and how many.
    pub interrupt: usize,
    pub lines: usize,
    /// The request of the first slice.
    pub request: u32,
}

/// Bytes of a slice's registers.
const STRIDE: u32 = 0x14;

/// See the module.
pub(crate) struct Pwm {
    layout: PwmLayout,
    slices: Vec<Slice>,
    raised: u32,
    enabled: [u32; 2],
    forced: [u32; 2],
}

impl Pwm {
    pub(crate) fn new(layout: PwmLayout) -> Self {
        Self {
            layout,
            slices: vec![Slice::new(); layout.slices],
            raised: 0,
            enabled: [0; 2],
            forced: [0; 2],
        }
    }

    /// The register of all slices' EN.
    fn enables_at(&self) -> u32 {
        STRIDE * self.layout.slices as u32
    }

    /// The slice and the channel of a pin.
    fn channel_of(pin: usize) -> (usize, usize) {
        let slice = if pin < 32 {
            pin / 2 % 8
        } else {
            8 + pin / 2 % 4
        };
        (slice, pin % 2)
    }

    /// Brings all slices up to a cycle, and the pins.
    fn advance(&mut self, cycle: u64, bus: &mut Bus) {
        for (index, slice) in self.slices.iter_mut().enumerate() {
            if slice.advance(cycle) {
                self.raised |= 1 << index;
                bus.request_pulse(self.layout.request + index as u32, cycle);
            }
        }
        self.show(cycle, bus);
    }

    fn show(&self, cycle: u64, bus: &mut Bus) {
        let outputs: Vec<[bool; 2]> = self.slices.iter().map(|s| s.outputs(cycle)).collect();
        let level = |pin: usize| {
            let (slice, channel) = Self::channel_of(pin);
            let high = outputs.get(slice).is_some_and(|both| both[channel]);
            u64::from(high) << pin
        };
        let levels = (0..bus.pins.count()).map(level).sum();
        bus.pins.set(Source::Pwm, levels, u64::MAX, cycle + 1);
        for line in 0..self.layout.lines {
            let active = self.raised & self.enabled[line] | self.forced[line];
            bus.lines.set_all(self.layout.interrupt + line, active != 0);
        }
    }

    fn enables(&self) -> u32 {
        let bit = |(i, slice): (usize, &Slice)| u32::from(slice.is_enabled()) << i;
        self.slices.iter().enumerate().map(bit).sum()
    }

    /// An interrupt line's register: which line, and 0 for INTE, 1 for INTF, 2 for INTS.
    fn line(&self, at: u32) -> Option<(usize, u32)> {
        let from = at.checked_sub(self.enables_at() + 8)? / 4;
        Some((from as usize / 3, from % 3)).filter(|(line, _)| *line < self.layout.lines)
    }

    fn word(&self, at: u32, cycle: u64) -> Option<u32> {
        if at < self.enables_at() {
            return Some(self.slices[(at / STRIDE) as usize].read(at % STRIDE, cycle));
        }
        Some(match at - self.enables_at() {
            0 => self.enables(),
            4 => self.raised,
            _ => match self.line(at)? {
                (line, 0) => self.enabled[line],
                (line, 1) => self.forced[line],
                (line, _) => self.raised & self.enabled[line] | self.forced[line],
            },
        })
    }

    fn set_word(&mut self, at: u32, value: u32, cycle: u64) -> Option<()> {
        if at < self.enables_at() {
            self.slices[(at / STRIDE) as usize].write(at % STRIDE, value, cycle);
            return Some(());
        }
        match at - self.enables_at() {
            0 => {
                for (i, slice) in self.slices.iter_mut().enumerate() {
                    slice.enable(value >> i & 1 != 0, cycle);
                }
            }
            4 => self.raised &= !value,
            _ => match self.line(at)? {
                (line, 0) => self.enabled[line] = value & ((1 << self.layout.slices) - 1),
                (line, 1) => self.forced[line] = value & ((1 << self.layout.slices) - 1),
                _ => {}
            },
        }
        Some(())
    }
}

impl Device for Pwm {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.advance(access.cycle, bus);
        let at = alias::plain(access.offset) & !3;
        let word = self.word(at, access.cycle).ok_or(BusError)?;
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.advance(access.cycle, bus);
        let at = alias::plain(access.offset) & !3;
        let clears = at == self.enables_at() + 4;
        let held = if clears {
            0
        } else {
            self.word(at, access.cycle).ok_or(BusError)?
        };
        let value = alias::written(access, value, held);
        self.set_word(at, value, access.cycle).ok_or(BusError)?;
        self.show(access.cycle, bus);
        Ok(())
    }

    fn due(&self) -> u64 {
        let dues = self.slices.iter().map(Slice::due);
        dues.min().unwrap_or(u64::MAX)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.advance(cycle, bus);
    }
}

#[cfg(test)]
mod tests;
