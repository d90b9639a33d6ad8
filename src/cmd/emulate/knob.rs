//! A knob's parts on the pins of an emulated chip: sensor, driver and motor, as a board file with
//! `[knob]` and a device file say, and a hand that turns it.
//!
//! ```text
//!   --motion--> hand --spring--> shaft <--motor <-- driver <--pins-- chip
//!                                  '--> sensor --pins--> chip          `--> --out: a row every ten periods
//! ```

use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::firmware::core_block;
use whippen_compiler::model::Moves;
use whippen_compiler::rate::Rate;
use whippen_emulator::elf::Elf;
use whippen_emulator::{DeviceId, Hand, Knob, KnobParts, KnobPins, Machine, MotorParameters};
use whippen_runtime::device::Device;
use whippen_runtime::files::write_whole;
use whippen_runtime::motion::{self, MotionOptions};
use whippen_runtime::trajectory::Trajectory;

use crate::cmd::setup::find_board;
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::hardware::BOARD;

/// The hand's spring (N*m/rad) and damper (N*m*s/rad): a loose grip of two fingers.
const GRIP: [f64; 2] = [0.5, 2e-3];
/// Periods of the carrier between two rows.
const PERIODS: u64 = 10;
/// What the bundled parts are that no file tells: how old the sensor's angle is, when its data
/// follow its clock, and the current at which the driver turns itself off.
const SENSOR_DELAY_S: f64 = 5e-6;
const DATA_DELAY_CYCLES: u64 = 3;
const TRIP_A: f64 = 2.5;

/// What is on the pins.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "A knob on the pins of rp2350")]
pub struct KnobArgs {
    /// Wire a knob's sensor, driver and motor to the pins that the `[knob]` of this board names
    #[arg(long, value_name = "BOARD|FILE.toml", value_hint = ValueHint::FilePath)]
    pub knob: Option<OsString>,
    /// What its motor is: winding, torque constant, what turns [default: gimbal]
    #[arg(long, value_name = "NAME|FILE.toml", requires = "knob", value_hint = ValueHint::FilePath)]
    pub device: Option<OsString>,
    /// Where a hand holds it, once the image has ticks, from where it stands then: a table such as
    /// t_s,angle_deg; its end ends the run
    #[arg(long, value_name = "FILE", requires = "knob", value_hint = ValueHint::FilePath)]
    pub motion: Option<PathBuf>,
    /// A table of the knob over time: angle, the hand's torque and the motor's, a current, whether
    /// the driver is enabled
    #[arg(short, long, value_name = "FILE.csv", requires = "knob", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
}

impl KnobArgs {
    /// The files that are read.
    pub fn files(&self) -> Vec<PathBuf> {
        let board = self.knob.iter().filter_map(|name| BOARD.file(name));
        let device = device::file(self.device.as_deref());
        board.chain(device).chain(self.motion.clone()).collect()
    }

    /// Wires a knob, if one is wanted.
    pub fn connect(&self, machine: &mut Machine, elf: &Elf) -> Result<Option<WiredKnob>, Failure> {
        let Some(name) = &self.knob else {
            return Ok(None);
        };
        if machine.bus.pins.count() == 0 {
            let board = "--knob needs a board with pins: --board rp2350";
            return Err(Failure::Usage(board.into()));
        }
        let wrong = |what: &str| Failure::Usage(format!("--knob {}: {what}", name.display()));
        let board = find_board(Some(name), None)?;
        let knob = board
            .knob
            .ok_or_else(|| wrong("this board has no `[knob]`, which says what its pins lead to"))?;
        let named = self.device.as_deref().unwrap_or(OsStr::new("gimbal"));
        let device = device::named(named).map_err(Failure::Usage)?;
        let motor = motor(&device, knob.pole_pairs)
            .ok_or_else(|| Failure::Usage(unknown_motor(&device)))?;
        let clock_hz = f64::from(machine.board().clock_hz);
        let parts = KnobParts {
            clock_hz,
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
        let row_cycles = PERIODS * u64::from(knob.period_cycles);
        let places = match &self.motion {
            Some(path) => Some(places(path, machine.board().clock_hz, row_cycles)?),
            None => None,
        };
        let mut table = String::new();
        if self.out.is_some() {
            table.push_str("t_s,angle_deg,hand_n_m,torque_n_m,current_a,driven\n");
        }
        Ok(Some(WiredKnob {
            id: Knob::attach(&mut machine.bus, pins, parts),
            clock_hz,
            row_cycles,
            rows: 0,
            ticks: elf
                .symbols
                .named("core0")
                .ok()
                .map(|core| core.address + core_block::TICK),
            began: None,
            places,
            table: self.out.is_some().then_some(table),
        }))
    }

    /// Writes the table, if one is wanted.
    pub fn write(&self, knob: Option<&WiredKnob>) -> Outcome {
        let table = knob.and_then(|knob| knob.table.as_ref());
        let (Some(path), Some(table)) = (&self.out, table) else {
            return Ok(());
        };
        write_whole(path, |w| w.write_all(table.as_bytes()))
            .map_err(|e| Failure::Usage(e.to_string()))
    }
}

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

/// Where the hand is at each row (rad).
fn places(path: &Path, clock_hz: u32, row_cycles: u64) -> Result<Trajectory, Failure> {
    let options = MotionOptions {
        turns: true,
        ..MotionOptions::default()
    };
    // Periods have 17 bits at most.
    let rate = Rate::new(clock_hz, row_cycles as u32)
        .ok_or_else(|| Failure::Defect("a knob without a rate".into()))?;
    let motion = motion::load(path, &options, rate).map_err(|e| Failure::Usage(e.to_string()))?;
    Ok(motion.positions)
}

/// A knob on the pins.
pub struct WiredKnob {
    id: DeviceId,
    clock_hz: f64,
    /// Cycles from row to row.
    row_cycles: u64,
    rows: u64,
    /// Where the image counts its ticks, if it does: while there are none it turns the knob by
    /// itself.
    ticks: Option<u32>,
    /// The row in which the hand took it, and where it was (rad).
    began: Option<(u64, f64)>,
    /// The hand's, if there is one.
    places: Option<Trajectory>,
    /// What is written at the end, if it is wanted.
    table: Option<String>,
}

impl WiredKnob {
    /// The cycle up to which the hand holds still.
    pub fn next(&self) -> u64 {
        (self.rows + 1) * self.row_cycles
    }

    /// Whether the hand has done all that it does.
    pub fn is_over(&self) -> bool {
        let (Some(places), Some((row, _))) = (&self.places, self.began) else {
            return false;
        };
        self.rows - row >= places.ticks() as u64
    }

    /// A row, if it is time for one; then the hand goes on.
    pub fn pass(&mut self, machine: &mut Machine) {
        if machine.cycle(0) < self.next() {
            return;
        }
        let is_ready = self.is_ready(machine);
        let Some(knob) = machine.bus.device_mut::<Knob>(self.id) else {
            return;
        };
        let (angle, driven) = (knob.motor().angle_rad(), knob.is_driven());
        let hand = knob.hand;
        let time_s = self.next() as f64 / self.clock_hz;
        if let Some(table) = &mut self.table {
            let push = hand.stiffness * (hand.place_rad - angle)
                - hand.damping * knob.motor().speed_rad_s();
            let _ = writeln!(
                table,
                "{:.6},{:.4},{push:.6},{:.6},{:.4},{}",
                time_s,
                angle.to_degrees(),
                knob.motor().torque_n_m(),
                knob.motor().phase_currents()[0],
                u8::from(driven),
            );
        }
        if let Some(places) = self.places.as_ref().filter(|_| is_ready) {
            let (row, from) = *self.began.get_or_insert((self.rows, angle));
            if let Some(place) = places.get((self.rows - row) as usize) {
                knob.hand = Hand {
                    torque_n_m: 0.0,
                    stiffness: GRIP[0],
                    damping: GRIP[1],
                    place_rad: from + place,
                };
            }
        }
        self.rows += 1;
    }

    fn is_ready(&self, machine: &Machine) -> bool {
        let Some(ticks) = self.ticks else {
            return true;
        };
        let mut bytes = [0; 4];
        let read = machine.bus.memory.read(ticks, &mut bytes);
        read.is_ok() && bytes != [0; 4]
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
