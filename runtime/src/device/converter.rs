//! A sensor's curve and its converter: from what is sensed to a code of so many bits, and back.
//!
//! ```text
//!   position --curve--> reading 0 .. 1 --noise--> code 0 .. 2^bits - 1 --straightened--> word 0 .. 65535
//! ```
//!
//! Words have 16 bits whatever the converter has: a code's bits are repeated below, so that the
//! lowest reads 0 and the highest 65535, where a broken wire is found. A sensor with a curve is
//! straightened by its inverse before words reach a program, so what is left of the curve is that
//! noise and steps are larger where it is flat.
//!
//! Not here: how a recording is straightened (`motion::calibration`).

use crate::motion::Pchip;

/// Bits of a converter.
pub const BITS: [u32; 2] = [4, 16];

/// Halvings with which a reading's place is found: to the last bits of a number.
const HALVINGS: usize = 60;
/// Places at which the slope of a curve is looked at.
const SLOPES: usize = 2000;

/// What a sensor reads over what it senses, strictly rising or falling: readings are parts of all
/// that the converter takes.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingCurve {
    reading: Pchip,
    rises: bool,
    /// The least and the greatest slope (1/m or 1/rad).
    slopes: [f64; 2],
}

impl ReadingCurve {
    /// A curve through points: value (SI, rising) and reading.
    ///
    /// # Errors
    /// There are fewer than two, the values do not rise, the readings neither rise nor fall all
    /// along, or one is not in 0 .. 1.
    pub fn new(points: &[(f64, f64)]) -> Result<ReadingCurve, String> {
        if points.len() < 2 {
            return Err("needs at least two points".to_string());
        }
        let rises = points[1].1 > points[0].1;
        for two in points.windows(2) {
            if two[1].0 <= two[0].0 {
                return Err("must have values that rise from point to point".to_string());
            }
            if two[1].1 == two[0].1 || (two[1].1 > two[0].1) != rises {
                return Err("must have readings that rise or fall all along".to_string());
            }
        }
        if !points.iter().all(|point| (0.0..=1.0).contains(&point.1)) {
            return Err("must have readings from 0 to 1, parts of what the converter takes".into());
        }
        let (x, y) = points.iter().copied().unzip();
        let reading = Pchip::new(x, y).ok_or("must have finite numbers")?;
        let (low, high) = reading.domain();
        let step = (high - low) / SLOPES as f64;
        let slope = |n: usize| {
            let at = |n: usize| reading.at(low + step * n as f64);
            (at(n + 1) - at(n)).abs() / step
        };
        let slopes = (0..SLOPES).map(slope);
        let slopes = slopes.fold([f64::INFINITY, 0.0], |ends, slope| {
            [ends[0].min(slope), f64::max(ends[1], slope)]
        });
        Ok(ReadingCurve {
            reading,
            rises,
            slopes,
        })
    }

    /// From where to where it goes (SI).
    pub fn ends(&self) -> [f64; 2] {
        self.reading.domain().into()
    }

    /// What is read of a value.
    pub fn reading(&self, value: f64) -> f64 {
        self.reading.at(value)
    }

    /// The value that is read so; beyond the ends the value there.
    pub fn value(&self, reading: f64) -> f64 {
        let [mut low, mut high] = self.ends();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match (self.reading(middle) < reading) == self.rises {
                true => low = middle,
                false => high = middle,
            }
        }
        0.5 * (low + high)
    }

    /// What is sensed where the reading is off by what `off` (SI) is at the steepest place.
    pub fn with_noise(&self, value: f64, off: f64) -> f64 {
        let sign = if self.rises { 1.0 } else { -1.0 };
        self.value(self.reading(value) + sign * off * self.slopes[1])
    }

    /// How many times as much a difference of readings is where the curve is flattest as where it
    /// is steepest.
    pub fn flatness(&self) -> f64 {
        self.slopes[1] / self.slopes[0]
    }

    /// What a difference of readings is where the curve is flattest (SI).
    pub fn widest(&self, reading: f64) -> f64 {
        reading / self.slopes[0]
    }
}

/// The nearest code of a part of all that a converter takes.
fn code(part: f64, bits: u32) -> u32 {
    let last = f64::from((1u32 << bits) - 1);
    (part * last + 0.5).floor().clamp(0.0, last) as u32
}

/// The same as a part again.
pub fn quantized(part: f64, bits: u32) -> f64 {
    f64::from(code(part, bits)) / f64::from((1u32 << bits) - 1)
}

/// The same as a word: the code's bits, repeated below.
pub fn word(part: f64, bits: u32) -> u16 {
    let code = code(part, bits);
    let (mut word, mut place) = (0, 16);
    while place > bits {
        place -= bits;
        word |= code << place;
    }
    (word | code >> (bits - place)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converter_is_off_by_half_a_step_at_most() {
        for bits in [4, 8, 12, 16] {
            let step = 1.0 / f64::from((1u32 << bits) - 1);
            let parts = (0..=10_000).map(|n| f64::from(n) * 1e-4);
            let (mut most, mut squares) = (0.0_f64, 0.0);
            for part in parts {
                let off = quantized(part, bits) - part;
                most = most.max(off.abs());
                squares += off * off;
            }
            assert!(most <= 0.5 * step * 1.000_001, "{bits}: {most}");
            // Spread evenly over a step: its width over the root of twelve. Finer steps than the
            // places here are met at few of their parts.
            let rms = (squares / 10_001.0).sqrt();
            let is_near = (rms / (step / 12f64.sqrt()) - 1.0).abs() < 0.02;
            assert!(bits > 12 || is_near, "{bits}: {rms}");
            assert_eq!((quantized(0.0, bits), quantized(1.0, bits)), (0.0, 1.0));
        }
    }

    #[test]
    fn a_word_repeats_the_bits_of_a_code() {
        let of = |code: u32, bits: u32| word(f64::from(code) / f64::from((1u32 << bits) - 1), bits);
        assert_eq!(
            (of(0xabc, 12), of(0xfff, 12), of(0, 12)),
            (0xabca, 0xffff, 0)
        );
        assert_eq!((of(0x5, 4), of(0x2a, 6)), (0x5555, 0b1010_1010_1010_1010));
        assert_eq!(
            (of(0x1ff, 9), of(0x100, 9)),
            (0xffff, 0b1000_0000_0100_0000)
        );
        assert_eq!(of(0xbeef, 16), 0xbeef);
    }

    #[test]
    fn a_curve_comes_back_and_is_wide_where_it_is_flat() {
        for falls in [false, true] {
            // 1 - exp(-x): the slope falls by e over each millimetre.
            let turned = |reading: f64| if falls { 1.0 - reading } else { reading };
            let point = |n: i32| {
                let x = f64::from(n) * 0.1e-3;
                (x, turned(1.0 - (-x / 1e-3).exp()))
            };
            let points: Vec<(f64, f64)> = (0..=30).map(point).collect();
            let curve = ReadingCurve::new(&points).expect("monotone");
            for n in 0..=300 {
                let x = f64::from(n) * 1e-5;
                assert!((curve.value(curve.reading(x)) - x).abs() < 1e-12, "{x}");
            }
            assert!((curve.flatness() / 3f64.exp() - 1.0).abs() < 0.05);
            // A micrometre at the steepest place is e times as much a millimetre on, and it goes
            // the same way.
            let off = curve.with_noise(1e-3, 1e-6) - 1e-3;
            assert!((off / (1e-6 * 1f64.exp()) - 1.0).abs() < 0.02, "{off}");
        }
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        let cases: [(&[(f64, f64)], &str); 4] = [
            (&[(0.0, 0.0)], "two points"),
            (&[(0.0, 0.0), (0.0, 1.0)], "values that rise"),
            (&[(0.0, 0.0), (1.0, 0.5), (2.0, 0.4)], "rise or fall"),
            (&[(0.0, 0.0), (1.0, 1.5)], "from 0 to 1"),
        ];
        for (points, words) in cases {
            let error = ReadingCurve::new(points).expect_err(words);
            assert!(error.contains(words), "{error}");
        }
    }
}
