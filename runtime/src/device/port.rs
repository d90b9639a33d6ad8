//! A port of a device: a sensor, and perhaps a drive against what it senses.

use whippen_compiler::model::Moves;
use whippen_compiler::scales::Scales;
use whippen_compiler::stability::Resonance;
use whippen_compiler::units::Dim;

use super::Heat;
use super::converter::{self, ReadingCurve, quantized};
use super::mechanics::Mechanics;
use super::noise;

/// A port.
#[derive(Debug, Clone, PartialEq)]
pub struct Port {
    /// Its name; empty for the only port of a device, which takes any name.
    pub name: String,
    /// What is sensed.
    pub dim: Dim,
    /// How that moves.
    pub moves: Moves,
    /// How what is sensed becomes words.
    pub sensor: Sensor,
    /// What the sensor reads over what it senses, where it is not straight.
    pub curve: Option<ReadingCurve>,
    /// How words become forces, if it is driven.
    pub drive: Option<Drive>,
    /// What its motor stands, where a device with several ports says so: an image protects it.
    pub stands: Option<Stands>,
    /// How what is driven moves by itself, if the device says so: the stability budget and closed
    /// loops need it.
    pub mechanics: Option<Mechanics>,
}

/// What the motor of one of several ports stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stands {
    /// The force that it gives for ever (N or N*m), below the drive's full scale.
    pub rated: f64,
    /// How long it gives all of its force (s).
    pub peak_s: f64,
}

/// A sensor with its converter: 16-bit words, unsigned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// How many bits its converter has.
    pub bits: u32,
    /// What word 0 stands for (SI).
    pub low: f64,
    /// What word 65535 stands for (SI), above `low`.
    pub high: f64,
    /// From the instant of measurement to the tick that reads the word, in ticks.
    pub delay_samples: f64,
    /// How often it is read (Hz); none for every tick.
    pub update_hz: Option<f64>,
    /// The least difference that it tells (SI); none for a word.
    pub step: Option<f64>,
    /// How much noise it adds to a reading (SI, root of the mean square), normal and white, where
    /// its curve is steepest; none where nobody says.
    pub noise_rms: Option<f64>,
}

/// A drive with its converter: 16-bit words, signed (`I1F15`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// How many bits its converter has: it takes the upper ones of a word.
    pub bits: u32,
    /// Force that word 32768 would stand for (N or N*m), above 0.
    pub full_scale: f64,
    /// From the tick that writes the word to the instant the force acts, in ticks.
    pub delay_samples: f64,
    /// Up to where the force follows (Hz); none for a drive without limit.
    pub bandwidth_hz: Option<f64>,
    /// Up to where the current of its amplifier follows (Hz), if it is one of current.
    pub amplifier_hz: Option<f64>,
    /// The coil's winding, if it is known.
    pub winding: Option<Winding>,
    /// What drives a current through the winding, if its limits are known.
    pub supply: Option<Supply>,
    /// The coil's first mode, if it is known.
    pub mode: Option<Resonance>,
}

/// A coil's winding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winding {
    /// Its resistance (Ohm).
    pub resistance_ohm: f64,
    /// Its inductance (H).
    pub inductance_h: f64,
}

/// The supply of an amplifier, and what it takes to warm the winding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supply {
    /// The largest voltage on the winding, either way (V).
    pub volts: f64,
    /// The current of a force (A/N or A/(N*m)); a speed of the key induces its reciprocal in volts.
    pub amperes_per_force: f64,
    /// The current that warms the winding by what `heat` says (A).
    pub rated_a: f64,
    /// How the winding gets warm; none for one that stays cold.
    pub heat: Option<Heat>,
}

impl Drive {
    /// No drive at all; a word of it is 1/32768, so that scales are above 0.
    pub const NONE: Drive = Drive {
        bits: 16,
        full_scale: 1.0,
        delay_samples: 0.0,
        bandwidth_hz: None,
        amplifier_hz: None,
        winding: None,
        supply: None,
        mode: None,
    };

    /// The force (N or N*m) a word stands for.
    pub fn force(&self, word: i16) -> f64 {
        let below = 16 - self.bits;
        let taken = (word >> below) << below;
        f64::from(taken) / 32768.0 * self.full_scale
    }

    /// Up to where the current follows (Hz): an amplifier of current makes its own bandwidth of
    /// the coil; without one the current follows a voltage by the winding's R/L.
    pub fn lag_hz(&self) -> Option<f64> {
        let of_winding = |winding: Winding| {
            let Winding {
                resistance_ohm,
                inductance_h,
            } = winding;
            resistance_ohm / inductance_h / std::f64::consts::TAU
        };
        self.amplifier_hz.or(self.winding.map(of_winding))
    }

    /// Whether it says more of itself than a scale, a delay and a bandwidth.
    pub fn has_stages(&self) -> bool {
        self.bits < 16 || self.lag_hz().is_some() || self.mode.is_some()
    }
}

impl Port {
    /// Whether it is turned (rad, N*m); otherwise it slides (m, N), or does not move.
    pub fn turns(&self) -> bool {
        self.moves == Moves::Turns
    }

    /// Its drive; one without any force if it has none.
    pub fn drive(&self) -> Drive {
        self.drive.unwrap_or(Drive::NONE)
    }

    /// The sensor's word for a value (SI), and whether that lay outside the sensor's range; halves
    /// are rounded up. What is not a number reads as word 0 and counts as outside.
    pub fn word(&self, value: f64) -> (u16, bool) {
        let Sensor {
            low, high, step, ..
        } = self.sensor;
        let told = step.map_or(value, |step| (value / step).round() * step);
        let word = self.linear_word(self.converted(told));
        (word, !(low..=high).contains(&value))
    }

    /// The word nearest to a value, by a straight sensor without steps.
    pub fn linear_word(&self, value: f64) -> u16 {
        let Sensor { low, high, .. } = self.sensor;
        // The cast clamps, and takes what is not a number to 0.
        ((value - low) / (high - low) * f64::from(u16::MAX) + 0.5).floor() as u16
    }

    /// What is left of a value by the sensor's curve and its converter, straightened again: one of
    /// 16 bits on a straight sensor leaves the rounding to the word.
    fn converted(&self, value: f64) -> f64 {
        let Sensor {
            low, high, bits, ..
        } = self.sensor;
        match &self.curve {
            None if bits == 16 => value,
            None => {
                let word = converter::word((value - low) / (high - low), bits);
                low + (high - low) * (f64::from(word) / f64::from(u16::MAX))
            }
            Some(curve) => curve.value(quantized(curve.reading(value), bits)),
        }
    }

    /// Whether what it tells has wider steps than words.
    pub fn has_steps(&self) -> bool {
        self.sensor.bits < 16 || self.curve.is_some()
    }

    /// The widest step that the converter makes of what is sensed (SI): where the sensor's curve is
    /// flattest.
    pub fn widest_step(&self) -> f64 {
        let Sensor {
            low, high, bits, ..
        } = self.sensor;
        let part = 1.0 / f64::from((1u32 << bits) - 1);
        let word = (high - low) / f64::from(u16::MAX);
        match &self.curve {
            None if bits == 16 => word,
            None => part * (high - low),
            Some(curve) => curve.widest(part).max(word),
        }
    }

    /// What the sensor of a key reads of a value (SI) in a tick: with its noise, if it says how
    /// much. Every key has noise of its own.
    pub fn read(&self, key: usize, tick: usize, value: f64) -> f64 {
        let stream = noise::stream(&self.name, key as u64);
        let noise = |rms: f64| rms * noise::normal(stream, tick as u64);
        match (&self.curve, self.sensor.noise_rms) {
            (Some(curve), Some(rms)) => curve.with_noise(value, noise(rms)),
            (_, rms) => value + rms.map_or(0.0, noise),
        }
    }

    /// The value (SI) a word of its sensor stands for.
    pub fn sensed(&self, word: u16) -> f64 {
        let Sensor { low, high, .. } = self.sensor;
        low + (high - low) * (f64::from(word) / f64::from(u16::MAX))
    }

    /// What its words mean.
    pub fn scales(&self) -> Scales {
        let Sensor { low, high, .. } = self.sensor;
        Scales {
            sensor_zero: low,
            sensor_lsb: (high - low) / f64::from(u16::MAX),
            drive_lsb: self.drive().full_scale / 32_768.0,
            update_hz: self.sensor.update_hz,
        }
    }

    /// What it measures, in words: `lengths`.
    pub fn measures(&self) -> String {
        match self.moves {
            Moves::Slides => "lengths".to_string(),
            Moves::Turns => "angles".to_string(),
            Moves::Not if self.dim.is_number() => "plain numbers".to_string(),
            Moves::Not => format!("values in {}", self.dim.unit()),
        }
    }
}
