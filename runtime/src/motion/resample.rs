//! From one rate to another by band-limited interpolation.
//!
//! Every output sample is a weighted mean of the input samples around its own instant; the weights
//! are a sinc under a Kaiser window, cut off at the lower of the two rates:
//!
//! ```text
//!   lower Nyquist frequency:   0 ....... 0.8      1.0
//!                              kept within  falls  gone (-100 dB)
//!                              -100 dB
//! ```
//!
//! There is no delay: output `i` is the signal at `i / to_hz`. Beyond the ends the first and the
//! last sample are held. Weights sum to one and apply to differences from the nearest sample, so a
//! constant stays exactly that constant.
//!
//! Why not a library: those at hand round their delay to whole output samples and choose their
//! summation order by the processor; here a motion has the same bits on every machine.

use std::f64::consts::PI;

/// Zero crossings of the sinc on each side of its centre.
const CROSSINGS: f64 = 40.0;
/// Shape of the Kaiser window: side lobes at -120 dB.
const BETA: f64 = 12.26;
/// Centre of the falling edge, as a fraction of the lower Nyquist frequency.
const CUTOFF: f64 = 0.9;
/// Tabulated shifts of the kernel per sample of the lower rate; between them the weights are linear
/// (error below -115 dB).
const SHIFTS: f64 = 1024.0;
/// Sums that run side by side in a dot product: a fixed order that a vector unit can follow.
const LANES: usize = 4;

/// The number of samples after [`resample`]: as long in time, to the nearest sample.
pub fn resampled_len(len: usize, from_hz: f64, to_hz: f64) -> f64 {
    (len as f64 * (to_hz / from_hz)).round()
}

/// The signal at another rate, sample by sample when it is asked for: what is held are the samples
/// at their own rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// The samples, with the first and the last repeated as far as the kernel reaches.
    held: Vec<f64>,
    /// None where both rates are one.
    kernel: Option<Kernel>,
    /// Input samples per output sample.
    step: f64,
    /// The last input sample.
    end: f64,
    len: usize,
}

impl Resampled {
    /// Both rates are positive and finite; the caller has checked that the result is of a sensible
    /// size.
    pub fn new(x: Vec<f64>, from_hz: f64, to_hz: f64) -> Resampled {
        let step = from_hz / to_hz;
        let end = x.len().saturating_sub(1) as f64;
        // Rates whose grids stay together to a thousandth of a sample over the whole file are one
        // rate.
        let (Some(&first), Some(&last), false) = (
            x.first(),
            x.last(),
            (step - 1.0).abs() * (x.len() as f64) < 1e-3,
        ) else {
            return Resampled {
                len: x.len(),
                held: x,
                kernel: None,
                step,
                end,
            };
        };
        let kernel = Kernel::new(step.max(1.0));
        let len = resampled_len(x.len(), from_hz, to_hz) as usize;
        let mut held = vec![first; kernel.half];
        held.reserve_exact(x.len() + kernel.half + 1);
        held.extend(x);
        held.resize(held.len() + kernel.half + 1, last);
        Resampled {
            held,
            kernel: Some(kernel),
            step,
            end,
            len,
        }
    }

    /// How many samples it has at the other rate.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// A sample at the other rate; the index is below the length.
    pub fn at(&self, index: usize) -> f64 {
        match &self.kernel {
            Some(kernel) => kernel.at(&self.held, (index as f64 * self.step).min(self.end)),
            None => self.held[index],
        }
    }
}

/// The signal at another rate, as [`Resampled`] has it.
#[cfg(test)]
pub fn resample(x: &[f64], from_hz: f64, to_hz: f64) -> Vec<f64> {
    let resampled = Resampled::new(x.to_vec(), from_hz, to_hz);
    (0..resampled.len()).map(|i| resampled.at(i)).collect()
}

/// Tabulated weights: row `s` is the kernel shifted by `s / shifts` of an input sample.
#[derive(Debug, Clone, PartialEq)]
struct Kernel {
    half: usize,
    shifts: usize,
    weights: Vec<f64>,
}

impl Kernel {
    /// For input samples that are `ratio` (at least 1) times as dense as those of the lower rate.
    fn new(ratio: f64) -> Kernel {
        let half = ((CROSSINGS * ratio) as usize).next_multiple_of(LANES);
        let shifts = (SHIFTS / ratio).ceil() as usize + 1;
        let mut weights = Vec::with_capacity((shifts + 1) * 2 * half);
        for s in 0..=shifts {
            let start = weights.len();
            let shift = s as f64 / shifts as f64;
            weights.extend((0..2 * half).map(|tap| {
                let distance = (tap as f64 - (half - 1) as f64 - shift) / ratio;
                sinc(CUTOFF * distance) * kaiser(distance / CROSSINGS)
            }));
            let sum: f64 = weights[start..].iter().sum();
            weights[start..].iter_mut().for_each(|w| *w /= sum);
        }
        Kernel {
            half,
            shifts,
            weights,
        }
    }

    /// The signal at `position` input samples; `held` begins `half` samples earlier.
    fn at(&self, held: &[f64], position: f64) -> f64 {
        let index = position as usize;
        let shift = (position - index as f64) * self.shifts as f64;
        let row = (shift as usize).min(self.shifts - 1);
        let between = shift - row as f64;
        let taps = 2 * self.half;
        let (low, high) = self.weights[row * taps..].split_at(taps);
        let samples = &held[index + 1..][..taps];
        let near = samples[self.half - 1];
        let mut sums = [0.0; LANES];
        for ((x, low), high) in samples
            .chunks_exact(LANES)
            .zip(low.chunks_exact(LANES))
            .zip(high.chunks_exact(LANES))
        {
            for lane in 0..LANES {
                sums[lane] += (x[lane] - near) * (low[lane] + between * (high[lane] - low[lane]));
            }
        }
        near + sums.iter().sum::<f64>()
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        libm::sin(PI * x) / (PI * x)
    }
}

/// The Kaiser window, up to a factor; 0 outside -1 .. 1.
fn kaiser(x: f64) -> f64 {
    if x.abs() < 1.0 {
        bessel_i0(BETA * (1.0 - x * x).sqrt())
    } else {
        0.0
    }
}

/// The modified Bessel function of order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..60 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(tones_hz: &[f64], t_s: f64) -> f64 {
        tones_hz
            .iter()
            .enumerate()
            .map(|(i, hz)| (2.0 * PI * hz * t_s + i as f64).sin())
            .sum()
    }

    fn sampled(tones_hz: &[f64], rate_hz: f64, seconds: f64) -> Vec<f64> {
        (0..(rate_hz * seconds) as usize)
            .map(|i| signal(tones_hz, i as f64 / rate_hz))
            .collect()
    }

    /// Largest error against the analytic signal away from the ends, relative to one tone's
    /// amplitude.
    fn worst(tones_hz: &[f64], from_hz: f64, to_hz: f64) -> f64 {
        let y = resample(&sampled(tones_hz, from_hz, 1.0), from_hz, to_hz);
        assert_eq!(y.len() as f64, (from_hz.floor() * to_hz / from_hz).round());
        let margin = (2.0 * CROSSINGS * to_hz / from_hz.min(to_hz)) as usize;
        (margin..y.len() - margin)
            .map(|i| (y[i] - signal(tones_hz, i as f64 / to_hz)).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_multi_sine_survives_to_minus_100_db() {
        for (from_hz, to_hz) in [
            (2000.0, 44_100.0),
            (8000.0, 44_100.0),
            (96_000.0, 44_100.0),
            (1234.567, 44_100.0),
            (44_100.0, 2000.0),
            (100.0, 101.0),
        ] {
            let nyquist = 0.5 * f64::min(from_hz, to_hz);
            let tones = [0.0013, 0.11, 0.37, 0.5, 0.79].map(|f| f * nyquist);
            let error = worst(&tones, from_hz, to_hz);
            assert!(
                error < 1e-5,
                "{from_hz} -> {to_hz} Hz: {} dB",
                20.0 * error.log10()
            );
        }
    }

    #[test]
    fn instants_are_kept_within_a_microsecond() {
        // The phase of a tone in the output, as a time.
        for (from_hz, hz) in [
            (2000.0, 30.0),
            (2000.0, 700.0),
            (8000.0, 3000.0),
            (192_000.0, 5000.0),
        ] {
            let y = resample(&sampled(&[hz], from_hz, 1.0), from_hz, 44_100.0);
            let (mut re, mut im) = (0.0, 0.0);
            for (i, y) in y.iter().enumerate().skip(4410).take(35_280) {
                let angle = 2.0 * PI * hz * i as f64 / 44_100.0;
                re += y * angle.sin();
                im += y * angle.cos();
            }
            let late_s = im.atan2(re) / (2.0 * PI * hz);
            assert!(late_s.abs() < 1e-8, "{from_hz} Hz, {hz} Hz: {late_s} s");
        }
    }

    #[test]
    fn what_the_lower_rate_cannot_carry_is_gone() {
        for (from_hz, to_hz, hz) in [
            (192_000.0, 44_100.0, 22_100.0),
            (192_000.0, 44_100.0, 90_000.0),
            (44_100.0, 2000.0, 1001.0),
        ] {
            let y = resample(&sampled(&[hz], from_hz, 1.0), from_hz, to_hz);
            let left = y[100..y.len() - 100]
                .iter()
                .fold(0.0_f64, |a, v| a.max(v.abs()));
            assert!(
                left < 1e-5,
                "{hz} Hz from {from_hz} to {to_hz} Hz: {} dB left",
                20.0 * left.log10()
            );
        }
    }

    #[test]
    fn constants_are_exact_ends_are_held_and_equal_rates_are_untouched() {
        for (from_hz, to_hz) in [
            (2000.0, 44_100.0),
            (1e6, 44_100.0),
            (300.0, 44_100.0),
            (44_100.0, 70.0),
        ] {
            assert!(
                resample(&[0.010; 1000], from_hz, to_hz)
                    .iter()
                    .all(|&y| y == 0.010),
                "{from_hz} Hz"
            );
        }
        let step: Vec<f64> = (0..200).map(|i| f64::from(u8::from(i >= 100))).collect();
        let y = resample(&step, 2000.0, 44_100.0);
        assert_eq!((y.len(), y[0], y[y.len() - 1]), (4410, 0.0, 1.0));
        assert_eq!(resample(&step, 2000.0, 2000.0 + 1e-9), step);
        assert!(resample(&[], 1.0, 2.0).is_empty());
        assert_eq!(resample(&[5.0], 2000.0, 44_100.0), vec![5.0; 22]);
    }
}
