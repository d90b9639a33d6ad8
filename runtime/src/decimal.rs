//! Shortest decimals: as many digits as tell neighbouring values apart, and no more.
//!
//! A value of fixed point is a whole number of steps. Of all decimals that are nearer to it than to
//! its neighbours, the one with the fewest digits behind the point is written; so it reads back as
//! the same word (divide by the step, round). What has no step is written with the fewest digits
//! that read back as the same `f64`.

/// Powers of ten that are exact and leave room in an `f64`.
const DECIMALS_MAX: usize = 17;

/// Scaled values below this have no digits left to lose in an `f64`.
const EXACT_MAX: f64 = (1_u64 << 52) as f64;

/// How numbers of a column are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decimal {
    /// Digits behind the point at the most; all that an `f64` has without it.
    decimals: Option<usize>,
    /// How far a decimal may be from the value, in units of the last digit.
    within: f64,
}

impl Decimal {
    /// All digits.
    pub const EXACT: Decimal = Decimal {
        decimals: None,
        within: 0.0,
    };

    /// To a billionth: for times (s).
    pub const NANO: Decimal = Decimal {
        decimals: Some(9),
        within: 0.0,
    };

    /// For whole numbers of steps; all digits where a step is no positive number.
    pub fn of_step(step: f64) -> Decimal {
        if !(step.is_finite() && step > 0.0) {
            return Decimal::EXACT;
        }
        let decimals = (0..=DECIMALS_MAX).find(|&n| 1.0 / power(n) < step);
        Decimal {
            decimals,
            // What lies half way is no nearer to it than to its neighbour.
            within: decimals.map_or(0.0, |n| step * power(n) / 2.0 * (1.0 - 1e-9)),
        }
    }

    /// The text of a value.
    pub fn text(self, value: f64) -> String {
        let mut out = String::new();
        self.write(value, &mut out);
        out
    }

    /// Writes a value behind what is there.
    pub fn write(self, value: f64, out: &mut String) {
        let scaled = self.decimals.map(|n| (n, value * power(n)));
        match scaled.filter(|(_, scaled)| scaled.abs() < EXACT_MAX) {
            Some((decimals, scaled)) => self.shortest(decimals, scaled, out),
            None => out.push_str(ryu::Buffer::new().format(value)),
        }
    }

    fn shortest(self, decimals: usize, scaled: f64, out: &mut String) {
        let (mut digits, mut behind) = (scaled.round() as i64, decimals);
        let within = self.within.max((digits as f64 - scaled).abs());
        while behind > 0 {
            // The nearest with one digit less; who is too far away stays so with even fewer.
            let left = power(decimals - behind + 1);
            let fewer = (scaled / left).round();
            let off = (fewer * left - scaled).abs();
            let as_near = if self.within > 0.0 {
                off < within
            } else {
                off <= within
            };
            if !as_near {
                break;
            }
            (digits, behind) = (fewer as i64, behind - 1);
        }
        if digits < 0 {
            out.push('-');
        }
        let text = digits.unsigned_abs().to_string();
        let text = format!("{text:0>width$}", width = behind + 1);
        let (whole, part) = text.split_at(text.len() - behind);
        out.push_str(whole);
        if !part.is_empty() {
            out.push('.');
            out.push_str(part);
        }
    }
}

/// A power of ten.
fn power(n: usize) -> f64 {
    const POWERS: [f64; DECIMALS_MAX + 1] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
        1e17,
    ];
    POWERS[n]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_with_few_digits() {
        let mut seed = 1_u64;
        for step in [
            1.0 / 65_536.0,
            11e-3 / 65_535.0,
            2_f64.powi(-29),
            3.7e-4,
            12.5,
            0.001,
        ] {
            let decimal = Decimal::of_step(step);
            let digits = (-step.log10()).ceil().max(0.0) as usize;
            for _ in 0..2000 {
                seed = seed
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let word = (seed >> 33) as i32 as i64 - (1 << 30);
                let text = decimal.text(word as f64 * step);
                let back: f64 = text.parse().expect("a number");
                assert_eq!((back / step).round() as i64, word, "{text} of {step}");
                let behind = text.split_once('.').map_or(0, |(_, part)| part.len());
                assert!(behind <= digits, "{text} of {step}");
            }
        }
    }

    #[test]
    fn no_digit_can_be_left_out() {
        let step = 11e-3 / 65_535.0;
        let decimal = Decimal::of_step(step);
        for word in -70_000_i32..70_000 {
            let value = f64::from(word) * step;
            let text = decimal.text(value);
            let Some((_, part)) = text.split_once('.') else {
                continue;
            };
            let shorter = format!("{value:.*}", part.len() - 1);
            let back: f64 = shorter.parse().expect("a number");
            assert!(
                (back - value).abs() >= step / 2.0 * 0.999_999,
                "{text}, {shorter}"
            );
        }
    }

    #[test]
    fn half_way_to_a_neighbour_is_too_far() {
        let step = 11e-3 / 65_535.0;
        let word = |value: f64| ((value + 0.5e-3) / step).round();
        for number in 0..65_536 {
            let value = f64::from(number) * step - 0.5e-3;
            let text = Decimal::of_step(step).text(value);
            let back = text.parse().expect("a number");
            assert_eq!(word(back), f64::from(number), "{text}");
        }
    }

    #[test]
    fn what_numbers_look_like() {
        let cases = [
            (Decimal::of_step(0.001), 0.25, "0.25"),
            (Decimal::of_step(0.001), -1.0, "-1"),
            (Decimal::of_step(0.001), -0.0, "0"),
            (Decimal::of_step(0.001), -0.012, "-0.012"),
            (Decimal::of_step(1.0), 12.0, "12"),
            (Decimal::of_step(2_f64.powi(-20)), 0.1, "0.1"),
            (Decimal::of_step(1e-30), 0.1, "0.1"),
            (Decimal::of_step(0.0), 0.1 + 0.2, "0.30000000000000004"),
            (Decimal::of_step(1e-9), 1e30, "1e30"),
            (Decimal::of_step(1e-3), f64::NAN, "NaN"),
            (Decimal::NANO, 1.0 / 44_100.0, "0.000022676"),
            (Decimal::NANO, 2.5, "2.5"),
            (Decimal::NANO, 0.0, "0"),
        ];
        for (decimal, value, text) in cases {
            assert_eq!(decimal.text(value), text);
        }
    }
}
