//! `FPAdd`, `FPMul`, `FPMulAdd`, `FPDiv`, `FPSqrt`, `FPCompare`, `FPMaxNum`, `FPMinNum`.

use super::round::{Rounding, round};
use super::{DIVIDE_BY_ZERO, INFINITY, INVALID, Kind, Number, SIGN, Status};
use super::{host, invalid, process_nans, signed, unpack};

/// `FPAdd`; with `negate`, `FPSub`.
pub(crate) fn add(x: u32, y: u32, negate: bool, status: &mut Status) -> u32 {
    let y_signed = y ^ if negate { SIGN } else { 0 };
    if let Some(bits) = host(*status, &[x, y], || {
        f32::from_bits(x) + f32::from_bits(y_signed)
    }) {
        return bits;
    }
    let (a, b) = (unpack(x, status), unpack(y, status));
    if let Some(nan) = process_nans(&[(x, a), (y, b)], status) {
        return nan;
    }
    sum(
        a,
        Number {
            sign: b.sign != negate,
            ..b
        },
        status,
    )
}

/// The sum of two that are no NaN.
fn sum(a: Number, b: Number, status: &mut Status) -> u32 {
    match (a.kind, b.kind) {
        (Kind::Infinity, Kind::Infinity) if a.sign != b.sign => invalid(status),
        (Kind::Infinity, _) => signed(a.sign, INFINITY),
        (_, Kind::Infinity) => signed(b.sign, INFINITY),
        (Kind::Zero, Kind::Zero) if a.sign == b.sign => signed(a.sign, 0),
        (Kind::Zero, Kind::Zero) => zero(status),
        (Kind::Zero, _) => round(b.sign, b.mantissa, b.exponent, status.rounding(), status),
        (_, Kind::Zero) => round(a.sign, a.mantissa, a.exponent, status.rounding(), status),
        _ => finite_sum(a, b, status),
    }
}

/// The zero that a difference of equals gives.
fn zero(status: &Status) -> u32 {
    signed(status.rounding() == Rounding::Down, 0)
}

/// Mantissas of at most 48 bits. The one with the larger exponent moves left by up to 64 places;
/// what the other one then still loses on the right is too far below the sum's leading bit to
/// matter but for not being zero.
fn finite_sum(a: Number, b: Number, status: &mut Status) -> u32 {
    let (high, low) = if a.exponent >= b.exponent {
        (a, b)
    } else {
        (b, a)
    };
    let apart = high.exponent - low.exponent;
    let left = apart.min(64);
    let (x, exponent) = (high.mantissa << left, high.exponent - left);
    let y = jam(low.mantissa, apart - left);
    let (sign, mantissa) = match (high.sign == low.sign, x >= y) {
        (true, _) => (high.sign, x + y),
        (false, true) => (high.sign, x - y),
        (false, false) => (low.sign, y - x),
    };
    if mantissa == 0 {
        zero(status)
    } else {
        round(sign, mantissa, exponent, status.rounding(), status)
    }
}

/// Shifts right; the last bit tells whether anything was lost.
fn jam(value: u128, places: i32) -> u128 {
    match places {
        0 => value,
        1..128 => value >> places | u128::from(value & ((1 << places) - 1) != 0),
        _ => u128::from(value != 0),
    }
}

/// `FPMul`.
pub(crate) fn multiply(x: u32, y: u32, status: &mut Status) -> u32 {
    if let Some(bits) = host(*status, &[x, y], || f32::from_bits(x) * f32::from_bits(y)) {
        return bits;
    }
    let (a, b) = (unpack(x, status), unpack(y, status));
    if let Some(nan) = process_nans(&[(x, a), (y, b)], status) {
        return nan;
    }
    match product(a, b) {
        None => invalid(status),
        Some(p) => match p.kind {
            Kind::Finite => round(p.sign, p.mantissa, p.exponent, status.rounding(), status),
            Kind::Infinity => signed(p.sign, INFINITY),
            _ => signed(p.sign, 0),
        },
    }
}

/// The exact product of two that are no NaN; nothing for infinity times zero.
fn product(a: Number, b: Number) -> Option<Number> {
    let kind = match (a.kind, b.kind) {
        (Kind::Infinity, Kind::Zero) | (Kind::Zero, Kind::Infinity) => return None,
        (Kind::Infinity, _) | (_, Kind::Infinity) => Kind::Infinity,
        (Kind::Zero, _) | (_, Kind::Zero) => Kind::Zero,
        _ => Kind::Finite,
    };
    let (mantissa, exponent) = (a.mantissa * b.mantissa, a.exponent + b.exponent);
    Some(Number {
        sign: a.sign != b.sign,
        kind,
        mantissa,
        exponent,
    })
}

/// `FPMulAdd`: `addend + x * y`, rounded once.
pub(crate) fn multiply_add(addend: u32, x: u32, y: u32, status: &mut Status) -> u32 {
    let (c, a, b) = (unpack(addend, status), unpack(x, status), unpack(y, status));
    let no_product = !a.is_nan() && !b.is_nan() && product(a, b).is_none();
    let nan = process_nans(&[(addend, c), (x, a), (y, b)], status);
    if c.kind == Kind::QuietNan && no_product {
        return invalid(status);
    }
    match (nan, product(a, b)) {
        (Some(nan), _) => nan,
        (None, None) => invalid(status),
        (None, Some(p)) => sum(c, p, status),
    }
}

/// `FPDiv`.
pub(crate) fn divide(x: u32, y: u32, status: &mut Status) -> u32 {
    if let Some(bits) = host(*status, &[x, y], || f32::from_bits(x) / f32::from_bits(y)) {
        return bits;
    }
    let (a, b) = (unpack(x, status), unpack(y, status));
    if let Some(nan) = process_nans(&[(x, a), (y, b)], status) {
        return nan;
    }
    let sign = a.sign != b.sign;
    match (a.kind, b.kind) {
        (Kind::Infinity, Kind::Infinity) | (Kind::Zero, Kind::Zero) => invalid(status),
        (Kind::Infinity, _) => signed(sign, INFINITY),
        (_, Kind::Zero) => {
            status.raise(DIVIDE_BY_ZERO);
            signed(sign, INFINITY)
        }
        (Kind::Zero, _) | (_, Kind::Infinity) => signed(sign, 0),
        _ => {
            let dividend = a.mantissa << 64;
            let quotient =
                (dividend / b.mantissa) << 1 | u128::from(!dividend.is_multiple_of(b.mantissa));
            round(
                sign,
                quotient,
                a.exponent - b.exponent - 65,
                status.rounding(),
                status,
            )
        }
    }
}

/// `FPSqrt`.
pub(crate) fn square_root(x: u32, status: &mut Status) -> u32 {
    if x & SIGN == 0
        && let Some(bits) = host(*status, &[x], || f32::from_bits(x).sqrt())
    {
        return bits;
    }
    let a = unpack(x, status);
    if let Some(nan) = process_nans(&[(x, a)], status) {
        return nan;
    }
    match (a.kind, a.sign) {
        (Kind::Zero, sign) => signed(sign, 0),
        (_, true) => invalid(status),
        (Kind::Infinity, _) => INFINITY,
        _ => {
            let left = 64 + (a.exponent & 1);
            let square = a.mantissa << left;
            let root = square.isqrt();
            let mantissa = root << 1 | u128::from(root * root != square);
            round(
                false,
                mantissa,
                (a.exponent - left) / 2 - 1,
                status.rounding(),
                status,
            )
        }
    }
}

/// `FPCompare`: N, Z, C, V in bits 31 to 28.
pub(crate) fn compare(x: u32, y: u32, quiet_nan_is_invalid: bool, status: &mut Status) -> u32 {
    let (a, b) = (unpack(x, status), unpack(y, status));
    let signaling = a.kind == Kind::SignalingNan || b.kind == Kind::SignalingNan;
    if a.is_nan() || b.is_nan() {
        if signaling || quiet_nan_is_invalid {
            status.raise(INVALID);
        }
        return 0b0011 << 28;
    }
    match order(x, a).cmp(&order(y, b)) {
        std::cmp::Ordering::Equal => 0b0110 << 28,
        std::cmp::Ordering::Less => 0b1000 << 28,
        std::cmp::Ordering::Greater => 0b0010 << 28,
    }
}

/// Integers in the order of the numbers; both zeros are 0.
fn order(bits: u32, number: Number) -> i64 {
    let magnitude = if number.kind == Kind::Zero {
        0
    } else {
        i64::from(bits & !SIGN)
    };
    if number.sign { -magnitude } else { magnitude }
}

/// `FPMaxNum`: a number rather than a quiet NaN.
pub(crate) fn max_number(x: u32, y: u32, status: &mut Status) -> u32 {
    choose(x, y, status, |a, b| a > b, false)
}

/// `FPMinNum`.
pub(crate) fn min_number(x: u32, y: u32, status: &mut Status) -> u32 {
    choose(x, y, status, |a, b| a < b, true)
}

fn choose(
    x: u32,
    y: u32,
    status: &mut Status,
    first: fn(i64, i64) -> bool,
    negative_zero: bool,
) -> u32 {
    let (a, b) = (unpack(x, status), unpack(y, status));
    let numbers = match (a.kind, b.kind) {
        (Kind::QuietNan, Kind::QuietNan) => None,
        (Kind::QuietNan, _) if !b.is_nan() => return flushed(y, b),
        (_, Kind::QuietNan) if !a.is_nan() => return flushed(x, a),
        _ if a.is_nan() || b.is_nan() => None,
        _ => Some((order(x, a), order(y, b))),
    };
    match numbers {
        None => process_nans(&[(x, a), (y, b)], status).unwrap_or(super::DEFAULT_NAN),
        Some((0, 0)) => signed(
            if negative_zero {
                a.sign || b.sign
            } else {
                a.sign && b.sign
            },
            0,
        ),
        Some((p, q)) => {
            if first(p, q) {
                flushed(x, a)
            } else {
                flushed(y, b)
            }
        }
    }
}

/// The bits of a number as unpacked: a flushed one is zero.
fn flushed(bits: u32, number: Number) -> u32 {
    if number.kind == Kind::Zero {
        signed(number.sign, 0)
    } else {
        bits
    }
}
