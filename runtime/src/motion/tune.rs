//! Tuning of a position sensor: from readings of a key that rested and was then moved to both ends
//! to offset and gain of a calibration table.
//!
//! ```text
//!   readings --median of five--> least, greatest --the table's readings at rest and full--> offset, gain
//! ```
//!
//! The first readings are of the key at rest and say which of the two ends that is. Medians leave
//! out up to two wrong readings in a row. What the table then makes of readings is monotone,
//! because the table is.

use std::path::Path;

use super::calibration::Calibration;
use super::raw;
use crate::files::FileError;

/// So many readings in a row have a median.
const MEDIAN: usize = 5;
/// Fewest readings.
const READINGS_MIN: usize = 100;
/// So many of the first are of the key at rest: this part of all.
const RESTS: usize = 50;
/// The ends of the readings are further apart than so many times what neighbours differ by.
const MOVED: f64 = 20.0;

/// What a tuning found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// The least and the greatest reading, wrong ones aside.
    pub ends: [f64; 2],
    /// Whether readings rise when the key goes down.
    pub rises: bool,
    /// A reading is this and..
    pub offset: f64,
    /// ..so many times that of the table.
    pub gain: f64,
}

/// Tunes a table, whose key goes from a place to another (m).
///
/// # Errors
/// There are too few readings, the key did not move, or the places are not in the table.
pub fn tune(readings: &[f64], table: &Calibration, stops_m: [f64; 2]) -> Result<Tuning, String> {
    if readings.len() < READINGS_MIN {
        let count = readings.len();
        return Err(format!(
            "has {count} readings, and at least {READINGS_MIN} are needed"
        ));
    }
    let medians: Vec<f64> = readings.windows(MEDIAN).map(median).collect();
    let least = medians.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = medians.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let steps: Vec<f64> = readings
        .windows(2)
        .map(|two| (two[1] - two[0]).abs())
        .collect();
    if greatest - least <= MOVED * median(&steps) || greatest == least {
        return Err("shows no key that moves from end to end".to_string());
    }
    let rest = median(&medians[..medians.len() / RESTS + 1]);
    let rises = rest - least < greatest - rest;
    let [at_rest, at_full] = if rises {
        [least, greatest]
    } else {
        [greatest, least]
    };
    let [rest, full] = readings_at(table, stops_m)?;
    let gain = (at_full - at_rest) / (full - rest);
    Ok(Tuning {
        ends: [least, greatest],
        rises,
        offset: at_rest - gain * rest,
        gain,
    })
}

/// The table's readings where the key rests and where it is down (m).
///
/// # Errors
/// The places are not in the table, or one place.
pub fn readings_at(table: &Calibration, stops_m: [f64; 2]) -> Result<[f64; 2], String> {
    let [from_m, to_m] = table.ends_m();
    for place in stops_m {
        if !(from_m..=to_m).contains(&place) {
            let (place, from, to) = (1e3 * place, 1e3 * from_m, 1e3 * to_m);
            return Err(format!(
                "{place} mm is beyond the table, from {from} mm to {to} mm"
            ));
        }
    }
    let [rest, full] = stops_m.map(|place| table.reading(place));
    if rest == full {
        return Err("the key rests where it is down; its two places must differ".to_string());
    }
    Ok([rest, full])
}

/// The readings of a bare column.
///
/// # Errors
/// As of any recording of bare columns.
pub fn readings(path: &Path, column: usize) -> Result<Vec<f64>, FileError> {
    raw::read(path, column, None, 0.0).map(|raw| raw.positions_m)
}

fn median(values: &[f64]) -> f64 {
    let mut ordered = values.to_vec();
    ordered.sort_by(f64::total_cmp);
    ordered.get(ordered.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Calibration {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("table.csv");
        std::fs::write(&path, "key_mm,adc\n0,0\n2,0.1\n5,0.5\n10,0.9\n12,1\n").expect("writable");
        Calibration::load(&path).expect("a table")
    }

    /// A key at rest, two presses all the way, at rest again.
    fn places() -> Vec<f64> {
        let press = |n: i32| 5e-3 * (1.0 - (f64::from(n) * 1e-3 * std::f64::consts::TAU).cos());
        let presses = (0..2000).map(press);
        let rest = |count| std::iter::repeat_n(0.0, count);
        rest(200).chain(presses).chain(rest(200)).collect()
    }

    #[test]
    fn a_tuned_table_gives_the_places_back() {
        let table = table();
        for (offset, gain) in [(0.2, 0.5), (3000.0, -2500.0)] {
            let place_of = |raw: f64, tuning: &Tuning| {
                let (place, _) = table.position_m((raw - tuning.offset) / tuning.gain);
                place
            };
            let mut raw: Vec<f64> = places()
                .iter()
                .map(|x| offset + gain * table.reading(*x))
                .collect();
            raw[700] += 3.0 * gain;
            raw[701] -= 3.0 * gain;
            let tuning = tune(&raw, &table, [0.0, 10e-3]).expect("a key that moves");
            assert_eq!(tuning.rises, gain > 0.0);
            assert!((tuning.gain / gain - 1.0).abs() < 1e-3, "{tuning:?}");
            for (n, (x, raw)) in places().iter().zip(&raw).enumerate() {
                let off = (place_of(*raw, &tuning) - x).abs();
                assert!(off < 10e-6 || (700..702).contains(&n), "{n}: {off}");
            }
        }
    }

    #[test]
    fn what_cannot_be_tuned_is_said() {
        let table = table();
        let stops = [0.0, 10e-3];
        let why = |readings: &[f64], stops| tune(readings, &table, stops).expect_err("refused");
        assert!(why(&[1.0; 20], stops).contains("has 20 readings"));
        assert!(why(&[1.0; 500], stops).contains("no key that moves"));
        let noise: Vec<f64> = (0..500).map(|n| f64::from(n * 7919 % 101)).collect();
        assert!(why(&noise, stops).contains("no key that moves"));
        let moves: Vec<f64> = places().iter().map(|x| table.reading(*x)).collect();
        assert!(why(&moves, [0.0, 20e-3]).contains("20 mm is beyond the table"));
        assert!(why(&moves, [0.0, 0.0]).contains("must differ"));
    }
}
