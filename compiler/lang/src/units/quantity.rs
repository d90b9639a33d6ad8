//! Quantities as they are given on the command line and in device files: `0.4N`, `12.7 mm`, `on`.

use std::fmt;

use super::dim::Dim;
use super::table::nearest_unit;
use super::unit::{Unit, parse_unit};

/// What was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// `on` or `off`.
    Bool(bool),
    /// A number with or without unit.
    Real {
        /// Its value in SI.
        value: f64,
        /// Its dimension.
        dim: Dim,
    },
}

/// Why a text is no quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum QuantityError {
    /// It does not begin with a number.
    NotANumber(String),
    /// The number is too large.
    TooLarge(String),
    /// What follows the number is no unit; a known one that looks like it.
    UnknownUnit(String, Option<&'static str>),
}

impl fmt::Display for QuantityError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            QuantityError::NotANumber(text) => {
                write!(f, "`{text}` is not a number with a unit, such as `0.4N`")
            }
            QuantityError::TooLarge(text) => write!(f, "`{text}` is too large"),
            QuantityError::UnknownUnit(unit, _) if unit.starts_with(',') => {
                f.write_str("the decimal point is `.`, not a comma")
            }
            QuantityError::UnknownUnit(unit, None) => write!(f, "`{unit}` is not a unit"),
            QuantityError::UnknownUnit(unit, Some(near)) => {
                write!(f, "`{unit}` is not a unit; did you mean `{near}`?")
            }
        }
    }
}

impl std::error::Error for QuantityError {}

/// Reads a number with an optional unit (a space between them is optional too), or `on` or `off`.
pub fn parse_quantity(text: &str) -> Result<Quantity, QuantityError> {
    let text = text.trim();
    match text {
        "on" => return Ok(Quantity::Bool(true)),
        "off" => return Ok(Quantity::Bool(false)),
        _ => {}
    }
    let (digits, rest) = text.split_at(number_length(text));
    let number: f64 = digits
        .parse()
        .map_err(|_| QuantityError::NotANumber(text.to_string()))?;
    let rest = rest.trim_start();
    let unit = if rest.is_empty() {
        Unit::ONE
    } else {
        parse_unit(rest).ok_or_else(|| unknown(rest))?
    };
    let value = unit.to_si(number);
    if value.is_finite() {
        Ok(Quantity::Real {
            value,
            dim: unit.dim,
        })
    } else {
        Err(QuantityError::TooLarge(text.to_string()))
    }
}

/// Length of the number at the beginning: sign, digits, fraction, exponent.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = usize::from(text.starts_with(['+', '-']));
    end += digits(end);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        let exponent = digits(end + 1 + sign);
        end += if exponent > 0 { 1 + sign + exponent } else { 0 };
    }
    end
}

/// Names the first word that is no unit.
fn unknown(unit: &str) -> QuantityError {
    let mut words = unit
        .split(['*', '/', '^', ' '])
        .filter(|w| w.starts_with(|c: char| c.is_alphabetic()));
    let word = words.find(|w| parse_unit(w).is_none()).unwrap_or(unit);
    QuantityError::UnknownUnit(word.to_string(), nearest_unit(word))
}
