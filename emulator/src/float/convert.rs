//! Between singles, halves, integers and fixed point: `FPToFixed`, `FixedToFP`, `FPRoundInt`,
//! `FPHalfToSingle`, `FPSingleToHalf`.

use super::round::{Format, Rest, Rounding, round, round_magnitude, shift};
use super::{DEFAULT_NAN, INEXACT, INFINITY, INVALID, Kind, OVERFLOW, Status, UNDERFLOW};
use super::{process_nan, signed, unpack};

/// `FPToFixed`: to an integer of `bits` bits that counts `2^-fraction`, saturated. The result is
/// extended to a word.
pub(crate) fn single_to_fixed(
    x: u32,
    fraction: u32,
    bits: u32,
    is_signed: bool,
    rounding: Rounding,
    status: &mut Status,
) -> u32 {
    let number = unpack(x, status);
    let least = if is_signed {
        -(1_i128 << (bits - 1))
    } else {
        0
    };
    let most = if is_signed {
        (1_i128 << (bits - 1)) - 1
    } else {
        (1 << bits) - 1
    };
    let value = match number.kind {
        Kind::QuietNan | Kind::SignalingNan => {
            status.raise(INVALID);
            return 0;
        }
        Kind::Infinity if number.sign => i128::MIN,
        Kind::Infinity => i128::MAX,
        _ => {
            let (magnitude, rest) = shift(number.mantissa, -(number.exponent + fraction as i32));
            let huge = number.exponent + fraction as i32 > 64;
            let grown =
                magnitude + u128::from(rounding.grows(number.sign, magnitude & 1 != 0, rest));
            let value = if huge { i128::MAX >> 1 } else { grown as i128 };
            let value = if number.sign { -value } else { value };
            if rest != Rest::None && (least..=most).contains(&value) {
                status.raise(INEXACT);
            }
            value
        }
    };
    if !(least..=most).contains(&value) {
        status.raise(INVALID);
    }
    value.clamp(least, most) as u32
}

/// `FixedToFP`: from a word that counts `2^-fraction`.
pub(crate) fn fixed_to_single(
    value: i64,
    fraction: u32,
    rounding: Rounding,
    status: &mut Status,
) -> u32 {
    match value {
        0 => 0,
        _ => round(
            value < 0,
            u128::from(value.unsigned_abs()),
            -(fraction as i32),
            rounding,
            status,
        ),
    }
}

/// `FPRoundInt`: to an integral float; `exact` tells whether inexactness is recorded.
pub(crate) fn round_to_integral(
    x: u32,
    rounding: Rounding,
    exact: bool,
    status: &mut Status,
) -> u32 {
    let number = unpack(x, status);
    match number.kind {
        Kind::QuietNan | Kind::SignalingNan => process_nan(x, &number, status),
        Kind::Infinity => x,
        Kind::Zero => signed(number.sign, 0),
        Kind::Finite if number.exponent >= 0 => x,
        Kind::Finite => {
            let (magnitude, rest) = shift(number.mantissa, -number.exponent);
            let grown =
                magnitude + u128::from(rounding.grows(number.sign, magnitude & 1 != 0, rest));
            if rest != Rest::None && exact {
                status.raise(INEXACT);
            }
            match grown {
                0 => signed(number.sign, 0),
                _ => round(number.sign, grown, 0, Rounding::Zero, status),
            }
        }
    }
}

const HALF: Format = Format {
    least: -14,
    fraction: 10,
    top: 31,
};
const HALF_INFINITY: u32 = 0x7c00;

/// `FPHalfToSingle`.
pub(crate) fn half_to_single(half: u32, status: &mut Status) -> u32 {
    let (sign, exponent, fraction) = (half >> 15 & 1 != 0, half >> 10 & 31, half & 0x3ff);
    match (exponent, fraction) {
        (0, 0) => signed(sign, 0),
        (0, _) => exact_single(sign, fraction, -24),
        (31, 0) if !status.alternative_half() => signed(sign, INFINITY),
        (31, _) if !status.alternative_half() => half_nan(sign, fraction, status),
        _ => exact_single(sign, fraction | 0x400, exponent as i32 - 25),
    }
}

/// Every half is a normal single.
fn exact_single(sign: bool, mantissa: u32, exponent: i32) -> u32 {
    round(
        sign,
        u128::from(mantissa),
        exponent,
        Rounding::Zero,
        &mut Status(0),
    )
}

fn half_nan(sign: bool, fraction: u32, status: &mut Status) -> u32 {
    if fraction & 0x200 == 0 {
        status.raise(INVALID);
    }
    if status.default_nan() {
        DEFAULT_NAN
    } else {
        signed(sign, DEFAULT_NAN | (fraction & 0x1ff) << 13)
    }
}

/// `FPSingleToHalf`.
pub(crate) fn single_to_half(x: u32, status: &mut Status) -> u32 {
    let number = unpack(x, status);
    let sign = u32::from(number.sign) << 15;
    let alternative = status.alternative_half();
    match number.kind {
        Kind::QuietNan | Kind::SignalingNan => {
            if alternative || number.kind == Kind::SignalingNan {
                status.raise(INVALID);
            }
            match (alternative, status.default_nan()) {
                (true, _) => sign,
                (false, true) => HALF_INFINITY | 0x200,
                (false, false) => sign | HALF_INFINITY | 0x200 | x >> 13 & 0x1ff,
            }
        }
        Kind::Infinity if alternative => {
            status.raise(INVALID);
            sign | 0x7fff
        }
        Kind::Infinity => sign | HALF_INFINITY,
        Kind::Zero => sign,
        Kind::Finite => sign | finite_half(number.sign, number.mantissa, number.exponent, status),
    }
}

/// Denormal halves are never flushed.
fn finite_half(sign: bool, mantissa: u128, exponent: i32, status: &mut Status) -> u32 {
    let top = 127 - mantissa.leading_zeros() as i32 + exponent;
    let rounding = status.rounding();
    let (magnitude, rest) = round_magnitude(&HALF, sign, mantissa, exponent, rounding);
    if status.alternative_half() && magnitude > 0x7fff {
        status.raise(INVALID);
        return 0x7fff;
    }
    if top < HALF.least && rest != Rest::None {
        status.raise(UNDERFLOW);
    }
    if !status.alternative_half() && magnitude >= HALF_INFINITY {
        status.raise(OVERFLOW | INEXACT);
        let infinite = match rounding {
            Rounding::Up => !sign,
            Rounding::Down => sign,
            Rounding::Zero => false,
            Rounding::Nearest | Rounding::Away => true,
        };
        return if infinite {
            HALF_INFINITY
        } else {
            HALF_INFINITY - 1
        };
    }
    if rest != Rest::None {
        status.raise(INEXACT);
    }
    magnitude
}
