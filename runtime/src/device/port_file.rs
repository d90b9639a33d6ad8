//! Reading of ports: the `sensor` and the `drive` of a device, or of each `port.NAME` in it.

use whippen_compiler::model::Moves;
use whippen_compiler::stability::Resonance;
use whippen_compiler::units::{Dim, Quantity, parse_quantity};

use super::converter::ReadingCurve;
use super::{Device, Drive, Mechanics, Port, Sensor, Stands, Winding};
use crate::entries::Entries;
use crate::files::FileError;

/// Parts of a device with a single port alone.
const OF_ONE: &[&str] = &["sensor.", "drive.", "mechanics.", "motor.", "passivity."];

/// The names behind `port.`, each once, in the order of the file.
pub(super) fn port_names(entries: &Entries) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (key, _) in entries.all() {
        let name = key
            .strip_prefix("port.")
            .and_then(|rest| rest.split('.').next());
        if let Some(name) = name.filter(|name| names.iter().all(|known| known != name)) {
            names.push(name.to_string());
        }
    }
    names
}

/// A device with named ports.
pub(super) fn several(
    entries: &Entries,
    name: String,
    names: &[String],
) -> Result<Device, FileError> {
    let of_one = |key: &str| OF_ONE.iter().any(|part| key.starts_with(part));
    if let Some((key, _)) = entries.all().find(|(key, _)| of_one(key)) {
        return Err(entries.error(
            key,
            "belongs to a device with a single port, without `port`",
        ));
    }
    let all = names
        .iter()
        .map(|port_name| port(entries, &format!("port.{port_name}."), port_name));
    Ok(Device {
        name,
        ports: all.collect::<Result<_, _>>()?,
        motor: None,
        passivity_j: None,
    })
}

/// The port whose keys begin with a prefix. What it measures says how it moves, and so what drives
/// it.
pub(super) fn port(entries: &Entries, prefix: &str, name: &str) -> Result<Port, FileError> {
    let key = |key: &str| format!("{prefix}{key}");
    let low = key("sensor.low");
    let (dim, moves) = match entries.kind(&low) {
        _ if entries.is_angle(&low) => (Dim::NUMBER, Moves::Turns),
        Some(dim) if dim != Dim::LENGTH && !name.is_empty() => (dim, Moves::Not),
        _ => (Dim::LENGTH, Moves::Slides),
    };
    let sensor = sensor(entries, prefix, dim)?;
    let has_drive = name.is_empty()
        || entries
            .all()
            .any(|(found, _)| found.starts_with(&key("drive.")));
    let drive = has_drive
        .then(|| drive(entries, prefix, moves))
        .transpose()?;
    let mechanics = mechanics(entries, prefix, drive.is_some(), moves)?;
    Ok(Port {
        name: name.to_string(),
        dim,
        moves,
        curve: curve(entries, &key("sensor.curve"), dim, &sensor)?,
        sensor,
        stands: match &drive {
            Some(drive) if !name.is_empty() => stands(entries, prefix, moves, drive)?,
            _ => None,
        },
        drive,
        mechanics,
    })
}

/// How what is driven moves by itself, if the file says so.
fn mechanics(
    entries: &Entries,
    prefix: &str,
    is_driven: bool,
    moves: Moves,
) -> Result<Option<Mechanics>, FileError> {
    let part = format!("{prefix}mechanics.");
    let Some((found, _)) = entries.all().find(|(key, _)| key.starts_with(&part)) else {
        return Ok(None);
    };
    if !is_driven {
        let why = format!("is of a port that is driven: `{prefix}drive` is missing");
        return Err(entries.error(found, &why));
    }
    Mechanics::read(entries, &part, moves == Moves::Turns).map(Some)
}

/// What the motor of one of several ports stands, if the file says so.
fn stands(
    entries: &Entries,
    prefix: &str,
    moves: Moves,
    drive: &Drive,
) -> Result<Option<Stands>, FileError> {
    let key = |key: &str| format!("{prefix}motor.{key}");
    let has_any = |(found, _): (&str, _)| found.starts_with(&key(""));
    if !entries.all().any(has_any) {
        return Ok(None);
    }
    let force = match moves {
        Moves::Turns => Dim::TORQUE,
        _ => Dim::FORCE,
    };
    let stands = Stands {
        rated: entries.quantity(&key("rated"), force)?,
        peak_s: entries.quantity(&key("peak_time"), Dim::TIME)?,
    };
    if stands.rated <= 0.0 || stands.rated >= drive.full_scale {
        let why = format!("must lie between zero and `{prefix}drive.full_scale`");
        return Err(entries.error(&key("rated"), &why));
    }
    if stands.peak_s <= 0.0 {
        return Err(entries.error(&key("peak_time"), "must be greater than zero"));
    }
    Ok(Some(stands))
}

fn sensor(entries: &Entries, prefix: &str, dim: Dim) -> Result<Sensor, FileError> {
    let key = |key: &str| format!("{prefix}sensor.{key}");
    let positive = |key: String, dim: Dim| {
        let found = entries.find(&key).map(|_| entries.quantity(&key, dim));
        match found.transpose()? {
            Some(value) if value <= 0.0 => Err(entries.error(&key, "must be greater than zero")),
            found => Ok(found),
        }
    };
    let sensor = Sensor {
        bits: entries.bits(&key("bits"))?,
        low: entries.quantity(&key("low"), dim)?,
        high: entries.quantity(&key("high"), dim)?,
        delay_samples: entries.samples(&key("delay"))?,
        update_hz: positive(key("rate"), Dim::PER_TIME)?,
        step: positive(key("step"), dim)?,
        noise_rms: positive(key("noise"), dim)?,
    };
    if sensor.low >= sensor.high {
        let why = format!("must lie above `{}`", key("low"));
        return Err(entries.error(&key("high"), &why));
    }
    Ok(sensor)
}

fn drive(entries: &Entries, prefix: &str, moves: Moves) -> Result<Drive, FileError> {
    let key = |key: &str| format!("{prefix}drive.{key}");
    let force = match moves {
        Moves::Slides => Dim::FORCE,
        Moves::Turns => Dim::TORQUE,
        Moves::Not => {
            let found = entries.all().find(|(found, _)| found.starts_with(&key("")));
            let found = found.map_or("", |(found, _)| found);
            return Err(entries.error(
                found,
                "drives what does not move: forces act on lengths, torques on angles",
            ));
        }
    };
    let bits = entries.bits(&key("bits"))?;
    let bandwidth = key("bandwidth");
    let frequency = |key: String| {
        let found = entries
            .find(&key)
            .map(|_| entries.quantity(&key, Dim::PER_TIME));
        match found.transpose()? {
            Some(hz) if hz <= 0.0 => Err(entries.error(&key, "must be greater than zero")),
            found => Ok(found),
        }
    };
    let drive = Drive {
        bits,
        full_scale: entries.quantity(&key("full_scale"), force)?,
        delay_samples: entries.samples(&key("delay"))?,
        bandwidth_hz: frequency(bandwidth)?,
        amplifier_hz: frequency(key("amplifier"))?,
        winding: winding(entries, &key)?,
        supply: None,
        mode: mode(entries, &key, frequency(key("mode"))?)?,
    };
    if drive.full_scale <= 0.0 {
        return Err(entries.error(&key("full_scale"), "must be greater than zero"));
    }
    Ok(drive)
}

/// The winding of a coil: its resistance and its inductance, or neither.
fn winding(entries: &Entries, key: &impl Fn(&str) -> String) -> Result<Option<Winding>, FileError> {
    let keys = [key("resistance"), key("inductance")];
    if keys.iter().all(|key| entries.find(key).is_none()) {
        return Ok(None);
    }
    Ok(Some(Winding {
        resistance_ohm: entries
            .measure(&keys[0], &[("mOhm", 1e-3), ("kOhm", 1e3), ("Ohm", 1.0)])?,
        inductance_h: entries.measure(&keys[1], &[("uH", 1e-6), ("mH", 1e-3), ("H", 1.0)])?,
    }))
}

/// The first mode of a coil: its frequency, and its damping as a part of the critical one.
fn mode(
    entries: &Entries,
    key: &impl Fn(&str) -> String,
    hz: Option<f64>,
) -> Result<Option<Resonance>, FileError> {
    let damping = key("mode_damping");
    let Some(hz) = hz else {
        return match entries.find(&damping) {
            Some(_) => Err(entries.error(&damping, "is of a `mode`, which is missing")),
            None => Ok(None),
        };
    };
    let part = entries.measure(&damping, &[("%", 0.01), ("", 1.0)])?;
    if part >= 1.0 {
        return Err(entries.error(&damping, "must be below 1, or nothing rings"));
    }
    Ok(Some(Resonance { hz, damping: part }))
}

/// The curve of a sensor, `VALUE: READING, ..` over all of its range.
fn curve(
    entries: &Entries,
    key: &str,
    dim: Dim,
    sensor: &Sensor,
) -> Result<Option<ReadingCurve>, FileError> {
    let Some(text) = entries.find(key) else {
        return Ok(None);
    };
    let point = |text: &str| {
        let (value, reading) = text.split_once(':')?;
        let value = match parse_quantity(value.trim()) {
            Ok(Quantity::Real { value, dim: found }) if found == dim => value,
            _ => return None,
        };
        Some((value, reading.trim().parse().ok()?))
    };
    let mut points = Vec::new();
    for part in text.split(',') {
        points.push(point(part).ok_or_else(|| {
            let part = part.trim();
            entries.error(
                key,
                &format!("has `{part}`, where `VALUE: READING` is wanted"),
            )
        })?);
    }
    let curve = ReadingCurve::new(&points).map_err(|why| entries.error(key, &why))?;
    let ([first, last], room) = (curve.ends(), 1e-9 * (sensor.high - sensor.low));
    if first > sensor.low + room || last < sensor.high - room {
        return Err(entries.error(key, "must reach from the sensor's `low` to its `high`"));
    }
    Ok(Some(curve))
}
