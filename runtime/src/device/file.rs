//! Reading of device files: TOML whose values are strings with units.

use std::path::Path;

use toml::de::{DeTable, DeValue};
use whippen_compiler::diag::nearest;
use whippen_compiler::units::{Dim, Quantity, parse_quantity, parse_unit};

use super::{Device, Drive, Sensor};
use crate::files::FileError;

/// The keys of a device file, and an example of each.
const KEYS: &[(&str, &str)] = &[
    ("name", "mikey"),
    ("sensor.bits", "16 bit"),
    ("sensor.low", "-0.5 mm"),
    ("sensor.high", "10.5 mm"),
    ("sensor.delay", "1 sample"),
    ("drive.bits", "16 bit"),
    ("drive.full_scale", "20 N"),
    ("drive.delay", "1 sample"),
];

/// Reads the text of a device file.
pub fn read(path: &Path, text: &str) -> Result<Device, FileError> {
    let entries = Entries::parse(path, text)?;
    let name = entries.text("name")?.0.to_string();
    entries.word("sensor.bits")?;
    entries.word("drive.bits")?;
    // What the sensor measures says how the device moves, and so what it drives.
    let turns = entries.is_angle("sensor.low");
    let (position, force) = if turns { (Dim::NUMBER, Dim::TORQUE) } else { (Dim::LENGTH, Dim::FORCE) };
    let sensor = Sensor {
        low: entries.quantity("sensor.low", position)?,
        high: entries.quantity("sensor.high", position)?,
        delay_samples: entries.samples("sensor.delay")?,
    };
    if sensor.low >= sensor.high {
        return Err(entries.error("sensor.high", "must lie above `sensor.low`"));
    }
    let drive = Drive {
        full_scale: entries.quantity("drive.full_scale", force)?,
        delay_samples: entries.samples("drive.delay")?,
    };
    if drive.full_scale <= 0.0 {
        return Err(entries.error("drive.full_scale", "must be greater than zero"));
    }
    Ok(Device { name, sensor, drive, turns })
}

/// The entries of a file: dotted key, value and line.
struct Entries<'a> {
    path: &'a Path,
    list: Vec<(String, String, u64)>,
}

impl<'a> Entries<'a> {
    fn parse(path: &'a Path, text: &str) -> Result<Entries<'a>, FileError> {
        let line = |at: usize| text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count() as u64 + 1;
        let table = DeTable::parse(text).map_err(|e| {
            let error = FileError::new(path, e.message());
            e.span().map_or(error.clone(), |span| error.at_line(line(span.start)))
        })?;
        let mut list = Vec::new();
        collect("", table.get_ref(), &mut |key, at, value| {
            let error = |message| Err(FileError::new(path, message).at_line(line(at)));
            let Some((_, example)) = KEYS.iter().find(|(known, _)| *known == key) else {
                let hint = nearest(&key, KEYS.iter().map(|k| k.0)).map(|near| format!("; did you mean `{near}`?"));
                return error(format!("unknown key `{key}`{}", hint.unwrap_or_default()));
            };
            let Some(value) = value.as_str() else {
                return error(format!("`{key}` must be a string, such as `\"{example}\"`"));
            };
            list.push((key, value.to_string(), line(at)));
            Ok(())
        })?;
        Ok(Entries { path, list })
    }

    /// The value of a key and its line.
    fn text(&self, key: &str) -> Result<(&str, u64), FileError> {
        let found = self.list.iter().find(|entry| entry.0 == key);
        found.map(|(_, value, line)| (value.as_str(), *line)).ok_or_else(|| {
            let example = KEYS.iter().find(|(known, _)| *known == key).map_or("", |k| k.1);
            FileError::new(self.path, format!("`{key}` is missing, as in `{key} = \"{example}\"`"))
        })
    }

    /// Whether a value is written as an angle.
    fn is_angle(&self, key: &str) -> bool {
        let unit = self.text(key).ok().and_then(|(text, _)| text.trim().rsplit_once(' '));
        unit.is_some_and(|(_, unit)| parse_unit(unit).is_some_and(|u| u.dim.is_number()))
    }

    /// A value of the given dimension, in SI.
    fn quantity(&self, key: &str, dim: Dim) -> Result<f64, FileError> {
        let (text, _) = self.text(key)?;
        match parse_quantity(text) {
            Ok(Quantity::Real { value, dim: found }) if found == dim => Ok(value),
            Ok(_) => {
                let (kind, unit) = match dim {
                    Dim::NUMBER => ("an angle".to_string(), "rad".to_string()),
                    other => (format!("a {}", other.name().unwrap_or("quantity")), other.unit()),
                };
                Err(self.error(key, &format!("is `{text}`, but must be {kind} (a number of `{unit}`)")))
            }
            Err(e) => Err(self.error(key, &format!("is not a quantity: {e}"))),
        }
    }

    /// A delay in samples of the keyboard's rate: a measure only devices have.
    fn samples(&self, key: &str) -> Result<f64, FileError> {
        let (text, _) = self.text(key)?;
        let number = text.strip_suffix("samples").or_else(|| text.strip_suffix("sample"));
        let samples = number.and_then(|n| n.trim().parse().ok()).filter(|n: &f64| n.is_finite() && *n >= 0.0);
        samples.ok_or_else(|| self.error(key, &format!("is `{text}`, but must be a delay such as `1 sample`")))
    }

    /// The size of a word: 16 bits, the only one there is.
    fn word(&self, key: &str) -> Result<(), FileError> {
        match self.text(key)?.0 {
            "16 bit" | "16 bits" => Ok(()),
            other => Err(self.error(key, &format!("is `{other}`, but words have `16 bit`"))),
        }
    }

    fn error(&self, key: &str, what: &str) -> FileError {
        let error = FileError::new(self.path, format!("`{key}` {what}"));
        self.text(key).map_or(error.clone(), |(_, line)| error.at_line(line))
    }
}

/// Visits the values of a table with their dotted keys and places.
fn collect(
    prefix: &str,
    table: &DeTable,
    visit: &mut impl FnMut(String, usize, &DeValue) -> Result<(), FileError>,
) -> Result<(), FileError> {
    for (key, value) in table {
        let name = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => collect(&format!("{name}."), inner, visit)?,
            value => visit(name, key.span().start, value)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
name = "test"
[sensor]
bits = "16 bit"
low = "-0.5 mm"
high = "10.5 mm"
delay = "0.5 samples"
[drive]
bits = "16 bits"
full_scale = "500 mN"
delay = "12 samples"
"#;

    fn changed(from: &str, to: &str) -> String {
        assert!(GOOD.contains(from), "{from}");
        read(Path::new("test.toml"), &GOOD.replace(from, to)).unwrap_err().to_string()
    }

    #[test]
    fn units_are_those_of_the_language() {
        let device = read(Path::new("test.toml"), GOOD).unwrap();
        assert_eq!(device.sensor, Sensor { low: -0.0005, high: 0.0105, delay_samples: 0.5 });
        assert_eq!(device.drive, Drive { full_scale: 0.5, delay_samples: 12.0 });
    }

    #[test]
    fn deep_nesting_is_an_error_and_not_a_crash() {
        for text in [
            format!("{}a = 1", "a.".repeat(200_000)),
            format!("a = {}", "[".repeat(200_000)),
            "a = {b=".repeat(200_000),
        ] {
            assert!(read(Path::new("test.toml"), &text).is_err());
        }
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let messages = [
            changed("high =", "hihg ="),
            changed("[sensor]", "[sensors]"),
            changed("low =", "colour ="),
            changed("low = \"-0.5 mm\"\n", ""),
            changed("\"-0.5 mm\"", "-0.5"),
            changed("-0.5 mm", "-0.5"),
            changed("-0.5 mm", "-0.5 N"),
            changed("-0.5 mm", "-0.5 mmm"),
            changed("-0.5 mm", "on"),
            changed("-0.5 mm", "11 mm"),
            changed("500 mN", "0 N"),
            changed("500 mN", "500 mN*m"),
            changed("-0.5 mm", "-30 deg"),
            changed("low = \"-0.5 mm\"\nhigh = \"10.5 mm\"", "low = \"-30 deg\"\nhigh = \"30 deg\""),
            changed("0.5 samples", "1 ms"),
            changed("0.5 samples", "-1 sample"),
            changed("16 bits", "12 bit"),
            changed("name = \"test\"", "name = \"test"),
            changed("name = \"test\"", "name = [\"test\"]"),
            changed("[drive]", "[sensor]"),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }
}
