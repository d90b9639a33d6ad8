//! A real value as an integer: `real = lsb * integer + offset`, within an error.

use crate::kernel::Value;

/// How one real value is represented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Real {
    /// The integer (i32).
    pub value: Value,
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value at integer 0 (SI); 0 for everything but sensor words.
    pub offset: f64,
    /// Fraction bits if `lsb` is a power of two and `offset` is zero.
    pub bits: Option<i32>,
    /// Bound on what one tick's roundings add to it (SI).
    pub error: f64,
}

impl Real {
    /// A value with so many fraction bits.
    pub fn fixed(value: Value, bits: i32, error: f64) -> Real {
        Real { value, lsb: super::format::exp2(-bits), offset: 0.0, bits: Some(bits), error }
    }
}
