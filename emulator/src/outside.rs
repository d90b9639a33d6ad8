//! What is outside of a chip, on its pins: models of parts, wired to each other and to pins.
//!
//! ```text
//!   chip --select, clock--> angle sensor --data--> chip
//!                              | shaft
//!   chip --3 PWM, enable--> driver --terminals--> motor <-- hand
//!                              '--fault--> chip
//! ```
//!
//! Keys of a bench are in `keys`, columns of converters in `columns`, what hears sound in `dac`,
//! the flash chip in `flash`. All see a change of a pin in the cycle from which on it holds, and
//! answer a cycle later at the earliest. Not here: whole keyboards, whose converters are on no chip
//! (`device::converter`).

mod angle_sensor;
mod column_keys;
mod columns;
mod dac;
mod flash;
mod keys;
mod motor;
mod octal_dac;
mod scanning_adc;

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices, Waits};

use angle_sensor::AngleSensor;
pub use angle_sensor::SensorFault;
pub use column_keys::{ColumnKeyParts, ColumnKeys};
pub use columns::{
    Column, ColumnErrors, ColumnParts, ColumnPins, ColumnUpdate, Columns, ColumnsPins, ScanFault,
};
pub use dac::{DacErrors, DacPins, HeardFrame, SoundDac};
pub(crate) use flash::FlashChip;
pub use keys::{BenchKey, BenchPins, Finger, KeyBench, KeyParts, KeyPins};
pub use motor::{Hand, Motor, MotorParameters};

/// Which pins lead where.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KnobPins {
    /// To the sensor's select, low where it is read.
    pub select: u32,
    /// To its clock.
    pub clock: u32,
    /// From its data.
    pub data: u32,
    /// To the driver's three inputs.
    pub phases: [u32; 3],
    /// To its enable.
    pub enable: u32,
    /// From its fault, low where there is one; somebody must pull it up.
    pub fault: u32,
}

/// The parts of a knob.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KnobParts {
    /// Cycles of the chip a second.
    pub clock_hz: f64,
    /// The driver's supply (V).
    pub supply_v: f64,
    /// The current of a phase at which the driver turns itself off (A).
    pub trip_a: f64,
    /// How old the sensor's angle is when it is selected (s).
    pub sensor_delay_s: f64,
    /// Cycles from its clock's edge to its data.
    pub data_delay_cycles: u64,
    /// The motor.
    pub motor: MotorParameters,
    /// Where it stands at first (rad).
    pub angle_rad: f64,
}

/// Steps of a turn that the sensor tells.
const STEPS: u32 = 1 << 14;
/// The longest step of the shaft (s).
const STEP_S: f64 = 4e-6;

/// A knob's parts at work.
pub struct Knob {
    /// What holds it.
    pub hand: Hand,
    parts: KnobParts,
    pins: KnobPins,
    motor: Motor,
    sensor: AngleSensor,
    /// Whether the driver has turned itself off, which it remembers.
    tripped: bool,
    levels: u64,
    /// Up to which cycle everything has been.
    now: u64,
    /// Angles that the sensor may still tell, and since when: the newest last.
    angles: VecDeque<(u64, u16)>,
    /// What the sensor puts on its pin, and when.
    coming: Option<(u64, Option<bool>)>,
    /// Whether the fault pin is held low.
    shows_fault: bool,
}

impl Knob {
    /// Wires a knob to a chip's pins.
    pub fn attach(bus: &mut Bus, pins: KnobPins, parts: KnobParts) -> DeviceId {
        let knob = Self {
            hand: Hand::default(),
            parts,
            pins,
            motor: Motor::new(parts.motor, parts.angle_rad),
            sensor: AngleSensor::default(),
            tripped: false,
            levels: bus.pins.levels(),
            now: 0,
            angles: VecDeque::new(),
            coming: None,
            shows_fault: false,
        };
        let id = bus.attach(0, 0, Waits::default(), Box::new(knob));
        let pins = true;
        bus.watch(
            id,
            Notices {
                pins,
                requests: false,
            },
        );
        id
    }

    /// The motor.
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// Whether the driver drives.
    pub fn is_driven(&self) -> bool {
        !self.tripped && self.level(self.pins.enable)
    }

    /// From now on the sensor has this.
    pub fn set_sensor_fault(&mut self, fault: SensorFault) {
        self.sensor.fault = fault;
    }

    /// The driver gets too warm, and turns itself off; or is as it was.
    pub fn set_tripped(&mut self, tripped: bool) {
        self.tripped = tripped;
    }

    fn level(&self, pin: u32) -> bool {
        self.levels >> pin & 1 != 0
    }

    /// The terminals under the levels so far.
    fn terminals(&self) -> Option<[f64; 3]> {
        let volts = |pin| {
            if self.level(pin) {
                self.parts.supply_v
            } else {
                0.0
            }
        };
        self.is_driven().then(|| self.pins.phases.map(volts))
    }

    /// Shaft and currents go on to a cycle.
    fn advance(&mut self, cycle: u64) {
        let seconds = (cycle.saturating_sub(self.now)) as f64 / self.parts.clock_hz;
        if seconds == 0.0 {
            return;
        }
        let terminals = self.terminals();
        self.motor.pass(terminals, &self.hand, seconds);
        self.now = cycle;
        let currents = self.motor.phase_currents();
        self.tripped |= currents.iter().any(|a| a.abs() > self.parts.trip_a);
        self.angles
            .push_back((cycle, self.motor.steps(STEPS) as u16));
        let late = (self.parts.sensor_delay_s * self.parts.clock_hz) as u64;
        while self.angles.len() > 1 && self.angles[1].0 + late <= cycle {
            self.angles.pop_front();
        }
    }

    /// The angle that the sensor tells.
    fn sensed(&self) -> u16 {
        let oldest = self.angles.front();
        oldest.map_or(self.motor.steps(STEPS) as u16, |(_, steps)| *steps)
    }

    fn drive(pin: u32, level: Option<bool>, cycle: u64, bus: &mut Bus) {
        let mask = 1 << pin;
        let level = level.map(|level| if level { mask } else { 0 });
        bus.pins.set_outside(mask, level, cycle);
    }
}

impl Device for Knob {
    fn read(&mut self, _: Access, _: &mut Bus) -> Result<u32, BusError> {
        Err(BusError)
    }

    fn write(&mut self, _: Access, _: u32, _: &mut Bus) -> Result<(), BusError> {
        Err(BusError)
    }

    fn due(&self) -> u64 {
        let step = (STEP_S * self.parts.clock_hz) as u64;
        let coming = self.coming.map_or(u64::MAX, |(cycle, _)| cycle);
        coming.min(self.now + step.max(1))
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.advance(cycle);
        self.levels = bus.pins.levels();
        if let Some((_, level)) = self.coming.take_if(|(due, _)| *due <= cycle) {
            Self::drive(self.pins.data, level, cycle + 1, bus);
        }
        let (select, clock) = (self.level(self.pins.select), self.level(self.pins.clock));
        if let Some(level) = self.sensor.inputs(select, clock, self.sensed()) {
            self.coming = Some((cycle + self.parts.data_delay_cycles, level));
        }
        if self.shows_fault != self.tripped {
            self.shows_fault = self.tripped;
            let low = self.tripped.then_some(false);
            Self::drive(self.pins.fault, low, cycle + 1, bus);
        }
    }
}

#[cfg(test)]
mod tests;
