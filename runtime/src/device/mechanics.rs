//! What moves: the key or the knob by itself, without any force of the drive.

use whippen_compiler::rate::Rate;
use whippen_compiler::stability::Key;
use whippen_compiler::units::Dim;

use super::Port;
use crate::entries::Entries;
use crate::files::FileError;

/// A key's mechanics, where its position is measured. On what turns, masses are inertias (kg*m^2),
/// forces torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanics {
    /// Effective mass (kg or kg*m^2), above 0.
    pub mass: f64,
    /// Viscous friction (N*s/m or N*m*s/rad).
    pub damping: f64,
    /// Dry friction (N or N*m).
    pub friction: f64,
    /// Stops, if it has any.
    pub stops: Option<FeltStops>,
}

/// Felt at both ends of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeltStops {
    /// Where it is touched going up (m or rad).
    pub low: f64,
    /// Where it is touched going down (m or rad), above `low`.
    pub high: f64,
    /// N/m or N*m/rad.
    pub stiffness: f64,
    /// N*s/m or N*m*s/rad.
    pub damping: f64,
}

impl Mechanics {
    /// Reads the keys of a device file that begin with `part`, such as `mechanics.`.
    pub(super) fn read(entries: &Entries, part: &str, turns: bool) -> Result<Mechanics, FileError> {
        let (position, force) = if turns {
            (Dim::NUMBER, Dim::TORQUE)
        } else {
            (Dim::LENGTH, Dim::FORCE)
        };
        let (mass_key, mass) = if turns {
            ("inertia", Dim::INERTIA)
        } else {
            ("mass", Dim::MASS)
        };
        let (stiffness, damping) = (force.div(position), force.div(position).mul(Dim::TIME));
        let least = |key: &str, dim: Dim, zero: bool| {
            let key = format!("{part}{key}");
            let value = entries.quantity(&key, dim)?;
            let good = value > 0.0 || zero && value == 0.0;
            if good {
                Ok(value)
            } else {
                Err(entries.error(&key, "must be greater than zero"))
            }
        };
        let stop = |end: &str| format!("{part}stop_{end}");
        let stops = || {
            let stops = FeltStops {
                low: entries.quantity(&stop("low"), position)?,
                high: entries.quantity(&stop("high"), position)?,
                stiffness: least("stop_stiffness", stiffness, false)?,
                damping: least("stop_damping", damping, true)?,
            };
            let apart = stops.low < stops.high;
            if apart {
                Ok(stops)
            } else {
                Err(entries.error(&stop("high"), &format!("must lie above `{}`", stop("low"))))
            }
        };
        let has_stops = entries.all().any(|(key, _)| key.starts_with(&stop("")));
        Ok(Mechanics {
            mass: least(mass_key, mass, false)?,
            damping: least("damping", damping, true)?,
            friction: least("friction", force, true)?,
            stops: has_stops.then(stops).transpose()?,
        })
    }
}

impl Port {
    /// The loop around a program at a tick rate, if the device says how what is driven moves. A
    /// sensor that is read less often than there are ticks is taken as late by all of the time
    /// between two readings: so old a reading gets.
    pub fn key(&self, rate_hz: Rate) -> Option<Key> {
        let ticks = |hz: f64| f64::from(rate_hz) / hz;
        let held_ticks = self.sensor.update_hz.map_or(0.0, ticks);
        let held_ticks = if held_ticks > 1.0 { held_ticks } else { 0.0 };
        let Mechanics {
            mass,
            damping,
            friction,
            ..
        } = self.mechanics?;
        Some(Key {
            mass,
            damping,
            friction,
            delay_ticks: self.sensor.delay_samples + held_ticks + self.drive().delay_samples,
            bandwidth_hz: self.drive().bandwidth_hz,
            lag_hz: self.drive().lag_hz(),
            mode: self.drive().mode,
            sensor_lsb: self.widest_step(),
        })
    }
}
