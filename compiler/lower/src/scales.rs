//! Scales of a device: how raw words map to the world, for lowering and every engine.

use whippen_lang::model::{Interval, Model};
use whippen_rate::Rate;

/// Scales of the ports of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct PortScales {
    /// By the names of the ports, at least one.
    ports: Vec<(String, Scales)>,
}

impl From<Scales> for PortScales {
    /// A device with a single port, which takes any name.
    fn from(only: Scales) -> PortScales {
        PortScales {
            ports: vec![(String::new(), only)],
        }
    }
}

impl PortScales {
    /// Those of a device with named ports; a single one takes any name.
    ///
    /// # Panics
    /// There is none.
    pub fn new(ports: Vec<(String, Scales)>) -> PortScales {
        assert!(!ports.is_empty(), "a device has a port");
        PortScales { ports }
    }

    /// The scales of each sense of an instrument that fits the device, in their order; at least
    /// one. A sense that the device does not have gets those of the first port.
    pub fn of(&self, model: &Model) -> Vec<Scales> {
        let (_, first) = self.ports[0];
        let named = |name: &str| self.ports.iter().find(|(port, _)| port == name);
        let senses = model.senses.iter();
        let mut all: Vec<Scales> = senses
            .map(|sense| named(&sense.name).map_or(first, |(_, scales)| *scales))
            .collect();
        if all.is_empty() {
            all.push(first);
        }
        all
    }
}

/// Scales of the sensor and drive words of one port.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Sensed value (SI) at sensor word 0.
    pub sensor_zero: f64,
    /// Sensed value per unit of the sensor word (SI).
    pub sensor_lsb: f64,
    /// Force (N; N*m for what turns) per unit of the drive word.
    pub drive_lsb: f64,
    /// How often the sensor is read (Hz); none for every tick.
    pub update_hz: Option<f64>,
}

impl Scales {
    /// The sensed value of a word.
    pub fn sensed(&self, word: i64) -> f64 {
        self.sensor_zero + self.sensor_lsb * word as f64
    }

    /// First and last word whose value lies in `range` (a millionth of a word of slack at each end,
    /// so that a range that ends on a word keeps it). Empty ranges give the nearest word twice.
    pub fn words_in(&self, range: Interval) -> (i64, i64) {
        let word = |value: f64| (value - self.sensor_zero) / self.sensor_lsb;
        let low = (word(range.low) - 1e-6).ceil().clamp(0.0, 65535.0) as i64;
        let high = (word(range.high) + 1e-6).floor().clamp(0.0, 65535.0) as i64;
        (low, high.max(low))
    }

    /// Whole words per tick that `speed` (SI per second) allows; at least 1.
    pub fn words_per_tick(&self, speed: f64, rate_hz: Rate) -> i64 {
        (speed / f64::from(rate_hz) / self.sensor_lsb)
            .floor()
            .clamp(1.0, 65535.0) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIKEY: Scales = Scales {
        sensor_zero: -0.5e-3,
        sensor_lsb: 11e-3 / 65535.0,
        drive_lsb: 20.0 / 32768.0,
        update_hz: None,
    };

    #[test]
    fn the_whole_sensor_range_keeps_every_word() {
        assert_eq!(
            MIKEY.words_in(Interval {
                low: -0.5e-3,
                high: 10.5e-3
            }),
            (0, 65535)
        );
        assert_eq!(
            MIKEY.words_in(Interval {
                low: -1.0,
                high: 1.0
            }),
            (0, 65535)
        );
        let (low, high) = MIKEY.words_in(Interval {
            low: 0.0,
            high: 10e-3,
        });
        assert!(MIKEY.sensed(low) >= 0.0 && MIKEY.sensed(low - 1) < 0.0);
        assert!(MIKEY.sensed(high) <= 10e-3 && MIKEY.sensed(high + 1) > 10e-3);
    }

    #[test]
    fn ten_metres_per_second_is_1350_words_per_tick() {
        assert_eq!(MIKEY.words_per_tick(10.0, 44_100.into()), 1350);
        assert_eq!(MIKEY.words_per_tick(1e-9, 44_100.into()), 1);
    }
}
