//! Reading of device files: TOML whose values are strings with units.

use std::path::Path;

use whippen_compiler::units::{Dim, Quantity, parse_quantity, parse_unit};

use super::port_file::{port, port_names, several};
use super::{Device, Heat, Motor};
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
    ("drive.bits", "16 bit"),
    ("drive.full_scale", "20 N"),
    ("drive.delay", "1 sample"),
    ("drive.bandwidth", "3 kHz"),
    ("port.*.sensor.bits", "16 bit"),
    ("port.*.sensor.low", "-0.5 mm"),
    ("port.*.sensor.high", "10.5 mm"),
    ("port.*.sensor.delay", "1 sample"),
    ("port.*.sensor.rate", "1 kHz"),
    ("port.*.sensor.step", "0.055 mm"),
    ("port.*.sensor.noise", "1 um"),
    ("port.*.drive.bits", "16 bit"),
    ("port.*.drive.full_scale", "20 N"),
    ("port.*.drive.delay", "1 sample"),
    ("port.*.drive.bandwidth", "3 kHz"),
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
    ("motor.rated", "0.5 A"),
    ("motor.peak", "2 A"),
    ("motor.peak_time", "100 ms"),
    ("motor.rise", "60 K"),
    ("motor.heat_time", "30 s"),
    ("passivity.energy", "20 mJ"),
];

/// Reads the text of a device file.
pub fn read(path: &Path, text: &str) -> Result<Device, FileError> {
    let entries = Entries::parse(path, text, KEYS)?;
    let name = entries.text("name")?.to_string();
    let names = port_names(&entries);
    if !names.is_empty() {
        return several(&entries, name, &names);
    }
    let port = port(&entries, "", "")?;
    let has = |part: &str| entries.all().any(|(key, _)| key.starts_with(part));
    let motor = has("motor.").then(|| motor(&entries)).transpose()?;
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

fn motor(entries: &Entries) -> Result<Motor, FileError> {
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
    Ok(motor)
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

    /// The size of a word: 16 bits, the only one there is.
    pub(super) fn word(&self, key: &str) -> Result<(), FileError> {
        match self.text(key)? {
            "16 bit" | "16 bits" => Ok(()),
            other => Err(self.error(key, &format!("is `{other}`, but words have `16 bit`"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Drive, FeltStops, Mechanics, Sensor};
    use super::*;
    use whippen_compiler::model::Moves;

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

    const MOTOR: &str = r#"[motor]
torque_constant = "0.007 N*m/A"
rated = "0.5 A"
peak = "2 A"
peak_time = "100 ms"
[drive]"#;

    const MECHANICS: &str = r#"[mechanics]
mass = "60 g"
damping = "0.2 N*s/m"
friction = "30 mN"
stop_low = "0 mm"
stop_high = "10 mm"
stop_stiffness = "20 kN/m"
stop_damping = "20 N*s/m"
[drive]"#;

    fn changed(from: &str, to: &str) -> String {
        assert!(GOOD.contains(from), "{from}");
        read(Path::new("test.toml"), &GOOD.replace(from, to))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn units_are_those_of_the_language() {
        let device = read(Path::new("test.toml"), GOOD).unwrap();
        assert_eq!(
            device.sensor(),
            Sensor {
                low: -0.0005,
                high: 0.0105,
                delay_samples: 0.5,
                update_hz: None,
                step: None,
                noise_rms: None,
            }
        );
        assert_eq!(
            device.drive(),
            Drive {
                full_scale: 0.5,
                delay_samples: 12.0,
                bandwidth_hz: None
            }
        );
    }

    #[test]
    fn the_page_has_every_key_and_a_file_that_can_be_read() {
        let page = include_str!("../../../docs/how-to/device.md");
        for (key, _) in KEYS {
            // Tables of ports have the keys of those for one.
            let key = key.trim_start_matches("port.*.");
            assert!(page.contains(&format!("`{key}`")), "{key}");
        }
        let (_, rest) = page.split_once("```toml\n").expect("an example");
        let (example, _) = rest.split_once("```").expect("its end");
        let device = read(Path::new("my-key.toml"), example);
        assert_eq!(device.map(|device| device.name).as_deref(), Ok("my key"));
    }

    #[test]
    fn a_motor_is_what_it_stands() {
        let device = read(Path::new("test.toml"), &GOOD.replace("[drive]", MOTOR)).unwrap();
        let motor = Motor {
            torque_constant: 0.007,
            rated_a: 0.5,
            peak_a: 2.0,
            peak_s: 0.1,
            heat: None,
        };
        assert_eq!(device.motor, Some(motor));
        assert_eq!(read(Path::new("test.toml"), GOOD).unwrap().motor, None);
    }

    #[test]
    fn a_motor_may_be_limited_in_what_it_gives() {
        let with = |energy: &str| {
            GOOD.replace(
                "[drive]",
                &format!("[passivity]\nenergy = \"{energy}\"\n[drive]"),
            )
        };
        let device = |energy: &str| read(Path::new("test.toml"), &with(energy));
        assert_eq!(
            device("20 mJ").map(|device| device.passivity_j),
            Ok(Some(0.02))
        );
        assert!(device("0 mJ").is_err() && device("20 mW").is_err());
        assert_eq!(
            read(Path::new("test.toml"), GOOD).unwrap().passivity_j,
            None
        );
    }

    #[test]
    fn a_key_moves_as_its_mechanics_say() {
        let device = read(Path::new("test.toml"), &GOOD.replace("[drive]", MECHANICS)).unwrap();
        let stops = FeltStops {
            low: 0.0,
            high: 0.01,
            stiffness: 2e4,
            damping: 20.0,
        };
        let mechanics = Mechanics {
            mass: 0.06,
            damping: 0.2,
            friction: 0.03,
            stops: Some(stops),
        };
        assert_eq!(device.port().mechanics, Some(mechanics));
        assert_eq!(
            device.port().key(44_100.into()).map(|key| key.delay_ticks),
            Some(12.5)
        );
        assert_eq!(
            read(Path::new("test.toml"), GOOD)
                .unwrap()
                .port()
                .key(44_100.into()),
            None
        );
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

    const PORTS: &str = r#"
name = "test"
[port.x.sensor]
bits = "16 bit"
low = "-10 mm"
high = "10 mm"
rate = "1 kHz"
step = "0.1 mm"
delay = "1 sample"
[port.x.drive]
bits = "16 bit"
full_scale = "3.3 N"
delay = "1 sample"
[port.push.sensor]
bits = "16 bit"
low = "0 N"
high = "20 N"
delay = "1 sample"
"#;

    #[test]
    fn ports_measure_anything_and_are_driven_where_they_move() {
        let device = read(Path::new("test.toml"), PORTS).unwrap();
        let [x, push] = &device.ports[..] else {
            panic!("{device:?}")
        };
        assert_eq!(
            (x.name.as_str(), x.moves, x.dim),
            ("x", Moves::Slides, Dim::LENGTH)
        );
        assert_eq!(x.drive.map(|drive| drive.full_scale), Some(3.3));
        assert_eq!(
            (x.sensor.update_hz, x.sensor.step),
            (Some(1000.0), Some(1e-4))
        );
        assert_eq!(
            (push.dim, push.moves, push.drive),
            (Dim::FORCE, Moves::Not, None)
        );
        // A step is told at its middle.
        assert_eq!(x.word(0.04e-3), x.word(0.0));
        assert_eq!(x.word(0.06e-3), x.word(0.1e-3));
        let changed = |from: &str, to: &str| {
            assert!(PORTS.contains(from), "{from}");
            let read = read(Path::new("test.toml"), &PORTS.replace(from, to));
            read.unwrap_err().to_string()
        };
        let messages = [
            changed("[port.x.sensor]", "[port.x.sensors]"),
            changed("\"1 kHz\"", "\"0 Hz\""),
            changed("\"0.1 mm\"", "\"0.1 N\""),
            changed("\"3.3 N\"", "\"3.3 N*m\""),
            changed("\"20 N\"", "\"-20 N\""),
            changed("[port.x.drive]", "[port.push.drive]"),
            changed("[port.x.drive]", "[drive]"),
            changed("[port.push.sensor]", "[port.push]"),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }

    #[test]
    fn each_port_that_is_driven_moves_as_its_own_mechanics_say() {
        let with = |of_port: &str, mass: &str| {
            let table = "mass = \"45 g\"\ndamping = \"0.1 N*s/m\"\nfriction = \"0.26 N\"\n";
            let table = table.replace("45 g", mass);
            format!("{PORTS}[port.{of_port}.mechanics]\n{table}")
        };
        let read = |text: &str| read(Path::new("test.toml"), text);
        let device = read(&with("x", "45 g")).unwrap();
        let mechanics = device.ports.iter().map(|port| port.mechanics);
        let x = Mechanics {
            mass: 0.045,
            damping: 0.1,
            friction: 0.26,
            stops: None,
        };
        assert_eq!(mechanics.collect::<Vec<_>>(), [Some(x), None]);
        let refused = [
            with("push", "45 g"),
            with("x", "0 g"),
            with("x", "1 kg*m^2"),
            format!("{PORTS}[mechanics]\nmass = \"45 g\"\n"),
        ];
        let messages = refused.map(|text| read(&text).unwrap_err().to_string());
        insta::assert_snapshot!(messages.join("\n"));
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
            changed(
                "low = \"-0.5 mm\"\nhigh = \"10.5 mm\"",
                "low = \"-30 deg\"\nhigh = \"30 deg\"",
            ),
            changed("0.5 samples", "1 ms"),
            changed("0.5 samples", "-1 sample"),
            changed("16 bits", "12 bit"),
            changed("name = \"test\"", "name = \"test"),
            changed("name = \"test\"", "name = [\"test\"]"),
            changed("[drive]", "[sensor]"),
            changed("[drive]", "[motor]\nrated = \"2 A\"\n[drive]"),
            changed("[drive]", &MOTOR.replace("0.5 A", "2 A")),
            changed("[drive]", &MOTOR.replace("100 ms", "0 ms")),
            changed(
                "[drive]",
                &MOTOR.replace("\"100 ms\"", "\"100 ms\"\nrise = \"60 degC\""),
            ),
            changed(
                "[drive]",
                &MOTOR.replace("\"100 ms\"", "\"100 ms\"\nrise = \"60 K\""),
            ),
            changed("[drive]", "[mechanics]\nweight = \"60 g\"\n[drive]"),
            changed("[drive]", "[mechanics]\nmass = \"60 mN\"\n[drive]"),
            changed("[drive]", "[mechanics]\nmass = \"0 g\"\n[drive]"),
            changed("[drive]", &MECHANICS.replace("10 mm", "-1 mm")),
            changed("500 mN\"", "500 mN\"\nbandwidth = \"0 Hz\""),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }
}
