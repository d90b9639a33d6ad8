//! Clocks of RP2350 and RP2040 (RP2350 datasheet 8.1, RP2040 datasheet 2.15), and which blocks
//! leave their reset (7.5, 2.14).
//!
//! ```text
//!   auxiliary sources --aux mux (glitches)--+
//!   oscillators, clk_ref -------------------+--glitchless mux--> / divider --> clk_ref, clk_sys
//! ```
//!
//! The glitchless mux takes a while, in which SELECTED is zero. The auxiliary mux must be changed
//! only while nobody listens to it: a change in use ends the run ([`Lines::glitch`]), because
//! nobody knows what a core does after an edge that came too early. The clock of the emulated cores
//! is what the board says, whatever is written; clk_ref is what the ticks of the watchdog are made
//! of.
//!
//! [`Lines::glitch`]: crate::lines::Lines::glitch

use crate::bus::{Access, Bus, BusError, Device, DeviceId};
use crate::device::alias;
use crate::device::registers::{Registers, Row};

const REF: u32 = 0x30;
const SYS: u32 = 0x3c;
const PERI: u32 = 0x48;
/// Of a clock: where its divider and SELECTED are behind CTRL.
const DIV: u32 = 4;
const SELECTED: u32 = 8;
/// The bits of CTRL that select an auxiliary source.
const AUX_BITS: u32 = 7 << 5;
/// The source that is the auxiliary mux, of either clock.
const AUX: u32 = 1;
/// Where CTRL enables clk_peri.
const ENABLE: u32 = 1 << 11;
/// How long a glitchless mux takes: some cycles of the slower of both clocks; no number is
/// published.
const SWITCH_CYCLES: u64 = 40;
/// The crystal of the boards (cycles per second).
const XOSC_HZ: u64 = 12_000_000;

/// What differs between the chips.
#[derive(Clone, Copy)]
pub(crate) struct ClockLayout {
    pub rows: &'static [Row],
    /// The ring oscillator as it comes up (cycles per second).
    pub rosc_hz: u32,
    /// Where the integer part of a divider begins, and by what 0 divides clk_ref.
    pub divider_shift: u32,
    pub divider_zero: u64,
}

/// A glitchless mux.
#[derive(Clone, Copy)]
struct Mux {
    clock: &'static str,
    /// The offset of its CTRL.
    ctrl: u32,
    /// The bits of CTRL that select a source.
    sources: u32,
    from: u32,
    to: u32,
    /// The cycle from which on `to` is selected.
    done: u64,
}

impl Mux {
    fn new(clock: &'static str, ctrl: u32, sources: u32, registers: &Registers) -> Self {
        let to = registers.holds(ctrl) & sources;
        Self {
            clock,
            ctrl,
            sources,
            from: to,
            to,
            done: 0,
        }
    }

    fn selected(&self, cycle: u64) -> u32 {
        if cycle < self.done { 0 } else { 1 << self.to }
    }

    /// Takes a new CTRL; whether that is a glitch.
    fn switch(&mut self, old: u32, new: u32, cycle: u64) -> bool {
        let switching = cycle < self.done;
        let listens = self.to == AUX || switching && self.from == AUX;
        let to = new & self.sources;
        if to != self.to {
            self.from = if switching { self.from } else { self.to };
            self.to = to;
            self.done = cycle + SWITCH_CYCLES;
        }
        listens && (old ^ new) & AUX_BITS != 0
    }
}

/// See the module.
pub(crate) struct Clocks {
    registers: Registers,
    layout: ClockLayout,
    muxes: [Mux; 2],
}

impl Clocks {
    pub(crate) fn new(layout: ClockLayout) -> Self {
        let registers = Registers::new(layout.rows);
        let muxes = [
            Mux::new("clk_ref", REF, 3, &registers),
            Mux::new("clk_sys", SYS, 1, &registers),
        ];
        Self {
            registers,
            layout,
            muxes,
        }
    }

    /// clk_ref (cycles per second); none while its source is one that no board here has.
    pub(crate) fn ref_hz(&self) -> Option<u64> {
        let source = match self.muxes[0].to {
            0 => u64::from(self.layout.rosc_hz),
            2 => XOSC_HZ,
            _ => return None,
        };
        let divider = u64::from(self.registers.holds(REF + DIV) >> self.layout.divider_shift);
        let divider = if divider == 0 {
            self.layout.divider_zero
        } else {
            divider
        };
        Some(source / divider)
    }

    fn peri_runs(&self) -> bool {
        self.registers.holds(PERI) & ENABLE != 0
    }
}

impl Device for Clocks {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        let at = alias::plain(access.offset) & !3;
        match self.muxes.iter().find(|mux| mux.ctrl + SELECTED == at) {
            Some(mux) => Ok(alias::part(access.offset, mux.selected(access.cycle))),
            None => self.registers.read(access, bus),
        }
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        let at = alias::plain(access.offset) & !3;
        let old = self.registers.holds(at);
        self.registers.write(access, value, bus)?;
        let new = self.registers.holds(at);
        if let Some(mux) = self.muxes.iter_mut().find(|mux| mux.ctrl == at)
            && mux.switch(old, new, access.cycle)
        {
            bus.lines.glitch(mux.clock);
        }
        Ok(())
    }
}

/// The offset of RESET_DONE.
const DONE: u32 = 8;

/// RESETS. A block whose own clock is clk_peri is out of reset only when that runs: it takes edges
/// of the clock to leave it.
pub(crate) struct Resets {
    registers: Registers,
    clocks: DeviceId,
    /// The blocks on clk_peri.
    on_peri: u32,
}

impl Resets {
    pub(crate) fn new(rows: &'static [Row], clocks: DeviceId, on_peri: u32) -> Self {
        Self {
            registers: Registers::new(rows),
            clocks,
            on_peri,
        }
    }
}

impl Device for Resets {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        let word = self.registers.read(access, bus)?;
        let stopped = bus
            .device::<Clocks>(self.clocks)
            .is_some_and(|clocks| !clocks.peri_runs());
        let done = alias::plain(access.offset) & !3 == DONE;
        Ok(if done && stopped {
            word & !alias::part(access.offset, self.on_peri)
        } else {
            word
        })
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.registers.write(access, value, bus)
    }
}
