//! Reading of ports: the `sensor` and the `drive` of a device, or of each `port.NAME` in it.

use whippen_compiler::model::Moves;
use whippen_compiler::units::Dim;

use super::{Device, Drive, Mechanics, Port, Sensor, Stands};
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
    entries.word(&key("sensor.bits"))?;
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
    entries.word(&key("bits"))?;
    let bandwidth = key("bandwidth");
    let drive = Drive {
        full_scale: entries.quantity(&key("full_scale"), force)?,
        delay_samples: entries.samples(&key("delay"))?,
        bandwidth_hz: entries
            .find(&bandwidth)
            .map(|_| entries.quantity(&bandwidth, Dim::PER_TIME))
            .transpose()?,
    };
    if drive.bandwidth_hz.is_some_and(|hz| hz <= 0.0) {
        return Err(entries.error(&bandwidth, "must be greater than zero"));
    }
    if drive.full_scale <= 0.0 {
        return Err(entries.error(&key("full_scale"), "must be greater than zero"));
    }
    Ok(drive)
}
