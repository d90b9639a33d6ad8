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
        let bits = |low, high| fraction_bits(Interval { low, high });
        assert_eq!(
            [bits(0.0, 1.0), bits(-2.0, 0.0), bits(0.0, 0.0)],
            [30, 29, 62]
        );
        // The largest planned value exactly, and the next above it.
        let top = TOP * exp2(-20);
        assert_eq!([bits(0.0, top), bits(0.0, top.next_up())], [20, 19]);
        assert_eq!(
            [27, 0, -3].map(name),
            ["I5F27", "I32F0", "I35F-3"].map(String::from)
        );
    }

    /// A drive word is any of 16 bits with a sign; a planned value any of 32, less a 32768th.
    #[test]
    fn words_and_what_is_planned_for_them() {
        let word = Range::new(i16::MIN.into(), i16::MAX.into());
        assert_eq!(DRIVE_WORD, word);
        assert_eq!(TOP, exp2(31) - exp2(31 - 15));
    }

    #[test]
    fn powers_of_two_and_their_exponents() {
        assert_eq!(
            [0, 3, -3, 62].map(exp2),
            [1.0, 8.0, 0.125, 4_611_686_018_427_387_904.0]
        );
        assert_eq!([-1022, -5000].map(exp2), [f64::MIN_POSITIVE; 2]);
        assert_eq!([1023, 5000].map(exp2), [2f64.powi(1023); 2]);
        let numbers = [1.0, 1.999, 2.0, 0.999, 0.125, 1e-300, f64::MAX];
        assert_eq!(numbers.map(exponent), [0, 0, 1, -1, -3, -997, 1023]);
    }

    /// Ties go away from zero; what 62 bits do not hold stops at their ends.
    #[test]
    fn reals_round_to_the_nearest_integer_of_a_unit() {
        let in_halves = [0.24, 0.25, -0.25, 1.5, -1.74].map(|value| quantize(value, 0.5));
        assert_eq!(in_halves, [0, 1, -1, 3, -3]);
        let far = 1i64 << 62;
        assert_eq!([1e30, -1e30].map(|value| quantize(value, 0.5)), [far, -far]);
    }

    #[test]
    fn integers_of_an_interval() {
        let interval = |low, high| Interval { low, high };
        assert_eq!(inside(interval(-0.6, 0.74), 0.25), Range::new(-2, 2));
        assert_eq!(nearest(interval(-0.65, 0.74), 0.25), Range::new(-3, 3));
        assert_eq!(inside(interval(-0.5, 0.75), 0.25), Range::new(-2, 3));
        // None lies inside: those around it.
        assert_eq!(inside(interval(0.3, 0.4), 0.25), Range::new(1, 2));
    }

    /// A saturation takes one instruction where it is to powers of two: at most a 256th of the
    /// integers is given up for that at each end, and none is added.
    #[test]
    fn ends_move_in_to_powers_of_two_that_are_near() {
        for (low, high, expected) in [
            (-1026, 1026, (-1024, 1023)),
            (-1028, 1027, (-1024, 1023)),
            (-1028, 1023, (-1024, 1023)),
            (-1024, 1023, (-1024, 1023)),
            (0, 1026, (0, 1023)),
            (-1029, 1027, (-1029, 1027)),
            (-1028, 1028, (-1028, 1028)),
            (-1023, 1023, (-1023, 1023)),
            (-1000, 1000, (-1000, 1000)),
            (1, 1026, (1, 1026)),
            (-5, -3, (-5, -3)),
            (0, 0, (0, 0)),
        ] {
            let unit = Interval {
                low: f64::from(low) * 0.5,
                high: f64::from(high) * 0.5,
            };
            let expected = Range::new(expected.0, expected.1);
            assert_eq!(inside_powers(unit, 0.5), expected, "{low} .. {high}");
        }
        let few = [1, 2].map(|few| powers(Range::new(-5, 5), few));
        assert_eq!(few, [Range::new(-5, 5), Range::new(-4, 3)]);
    }
}
