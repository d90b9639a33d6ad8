//! Motions as bare columns of numbers at a known rate, separated by spaces, tabs or commas.

use std::io::{BufRead, BufReader};
use std::path::Path;

use super::ROWS_MAX;
use super::calibration::Calibration;
use super::table::finite;
use super::titled::too_many_rows;
use crate::files::{FileError, InputKind, open};

/// What was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Raw {
    /// Positions (m).
    pub positions_m: Vec<f64>,
    /// How many of them lay beyond the ends of the calibration table.
    pub clipped: usize,
}

/// A dead band in front of readings, as the play of a gear: what moves by less than its half width
/// does not move.
struct DeadBand {
    half: f64,
    held: Option<f64>,
}

impl DeadBand {
    fn follow(&mut self, reading: f64) -> f64 {
        let held = self.held.unwrap_or(reading);
        let held = held.clamp(reading - self.half, reading + self.half);
        *self.held.insert(held)
    }
}

/// Reads one column (counted from 1) through a dead band of so much to either side; without a
/// calibration its numbers are metres.
///
/// # Errors
/// The file cannot be read, is empty, has an empty line amid others or too few columns, or a number
/// is not finite, or there are more than [`ROWS_MAX`] rows.
pub fn read(
    path: &Path,
    column: usize,
    calibration: Option<&Calibration>,
    dead_band: f64,
) -> Result<Raw, FileError> {
    let mut reader = BufReader::with_capacity(1 << 16, open(path, InputKind::RECORDING)?);
    let mut raw = Raw {
        positions_m: Vec::new(),
        clipped: 0,
    };
    let mut dead_band = DeadBand {
        half: dead_band,
        held: None,
    };
    let (mut text, mut empty_line) = (String::new(), None);
    for line in 1.. {
        let error = |message: String| FileError::new(path, message).at_line(line);
        text.clear();
        if reader
            .read_line(&mut text)
            .map_err(|e| error(e.to_string()))?
            == 0
        {
            break;
        }
        if text.trim().is_empty() {
            empty_line = empty_line.or(Some(line));
            continue;
        }
        if let Some(line) = empty_line {
            return Err(
                FileError::new(path, "this line is empty, though numbers follow").at_line(line),
            );
        }
        let cell = cell(&text, column).map_err(error)?;
        let hint = if line == 1 && cell.starts_with(char::is_alphabetic) {
            "; a table with titles needs no rate"
        } else {
            ""
        };
        let number =
            finite(cell).map_err(|message| error(format!("{message}{hint}")).at_column(column))?;
        let number = dead_band.follow(number);
        let (position_m, clipped) = calibration.map_or((number, false), |c| c.position_m(number));
        if raw.positions_m.len() == ROWS_MAX {
            return Err(too_many_rows(path, ROWS_MAX));
        }
        raw.positions_m.push(position_m);
        raw.clipped += usize::from(clipped);
    }
    if raw.positions_m.is_empty() {
        Err(FileError::new(path, "is empty"))
    } else {
        Ok(raw)
    }
}

/// One cell of a line, the columns counted from 1.
fn cell(line: &str, column: usize) -> Result<&str, String> {
    let index = column.checked_sub(1).ok_or("columns are counted from 1")?;
    let (found, count) = if line.contains(',') {
        (
            line.split(',').nth(index).map(str::trim),
            line.split(',').count(),
        )
    } else {
        (
            line.split_whitespace().nth(index),
            line.split_whitespace().count(),
        )
    };
    found.ok_or_else(|| format!("column {column} is asked for, but this line has {count}"))
}
