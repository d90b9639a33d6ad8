//! Calibration of a position sensor: from raw readings to metres by a measured table.
//!
//! ```text
//!   front_of_key_mm,adc_after_offset_0.30_gain_0.58        position = table^-1((raw - offset) / gain)
//!   0.000,0
//!   0.794,0.0015
//! ```
//!
//! The title of the first column carries the unit of the position, that of the second may carry
//! offset and gain (else 0 and 1). The table is strictly monotone; it is inverted by a smooth
//! monotone interpolation. A reading beyond its ends is held at the end and counted: the sensor's
//! response folds there and cannot be told apart.

use std::path::Path;

use whippen_compiler::units::{Dim, Unit};

use super::pchip::Pchip;
use super::table;
use crate::files::{FileError, InputKind};
use crate::titles::split_title;

/// A calibration table, ready for use.
#[derive(Debug, Clone)]
pub struct Calibration {
    offset: f64,
    gain: f64,
    position_m: Pchip,
}

impl Calibration {
    /// Reads a table.
    ///
    /// # Errors
    /// The file cannot be read, a title has no length, a cell is no number, or the readings are not
    /// strictly monotone.
    pub fn load(path: &Path) -> Result<Calibration, FileError> {
        let mut rows = table::Rows::open(path, InputKind::CALIBRATION)?;
        let [position, reading] = rows.titles() else {
            return Err(FileError::new(
                path,
                "a calibration table has two columns: position and reading",
            )
            .at_line(1));
        };
        let unit = length_unit(position).ok_or_else(|| {
            let message =
                format!("the title `{position}` has no unit of length, as in `front_of_key_mm`");
            FileError::new(path, message).at_line(1).at_column(1)
        })?;
        let offset = number_after(reading, "offset_").unwrap_or(0.0);
        let gain = number_after(reading, "gain_").unwrap_or(1.0);
        if gain == 0.0 {
            return Err(FileError::new(path, "the gain is zero")
                .at_line(1)
                .at_column(2));
        }
        let (mut readings, mut positions) = (Vec::new(), Vec::new());
        while let Some(line) = rows.next_row()? {
            positions.push(unit.to_si(rows.number(0)?));
            readings.push(rows.number(1)?);
            monotone(&readings)
                .map_err(|message| FileError::new(path, message).at_line(line).at_column(2))?;
        }
        if readings.first() > readings.last() {
            readings.reverse();
            positions.reverse();
        }
        let position_m = Pchip::new(readings, positions)
            .ok_or_else(|| FileError::new(path, "a calibration table needs at least two rows"))?;
        Ok(Calibration {
            offset,
            gain,
            position_m,
        })
    }

    /// The position (m) of a raw reading, and whether it lay beyond the ends of the table.
    pub fn position_m(&self, raw: f64) -> (f64, bool) {
        let reading = (raw - self.offset) / self.gain;
        let (low, high) = self.position_m.domain();
        (self.position_m.at(reading), reading < low || reading > high)
    }
}

impl Calibration {
    /// The least and the greatest reading of the table, without offset and gain.
    pub fn domain(&self) -> (f64, f64) {
        self.position_m.domain()
    }

    /// The position (m) of a reading without offset and gain; beyond the ends that of the end.
    pub fn place_m(&self, reading: f64) -> f64 {
        self.position_m.at(reading)
    }
}

/// Halvings with which a place's reading is found: to the last bits of a number.
const HALVINGS: usize = 60;

impl Calibration {
    /// The least and the greatest position of the table (m).
    pub fn ends_m(&self) -> [f64; 2] {
        let (low, high) = self.position_m.domain();
        let [a, b] = [low, high].map(|reading| self.position_m.at(reading));
        [a.min(b), a.max(b)]
    }

    /// The table's reading at a position (m), without offset and gain; beyond the ends that of the
    /// end.
    pub fn reading(&self, position_m: f64) -> f64 {
        let (mut low, mut high) = self.position_m.domain();
        let [at_low, at_high] = [low, high].map(|reading| self.position_m.at(reading));
        let rises = at_high > at_low;
        // Ends are what they are, to the last bit.
        if let Some((_, end)) = [(at_low, low), (at_high, high)]
            .into_iter()
            .find(|end| end.0 == position_m)
        {
            return end;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match (self.position_m.at(middle) < position_m) == rises {
                true => low = middle,
                false => high = middle,
            }
        }
        0.5 * (low + high)
    }
}

fn length_unit(title: &str) -> Option<Unit> {
    split_title(title).1.filter(|unit| unit.dim == Dim::LENGTH)
}

/// The number that follows a word in a title.
fn number_after(title: &str, word: &str) -> Option<f64> {
    let (_, rest) = title.split_once(word)?;
    rest.split('_')
        .next()?
        .parse()
        .ok()
        .filter(|v: &f64| v.is_finite())
}

/// Whether the last reading goes on in the direction of the first two.
fn monotone(readings: &[f64]) -> Result<(), String> {
    let [first, second, ..] = readings else {
        return Ok(());
    };
    let [.., before, last] = readings else {
        return Ok(());
    };
    let goes_on = if second > first {
        last > before
    } else {
        last < before
    };
    if goes_on {
        Ok(())
    } else {
        Err(format!(
            "readings must rise or fall throughout, but {last} follows {before}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<Calibration, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("table.csv");
        std::fs::write(&path, text).unwrap();
        Calibration::load(&path).map_err(|e| {
            e.to_string()
                .replace(&path.display().to_string(), "table.csv")
        })
    }

    #[test]
    fn offset_gain_unit_and_ends() {
        let c = load("key_mm,adc_after_offset_0.5_gain_-2\n0,0\n1,0.5\n3,1\n").unwrap();
        let (m, clipped) = c.position_m(0.5 - 2.0 * 0.5);
        assert!((m - 0.001).abs() < 1e-15 && !clipped);
        assert_eq!(c.position_m(-1.6), (0.003, true));
        assert_eq!(c.position_m(0.6), (0.0, true));
        assert_eq!(c.position_m(0.5), (0.0, false));
        let falling = load("x_um,counts\n0,100\n10,60\n20,0\n").unwrap();
        assert!((falling.position_m(60.0).0 - 10e-6).abs() < 1e-18);
    }

    #[test]
    fn mistakes_in_tables() {
        let message = |text| load(text).unwrap_err();
        insta::assert_snapshot!(
            [
                message("key,adc\n0,0\n1,1\n"),
                message("key_mm\n0\n"),
                message("key_mm,adc_gain_0\n0,0\n1,1\n"),
                message("key_mm,adc\n0,0\n1,1\n2,1\n"),
                message("key_mm,adc\n0,0\n1,one\n"),
                message("key_mm,adc\n0,0\n1\n"),
                message("key_mm,adc\n0,0\n"),
                message(""),
            ]
            .join("\n")
        );
    }
}
