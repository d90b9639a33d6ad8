//! Parameters: what is set before an instrument is played, while it is played, and by key.

use whippen_source::Span;

use super::Interval;
use crate::units::Dim;

/// `param`: a number, as a constant, a live value or a value per key.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its full name, by which it is set.
    pub name: String,
    /// Its dimension.
    pub dim: Dim,
    /// What it is, as written or as set (SI).
    pub value: f64,
    /// Its declared bounds (SI).
    pub range: Option<Interval>,
    /// Where its value is written.
    pub span: Span,
}

/// `live param`: a number or a bool.
#[derive(Debug, Clone)]
pub struct Live {
    /// Name.
    pub name: String,
    /// What it is: `None` for a bool.
    pub dim: Option<Dim>,
    /// The unit of its values in SI, in the words of the text: a pitch is in `Hz`, what turns in
    /// `rad/s`. Empty for plain numbers and bools.
    pub unit: String,
    /// Value at the start (SI; bools 0 or 1).
    pub value: f64,
    /// Its bounds (SI; 0 .. 1 for a bool).
    pub range: Interval,
    /// Where it is declared.
    pub span: Span,
}

/// A parameter that the keyboard sets per key.
#[derive(Debug, Clone)]
pub struct Keyed {
    /// Name.
    pub name: String,
    /// Its dimension.
    pub dim: Dim,
    /// One value per key (SI), in the order of the keys.
    pub values: Vec<f64>,
    /// Bounds: those declared, else the smallest interval that holds the values.
    pub range: Interval,
    /// Where it is set.
    pub span: Span,
}
