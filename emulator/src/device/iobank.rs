//! IO_BANK0 and PADS_BANK0: which function has a pin, and what its pad does (RP2350 datasheet 9,
//! RP2040 datasheet 2.19). What they say goes to the pins; the registers hold it.
//!
//! Not here: interrupts of pins; their registers hold what is written.

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;
use crate::device::registers::{Registers, Row};

/// Function select and overrides: STATUS and CTRL of each pin, then the rest.
pub(crate) struct IoBank {
    registers: Registers,
}

impl IoBank {
    pub(crate) fn new(rows: &'static [Row]) -> Self {
        Self {
            registers: Registers::new(rows),
        }
    }

    /// The pin whose STATUS (or CTRL) lies here.
    fn pin(at: u32, bus: &Bus) -> Option<usize> {
        Some(at as usize / 8).filter(|pin| *pin < bus.pins.count())
    }
}

/// Output, enable and input of the pad in STATUS, the same on both chips.
const STATUS_BITS: [u32; 3] = [9, 13, 17];

impl Device for IoBank {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        let at = alias::plain(access.offset) & !3;
        match Self::pin(at, bus).filter(|_| at.is_multiple_of(8)) {
            Some(pin) => {
                let signals = bus.pins.pad_signals(pin).into_iter().zip(STATUS_BITS);
                let word = signals.map(|(on, bit)| u32::from(on) << bit).sum();
                Ok(alias::part(access.offset, word))
            }
            None => self.registers.read(access, bus),
        }
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.registers.write(access, value, bus)?;
        let at = alias::plain(access.offset) & !3;
        if let Some(pin) = Self::pin(at, bus).filter(|_| at % 8 == 4) {
            bus.pins
                .set_function(pin, self.registers.holds(at), access.cycle + 1);
        }
        Ok(())
    }
}

/// Pulls, enables and isolation: the voltage, then a word a pin.
pub(crate) struct PadsBank {
    registers: Registers,
}

impl PadsBank {
    pub(crate) fn new(rows: &'static [Row]) -> Self {
        Self {
            registers: Registers::new(rows),
        }
    }
}

impl Device for PadsBank {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.registers.read(access, bus)
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.registers.write(access, value, bus)?;
        let at = alias::plain(access.offset) & !3;
        let pin = (at as usize / 4).wrapping_sub(1);
        if pin < bus.pins.count() {
            bus.pins
                .set_pad(pin, self.registers.holds(at), access.cycle + 1);
        }
        Ok(())
    }
}
