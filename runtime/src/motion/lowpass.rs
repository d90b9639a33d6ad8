//! A low-pass filter without delay: a Butterworth filter of fourth order run forward and then
//! backward.
//!
//! The magnitude is squared (-6 dB at the corner, -48 dB an octave above) and the phase cancels, so
//! events stay where they are. Both ends are continued by their own odd reflection and the filter
//! starts settled, so a file that begins or ends away from zero, or on a slope, does not ring.
//!
//! Sine and cosine come from a portable library, not from the platform, so that a motion has the
//! same bits on every machine.

use std::f64::consts::{FRAC_PI_8, PI};

/// Keeps what is below `corner_hz`; `None` unless the corner lies between 0 and half the rate.
pub fn lowpass(x: &[f64], rate_hz: f64, corner_hz: f64) -> Option<Vec<f64>> {
    if !(corner_hz > 0.0 && corner_hz < rate_hz / 2.0) {
        return None;
    }
    let omega = 2.0 * PI * corner_hz / rate_hz;
    // Poles of a fourth-order Butterworth filter lie at pi/8 and 3 pi/8 from the real axis: Q = 1 /
    // (2 cos angle).
    let sections = [FRAC_PI_8, 3.0 * FRAC_PI_8]
        .map(|angle| FilterSection::low_pass(omega, 0.5 / libm::cos(angle)));
    let (mut padded, pad) = reflected(x, (6.0 * rate_hz / corner_hz) as usize);
    for _direction in 0..2 {
        for section in sections {
            section.run(&mut padded);
        }
        padded.reverse();
    }
    padded.drain(..pad);
    padded.truncate(x.len());
    Some(padded)
}

/// The samples with `pad` (or as many as there are) reflected about the first and about the last
/// one.
fn reflected(x: &[f64], pad: usize) -> (Vec<f64>, usize) {
    let pad = pad.min(x.len().saturating_sub(1));
    let mut all = Vec::with_capacity(x.len() + 2 * pad);
    all.extend(x.iter().skip(1).take(pad).rev().map(|v| 2.0 * x[0] - v));
    all.extend_from_slice(x);
    all.extend(
        x.iter()
            .rev()
            .skip(1)
            .take(pad)
            .map(|v| 2.0 * x[x.len() - 1] - v),
    );
    (all, pad)
}

/// A second-order section: y = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2.
#[derive(Debug, Clone, Copy)]
struct FilterSection {
    b0: f64,
    b1: f64,
    a1: f64,
    a2: f64,
}

impl FilterSection {
    /// By the bilinear transform, with the corner (rad per sample) where it is asked for.
    fn low_pass(omega: f64, q: f64) -> FilterSection {
        let (sin, cos) = (libm::sin(omega), libm::cos(omega));
        let alpha = sin / (2.0 * q);
        let a0 = 1.0 + alpha;
        FilterSection {
            b0: (1.0 - cos) / 2.0 / a0,
            b1: (1.0 - cos) / a0,
            a1: -2.0 * cos / a0,
            a2: (1.0 - alpha) / a0,
        }
    }

    /// Filters in place, settled on the first sample.
    fn run(self, x: &mut [f64]) {
        let rest = x.first().copied().unwrap_or(0.0);
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        for sample in x {
            let x0 = *sample - rest;
            let y0 = self.b0 * (x0 + x2) + self.b1 * x1 - self.a1 * y1 - self.a2 * y2;
            (x2, x1, y2, y1) = (x1, x0, y1, y0);
            *sample = y0 + rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 2000.0;

    fn tone(hz: f64) -> Vec<f64> {
        (0..4000)
            .map(|i| (2.0 * PI * hz * f64::from(i) / RATE_HZ).sin())
            .collect()
    }

    /// Amplitude and phase (rad) of a tone in the middle of the samples.
    fn measured(x: &[f64], hz: f64) -> (f64, f64) {
        let middle = 1000..3000;
        let (mut re, mut im) = (0.0, 0.0);
        for i in middle.clone() {
            let angle = 2.0 * PI * hz * i as f64 / RATE_HZ;
            re += x[i] * angle.sin() / 1000.0;
            im += x[i] * angle.cos() / 1000.0;
        }
        (re.hypot(im), im.atan2(re))
    }

    #[test]
    fn magnitude_is_that_of_a_squared_butterworth_and_phase_is_zero() {
        for hz in [10.0, 50.0, 100.0, 150.0, 200.0, 300.0, 400.0] {
            let warped = (PI * hz / RATE_HZ).tan() / (PI * 200.0 / RATE_HZ).tan();
            let expected = 1.0 / (1.0 + warped.powi(8));
            let (amplitude, phase) = measured(&lowpass(&tone(hz), RATE_HZ, 200.0).unwrap(), hz);
            assert!(
                (amplitude - expected).abs() < 1e-9,
                "{hz} Hz: {amplitude} for {expected}"
            );
            assert!(phase.abs() < 1e-9 / expected, "{hz} Hz: phase {phase}");
        }
    }

    #[test]
    fn constants_and_ramps_keep_their_ends() {
        let flat = lowpass(&[0.7; 300], RATE_HZ, 20.0).unwrap();
        assert!(flat.iter().all(|y| (y - 0.7).abs() < 1e-14));
        let ramp: Vec<f64> = (0..3000).map(|i| 5.0 + f64::from(i)).collect();
        let y = lowpass(&ramp, RATE_HZ, 20.0).unwrap();
        let worst = y
            .iter()
            .zip(&ramp)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-5, "{worst}");
    }

    #[test]
    fn short_files_and_impossible_corners() {
        assert!(lowpass(&[], RATE_HZ, 200.0).unwrap().is_empty());
        assert_eq!(lowpass(&[3.0], RATE_HZ, 200.0).unwrap(), vec![3.0]);
        assert_eq!(lowpass(&[1.0, 2.0], RATE_HZ, 200.0).unwrap().len(), 2);
        for corner_hz in [0.0, -1.0, 1000.0, 1e9, f64::NAN] {
            assert_eq!(lowpass(&[1.0; 10], RATE_HZ, corner_hz), None);
        }
    }
}
