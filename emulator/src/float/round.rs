//! `FPRound`: an exact value to the nearest representable one.

use super::{INEXACT, OVERFLOW, Status, UNDERFLOW};

/// Which neighbour an inexact value becomes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rounding {
    /// The nearest, ties to even.
    Nearest,
    /// Towards plus infinity.
    Up,
    /// Towards minus infinity.
    Down,
    /// Towards zero.
    Zero,
    /// The nearest, ties away from zero.
    Away,
}

impl Rounding {
    /// Whether the magnitude grows, given the bit that stays last and how the rest compares with
    /// one half.
    pub fn grows(self, sign: bool, odd: bool, rest: Rest) -> bool {
        match self {
            Self::Nearest => rest == Rest::More || rest == Rest::Half && odd,
            Self::Away => rest == Rest::More || rest == Rest::Half,
            Self::Up => rest != Rest::None && !sign,
            Self::Down => rest != Rest::None && sign,
            Self::Zero => false,
        }
    }

    /// Whether a magnitude that is too large becomes infinite.
    fn overflows(self, sign: bool) -> bool {
        match self {
            Self::Nearest | Self::Away => true,
            Self::Up => !sign,
            Self::Down => sign,
            Self::Zero => false,
        }
    }
}

/// What was cut off, in halves of the last place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rest {
    None,
    Less,
    Half,
    More,
}

/// `value / 2^places` and the rest.
pub(crate) fn shift(value: u128, places: i32) -> (u128, Rest) {
    if places <= 0 {
        return (value << places.unsigned_abs().min(127), Rest::None);
    }
    if places > 127 {
        return (0, if value == 0 { Rest::None } else { Rest::Less });
    }
    let (kept, cut, half) = (
        value >> places,
        value & ((1 << places) - 1),
        1 << (places - 1),
    );
    let rest = match cut {
        0 => Rest::None,
        _ if cut < half => Rest::Less,
        _ if cut == half => Rest::Half,
        _ => Rest::More,
    };
    (kept, rest)
}

/// A binary format: exponent of the smallest normal number, bits of the fraction, the exponent
/// field of infinity.
pub(super) struct Format {
    pub least: i32,
    pub fraction: u32,
    pub top: i32,
}

pub(super) const SINGLE: Format = Format {
    least: -126,
    fraction: 23,
    top: 255,
};

/// Rounds `mantissa * 2^exponent`, where the mantissa is not zero. The last bit of the mantissa may
/// stand for more below it.
pub(super) fn round(
    sign: bool,
    mantissa: u128,
    exponent: i32,
    rounding: Rounding,
    status: &mut Status,
) -> u32 {
    let (format, top) = (&SINGLE, 127 - mantissa.leading_zeros() as i32 + exponent);
    if status.flush_to_zero() && top < format.least {
        status.raise(UNDERFLOW);
        return super::signed(sign, 0);
    }
    let (magnitude, rest) = round_magnitude(format, sign, mantissa, exponent, rounding);
    if top < format.least && rest != Rest::None {
        status.raise(UNDERFLOW);
    }
    if magnitude >> format.fraction >= format.top as u32 {
        status.raise(OVERFLOW | INEXACT);
        let infinity = (format.top as u32) << format.fraction;
        return super::signed(
            sign,
            if rounding.overflows(sign) {
                infinity
            } else {
                infinity - 1
            },
        );
    }
    if rest != Rest::None {
        status.raise(INEXACT);
    }
    super::signed(sign, magnitude)
}

/// Exponent field and fraction of the rounded magnitude, which may reach past the largest number;
/// and what was cut.
pub(super) fn round_magnitude(
    format: &Format,
    sign: bool,
    mantissa: u128,
    exponent: i32,
    rounding: Rounding,
) -> (u32, Rest) {
    let top = 127 - mantissa.leading_zeros() as i32 + exponent;
    let last = top.max(format.least) - format.fraction as i32;
    let (kept, rest) = shift(mantissa, last - exponent);
    let kept = kept as u32 + u32::from(rounding.grows(sign, kept & 1 != 0, rest));
    // The leading one of the mantissa adds one to the exponent field, as does a carry out of it.
    let field = (top.max(format.least) - format.least).min(format.top) as u32;
    ((field << format.fraction) + kept, rest)
}
