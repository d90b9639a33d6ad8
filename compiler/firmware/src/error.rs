//! Why there is no firmware for a setup, in words.

use std::fmt;

use whippen_arm::asm::AsmError;

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
            FirmwareError::Parts(zones, keys) => write!(
                f,
                "the zones of a program have {zones} keys and the keyboard {keys}: \
                 give it that many"
            ),
            FirmwareError::Record(bytes) => write!(
                f,
                "a key's record takes {bytes} bytes; the firmware takes at most {RECORD_MAX}"
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
            FirmwareError::Assembly(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FirmwareError {}

impl From<AsmError> for FirmwareError {
    fn from(error: AsmError) -> Self {
        FirmwareError::Assembly(error)
    }
}
