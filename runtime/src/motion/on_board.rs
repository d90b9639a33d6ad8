//! A calibration table as an image has it: pieces of a line between words, and what reads tuned
//! values back.

use std::path::Path;

use whippen_compiler::firmware::{CURVE_PIECES, SensorTuning, TunedSensor};

use super::calibration::Calibration;
use super::table;
use super::tune::readings_at;
use crate::device::Port;
use crate::files::{FileError, InputKind};

/// Places in a curve.
const PLACES: f64 = 65_536.0;
/// Points of each piece at which it is compared with the table.
const COMPARED: usize = 16;
/// What no position is: a sensor that says so is broken.
const RAILS: [u16; 2] = [0, u16::MAX];

/// A table, and how far a key may be from where its image says it is.
#[derive(Debug, Clone, PartialEq)]
pub struct OnBoard {
    /// For the firmware; no key is tuned.
    pub tuning: SensorTuning,
    /// The farthest that the pieces are from the table, between where the key rests and where it is
    /// down (m).
    pub error_m: f64,
}

impl OnBoard {
    /// Of a table, whose key goes from a place to another (m), for the words of a port.
    ///
    /// # Errors
    /// The places are not in the table, or one place.
    pub fn new(table: &Calibration, stops_m: [f64; 2], port: &Port) -> Result<Self, String> {
        let stops = readings_at(table, stops_m)?;
        let (low, high) = table.domain();
        let reading_at = |place: f64| low + (high - low) * place / PLACES;
        let place_of = |reading: f64| PLACES * (reading - low) / (high - low);
        let word = |place: f64| port.linear_word(table.place_m(reading_at(place)));
        let piece = PLACES / CURVE_PIECES as f64;
        let ends = (0..=CURVE_PIECES).map(|at| word(piece * at as f64));
        let [below, above] = [RAILS[0] + 1, RAILS[1] - 1];
        let tuning = SensorTuning {
            curve: ends.map(|word| word.clamp(below, above)).collect(),
            stops: stops.map(|reading| place_of(reading).round().clamp(0.0, PLACES - 1.0) as u16),
            tuned: Vec::new(),
        };
        let [from, to] = stops.map(place_of);
        let (from, to) = (from.min(to), from.max(to));
        let count = CURVE_PIECES * COMPARED;
        let places = (0..count).map(|at| PLACES * at as f64 / count as f64);
        let error = |place: f64| {
            let word = TunedSensor::default().linearised(place as u16, &tuning.curve);
            (port.sensed(word) - table.place_m(reading_at(place))).abs()
        };
        let inside = places.filter(|place| *place >= 1.0 && (from..=to).contains(place));
        let error_m = inside.map(error).fold(0.0, f64::max);
        Ok(Self { tuning, error_m })
    }
}

/// Tuned values as a table with a row for each key: offset and gain, the words of the board's
/// memory.
///
/// # Errors
/// The file cannot be read, or a cell is no whole number of 32 bits.
pub fn tuned_sensors(path: &Path) -> Result<Vec<TunedSensor>, FileError> {
    let mut rows = table::Rows::open(path, InputKind::CALIBRATION)?;
    if rows.titles() != ["offset", "gain"] {
        return Err(FileError::new(
            path,
            "tuned sensors are a table with the titles `offset,gain`",
        )
        .at_line(1));
    }
    let mut tuned = Vec::new();
    while let Some(line) = rows.next_row()? {
        let word = |column: usize| {
            let number = rows.number(column)?;
            let whole = number as i32;
            match f64::from(whole) == number {
                true => Ok(whole),
                false => Err(FileError::new(
                    path,
                    format!("{number} is no whole number of 32 bits"),
                )
                .at_line(line)
                .at_column(column + 1)),
            }
        };
        tuned.push(TunedSensor {
            offset: word(0)?,
            gain: word(1)?,
        });
    }
    Ok(tuned)
}
