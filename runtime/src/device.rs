//! Devices: what the words of sensors and drives mean in metres and newtons, or in radians and
//! newton metres.
//!
//! ```text
//!   position --low .. high--> sensor word 0 .. 65535 --> program --> drive word -32768 .. 32767 --full scale--> force
//! ```
//!
//! A device is a TOML file (`instruments/hardware/`): every value a string with its unit, as in the
//! language. What it measures says how it moves: a key slides (m, N), a knob turns (rad, N*m).
//! Positions and forces are meant that way in all of this crate, also where a name ends in `_m` or
//! `_n`. A device with several ports has a sensor, and perhaps a drive, for each of them, and its
//! ports are matched with what an instrument senses by their names; a single port takes any name.
//! Programs that name no device get the bundled one that their senses fit.
//!
//! Not here: boards (which core, which pins), what is done about a motor's heat (the firmware), the
//! mechanics of the key.

mod converter;
mod file;
mod matching;
mod mechanics;
pub(crate) mod noise;
mod port;
mod port_file;

use std::path::Path;

use whippen_compiler::scales::PortScales;
use whippen_instruments::DEVICES as BUNDLED;

use crate::files::{FileError, InputKind, read_text};
pub use mechanics::{FeltStops, Mechanics};
pub use port::{Drive, Port, Sensor, Stands, Supply, Winding};

/// Sensors and drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// Its ports, at least one.
    pub ports: Vec<Port>,
    /// What its motor stands, if it says so: an image protects it.
    pub motor: Option<Motor>,
    /// How much energy its motor may give in any span of time beyond what it got (J), if that is
    /// limited.
    pub passivity_j: Option<f64>,
}

/// A motor: what its amplifier gives and its winding stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Torque of a current (N*m/A).
    pub torque_constant: f64,
    /// The current it stands for ever (A).
    pub rated_a: f64,
    /// The current that drive word 32768 asks for, the most there is (A), above `rated_a`.
    pub peak_a: f64,
    /// How long it stands that (s).
    pub peak_s: f64,
    /// How its winding gets warm, if it says so.
    pub heat: Option<Heat>,
}

/// How a winding gets warm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heat {
    /// By how much at the rated current for ever (K).
    pub rise_k: f64,
    /// After which time it is warm by all but 1/e of that (s).
    pub time_s: f64,
}

impl Device {
    /// The keyboard of the first paper: the device of every key that names none.
    pub fn mikey() -> Device {
        Device::bundled("mikey").expect("mikey is bundled")
    }

    /// The bundled device of that name, if there is one.
    pub fn bundled(name: &str) -> Option<Device> {
        let read = |(file, text): &(&str, &str)| {
            file::read(Path::new(file), text).expect("bundled device files are correct")
        };
        BUNDLED.iter().map(read).find(|device| device.name == name)
    }

    /// Reads a device file.
    ///
    /// # Errors
    /// The file cannot be read or is no TOML; a key is unknown or missing; a value is not a string,
    /// has no unit or one of the wrong dimension, or makes no sense. Each names the file, the line
    /// and the key.
    pub fn load(path: &Path) -> Result<Device, FileError> {
        let text = read_text(path, InputKind::DESCRIPTION)?;
        file::read(path, &text)
    }

    /// The only port, or the first of several.
    pub fn port(&self) -> &Port {
        self.ports.first().expect("a device has a port")
    }

    /// The sensor of the [first port](Device::port).
    pub fn sensor(&self) -> Sensor {
        self.port().sensor
    }

    /// The drive of the [first port](Device::port); one without any force if it has none.
    pub fn drive(&self) -> Drive {
        self.port().drive()
    }

    /// Ticks from a place to the force that answers it, as the [first port](Device::port) says
    /// them; what the coil takes is not among them.
    pub fn delay_samples(&self) -> f64 {
        self.sensor().delay_samples + self.drive().delay_samples
    }

    /// The same with noise of this size (SI, root of the mean square) in the first sensor.
    #[must_use]
    pub fn with_noise(&self, rms: f64) -> Device {
        let mut device = self.clone();
        if let Some(port) = device.ports.first_mut() {
            port.sensor.noise_rms = (rms > 0.0).then_some(rms);
        }
        device
    }

    /// The same with a port of it alone.
    #[must_use]
    pub fn with_port(&self, port: &Port) -> Device {
        let ports = vec![port.clone()];
        Device {
            ports,
            ..self.clone()
        }
    }

    /// Whether the [first port](Device::port) turns (rad, N*m); otherwise it slides (m, N).
    pub fn turns(&self) -> bool {
        self.port().turns()
    }

    /// The word of the [first port](Device::port) for a position: [`Port::word`].
    pub fn word_of_position(&self, position_m: f64) -> (u16, bool) {
        self.port().word(position_m)
    }

    /// What lowering and the engines must know of it.
    pub fn scales(&self) -> PortScales {
        let port = |port: &Port| (port.name.clone(), port.scales());
        PortScales::new(self.ports.iter().map(port).collect())
    }

    /// What the converters of the first port make of a position and a force, where they have less
    /// than words or the sensor has a curve; in words.
    pub fn told_converters(&self) -> Vec<String> {
        let (port, drive, turns) = (self.port(), self.drive(), self.turns());
        let mut out = Vec::new();
        if port.has_steps() {
            let step = port.widest_step();
            let step = match turns {
                true => format!("{:.3} mdeg", 1e3 * step.to_degrees()),
                false => format!("{:.3} um", 1e6 * step),
            };
            let bits = port.sensor.bits;
            out.push(match &port.curve {
                None => format!("a step of the sensor's {bits} bits is {step}"),
                Some(curve) => format!(
                    "a step of the sensor's {bits} bits is up to {step}, where its curve is {:.1} times as flat as at its steepest",
                    curve.flatness()
                ),
            });
        }
        if drive.bits < 16 {
            let unit = if turns { "mN*m" } else { "mN" };
            let step = 1e3 * drive.full_scale / f64::from(1u32 << (drive.bits - 1));
            let bits = drive.bits;
            out.push(format!(
                "a step of the drive's {bits} bits is {step:.2} {unit}"
            ));
        }
        out
    }

    /// The force (N or N*m) that the motor gives for ever, if the device says what it stands: word
    /// 32768 is its peak current.
    pub fn rated_force(&self) -> Option<f64> {
        self.motor
            .map(|motor| motor.rated_a / motor.peak_a * self.drive().full_scale)
    }

    /// The position (m or rad) a word of the first port's sensor stands for.
    pub fn position_of_word(&self, word: u16) -> f64 {
        self.port().sensed(word)
    }

    /// The force (N or N*m) a word of the first port's drive stands for; positive pushes the key
    /// up.
    pub fn force_of_word(&self, word: i16) -> f64 {
        self.drive().force(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mikey_reads_and_drives_as_documented() {
        let mikey = Device::mikey();
        assert_eq!(
            (Device::bundled("mikey").as_ref(), Device::bundled("mickey")),
            (Some(&mikey), None)
        );
        assert_eq!(
            mikey.sensor(),
            Sensor {
                bits: 16,
                low: -0.0005,
                high: 0.0105,
                delay_samples: 1.0,
                update_hz: None,
                step: None,
                noise_rms: None,
            }
        );
        assert_eq!(
            mikey.drive(),
            Drive {
                full_scale: 32.0,
                delay_samples: 1.0,
                bandwidth_hz: Some(3000.0),
                ..Drive::NONE
            }
        );
        let lsb_m = mikey.position_of_word(1) - mikey.position_of_word(0);
        assert!((lsb_m - 0.168e-6).abs() < 1e-9, "{lsb_m}");
        assert_eq!(mikey.force_of_word(16_384), 16.0);
        assert_eq!(mikey.force_of_word(i16::MIN), -32.0);
    }

    #[test]
    fn the_knob_measures_angles_and_drives_torques() {
        let knob = Device::bundled("knob").expect("is bundled");
        assert!(knob.turns() && !Device::mikey().turns());
        assert!((knob.position_of_word(u16::MAX) - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(knob.force_of_word(i16::MIN), -0.125);
    }

    #[test]
    fn every_word_comes_back() {
        let mikey = Device::mikey();
        for word in 0..=u16::MAX {
            assert_eq!(mikey.word_of_position(mikey.position_of_word(word)).0, word);
        }
    }

    #[test]
    fn positions_outside_are_held_and_said() {
        let mikey = Device::mikey();
        assert_eq!(mikey.word_of_position(-0.0005), (0, false));
        assert_eq!(mikey.word_of_position(0.0105), (65_535, false));
        assert_eq!(mikey.word_of_position(-0.000_501), (0, true));
        assert_eq!(mikey.word_of_position(0.0106), (65_535, true));
        assert_eq!(mikey.word_of_position(f64::NAN), (0, true));
        assert_eq!(mikey.word_of_position(f64::INFINITY), (65_535, true));
    }
}
