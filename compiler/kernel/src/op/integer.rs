//! What meanings of operators compute with.

use std::ops::{Add, Mul, Shl, Shr, Sub};

use super::QUOTIENTS;
use crate::Range;

/// What computes like integers without bounds. Truths are 0 and 1.
///
/// `i128` does, as long as nothing is larger; the interpreter and the verifier have that. So may a
/// term of a solver, of which every number is asked at once.
pub trait Integer:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Shl<Output = Self>
    + Shr<Output = Self>
{
    /// A number.
    fn of(number: i128) -> Self;

    /// The smaller one.
    #[must_use]
    fn least(self, other: Self) -> Self;

    /// The larger one.
    #[must_use]
    fn most(self, other: Self) -> Self;

    /// 1 where it is equal, else 0.
    #[must_use]
    fn equal(self, other: Self) -> Self;

    /// 1 where it is less, else 0.
    #[must_use]
    fn less(self, other: Self) -> Self;

    /// The first where it is 1, else the second.
    #[must_use]
    fn choose(self, yes: Self, no: Self) -> Self;

    /// `floor(self / divisor)`, for a divisor of at least 1.
    #[must_use]
    fn floor_quotient(self, divisor: Self) -> Self;

    /// `floor(sqrt(self))`; 0 where it is negative.
    #[must_use]
    fn root(self) -> Self;

    /// `self * 2^n / divisor` as `quot` of the table finds it.
    #[must_use]
    fn quot(self, divisor: Self, n: Self) -> Self;

    /// The other truth.
    #[must_use]
    fn opposite(self) -> Self {
        Self::of(1) - self
    }
}

impl Integer for i128 {
    fn of(number: i128) -> Self {
        number
    }

    fn least(self, other: Self) -> Self {
        self.min(other)
    }

    fn most(self, other: Self) -> Self {
        self.max(other)
    }

    fn equal(self, other: Self) -> Self {
        (self == other).into()
    }

    fn less(self, other: Self) -> Self {
        (self < other).into()
    }

    fn choose(self, yes: Self, no: Self) -> Self {
        if self == 1 { yes } else { no }
    }

    fn floor_quotient(self, divisor: Self) -> Self {
        self.div_euclid(divisor)
    }

    fn root(self) -> Self {
        self.max(0).isqrt()
    }

    /// With one division of 32 bits by 16, as a word machine does it.
    fn quot(self, divisor: Self, n: Self) -> Self {
        if divisor <= 0 {
            return 0;
        }
        let (a, b) = (self as i32, divisor as i32);
        // Bits that repeat the sign, but one.
        let up = (a ^ (a << 1)).leading_zeros();
        let up_divisor = b.leading_zeros();
        let dividend = i64::from(a.unbounded_shl(up));
        let divisor = i64::from((b as u32) << up_divisor >> 16);
        let top = i128::from(dividend / divisor) << 15;
        let down = i128::from(up) - i128::from(up_divisor) + 31 - n;
        let Range { low, high } = QUOTIENTS;
        (top >> down.max(0)).clamp(low.into(), high.into())
    }
}
