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

use libm::{exp, sqrt};
use num_complex::Complex64;

use super::key::{Key, Resonance};

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
            let drive = before(key, w).map_or(drive, |before| drive * before);
            centre += drive * Complex64::from_polar(1.0, -w * delay_s) / (w * w);
            radius += drive.norm() / (w * w);
        }
        // 1/n^2 beyond N sums to less than 1/N, on both sides; the circle may be that much larger
        // wherever the centre is.
        let rest = 2.0 / f64::from(ALIASES) / (TAU * rate_hz).powi(2);
        let ends = corner.map_or(1.0, |corner| {
            (corner / (TAU * rate_hz * f64::from(ALIASES))).min(1.0)
        });
        // Two octaves above it a mode lets a fifteenth through; below that as much as at its peak.
        let far_hz = rate_hz * f64::from(ALIASES);
        let near = key.mode.filter(|mode| 4.0 * mode.hz > far_hz);
        let ends = near.map_or(ends, |mode| ends * peak(mode));
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

/// What lies before the drive's bandwidth, and its mode, make of a force, at a frequency (rad/s);
/// none where there is neither.
fn before(key: &Key, w: f64) -> Option<Complex64> {
    let lag = key
        .lag_hz
        .map(|hz| Complex64::new(1.0, w / (TAU * hz)).inv());
    let mode = key.mode.map(|Resonance { hz, damping }| {
        let part = w / (TAU * hz);
        Complex64::new(1.0 - part * part, 2.0 * damping * part).inv()
    });
    match (lag, mode) {
        (Some(lag), Some(mode)) => Some(lag * mode),
        (lag, mode) => lag.or(mode),
    }
}

/// The most that a mode makes of a force at any frequency.
fn peak(Resonance { damping, .. }: Resonance) -> f64 {
    if damping * damping >= 0.5 {
        return 1.0;
    }
    0.5 / (damping * sqrt(1.0 - damping * damping))
}

/// The answer h(t) of a mode to a pulse: the integrals of |h| and of t |h|. The first says by how
/// much a force may be larger than what was asked for, the second how late it is (s).
fn late_by_mode(Resonance { hz, damping }: Resonance) -> [f64; 2] {
    let w = TAU * hz;
    let (a, b) = (damping * w, w * sqrt(1.0 - damping * damping));
    let half_s = std::f64::consts::PI / b;
    let q = exp(-a * half_s);
    let squares = a * a + b * b;
    // Over the first half period; each further one is smaller by q.
    let first = b * (1.0 + q) / squares;
    let moment = b * (half_s * q * squares + 2.0 * a * (1.0 + q)) / (squares * squares);
    let size = w * w / b;
    let all = first / (1.0 - q);
    let late = moment / (1.0 - q) + half_s * first * q / ((1.0 - q) * (1.0 - q));
    [size * all, size * late]
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
    let late_s = late_s + key.lag_hz.map_or(0.0, |hz| 1.0 / (TAU * hz));
    let [larger, later_s] = key.mode.map_or([1.0, 0.0], late_by_mode);
    let late_s = late_s * larger + later_s;
    stiffness * late_s + damping * gains[0] * larger + mass * gains[1] * larger
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
        lag_hz: None,
        mode: None,
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
    fn a_mode_is_late_as_its_answer_says() {
        for damping in [0.05, 0.3, 0.9] {
            let mode = Resonance { hz: 300.0, damping };
            let w = TAU * mode.hz;
            let rings = w * sqrt(1.0 - damping * damping);
            let answer = |t: f64| w * w / rings * exp(-damping * w * t) * libm::sin(rings * t);
            let step = 1e-7;
            let sums = (0..2_000_000).fold([0.0; 2], |[all, late], n| {
                let t = (f64::from(n) + 0.5) * step;
                let part = answer(t).abs() * step;
                [all + part, late + t * part]
            });
            let found = late_by_mode(mode);
            for (found, sum) in found.iter().zip(sums) {
                assert!((found / sum - 1.0).abs() < 1e-4, "{damping}: {found} {sum}");
            }
        }
    }

    /// A lag asks for more damping, and a mode that rings for more yet; a fast lag for nothing.
    #[test]
    fn stages_before_a_drive_ask_for_more() {
        let spring = |lag_hz, mode| {
            let key = Key {
                delay_ticks: 1.0,
                lag_hz,
                mode,
                ..KEY
            };
            needed(&key, |_| 800.0.into())
        };
        let mode = |damping| Some(Resonance { hz: 200.0, damping });
        let plain = spring(None, None);
        assert!((spring(Some(1e5), None) / plain - 1.0).abs() < 0.01);
        let slow = spring(Some(200.0), None);
        assert!(slow > 1.3 * plain, "{slow} {plain}");
        let (rings, dead) = (spring(None, mode(0.05)), spring(None, mode(0.7)));
        assert!(rings > 1.2 * dead && dead > plain, "{rings} {dead} {plain}");
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
