//! Why there is no firmware for a setup, in words.

use std::fmt;

use whippen_arm::asm::AsmError;
use whippen_rate::Rate;

use super::constants::{PROGRAMS_MAX, RECORD_MAX};
use super::{Motor, Passivity};

/// Why there is no firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FirmwareError {
    /// So many keys on a core, not 1 to 255.
    Keys(u32),
    /// Keys are given for so many cores, and the board has another number of them.
    Cores(usize, usize),
    /// A program's zones have so many keys, and the cores so many.
    Parts(u32, u32),
    /// A record of so many bytes, more than the frame can reach.
    Record(u32),
    /// So many programs, not 1 to 64.
    Programs(usize),
    /// The board's core is one for which the limit of energy is not made.
    PassivityCore,
    /// Credit, past or damping of the passivity are out of range.
    Passivity(Passivity),
    /// The motor's rated word is not between 1 and 32767, or it stands its peak for less than 1 ms
    /// or more than 10 s.
    Motor(Motor),
    /// The board samples a knob or keys, and the tick has another period: the board's cycles, and
    /// the rate.
    Period(u32, Rate),
    /// So many keys are wanted, and the board has so many knobs.
    Knobs(u32, u32),
    /// So many keys are wanted, and the board's bench has so many.
    BenchKeys(u32, u32),
    /// So many keys are wanted, and the board's columns have so many.
    ColumnsKeys(u32, u32),
    /// Core 0 has so many keys, which are no whole columns.
    ColumnsDivided(u32),
    /// The board has keys on its pins, and the instrument is none of a key.
    BenchPorts,
    /// The board makes voltages, and the device does not say what its coil is.
    NoCoil,
    /// The board's knob and the motor do not go together: what is out of range.
    Coil(&'static str),
    /// Sensors cannot be tuned so, in words.
    Tuning(String),
    /// The monitor shall have so many bits per second, which the serial port of the board has not:
    /// its most.
    Baud(u32, u32),
    /// Safety is wanted for a program of somebody else's, of an instrument that is none of a key.
    SafetyPorts,
    /// A board's text is no assembly.
    Assembly(AsmError),
}

impl fmt::Display for FirmwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareError::Keys(keys) => {
                write!(f, "{keys} keys on a core; the firmware takes 1 to 255")
            }
            FirmwareError::Cores(given, has) => write!(
                f,
                "keys are given for {given} cores, and the board has {has}"
            ),
            FirmwareError::Parts(zones, keys) => f.write_str(&other_keys(*zones, *keys)),
            FirmwareError::Record(bytes) => write!(
                f,
                "a key's record takes {bytes} bytes; the firmware takes at most {RECORD_MAX}"
            ),
            FirmwareError::SafetyPorts => f.write_str(
                "--safety guards keys, with a sensor and a motor each, and this instrument has \
                 other ports: only an image guards those",
            ),
            FirmwareError::Programs(count) => write!(
                f,
                "{count} programs; the firmware takes 1 to {PROGRAMS_MAX}"
            ),
            FirmwareError::Motor(motor) => write!(
                f,
                "[motor]: value out of range (rated current {} of 1..32767, where the peak is \
                 32768; peak time {} of 1..10000 ms)",
                motor.rated, motor.peak_ms
            ),
            FirmwareError::Passivity(passivity) => write!(
                f,
                "[passivity]: value out of range (energy {} of 2^18..2^30 units, delay {} of \
                 1..16 ticks, damping {} of 0..8191/256)",
                passivity.credit, passivity.past, passivity.damping
            ),
            FirmwareError::PassivityCore => f.write_str(
                "[passivity] needs a Cortex-M4 or Cortex-M33: take another board, or remove \
                 [passivity] from the device",
            ),
            FirmwareError::Period(..)
            | FirmwareError::Knobs(..)
            | FirmwareError::BenchKeys(..)
            | FirmwareError::ColumnsKeys(..)
            | FirmwareError::ColumnsDivided(_)
            | FirmwareError::BenchPorts
            | FirmwareError::NoCoil
            | FirmwareError::Coil(_) => self.tell_of_parts(f),
            FirmwareError::Baud(baud, most) => f.write_str(&no_baud(*baud, *most)),
            FirmwareError::Tuning(why) => f.write_str(why),
            FirmwareError::Assembly(error) => error.fmt(f),
        }
    }
}

impl FirmwareError {
    /// What does not go together with the parts on a board's pins.
    fn tell_of_parts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Period(cycles, rate) => write!(
                f,
                "the board samples every {cycles} cycles, and the program has {rate} \
                 ticks a second: give it `--tick-rate 150MHz/{cycles}`, or `rate 150 MHz / \
                 {cycles}` in its keyboard"
            ),
            Self::Knobs(keys, 1) => write!(
                f,
                "{keys} keys on a board with one knob: give it `--keys 1`"
            ),
            Self::Knobs(keys, has) => write!(
                f,
                "{keys} keys on a board with {has} knobs, all of which are driven: give it `--keys \
                 {has}`"
            ),
            Self::BenchKeys(wanted, has) => write!(
                f,
                "{wanted} keys on a board whose [bench] has pins for {has}: give it `--keys {has}` \
                 or fewer"
            ),
            Self::ColumnsKeys(wanted, has) => write!(
                f,
                "{wanted} keys on a board whose [columns] have pins for {has}: give it `--keys {has}` \
                 or fewer"
            ),
            Self::ColumnsDivided(keys) => write!(
                f,
                "core 0 has {keys} keys, and each core has whole columns of eight"
            ),
            Self::BenchPorts => f.write_str(
                "the board has keys on its pins, and the instrument has other ports than a key: \
                 take another board",
            ),
            Self::NoCoil => f.write_str(
                "the board makes voltages, and the device does not say what they do: add \
                 `drive.resistance`, `drive.inductance` and [motor] to its file, or take \
                 `--device gimbal` for a knob, `--device voice_coil` for keys",
            ),
            Self::Coil(what) => write!(f, "the motor does not suit the board: {what}"),
            _ => Ok(()),
        }
    }
}

/// What is said of zones that have other keys than the keyboard.
fn other_keys(zones: u32, keys: u32) -> String {
    format!("the zones of a program have {zones} keys and the keyboard {keys}: give it that many")
}

/// What is said of a rate that the serial port has not.
fn no_baud(baud: u32, most: u32) -> String {
    format!("the board's serial port has no rate near {baud} baud: at most {most}")
}

impl std::error::Error for FirmwareError {}

impl From<AsmError> for FirmwareError {
    fn from(error: AsmError) -> Self {
        FirmwareError::Assembly(error)
    }
}
