//! The parts of knobs on the pins of an emulated chip: sensors, drivers and motors, as a board file
//! with `[knob]` and a device file say, and hands that turn them, all alike.
//!
//! ```text
//!   --motion--> hand --spring--> shaft <--motor <-- driver <--pins-- chip
//!                                  '--> sensor --pins--> chip          `--> --out: a row every ten periods
//! ```

use std::ffi::OsStr;
use std::fmt::Write;

use whippen_compiler::board::{Knob as Pins, Shaft};
use whippen_compiler::model::Moves;
use whippen_emulator::elf::Elf;
use whippen_emulator::{DeviceId, Hand, Knob, KnobParts, Machine, MotorParameters};
use whippen_runtime::board::knob_pins;
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

/// Knobs on the pins.
pub struct WiredKnob {
    /// Each, and where it stood when its hand took it (rad).
    knobs: Vec<(DeviceId, f64)>,
    /// The rows of its table, and of the hand.
    pub rows: Rows,
    /// What is written at the end, if it is wanted.
    table: Option<String>,
}

impl WiredKnob {
    /// Wires them.
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
        let mut attach = |own: &Shaft| {
            let pins = knob_pins(knob, own);
            (Knob::attach(&mut machine.bus, pins, parts), 0.0)
        };
        let knobs = knob.shafts.iter().map(&mut attach).collect();
        let motion = args.motion.as_deref().map(|path| (path, true));
        let rows = Rows::new(machine, elf, knob.period_cycles, motion)?;
        let table = args.out.is_some().then(|| titles(knob.shafts.len()));
        Ok(WiredKnob { knobs, rows, table })
    }

    /// A row; then the hands go on.
    pub fn pass(&mut self, machine: &mut Machine) {
        let moves = self.rows.hand(machine);
        let mut row = format!("{:.6}", self.rows.time_s());
        for (id, from) in &mut self.knobs {
            let Some(knob) = machine.bus.device_mut::<Knob>(*id) else {
                return;
            };
            let (angle, hand) = (knob.motor().angle_rad(), knob.hand);
            let push = hand.stiffness * (hand.place_rad - angle)
                - hand.damping * knob.motor().speed_rad_s();
            let _ = write!(
                row,
                ",{:.4},{push:.6},{:.6},{:.4},{}",
                angle.to_degrees(),
                knob.motor().torque_n_m(),
                knob.motor().phase_currents()[0],
                u8::from(knob.is_driven()),
            );
            if let Some((place, comes)) = moves {
                if comes {
                    *from = angle;
                }
                knob.hand = Hand {
                    torque_n_m: 0.0,
                    stiffness: GRIP[0],
                    damping: GRIP[1],
                    place_rad: *from + place,
                };
            }
        }
        if let Some(table) = &mut self.table {
            let _ = writeln!(table, "{row}");
        }
        self.rows.pass();
    }

    /// The table, if it is wanted.
    pub fn table(&self) -> Option<&str> {
        self.table.as_deref()
    }

    /// In words: how they stand.
    pub fn told(&self, machine: &Machine) -> String {
        let one = |(id, _): &(DeviceId, f64)| {
            let knob = machine.bus.device::<Knob>(*id)?;
            let driven = match knob.is_driven() {
                true => "driven",
                false => "not driven",
            };
            let degrees = knob.motor().angle_rad().to_degrees();
            Some(format!("{degrees:.2} degrees from its start, {driven}"))
        };
        let all: Vec<String> = self.knobs.iter().filter_map(one).collect();
        all.join("; ")
    }
}

/// The titles of a table of so many knobs; those of the second one end in `_2`.
fn titles(knobs: usize) -> String {
    let mut titles = "t_s".to_string();
    for number in 1..=knobs {
        let end = match number {
            1 => String::new(),
            _ => format!("_{number}"),
        };
        for what in ["angle_deg", "hand_n_m", "torque_n_m", "current_a", "driven"] {
            let _ = write!(titles, ",{what}{end}");
        }
    }
    titles + "\n"
}
