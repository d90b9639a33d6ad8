//! Values as a person would write them.

use super::{Dim, parse_unit};
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

/// Units that are usual for what stands on a key, the most usual first. Where none is listed it is
/// SI's.
const USUAL: &[(Dim, &[&str])] = &[
    (Dim::LENGTH, &["mm", "um", "cm", "m"]),
    (Dim::TIME, &["ms", "s", "us"]),
    (Dim::MASS, &["g", "kg"]),
    (Dim::FORCE, &["N", "mN"]),
    (Dim::TORQUE, &["N*m", "mN*m"]),
    (Dim::SPEED, &["m/s", "mm/s"]),
    (Dim::CURRENT, &["A", "mA"]),
];

/// The unit that is most likely meant by a number without one, of a size; `reach` is the largest
/// value (SI) that it can sensibly be, if that is known.
pub fn usual_unit(size: f64, dim: Dim, reach: Option<f64>) -> String {
    let listed = USUAL.iter().find(|(of, _)| *of == dim);
    let units = listed.map_or(&[] as &[&str], |(_, units)| units);
    let fits = |unit: &&&str| {
        let value = parse_unit(unit).map(|unit| unit.to_si(size));
        value.is_some_and(|value| reach.is_none_or(|reach| value <= reach * (1.0 + 1e-9)))
    };
    let usual = units.iter().find(fits).or(units.first());
    usual.map_or_else(|| dim.unit(), |unit| (*unit).to_string())
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
