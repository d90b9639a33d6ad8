//! Sensors: from a converter's word to the word that a program reads, and the tuning that finds
//! how; the integers of `tuning.s`, in Rust.
//!
//! ```text
//!   word --* gain + offset--> place in the curve, 16 bits --256 pieces of a line--> word of the position
//!   readings --median of five--> least, greatest, at rest --> offset, gain
//! ```
//!
//! Not here: the curve itself, which is made of a calibration table (the runtime).

use std::fmt::Write;

use super::ports::Guards;
use super::{CORES, FirmwareError, Setup};

/// Pieces of the curve, each a line.
pub const CURVE_PIECES: usize = 256;
/// A gain of 1.
const ONE: i32 = 1 << 13;
/// What is added so that a place is rounded to the nearest.
const HALF: i32 = ONE / 2;
/// The greatest gain, either way: with it no sum exceeds 32 bits.
const GAIN_MAX: i32 = 3 * ONE;
/// The least way from rest to the other end, in places of the curve: a gain that is larger than
/// noise.
const SPAN_MIN: u16 = 4096;
/// Readings of which the median counts.
const MEDIAN: usize = 5;

/// Through what the sensors of all keys are read.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SensorTuning {
    /// The word of the position at each end of a piece, monotone, no rail.
    pub curve: Vec<u16>,
    /// Where in the curve a key rests, and where it is when down (places, 65536 for the whole
    /// curve).
    pub stops: [u16; 2],
    /// What each key has from the start, in the order of the keyboard; those that have none read
    /// the whole curve over the whole range of the converter.
    pub tuned: Vec<TunedSensor>,
}

/// The sensor of a key: place = (word * gain + offset) / 2^13.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TunedSensor {
    /// With the half that rounds.
    pub offset: i32,
    /// 2^13 is 1.
    pub gain: i32,
}

impl Default for TunedSensor {
    fn default() -> Self {
        Self {
            offset: HALF,
            gain: ONE,
        }
    }
}

impl TunedSensor {
    /// Whether the board can compute with it: no sum exceeds 32 bits.
    pub fn is_possible(&self) -> bool {
        let ends =
            [0, 0xffff].map(|word: i64| word * i64::from(self.gain) + i64::from(self.offset));
        self.gain.abs() <= GAIN_MAX && ends.iter().all(|end| i32::try_from(*end).is_ok())
    }

    /// The word of the position for a word of the converter. A rail stays what it is.
    pub fn linearised(&self, word: u16, curve: &[u16]) -> u16 {
        if word == 0 || word == u16::MAX {
            return word;
        }
        let place = i32::from(word)
            .wrapping_mul(self.gain)
            .wrapping_add(self.offset)
            >> 13;
        let place = place.clamp(0, 0xffff);
        let (piece, part) = ((place >> 8) as usize, place & 0xff);
        let [from, to] = [curve[piece], curve[piece + 1]].map(i32::from);
        (from + (((to - from) * part) >> 8)) as u16
    }
}

impl SensorTuning {
    /// Places from rest to the other end, without sign.
    pub(super) fn span(&self) -> u16 {
        self.stops[0].abs_diff(self.stops[1])
    }

    /// Whether the table's readings fall on that way.
    pub(super) fn falls(&self) -> bool {
        self.stops[1] < self.stops[0]
    }

    /// Where a key rests, in the unit of offsets.
    pub(super) fn rest_scaled(&self) -> i32 {
        i32::from(self.stops[0]) * ONE + HALF
    }

    /// That the firmware can do it.
    pub(super) fn check(&self, setup: &Setup) -> Result<(), FirmwareError> {
        let refuse = |why: String| Err(FirmwareError::Tuning(why));
        let keys = setup.keys.iter().sum::<u32>() as usize;
        if setup.guards() == Guards::Ports {
            return refuse("sensors of an instrument with several ports are not calibrated".into());
        }
        if self.span() < SPAN_MIN {
            return refuse(format!(
                "rest and full are 1/{} of the calibration's readings apart; at least 1/16 is needed",
                0x10000 / u32::from(self.span().max(1))
            ));
        }
        if !self.tuned.is_empty() && self.tuned.len() != keys {
            let rows = self.tuned.len();
            return refuse(format!(
                "{rows} sensors are tuned, and there are {keys} keys"
            ));
        }
        if let Some(at) = self.tuned.iter().position(|own| !own.is_possible()) {
            return refuse(format!(
                "offset and gain of sensor {at} are out of range: gain -3..3, in units of 1/8192, \
                 and offset + 65535 * gain within 32 bits"
            ));
        }
        Ok(())
    }

    /// The curve and the keys' sensors, for so many keys of each core.
    pub(super) fn tables_as_assembly(&self, keys: &[u32]) -> String {
        let mut text = String::new();
        let mut first = 0;
        for (core, &count) in keys.iter().enumerate() {
            let section = section(CORES[core]);
            let _ = writeln!(
                text,
                "        .section {section}, \"aw\"\n        .balign 4\n        \
                 .global tuned{core}, curve{core}\ntuned{core}:"
            );
            for key in first..first + count as usize {
                let TunedSensor { offset, gain } = self.tuned.get(key).copied().unwrap_or_default();
                let _ = writeln!(text, "        .word   {offset}, {gain}");
            }
            first += count as usize;
            let _ = writeln!(text, "curve{core}:");
            for row in self.curve.chunks(16) {
                let row: Vec<String> = row.iter().map(u16::to_string).collect();
                let _ = writeln!(text, "        .short  {}", row.join(", "));
            }
            text.push_str("        .balign 4\n");
        }
        text
    }
}

/// The section of a core's tables.
pub(super) fn section(core: &str) -> String {
    format!(".data.{core}.tuning")
}

/// What is known of a key's sensor while it is tuned.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Watched {
    last: Vec<u16>,
    /// At rest, least, greatest: medians.
    found: Option<[u16; 3]>,
}

impl Watched {
    /// One more reading.
    pub fn read(&mut self, word: u16) {
        self.last.push(word);
        if self.last.len() < MEDIAN {
            return;
        }
        let mut ordered = self.last.clone();
        ordered.sort_unstable();
        let median = ordered[MEDIAN / 2];
        self.last.remove(0);
        let [rest, least, greatest] = self.found.unwrap_or([median; 3]);
        self.found = Some([rest, least.min(median), greatest.max(median)]);
    }

    /// The least and the greatest median.
    pub fn ends(&self) -> Option<[u16; 2]> {
        self.found.map(|[_, least, greatest]| [least, greatest])
    }

    /// What follows for the sensor, if its key has moved over a third of the way that the curve
    /// says, or more.
    pub fn tuned(&self, tuning: &SensorTuning) -> Option<TunedSensor> {
        let [rest, least, greatest] = self.found?.map(i32::from);
        let (way, span) = (greatest - least, i32::from(tuning.span()));
        if 3 * way < span {
            return None;
        }
        let gain = (span * ONE + way / 2) / way;
        let rises = rest - least < greatest - rest;
        let (at_rest, sign) = match rises {
            true => (least, 1),
            false => (greatest, -1),
        };
        let gain = if tuning.falls() { -sign } else { sign } * gain;
        Some(TunedSensor {
            offset: tuning
                .rest_scaled()
                .wrapping_sub(gain.wrapping_mul(at_rest)),
            gain,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tuning(stops: [u16; 2]) -> SensorTuning {
        SensorTuning {
            curve: (0..=CURVE_PIECES).map(|at| (1 + at * 255) as u16).collect(),
            stops,
            tuned: Vec::new(),
        }
    }

    /// Whatever the readings, and wherever the stops, the board can compute with what it found.
    #[test]
    fn what_is_found_is_possible() {
        for stops in [
            [0, 65_535],
            [65_535, 0],
            [0, 4096],
            [61_440, 65_535],
            [40_000, 10_000],
        ] {
            for ends in [
                [0, 65_535],
                [0, 21_845],
                [43_690, 65_535],
                [1, 1366],
                [64_000, 65_535],
            ] {
                for readings in [ends, [ends[1], ends[0]]] {
                    let mut watched = Watched::default();
                    let words = readings.map(|end| [end; 9]);
                    words
                        .as_flattened()
                        .iter()
                        .for_each(|word| watched.read(*word));
                    let Some(tuned) = watched.tuned(&tuning(stops)) else {
                        assert!(
                            3 * u32::from(ends[1] - ends[0])
                                < u32::from(stops[0].abs_diff(stops[1]))
                        );
                        continue;
                    };
                    assert!(tuned.is_possible(), "{stops:?} {readings:?}: {tuned:?}");
                    // Ends come out where they should, within what rounding of the gain makes.
                    for (reading, stop) in readings.into_iter().zip(stops) {
                        let place = (i32::from(reading) * tuned.gain + tuned.offset) >> 13;
                        assert!((place - i32::from(stop)).abs() <= 4, "{place} of {stop}");
                    }
                }
            }
        }
    }

    #[test]
    fn two_wrong_readings_in_a_row_change_nothing() {
        let mut watched = Watched::default();
        let words = [9000; 9].into_iter().chain([50_000; 9]).enumerate();
        words.for_each(|(at, word)| {
            watched.read(if [4, 5, 14, 15].contains(&at) {
                65_535
            } else {
                word
            })
        });
        assert_eq!(watched.ends(), Some([9000, 50_000]));
    }
}
