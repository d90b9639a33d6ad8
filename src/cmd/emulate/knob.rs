//! A knob's parts on the pins of an emulated chip: sensor, driver and motor, as a board file with
//! `[knob]` and a device file say, and a hand that turns it.
//!
//! ```text
//!   --motion--> hand --spring--> shaft <--motor <-- driver <--pins-- chip
//!                                  '--> sensor --pins--> chip          `--> --out: a row every ten periods
//! ```

use std::ffi::OsStr;
use std::fmt::Write;

use whippen_compiler::board::Knob as Pins;
use whippen_compiler::model::Moves;
use whippen_emulator::elf::Elf;
use whippen_emulator::{DeviceId, Hand, Knob, KnobParts, KnobPins, Machine, MotorParameters};
use whippen_runtime::device::Device;

use super::outside::PartArgs;
use super::rows::Rows;
use crate::device;
use crate::exit::Failure;

/// The hand's spring (N*m/rad) and damper (N*m*s/rad): a loose grip of two fingers.
const GRIP: [f64; 2] = [0.5, 2e-3];
/// What the bundled parts are that no file tells: how old the sensor's angle is, when its data
/// follow its clock, and the current at which the driver turns itself off.
const SENSOR_DELAY_S: f64 = 5e-6;
const DATA_DELAY_CYCLES: u64 = 3;
const TRIP_A: f64 = 2.5;

fn unknown_motor(device: &Device) -> String {
    format!(
        "the device `{}` does not say what a knob's motor is: it turns, and has `[motor]`, `[mechanics]`, \
         `drive.resistance` and `drive.inductance`",
        device.name
    )
}

/// The motor of a device that says all of it; the magnet's place and a reversed wiring are what the
/// firmware finds at its start.
fn motor(device: &Device, pole_pairs: u32) -> Option<MotorParameters> {
    let [port] = &device.ports[..] else {
        return None;
    };
    let mechanics = port.mechanics?;
    let winding = port.drive.as_ref()?.winding?;
    let torque_constant = device.motor?.torque_constant;
    let is_knob = port.moves == Moves::Turns;
    is_knob.then_some(MotorParameters {
        resistance_ohm: winding.resistance_ohm,
        inductance_h: winding.inductance_h,
        flux_v_s: torque_constant / (1.5 * f64::from(pole_pairs)),
        pole_pairs,
        inertia_kg_m2: mechanics.mass,
        damping_n_m_s: mechanics.damping,
        friction_n_m: mechanics.friction,
        cogging_n_m: 0.0,
        cogging_per_turn: 12 * pole_pairs,
        offset_rad: 2.0,
        reversed: false,
    })
}

/// A knob on the pins.
pub struct WiredKnob {
    id: DeviceId,
    /// The rows of its table, and of the hand.
    pub rows: Rows,
    /// Where it stood when the hand took it (rad).
    from: f64,
    /// What is written at the end, if it is wanted.
    table: Option<String>,
}

impl WiredKnob {
    /// Wires it.
    ///
    /// # Errors
    /// The device says no motor of a knob, or the motion no motion.
    pub fn connect(
        args: &PartArgs,
        machine: &mut Machine,
        elf: &Elf,
        knob: &Pins,
    ) -> Result<WiredKnob, Failure> {
        let named = args.device.as_deref().unwrap_or(OsStr::new("gimbal"));
        let device = device::named(named).map_err(Failure::Usage)?;
        let motor = motor(&device, knob.pole_pairs)
            .ok_or_else(|| Failure::Usage(unknown_motor(&device)))?;
        let parts = KnobParts {
            clock_hz: f64::from(machine.board().clock_hz),
            supply_v: f64::from(knob.supply_mv) / 1e3,
            trip_a: TRIP_A,
            sensor_delay_s: SENSOR_DELAY_S,
            data_delay_cycles: DATA_DELAY_CYCLES,
            motor,
            angle_rad: 0.0,
        };
        let pins = KnobPins {
            select: knob.select,
            clock: knob.clock,
            data: knob.data,
            phases: knob.phases,
            enable: knob.enable,
            fault: knob.fault,
        };
        let motion = args.motion.as_deref().map(|path| (path, true));
        let rows = Rows::new(machine, elf, knob.period_cycles, motion)?;
        let table = args
            .out
            .is_some()
            .then(|| "t_s,angle_deg,hand_n_m,torque_n_m,current_a,driven\n".to_string());
        Ok(WiredKnob {
            id: Knob::attach(&mut machine.bus, pins, parts),
            rows,
            from: 0.0,
            table,
        })
    }

    /// A row; then the hand goes on.
    pub fn pass(&mut self, machine: &mut Machine) {
        let moves = self.rows.hand(machine);
        let Some(knob) = machine.bus.device_mut::<Knob>(self.id) else {
            return;
        };
        let (angle, driven) = (knob.motor().angle_rad(), knob.is_driven());
        let hand = knob.hand;
        if let Some(table) = &mut self.table {
            let push = hand.stiffness * (hand.place_rad - angle)
                - hand.damping * knob.motor().speed_rad_s();
            let _ = writeln!(
                table,
                "{:.6},{:.4},{push:.6},{:.6},{:.4},{}",
                self.rows.time_s(),
                angle.to_degrees(),
                knob.motor().torque_n_m(),
                knob.motor().phase_currents()[0],
                u8::from(driven),
            );
        }
        if let Some((place, comes)) = moves {
            if comes {
                self.from = angle;
            }
            knob.hand = Hand {
                torque_n_m: 0.0,
                stiffness: GRIP[0],
                damping: GRIP[1],
                place_rad: self.from + place,
            };
        }
        self.rows.pass();
    }

    /// The table, if it is wanted.
    pub fn table(&self) -> Option<&str> {
        self.table.as_deref()
    }

    /// In words: how it stands.
    pub fn told(&self, machine: &Machine) -> String {
        let Some(knob) = machine.bus.device::<Knob>(self.id) else {
            return String::new();
        };
        let driven = match knob.is_driven() {
            true => "driven",
            false => "not driven",
        };
        let degrees = knob.motor().angle_rad().to_degrees();
        format!("{degrees:.2} degrees from its start, {driven}")
    }
}
