//! Ports: what the firmware guards of each word that comes in, and of the drive against it.
//!
//! Keys have one port each, and all the same: its numbers are constants of the frame. An instrument
//! that is played once has a table of its ports instead, a row each, which `ports.s` reads.
//!
//! ```text
//!   port_table   T_..   mid-travel, ages, ceiling, rails, shift, moved, drive, rated^2, heat
//! ```

use std::fmt::Write;

use super::constants::{FROZEN_MS, Heat, RAIL_MS};
use super::{FirmwareError, Motor, Setup};

/// What is guarded of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct GuardedPort {
    /// Sensor words between which it is in mid-travel: where a word that does not change may be a
    /// fault.
    pub mid_travel: [u16; 2],
    /// Whether word 0, and word 65535, are beyond what is sensed: then a sensor that stays there
    /// has a fault. So it is with keys.
    pub rails: [bool; 2],
    /// Ticks from an update of the sensor to the next.
    pub update_ticks: u32,
    /// What drives it, if something does. Keys are driven.
    pub drive: Option<GuardedDrive>,
}

/// What drives a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct GuardedDrive {
    /// Which of the drive words it is.
    pub word: u32,
    /// What it stands.
    pub motor: Motor,
}

/// Which frame guards the sensors and drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guards {
    /// Keys, whose ports are alike.
    Keys,
    /// The ports of an instrument that is played once.
    Ports,
}

/// Updates of a sensor after which a word that stays is judged, at least.
const UPDATES: u32 = 4;

impl Setup {
    /// Which frame it asks for.
    pub(super) fn guards(&self) -> Guards {
        match &self.ports[..] {
            [GuardedPort { drive: Some(_), .. }] => Guards::Keys,
            _ => Guards::Ports,
        }
    }

    /// The motor of each key.
    pub(super) fn motor_of_keys(&self) -> Option<Motor> {
        match (self.guards(), &self.ports[..]) {
            (Guards::Keys, [only]) => only.drive.map(|drive| drive.motor),
            _ => None,
        }
    }

    /// Guards of a core that has so many keys.
    pub(super) fn guards_of(&self, keys: u32) -> u32 {
        match self.guards() {
            Guards::Keys => keys,
            Guards::Ports => self.ports.len() as u32,
        }
    }

    /// Words each way of a core that has so many keys.
    pub(super) fn words_of(&self, keys: u32) -> u32 {
        match self.guards() {
            Guards::Keys => keys,
            Guards::Ports => (self.ports.len() as u32).max(1),
        }
    }
}

/// The table of the ports of an instrument that is played once, as assembly.
///
/// # Errors
/// A motor is out of range.
pub(super) fn table_as_assembly(setup: &Setup, distance: u32) -> Result<String, FirmwareError> {
    let mut text = String::from(
        "        .section .rodata.near.core0.ports, \"a\"\n        .balign 4\n        .global port_table\nport_table:\n",
    );
    let turns = setup.ports.len() as u64;
    for (number, port) in (0..).zip(&setup.ports) {
        let (moved, ceiling, heat, at) = match &port.drive {
            Some(GuardedDrive { word, motor }) => (
                motor.newton,
                2 * motor.rated,
                Heat::of(motor, setup.rate_hz, turns)?,
                distance + 2 * word - 2 * number,
            ),
            None => (u16::MAX.into(), 0, Heat::NONE, 0),
        };
        let age = |ms: u64| {
            let least = setup
                .rate_hz
                .ticks_in(ms)
                .max(u64::from(UPDATES * port.update_ticks));
            least.min(0xffff)
        };
        let [low, high] = port.mid_travel;
        let rails = u8::from(port.rails[0]) | u8::from(port.rails[1]) << 1;
        let _ = writeln!(
            text,
            "        .short  {low}, {high}, {}, {}, {ceiling}\n        .byte   {rails}, {}\n        \
             .short  {moved}, {at}\n        .word   {}, {}, 0, 0",
            age(RAIL_MS),
            age(FROZEN_MS),
            heat.shift,
            heat.rated2,
            heat.max
        );
    }
    Ok(text)
}
