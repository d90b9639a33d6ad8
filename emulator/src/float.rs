//! Single-precision arithmetic as the architecture defines it: rounding modes, NaNs, flushing to
//! zero, cumulative exceptions.
//!
//! Every operation is exact on integers, then rounded once by [`round::round`] (`FPRound`). The
//! host's arithmetic serves where it gives the same for certain: rounding to nearest, normal
//! operands and result, and nothing left to record because the inexact flag is set already.
//!
//! ```text
//!   bits --unpack--> Number (sign, mantissa * 2^exponent) --operation--> exact sum, product, ... --round--> bits
//! ```

mod convert;
mod operations;
mod round;

pub(crate) use convert::{
    fixed_to_single, half_to_single, round_to_integral, single_to_fixed, single_to_half,
};
pub(crate) use operations::{
    add, compare, divide, max_number, min_number, multiply, multiply_add, square_root,
};
pub(crate) use round::Rounding;

/// The bits of FPSCR that exist: flags, AHP, DN, FZ, rounding mode, cumulative exceptions.
pub(crate) const FPSCR_BITS: u32 = 0xf7c0_009f;

/// The sign of a float.
pub(crate) const SIGN: u32 = 1 << 31;
const DEFAULT_NAN: u32 = 0x7fc0_0000;
const INFINITY: u32 = 0x7f80_0000;
const QUIET: u32 = 1 << 22;

/// Cumulative exception bits.
const INVALID: u32 = 1 << 0;
const DIVIDE_BY_ZERO: u32 = 1 << 1;
const OVERFLOW: u32 = 1 << 2;
const UNDERFLOW: u32 = 1 << 3;
const INEXACT: u32 = 1 << 4;
const INPUT_DENORMAL: u32 = 1 << 7;

/// FPSCR while an operation uses it.
#[derive(Clone, Copy)]
pub(crate) struct Status(pub u32);

impl Status {
    fn raise(&mut self, exceptions: u32) {
        self.0 |= exceptions;
    }

    fn default_nan(self) -> bool {
        self.0 >> 25 & 1 != 0
    }

    fn flush_to_zero(self) -> bool {
        self.0 >> 24 & 1 != 0
    }

    fn alternative_half(self) -> bool {
        self.0 >> 26 & 1 != 0
    }

    /// The rounding mode.
    pub fn rounding(self) -> Rounding {
        match self.0 >> 22 & 3 {
            0 => Rounding::Nearest,
            1 => Rounding::Up,
            2 => Rounding::Down,
            _ => Rounding::Zero,
        }
    }

    /// Whether the host's arithmetic needs only normal operands and results.
    fn is_plain(self) -> bool {
        self.0 & (3 << 22 | INEXACT) == INEXACT
    }
}

/// A float taken apart: the value is `mantissa * 2^exponent`.
#[derive(Clone, Copy, PartialEq)]
struct Number {
    sign: bool,
    kind: Kind,
    mantissa: u128,
    exponent: i32,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Zero,
    Finite,
    Infinity,
    QuietNan,
    SignalingNan,
}

impl Number {
    fn is_nan(&self) -> bool {
        matches!(self.kind, Kind::QuietNan | Kind::SignalingNan)
    }
}

/// `FPUnpack`: a denormal number is zero when they are flushed.
fn unpack(bits: u32, status: &mut Status) -> Number {
    let (sign, exponent, fraction) = (
        bits & SIGN != 0,
        (bits >> 23 & 0xff) as i32,
        bits & 0x7f_ffff,
    );
    let number = |kind, mantissa: u32, exponent| Number {
        sign,
        kind,
        mantissa: u128::from(mantissa),
        exponent,
    };
    match (exponent, fraction) {
        (0, 0) => number(Kind::Zero, 0, 0),
        (0, _) if status.flush_to_zero() => {
            status.raise(INPUT_DENORMAL);
            number(Kind::Zero, 0, 0)
        }
        (0, _) => number(Kind::Finite, fraction, -149),
        (255, 0) => number(Kind::Infinity, 0, 0),
        (255, _) if fraction & QUIET != 0 => number(Kind::QuietNan, 0, 0),
        (255, _) => number(Kind::SignalingNan, 0, 0),
        _ => number(Kind::Finite, fraction | 1 << 23, exponent - 150),
    }
}

fn signed(sign: bool, magnitude: u32) -> u32 {
    magnitude | if sign { SIGN } else { 0 }
}

/// `FPProcessNaN`.
fn process_nan(bits: u32, number: &Number, status: &mut Status) -> u32 {
    if number.kind == Kind::SignalingNan {
        status.raise(INVALID);
    }
    if status.default_nan() {
        DEFAULT_NAN
    } else {
        bits | QUIET
    }
}

/// `FPProcessNaNs`: the first signaling one, else the first quiet one.
fn process_nans(operands: &[(u32, Number)], status: &mut Status) -> Option<u32> {
    let first = |kind| operands.iter().find(|(_, number)| number.kind == kind);
    let (bits, number) = first(Kind::SignalingNan).or_else(|| first(Kind::QuietNan))?;
    Some(process_nan(*bits, number, status))
}

fn invalid(status: &mut Status) -> u32 {
    status.raise(INVALID);
    DEFAULT_NAN
}

/// The host's result, if it is the architecture's for certain.
fn host(status: Status, operands: &[u32], result: impl FnOnce() -> f32) -> Option<u32> {
    let is_normal = |bits: u32| (1..255).contains(&(bits >> 23 & 0xff));
    if !status.is_plain() || !operands.iter().all(|bits| is_normal(*bits)) {
        return None;
    }
    let result = result().to_bits();
    // The smallest normal number may have been rounded up to.
    (is_normal(result) && result & !SIGN != 0x0080_0000).then_some(result)
}
