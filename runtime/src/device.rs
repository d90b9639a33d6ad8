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
//! `_n`. Programs that name no device get the bundled one that moves as they do.
//!
//! Not here: boards (which core, which pins), what is done about a motor's heat (the firmware), the
//! mechanics of the key.

mod file;
mod mechanics;

use std::path::Path;

use whippen_compiler::model::Model;
use whippen_compiler::scales::Scales;

use crate::files::{FileError, InputKind, read_text};
pub use mechanics::{FeltStops, Mechanics};

/// The bundled devices: file and text.
const BUNDLED: &[(&str, &str)] = &[
    (
        "mikey.toml",
        include_str!("../../instruments/hardware/mikey.toml"),
    ),
    (
        "knob.toml",
        include_str!("../../instruments/hardware/knob.toml"),
    ),
];

/// A key's sensor and drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// How positions become words.
    pub sensor: Sensor,
    /// How words become forces.
    pub drive: Drive,
    /// Whether it is turned (rad, N*m); otherwise it slides (m, N).
    pub turns: bool,
    /// What its motor stands, if it says so: an image protects it.
    pub motor: Option<Motor>,
    /// How its key moves by itself, if it says so: the stability budget and closed loops need it.
    pub mechanics: Option<Mechanics>,
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

/// A position sensor with its converter: 16-bit words, unsigned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Position at word 0 (m or rad).
    pub low: f64,
    /// Position at word 65535 (m or rad), above `low`.
    pub high: f64,
    /// From the instant of measurement to the tick that reads the word, in ticks.
    pub delay_samples: f64,
}

/// A drive with its converter: 16-bit words, signed (`I1F15`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Force that word 32768 would stand for (N or N*m), above 0.
    pub full_scale: f64,
    /// From the tick that writes the word to the instant the force acts, in ticks.
    pub delay_samples: f64,
    /// Up to where the force follows (Hz); none for a drive without limit.
    pub bandwidth_hz: Option<f64>,
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

    /// The bundled device for an instrument whose program names none.
    pub fn of(model: &Model) -> Device {
        let name = if model.turns() { "knob" } else { "mikey" };
        Device::bundled(name).expect("both are bundled")
    }

    /// A device that was found, such as a keyboard's, if the instrument can be played on it;
    /// otherwise the usual one.
    pub fn fitting(found: Option<&Device>, model: &Model) -> Device {
        let fits = found.filter(|device| device.fits(model).is_ok());
        fits.cloned().unwrap_or_else(|| Device::of(model))
    }

    /// Whether an instrument can be played on it.
    ///
    /// # Errors
    /// One of them turns and the other slides.
    pub fn fits(&self, model: &Model) -> Result<(), String> {
        let (measures, senses) = match (self.turns, model.turns()) {
            (false, true) => ("lengths", "an angle"),
            (true, false) => ("angles", "a length"),
            _ => return Ok(()),
        };
        Err(format!(
            "the device `{}` measures {measures}, but `{}` senses {senses}",
            self.name, model.name
        ))
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

    /// The sensor's word for a position, and whether the position lay outside the sensor's range;
    /// halves are rounded up. What is not a number reads as word 0 and counts as outside.
    pub fn word_of_position(&self, position_m: f64) -> (u16, bool) {
        let Sensor { low, high, .. } = self.sensor;
        let word = ((position_m - low) / (high - low) * f64::from(u16::MAX) + 0.5).floor();
        // The cast clamps, and takes what is not a number to 0.
        (word as u16, !(low..=high).contains(&position_m))
    }

    /// What lowering and the engines must know of it.
    pub fn scales(&self) -> Scales {
        let Sensor { low, high, .. } = self.sensor;
        Scales {
            sensor_zero: low,
            sensor_lsb: (high - low) / f64::from(u16::MAX),
            drive_lsb: self.drive.full_scale / 32_768.0,
        }
    }

    /// The force (N or N*m) that the motor gives for ever, if the device says what it stands: word
    /// 32768 is its peak current.
    pub fn rated_force(&self) -> Option<f64> {
        self.motor
            .map(|motor| motor.rated_a / motor.peak_a * self.drive.full_scale)
    }

    /// The position (m or rad) a sensor's word stands for.
    pub fn position_of_word(&self, word: u16) -> f64 {
        let Sensor { low, high, .. } = self.sensor;
        low + (high - low) * (f64::from(word) / f64::from(u16::MAX))
    }

    /// The force (N or N*m) a drive's word stands for; positive pushes the key up.
    pub fn force_of_word(&self, word: i16) -> f64 {
        f64::from(word) / 32768.0 * self.drive.full_scale
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
            mikey.sensor,
            Sensor {
                low: -0.0005,
                high: 0.0105,
                delay_samples: 1.0
            }
        );
        assert_eq!(
            mikey.drive,
            Drive {
                full_scale: 32.0,
                delay_samples: 1.0,
                bandwidth_hz: Some(3000.0)
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
        assert!(knob.turns && !Device::mikey().turns);
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
