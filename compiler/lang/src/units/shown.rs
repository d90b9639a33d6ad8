//! Values as a person would write them.

use super::Dim;
use crate::model::Interval;

/// Small values of these are shown in a thousandth of the SI unit.
const THOUSANDTHS: &[(Dim, &str)] = &[(Dim::LENGTH, "mm"), (Dim::TIME, "ms"), (Dim::MASS, "g")];

/// Below this a thousandth is shown (SI).
const SMALL: f64 = 0.1;

/// A value with its unit: `7 mm`, `0.5 N/m`, `3`.
pub fn shown(value: f64, dim: Dim) -> String {
    in_unit(value, unit(value.abs(), dim))
}

/// A range, both ends in one unit: `0 mm .. 10 mm`.
pub fn shown_range(range: Interval, dim: Dim) -> String {
    let unit = unit(range.low.abs().max(range.high.abs()), dim);
    format!(
        "{} .. {}",
        in_unit(range.low, unit.clone()),
        in_unit(range.high, unit)
    )
}

/// The unit for values up to this size, and how much of it the SI unit is.
fn unit(size: f64, dim: Dim) -> (String, f64) {
    match THOUSANDTHS
        .iter()
        .find(|(d, _)| *d == dim && size != 0.0 && size < SMALL)
    {
        Some((_, unit)) => ((*unit).to_string(), 1e3),
        None => (dim.unit(), 1.0),
    }
}

fn in_unit(value: f64, (unit, factor): (String, f64)) -> String {
    let number = number(value * factor);
    if unit.is_empty() {
        number
    } else {
        format!("{number} {unit}")
    }
}

/// A number as one would write it: six digits, an exponent only where it helps.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let size = rounded.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}
