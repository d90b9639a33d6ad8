//! A rate as a number of JSON.

use serde_json::Number;
use whippen_compiler::rate::Rate;

/// Ticks per second: a whole number where it is one, or else the nearest `f64`, of which
/// [`Rate::of_hz`] makes the same rate again.
pub fn number(rate: Rate) -> Number {
    match rate.fraction() {
        [whole, 1] => Number::from(whole),
        _ => Number::from_f64(rate.hz()).unwrap_or_else(|| rate.rounded_hz().into()),
    }
}
