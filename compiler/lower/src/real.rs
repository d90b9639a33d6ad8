//! A real value as an integer: `real = lsb * integer + offset`, within an error.

use super::format::{exp2, exponent, quantize};
use whippen_kernel::Value;

/// How one real value is represented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Real {
    /// The integer (i32).
    pub value: Value,
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value at integer 0 (SI); 0 for everything but sensor words and rates
    /// (`Units::scale_of_cell`).
    pub offset: f64,
    /// Bound on what one tick's roundings add to it (SI).
    pub error: f64,
}

/// A unit, and where its integers begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value at integer 0 (SI).
    pub offset: f64,
}

impl Scale {
    /// Integers that count from zero.
    pub fn plain(lsb: f64) -> Scale {
        Scale { lsb, offset: 0.0 }
    }

    /// The nearest integer, saturated to 62 bits.
    pub fn quantize(self, value: f64) -> i64 {
        quantize(value - self.offset, self.lsb)
    }
}

impl Real {
    /// How its integers count.
    pub fn scale(self) -> Scale {
        Scale {
            lsb: self.lsb,
            offset: self.offset,
        }
    }

    /// A value in units of `lsb`.
    pub fn new(value: Value, lsb: f64, error: f64) -> Real {
        Real {
            value,
            lsb,
            offset: 0.0,
            error,
        }
    }
}

/// What moving an integer by `n` places rounds down, in units of the result.
pub(super) fn floored(n: i32) -> f64 {
    if n < 0 { 1.0 - exp2(n.max(-31)) } else { 0.0 }
}

/// `n` where `ratio` is `2^n` but for what arithmetic in f64 rounds, -62 <= n <= 62.
pub(super) fn power_of_two(ratio: f64) -> Option<i32> {
    let exponent = exponent(ratio);
    let near = |n: &i32| n.abs() <= 62 && (ratio * exp2(-n) - 1.0).abs() < 1e-12;
    [exponent, exponent + 1].into_iter().find(near)
}

#[cfg(test)]
mod tests {
    use super::power_of_two;

    #[test]
    fn what_rounding_moved_is_a_power_all_the_same() {
        assert_eq!(power_of_two(1.0), Some(0));
        assert_eq!(power_of_two(0.25), Some(-2));
        assert_eq!(power_of_two(8.0_f64.next_down()), Some(3));
        assert_eq!(power_of_two((1.0 / 44_100.0) * 44_100.0 * 0.5), Some(-1));
        assert_eq!([3.0, 1.0 + 1e-9, 0.0].map(power_of_two), [None; 3]);
    }
}
