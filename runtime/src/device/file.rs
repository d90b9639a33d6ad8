//! Reading of device files: TOML whose values are strings with units.

use std::path::Path;

use whippen_compiler::units::{Dim, Quantity, parse_quantity, parse_unit};

use super::converter::BITS;
use super::port_file::{port, port_names, several};
use super::{Device, Drive, Heat, Motor, Port, Supply};
use crate::entries::{Entries, Known};
use crate::files::FileError;

/// The keys of a device file, and an example of each.
const KEYS: &[Known] = &[
    ("name", "mikey"),
    ("sensor.bits", "16 bit"),
    ("sensor.low", "-0.5 mm"),
    ("sensor.high", "10.5 mm"),
    ("sensor.delay", "1 sample"),
    ("sensor.rate", "1 kHz"),
    ("sensor.step", "0.055 mm"),
    ("sensor.noise", "1 um"),
    ("sensor.curve", "-0.5 mm: 0.1, 3 mm: 0.6, 10.5 mm: 0.9"),
    ("drive.bits", "16 bit"),
    ("drive.full_scale", "20 N"),
    ("drive.delay", "1 sample"),
    ("drive.bandwidth", "3 kHz"),
    ("drive.amplifier", "40 kHz"),
    ("drive.resistance", "8 Ohm"),
    ("drive.inductance", "1 mH"),
    ("drive.supply", "24 V"),
    ("drive.mode", "3 kHz"),
    ("drive.mode_damping", "0.02"),
    ("port.*.sensor.bits", "16 bit"),
    ("port.*.sensor.low", "-0.5 mm"),
    ("port.*.sensor.high", "10.5 mm"),
    ("port.*.sensor.delay", "1 sample"),
    ("port.*.sensor.rate", "1 kHz"),
    ("port.*.sensor.step", "0.055 mm"),
    ("port.*.sensor.noise", "1 um"),
    (
        "port.*.sensor.curve",
        "-0.5 mm: 0.1, 3 mm: 0.6, 10.5 mm: 0.9",
    ),
    ("port.*.drive.bits", "16 bit"),
    ("port.*.drive.full_scale", "20 N"),
    ("port.*.drive.delay", "1 sample"),
    ("port.*.drive.bandwidth", "3 kHz"),
    ("port.*.drive.amplifier", "40 kHz"),
    ("port.*.drive.resistance", "8 Ohm"),
    ("port.*.drive.inductance", "1 mH"),
    ("port.*.drive.mode", "3 kHz"),
    ("port.*.drive.mode_damping", "0.02"),
    ("port.*.motor.rated", "0.88 N"),
    ("port.*.motor.peak_time", "1 s"),
    ("port.*.mechanics.mass", "45 g"),
    ("port.*.mechanics.inertia", "15e-6 kg*m^2"),
    ("port.*.mechanics.damping", "0.2 N*s/m"),
    ("port.*.mechanics.friction", "30 mN"),
    ("port.*.mechanics.stop_low", "0 mm"),
    ("port.*.mechanics.stop_high", "10 mm"),
    ("port.*.mechanics.stop_stiffness", "20 kN/m"),
    ("port.*.mechanics.stop_damping", "20 N*s/m"),
    ("mechanics.mass", "60 g"),
    ("mechanics.inertia", "15e-6 kg*m^2"),
    ("mechanics.damping", "0.2 N*s/m"),
    ("mechanics.friction", "30 mN"),
    ("mechanics.stop_low", "0 mm"),
    ("mechanics.stop_high", "10 mm"),
    ("mechanics.stop_stiffness", "20 kN/m"),
    ("mechanics.stop_damping", "20 N*s/m"),
    ("motor.torque_constant", "0.007 N*m/A"),
    ("motor.arm", "30 mm"),
    ("motor.rated", "0.5 A"),
    ("motor.peak", "2 A"),
    ("motor.peak_time", "100 ms"),
    ("motor.rise", "60 K"),
    ("motor.heat_time", "30 s"),
    ("passivity.energy", "20 mJ"),
];

/// So far (parts) a full scale may be from what the arm says: its numbers are rounded.
const ARM_WITHIN: f64 = 0.02;

/// Reads the text of a device file.
pub fn read(path: &Path, text: &str) -> Result<Device, FileError> {
    let entries = Entries::parse(path, text, KEYS)?;
    let name = entries.text("name")?.to_string();
    let names = port_names(&entries);
    if !names.is_empty() {
        return several(&entries, name, &names);
    }
    let mut port = port(&entries, "", "")?;
    let has = |part: &str| entries.all().any(|(key, _)| key.starts_with(part));
    let motor = has("motor.").then(|| motor(&entries, &port)).transpose()?;
    if let Some(drive) = &mut port.drive {
        drive.supply = supply(&entries, drive, motor.as_ref())?;
    }
    let passivity_j = entries
        .find("passivity.energy")
        .map(|_| entries.quantity("passivity.energy", Dim::TORQUE));
    let passivity_j = passivity_j.transpose()?;
    if passivity_j.is_some_and(|energy| energy <= 0.0) {
        return Err(entries.error("passivity.energy", "must be greater than zero"));
    }
    Ok(Device {
        name,
        ports: vec![port],
        motor,
        passivity_j,
    })
}

fn motor(entries: &Entries, port: &Port) -> Result<Motor, FileError> {
    let positive = |key: &str, dim: Dim| {
        let value = entries.quantity(key, dim)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(entries.error(key, "must be greater than zero"))
        }
    };
    let motor = Motor {
        torque_constant: positive("motor.torque_constant", Dim::TORQUE.div(Dim::CURRENT))?,
        rated_a: positive("motor.rated", Dim::CURRENT)?,
        peak_a: positive("motor.peak", Dim::CURRENT)?,
        peak_s: positive("motor.peak_time", Dim::TIME)?,
        heat: match (entries.find("motor.rise"), entries.find("motor.heat_time")) {
            (None, None) => None,
            _ => Some(Heat {
                rise_k: entries.kelvins("motor.rise")?,
                time_s: positive("motor.heat_time", Dim::TIME)?,
            }),
        },
    };
    if motor.rated_a >= motor.peak_a {
        return Err(entries.error("motor.peak", "must be above `motor.rated`"));
    }
    check_arm(entries, &motor, port)?;
    Ok(motor)
}

/// What drives a current through the winding, if the file says so: the motor's currents and the
/// winding say what that comes to.
fn supply(
    entries: &Entries,
    drive: &Drive,
    motor: Option<&Motor>,
) -> Result<Option<Supply>, FileError> {
    const KEY: &str = "drive.supply";
    if entries.find(KEY).is_none() {
        return Ok(None);
    }
    let volts = entries.measure(KEY, &[("mV", 1e-3), ("V", 1.0)])?;
    let (Some(winding), Some(motor)) = (drive.winding, motor) else {
        let why = "needs `drive.resistance`, `drive.inductance` and `[motor]`, which says the current of a force";
        return Err(entries.error(KEY, why));
    };
    let most_a = volts / winding.resistance_ohm;
    if most_a < motor.peak_a {
        let why = format!(
            "drives {most_a:.3} A through `drive.resistance`, less than `motor.peak`, the current of the largest word"
        );
        return Err(entries.error(KEY, &why));
    }
    Ok(Some(Supply {
        volts,
        amperes_per_force: motor.peak_a / drive.full_scale,
        rated_a: motor.rated_a,
        heat: motor.heat,
    }))
}

/// Where the arm from the motor's axis to the finger is told, full scale must be what the peak
/// current makes of it.
fn check_arm(entries: &Entries, motor: &Motor, port: &Port) -> Result<(), FileError> {
    const KEY: &str = "motor.arm";
    if entries.find(KEY).is_none() {
        return Ok(());
    }
    if port.turns() {
        return Err(entries.error(KEY, "is of a key; what turns has a torque"));
    }
    let arm_m = entries.quantity(KEY, Dim::LENGTH)?;
    let force_n = motor.torque_constant * motor.peak_a / arm_m;
    let stated_n = port.drive().full_scale;
    if (force_n / stated_n - 1.0).abs() <= ARM_WITHIN {
        return Ok(());
    }
    let why = format!(
        "and the torque of the peak current make {force_n:.3} N, but `drive.full_scale` is {stated_n} N"
    );
    Err(entries.error(KEY, &why))
}

impl Entries<'_> {
    /// Whether a value is written as an angle.
    pub(super) fn is_angle(&self, key: &str) -> bool {
        let unit = self.find(key).and_then(|text| text.trim().rsplit_once(' '));
        unit.is_some_and(|(_, unit)| parse_unit(unit).is_some_and(|u| u.dim.is_number()))
    }

    /// The dimension of a value, if it is a quantity.
    pub(super) fn kind(&self, key: &str) -> Option<Dim> {
        match parse_quantity(self.find(key)?) {
            Ok(Quantity::Real { dim, .. }) => Some(dim),
            _ => None,
        }
    }

    /// A value of the given dimension, in SI.
    pub(super) fn quantity(&self, key: &str, dim: Dim) -> Result<f64, FileError> {
        let text = self.text(key)?;
        match parse_quantity(text) {
            Ok(Quantity::Real { value, dim: found }) if found == dim => Ok(value),
            Ok(_) => {
                let (kind, unit) = match dim {
                    Dim::NUMBER => ("an angle".to_string(), "rad".to_string()),
                    other => (
                        format!("a {}", other.name().unwrap_or("quantity")),
                        other.unit(),
                    ),
                };
                Err(self.error(
                    key,
                    &format!("is `{text}`, but must be {kind} (a number of `{unit}`)"),
                ))
            }
            Err(e) => Err(self.error(key, &format!("is not a quantity: {e}"))),
        }
    }

    /// A delay in samples of the keyboard's rate: a measure only devices have.
    pub(super) fn samples(&self, key: &str) -> Result<f64, FileError> {
        let text = self.text(key)?;
        let number = text
            .strip_suffix("samples")
            .or_else(|| text.strip_suffix("sample"));
        let samples = number
            .and_then(|n| n.trim().parse().ok())
            .filter(|n: &f64| n.is_finite() && *n >= 0.0);
        samples.ok_or_else(|| {
            self.error(
                key,
                &format!("is `{text}`, but must be a delay such as `1 sample`"),
            )
        })
    }

    /// A difference of temperatures: a measure only devices have.
    fn kelvins(&self, key: &str) -> Result<f64, FileError> {
        let text = self.text(key)?;
        let kelvins = text
            .strip_suffix('K')
            .and_then(|n| n.trim().parse().ok())
            .filter(|k: &f64| k.is_finite() && *k > 0.0);
        kelvins.ok_or_else(|| {
            self.error(
                key,
                &format!("is `{text}`, but must be a rise such as `60 K`"),
            )
        })
    }

    /// The bits of a converter.
    pub(super) fn bits(&self, key: &str) -> Result<u32, FileError> {
        let text = self.text(key)?;
        let number = text
            .strip_suffix("bits")
            .or_else(|| text.strip_suffix("bit"));
        let bits = number.and_then(|n| n.trim().parse().ok());
        bits.filter(|bits| (BITS[0]..=BITS[1]).contains(bits))
            .ok_or_else(|| {
                let [least, most] = BITS;
                let what = format!(
                    "is `{text}`, but a converter has `{least} bit` to `{most} bit`, as many as words"
                );
                self.error(key, &what)
            })
    }

    /// A number above zero with one of a few units, or with none: measures only devices have.
    pub(super) fn measure(&self, key: &str, units: &[(&str, f64)]) -> Result<f64, FileError> {
        let text = self.text(key)?;
        let with = |(unit, factor): &(&str, f64)| {
            let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
            Some(number * factor)
        };
        let value = units.iter().find_map(with);
        value.filter(|v| *v > 0.0 && v.is_finite()).ok_or_else(|| {
            let unit = units.last().map_or("", |unit| unit.0);
            let unit = match unit {
                "" => "without a unit".to_string(),
                unit => format!("of `{unit}`"),
            };
            self.error(
                key,
                &format!("is `{text}`, but must be a number above zero {unit}"),
            )
        })
    }
}

#[cfg(test)]
mod tests;
