//! Formats: how many fraction bits a value gets.

use whippen_kernel::Range;
use whippen_lang::model::Interval;

/// A drive word: `I1F15`.
pub(super) const DRIVE_WORD: Range = Range::new(-32_768, 32_767);

/// Largest integer a planned value may reach: 32 bits less a margin for roundings (2^-15 of the
/// range).
pub(super) const TOP: f64 = 2_147_418_112.0;

/// `2^n` for -1022 <= n <= 1023, exactly and alike on every machine.
pub(super) fn exp2(n: i32) -> f64 {
    f64::from_bits(((1023 + i64::from(n.clamp(-1022, 1023))) as u64) << 52)
}

/// `n` with `2^n <= x < 2^(n+1)`, for normal `x` above zero.
pub(super) fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// Most fraction bits with which every value of `range` fits; at most 62.
pub(super) fn fraction_bits(range: Interval) -> i32 {
    let magnitude = range.magnitude().max(exp2(-40));
    let bits = 30 - exponent(magnitude);
    (if magnitude * exp2(bits) <= TOP {
        bits
    } else {
        bits - 1
    })
    .min(62)
}

/// Whether every value of `range` fits with so many fraction bits.
#[cfg(test)]
fn fits(range: Interval, bits: i32) -> bool {
    range.magnitude() * exp2(bits) <= TOP
}

/// A real in units of `lsb`, rounded to the nearest integer (ties away from zero), saturated to 62
/// bits.
pub(super) fn quantize(value: f64, lsb: f64) -> i64 {
    (value / lsb).round().clamp(-exp2(62), exp2(62)) as i64
}

/// The integers whose values lie within `range`.
pub(super) fn inside(range: Interval, lsb: f64) -> Range {
    let (low, high) = (
        (range.low / lsb).ceil() as i64,
        (range.high / lsb).floor() as i64,
    );
    Range::new(low.min(high), high.max(low))
}

/// The integers from one end of `range` to the other, each end rounded.
pub(super) fn nearest(range: Interval, lsb: f64) -> Range {
    Range::new(quantize(range.low, lsb), quantize(range.high, lsb))
}

/// The integers whose values lie within `range`, less a few thousandths of them where that leaves
/// what [`powers`] gives.
pub(super) fn inside_powers(range: Interval, lsb: f64) -> Range {
    let all = inside(range, lsb);
    powers(all, (all.high + 1) >> 8)
}

/// `-2^n .. 2^n - 1` or `0 .. 2^n - 1`, which is one saturation, where that is all but `few` of the
/// integers at either end.
pub(super) fn powers(all: Range, few: i64) -> Range {
    let power = 1i64 << (63 - (all.high + 1).max(1).leading_zeros());
    let low = if all.low == 0 { 0 } else { -power };
    let (below, above) = (low - all.low, all.high - (power - 1));
    if (0..=few).contains(&below) && (0..=few).contains(&above) {
        Range::new(low, power - 1)
    } else {
        all
    }
}

/// `I5F27`: integer bits with the sign, fraction bits, as the `fixed` crate counts them.
pub fn name(fraction_bits: i32) -> String {
    format!("I{}F{}", 32 - fraction_bits, fraction_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_holds_its_range_and_one_more_bit_would_not() {
        for magnitude in [
            1e-9, 0.0105, 0.419, 0.5, 0.999, 1.0, 1.9, 2.0, 80.0, 1023.9, 1e6,
        ] {
            let range = Interval {
                low: -magnitude,
                high: magnitude / 3.0,
            };
            let bits = fraction_bits(range);
            assert!(fits(range, bits), "{magnitude}: {bits}");
            assert!(bits == 62 || !fits(range, bits + 1), "{magnitude}: {bits}");
        }
        assert_eq!(
            fraction_bits(Interval {
                low: 0.0,
                high: 1.0
            }),
            30
        );
        assert_eq!(name(27), "I5F27");
    }
}
