//! Passivity of the sampled loop: how much damping the key itself must have so that no hand
//! whatever can draw energy from it.
//!
//! Colgate and Schenkel (1997) for a hold without delay: `b > T/2 / (1 - cos wT) * Re{(1 - e^-jwT)
//! H(e^jwT)}`. With a delay `tau` that need not be whole ticks and a drive `G` behind the hold, the
//! same proof gives
//!
//! ```text
//!   w_n = w + 2 pi n / T     c = (1 - e^-jwT) H / 2T * sum G(w_n) e^(-j w_n tau) / w_n^2
//!                            r = |1 - e^-jwT| |H| / 2T * sum |G(w_n)| / w_n^2
//!   |b - c| > r for it and everything above, at every w:   b > Re c + sqrt(r^2 - (Im c)^2)
//! ```
//!
//! because a passive hand makes `1 / Z` anything in the disc around `1/2b` with that radius, at
//! every alias by itself. Without `G` and with a whole delay `r = |c|`, and it is their formula
//! with `H` delayed (`docs/stability.md`).

use std::f64::consts::TAU;

use libm::sqrt;
use num_complex::Complex64;

use super::key::Key;

/// So many aliases are summed on either side; the rest is bounded.
const ALIASES: i32 = 100;

/// What the hold, the delay and the drive make of a force, at one frequency.
#[derive(Debug, Clone, Copy)]
pub struct Hold {
    centre: Complex64,
    radius: f64,
}

impl Hold {
    /// At `theta` per tick, above 0 and at most pi.
    pub fn new(key: &Key, rate_hz: f64, theta: f64) -> Hold {
        let corner = key.bandwidth_hz.map(|hz| TAU * hz);
        let delay_s = key.delay_ticks / rate_hz;
        let (mut centre, mut radius) = (Complex64::ZERO, 0.0);
        for n in -ALIASES..=ALIASES {
            let w = (theta + TAU * f64::from(n)) * rate_hz;
            let drive = corner.map_or(Complex64::ONE, |corner| {
                Complex64::new(1.0, w / corner).inv()
            });
            centre += drive * Complex64::from_polar(1.0, -w * delay_s) / (w * w);
            radius += drive.norm() / (w * w);
        }
        // 1/n^2 beyond N sums to less than 1/N, on both sides; the circle may be that much larger
        // wherever the centre is.
        let rest = 2.0 / f64::from(ALIASES) / (TAU * rate_hz).powi(2);
        let ends = corner.map_or(1.0, |corner| {
            (corner / (TAU * rate_hz * f64::from(ALIASES))).min(1.0)
        });
        let difference = Complex64::ONE - Complex64::from_polar(1.0, -theta);
        let factor = difference * rate_hz / 2.0;
        Hold {
            centre: factor * centre,
            radius: factor.norm() * (radius + rest * ends),
        }
    }

    /// The damping that a virtual environment needs at this frequency (N*s/m); 0 where it needs
    /// none.
    pub fn damping(&self, environment: Complex64) -> f64 {
        let (centre, radius) = (self.centre * environment, self.radius * environment.norm());
        let under = radius * radius - centre.im * centre.im;
        if under < 0.0 {
            0.0
        } else {
            (centre.re + sqrt(under)).max(0.0)
        }
    }
}

/// The damping that suffices for gains that change as they like within bounds: no gain is ever
/// above these (absolute values of stiffness, damping and mass). From energies: what a spring is
/// late by is worth at most `|K| v^2` times the mean lateness, and what differentiators make of a
/// speed is bounded by their gains.
pub fn damping_for_changing(
    key: &Key,
    rate_hz: f64,
    [stiffness, damping, mass]: [f64; 3],
    gains: [f64; 2],
) -> f64 {
    let late_s =
        (0.5 + key.delay_ticks) / rate_hz + key.bandwidth_hz.map_or(0.0, |hz| 1.0 / (TAU * hz));
    stiffness * late_s + damping * gains[0] + mass * gains[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = Key {
        mass: 0.1,
        damping: 0.5,
        friction: 0.0,
        delay_ticks: 0.0,
        bandwidth_hz: None,
        sensor_lsb: 1e-7,
    };
    const RATE_HZ: f64 = 1000.0;

    fn needed(key: &Key, environment: impl Fn(Complex64) -> Complex64) -> f64 {
        let at = |i: i32| std::f64::consts::PI * f64::from(i) / 2000.0;
        let damping = |theta| {
            Hold::new(key, RATE_HZ, theta).damping(environment(Complex64::from_polar(1.0, theta)))
        };
        (1..=2000).map(|i| damping(at(i))).fold(0.0, f64::max)
    }

    /// Colgate and Schenkel's wall: `b > KT/2 + |B|`, with a delay of d ticks `KT/2 (1 + 2 d)` for
    /// the spring.
    #[test]
    fn the_published_conditions_come_out() {
        let (k, b) = (800.0, 0.3);
        let wall = |damping: f64| move |z: Complex64| k + damping * RATE_HZ * (1.0 - z.inv());
        for damping in [b, -b] {
            let found = needed(&KEY, wall(damping));
            let published = k / RATE_HZ / 2.0 + damping.abs();
            assert!(
                (found / published - 1.0).abs() < 2e-3,
                "{found} {published}"
            );
        }
        for delay_ticks in [1.0, 2.0, 5.0] {
            let found = needed(&Key { delay_ticks, ..KEY }, wall(0.0));
            let published = k / RATE_HZ / 2.0 * (1.0 + 2.0 * delay_ticks);
            assert!(
                (found / published - 1.0).abs() < 5e-3,
                "{found} {published}"
            );
            let changing = damping_for_changing(
                &Key { delay_ticks, ..KEY },
                RATE_HZ,
                [k, 0.0, 0.0],
                [1.0, 0.0],
            );
            assert!((changing / published - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_part_of_a_tick_lies_between_whole_ones_and_a_slow_drive_asks_for_more() {
        let at = |delay_ticks, bandwidth_hz| {
            needed(
                &Key {
                    delay_ticks,
                    bandwidth_hz,
                    ..KEY
                },
                |_| 800.0.into(),
            )
        };
        let (one, half, two) = (at(1.0, None), at(1.5, None), at(2.0, None));
        // A little more than half way: aliases come through a part of a tick with different phases.
        assert!(
            (1.6..1.65).contains(&half) && one < 1.21 && two > 1.99,
            "{one} {half} {two}"
        );
        assert!(at(1.0, Some(200.0)) > 1.3 * one);
    }
}
