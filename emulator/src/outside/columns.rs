//! Columns of eight keys: each with an ADC and a DAC of eight channels, all on the same select and
//! clock, so that a frame carries the sample of a key and the force of a key at once.
//!
//! ```text
//!   chip --select, clock--------> all ADCs, all DACs
//!   chip --command--------------> all ADCs
//!   chip <--data-- ADC c <-- voltages of eight sensors
//!   chip --data--> DAC c --> codes of eight drives
//! ```
//!
//! Counted besides is what the parts forbid. That the clock must not be faster than 17 MHz, and a
//! conversion be over in 850 ns, is general knowledge of the ADC that was not checked against its
//! table of times. Not here: what sensors and drives are (`column_keys`).

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices, Waits};

use super::column_keys::ColumnKeys;
use super::octal_dac::OctalDac;
use super::scanning_adc::{self, ScanningAdc};

pub use super::scanning_adc::ScanFault;

/// The two pins of a column.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ColumnPins {
    /// To the DAC's data (DIN).
    pub to_dac: u32,
    /// From the ADC's data (SDO).
    pub from_adc: u32,
}

/// The pins of all columns.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ColumnsPins {
    /// To the clock of all (SCLK).
    pub clock: u32,
    /// To the select of all (/CS, /SYNC).
    pub select: u32,
    /// To the commands of all ADCs (SDI).
    pub command: u32,
    /// To all amplifiers, which give no current while it is low, if they have such a pin.
    pub enable: Option<u32>,
    /// Of each column.
    pub columns: Vec<ColumnPins>,
}

/// What the parts are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ColumnParts {
    /// Cycles of the chip a second.
    pub clock_hz: f64,
    /// Cycles from the clock's edge to the ADC's data, at least one.
    pub data_delay_cycles: u64,
    /// The code of the DAC's channels when it gets power.
    pub resets_to: u16,
    /// Whether a DAC whose load pin is held low puts out at once what is written to an input
    /// register.
    pub loads_at_once: bool,
}

/// What was forbidden, how often.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ColumnErrors {
    /// A frame less than 2 us behind the one before.
    pub hurried: u32,
    /// A cycle of the clock of less than 1/17 us within a frame.
    pub clock: u32,
    /// The first bit of a result asked for less than 850 ns behind the sample.
    pub early: u32,
}

/// A DAC's word that acted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ColumnUpdate {
    /// The cycle of its last falling edge.
    pub cycle: u64,
    /// What all channels put out from then on.
    pub outputs: [u16; 8],
}

/// A column at work.
#[derive(Clone, Debug)]
pub struct Column {
    /// What its sensors put out (V), if no keys say it.
    pub volts: [f64; 8],
    /// The keys, if there are any.
    pub keys: Option<ColumnKeys>,
    /// As many of the next pulses of the clock do not reach it.
    pub lost_pulses: u32,
    adc: ScanningAdc,
    dac: OctalDac,
    updates: Vec<ColumnUpdate>,
    /// The clock on the pin, and whether its pulse gets lost.
    clock_pin: bool,
    loses: bool,
}

impl Column {
    fn new(parts: &ColumnParts) -> Self {
        Self {
            volts: [0.0; 8],
            keys: None,
            lost_pulses: 0,
            adc: ScanningAdc::default(),
            dac: OctalDac::new(parts.resets_to, parts.loads_at_once),
            updates: Vec::new(),
            clock_pin: false,
            loses: false,
        }
    }

    /// From now on the ADC's data line has this.
    pub fn set_fault(&mut self, fault: ScanFault) {
        self.adc.fault = fault;
    }

    /// The ADC's next sample is of the channel behind the one whose turn it is.
    pub fn slip(&mut self) {
        self.adc.slip();
    }

    /// What the DAC's channels put out.
    pub fn outputs(&self) -> [u16; 8] {
        self.dac.outputs()
    }

    /// Whether the DAC's own reference is on.
    pub fn has_reference(&self) -> bool {
        self.dac.has_reference()
    }

    /// Words that the DAC does not know, and those that were cancelled.
    pub fn refused_and_short(&self) -> [u32; 2] {
        [self.dac.refused(), self.dac.short()]
    }

    /// The DAC's words that acted since the last time.
    pub fn take_updates(&mut self) -> Vec<ColumnUpdate> {
        std::mem::take(&mut self.updates)
    }

    /// Keys go on to a cycle.
    fn advance(&mut self, cycle: u64, is_enabled: bool) {
        if let Some(keys) = &mut self.keys {
            let gives = is_enabled && self.dac.has_reference();
            let codes = gives.then(|| self.dac.outputs());
            self.volts = keys.advance(cycle, codes);
        }
    }

    /// The level of the clock as it comes to the column.
    fn clocked(&mut self, level: bool) -> bool {
        let was_high = std::mem::replace(&mut self.clock_pin, level);
        let rises = level && !was_high;
        if rises {
            self.loses = self.lost_pulses > 0;
            self.lost_pulses -= u32::from(self.loses);
        }
        level && !self.loses
    }
}

/// See the module.
pub struct Columns {
    pins: ColumnsPins,
    delay: u64,
    /// Cycles of 2 us, 1/17 us and 850 ns, rounded up.
    least: [u64; 3],
    columns: Vec<Column>,
    errors: ColumnErrors,
    /// The select and the clock, and when a frame began and the clock rose in it.
    select: bool,
    clock: bool,
    begun: Option<u64>,
    rose: Option<u64>,
    falls: u32,
    /// Whether amplifiers give currents.
    is_enabled: bool,
    /// What comes on data pins, and when.
    coming: VecDeque<(u64, u32, Option<bool>)>,
    /// When pins change again, if the chip has said so already: nobody tells that twice.
    again: Option<u64>,
}

impl Columns {
    /// Wires columns to a chip's pins.
    pub fn attach(bus: &mut Bus, pins: ColumnsPins, parts: ColumnParts) -> DeviceId {
        let cycles = |seconds: f64| (seconds * parts.clock_hz).ceil() as u64;
        let columns = Self {
            delay: parts.data_delay_cycles.max(1),
            least: [cycles(2e-6), cycles(1.0 / 17e6), cycles(850e-9)],
            columns: vec![Column::new(&parts); pins.columns.len()],
            is_enabled: pins.enable.is_none(),
            pins,
            errors: ColumnErrors::default(),
            select: true,
            clock: false,
            begun: None,
            rose: None,
            falls: 0,
            coming: VecDeque::new(),
            again: None,
        };
        let id = bus.attach(0, 0, Waits::default(), Box::new(columns));
        let notices = Notices {
            pins: true,
            requests: false,
        };
        bus.watch(id, notices);
        id
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A column, to move its keys or break it.
    pub fn column_mut(&mut self, column: usize) -> Option<&mut Column> {
        self.columns.get_mut(column)
    }

    /// Whether amplifiers give currents.
    pub fn is_enabled(&self) -> bool {
        self.is_enabled
    }

    /// What was forbidden.
    pub fn errors(&self) -> ColumnErrors {
        self.errors
    }

    /// Counts what the times of a change forbid.
    fn judge(&mut self, cycle: u64, select: bool, clock: bool) {
        let [frame, period, conversion] = self.least;
        let short = |since: Option<u64>, least| since.is_some_and(|since| cycle - since < least);
        let was_selected = !std::mem::replace(&mut self.select, select);
        let was_high = std::mem::replace(&mut self.clock, clock);
        if !select && !was_selected {
            self.errors.hurried += u32::from(short(self.begun, frame));
            (self.begun, self.rose, self.falls) = (Some(cycle), None, 0);
        }
        if select {
            return;
        }
        if clock && !was_high {
            self.errors.clock += u32::from(short(self.rose, period));
            self.rose = Some(cycle);
        }
        if was_high && !clock {
            self.falls += 1;
            let asks = self.falls * 2 == scanning_adc::BITS;
            self.errors.early += u32::from(asks && short(self.begun, conversion));
        }
    }
}

impl Device for Columns {
    fn read(&mut self, _: Access, _: &mut Bus) -> Result<u32, BusError> {
        Err(BusError)
    }

    fn write(&mut self, _: Access, _: u32, _: &mut Bus) -> Result<(), BusError> {
        Err(BusError)
    }

    fn due(&self) -> u64 {
        let coming = self.coming.front().map(|(cycle, ..)| *cycle);
        let keys = self.columns.iter().flat_map(|own| own.keys.as_ref());
        let all = keys.map(ColumnKeys::due).chain(coming).chain(self.again);
        all.min().unwrap_or(u64::MAX)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        let levels = bus.pins.levels_in(cycle);
        let is = |pin: u32| levels >> pin & 1 != 0;
        let (select, clock) = (is(self.pins.select), is(self.pins.clock));
        let command = is(self.pins.command);
        self.judge(cycle, select, clock);
        for (column, pins) in self.columns.iter_mut().zip(&self.pins.columns) {
            column.advance(cycle, self.is_enabled);
            let clock = column.clocked(clock);
            if column.dac.inputs(select, clock, is(pins.to_dac)) {
                let outputs = column.dac.outputs();
                column.updates.push(ColumnUpdate { cycle, outputs });
            }
            if let Some(put) = column.adc.inputs(select, clock, command, &column.volts) {
                let due = cycle + self.delay - 1;
                self.coming.push_back((due, pins.from_adc, put));
            }
        }
        self.is_enabled = self.pins.enable.is_none_or(is);
        while let Some((_, pin, level)) = self.coming.pop_front_if(|(due, ..)| *due <= cycle) {
            let mask = 1 << pin;
            let level = level.map(|level| if level { mask } else { 0 });
            bus.pins.set_outside(mask, level, cycle + 1);
        }
        self.again = Some(bus.pins.last_change()).filter(|change| *change > cycle);
    }
}

#[cfg(test)]
mod tests;
