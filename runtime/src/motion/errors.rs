//! What is known of a recording's errors, applied to its rows: a flat end of the sensor, and copies
//! that differ by noise and scale.

use crate::device::noise::{normal, stream};

/// What a sensor does not show near rest, where its curve is flat: from x on, a way of
/// `way_m (1 - exp(-x / over_m))` is added, and the dip stays what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unseen {
    /// What is missing far from rest (m).
    pub way_m: f64,
    /// The way over which it gets lost (m).
    pub over_m: f64,
}

impl Unseen {
    pub(super) fn restore(self, positions_m: &mut [f64], dip_m: f64) {
        let longer = |x: f64| x + self.way_m * (1.0 - libm::exp(-x.max(0.0) / self.over_m));
        let part = dip_m / longer(dip_m);
        for x in positions_m {
            *x = part * longer(*x);
        }
    }
}

/// What makes a copy of a motion that may as well have been recorded: each row off by noise, all of
/// them by a scale; both normally distributed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Which random numbers.
    pub seed: u64,
    /// Spread of the noise (m).
    pub noise_m: f64,
    /// Spread of the scale.
    pub scale: f64,
}

impl Disturbance {
    pub(super) fn disturb(self, positions_m: &mut [f64]) {
        // The first number is the scale's, each row has one of its own.
        let copy = stream("copy", self.seed);
        let scale = 1.0 + self.scale * normal(copy, 0);
        for (number, x) in (1..).zip(positions_m) {
            *x = scale * *x + self.noise_m * normal(copy, number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_seen_comes_back_and_the_dip_stays() {
        let unseen = Unseen {
            way_m: 1e-3,
            over_m: 0.5e-3,
        };
        let mut rows = [0.0, 0.5e-3, 10e-3];
        unseen.restore(&mut rows, 10e-3);
        let middle = (0.5e-3 + 1e-3 * (1.0 - (-1.0_f64).exp())) * 10.0 / 11.0;
        assert_eq!((rows[0], rows[2]), (0.0, 10e-3));
        assert!((rows[1] - middle).abs() < 1e-9, "{rows:?}");
    }

    #[test]
    fn a_copy_has_the_noise_and_the_scale_that_it_shall() {
        let copies = 200;
        let mut scales = 0.0;
        for seed in 0..copies {
            let mut rows = vec![1.0; 500];
            let copy = Disturbance {
                seed,
                noise_m: 30e-6,
                scale: 0.003,
            };
            copy.disturb(&mut rows);
            let mean = rows.iter().sum::<f64>() / rows.len() as f64;
            let square: f64 = rows.iter().map(|x| (x - mean).powi(2)).sum();
            let noise = (square / rows.len() as f64).sqrt();
            assert!((noise / 30e-6 - 1.0).abs() < 0.15, "{noise}");
            scales += (mean - 1.0).powi(2);
        }
        let scale = (scales / copies as f64).sqrt();
        assert!((scale / 0.003 - 1.0).abs() < 0.15, "{scale}");
    }
}
