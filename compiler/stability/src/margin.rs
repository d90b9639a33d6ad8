//! How much larger a force may be before the loop rings: where the loop gain turns round -1
//! (Nyquist), on a circle just outside of 1.
//!
//! ```text
//!   1 + g P(z) H(z) = 0    P: position for a force, key and hand; H: force for a position; g: how much larger
//!   for each z of the circle with g = -1 / P H real and positive, a pair of poles leaves (or enters) the circle at that g
//! ```
//!
//! Without force (`g = 0`) the key in a hand is stable, so the pairs outside at `g = 1` are what
//! left below 1 less what entered. A real pole that leaves is not counted: it is no ringing but a
//! force law that falls, through which a key snaps as it shall.

use std::cell::OnceCell;

use num_complex::Complex64;

/// Growth that counts as standing (1/s): by e in ten seconds, which any friction ends.
pub const GROWTH_PER_S: f64 = 0.1;

/// Larger factors than this are all the same.
pub const FACTOR_MAX: f64 = 100.0;

/// Of two numbers that are so many times apart, no rounding makes the smaller the larger.
const CLEAR: f64 = 1.0 + 1e-9;

/// A pair of poles on the circle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Crossing {
    factor: f64,
    theta: f64,
    leaves: bool,
}

/// The gain of a loop at an angle.
struct Point {
    theta: f64,
    gain: Complex64,
    /// Its absolute value, once somebody has asked for it.
    norm: OnceCell<f64>,
}

impl Point {
    fn new(theta: f64, gain: Complex64) -> Point {
        Point {
            theta,
            gain,
            norm: OnceCell::new(),
        }
    }

    fn norm(&self) -> f64 {
        *self.norm.get_or_init(|| self.gain.norm())
    }
}

/// What a loop bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The force may be so many times what it is: below 1 it rings.
    pub factor: f64,
    /// What it rings with then (radians per tick).
    pub theta: f64,
}

impl Margin {
    /// As much as one likes.
    pub const ENDLESS: Margin = Margin {
        factor: FACTOR_MAX,
        theta: 0.0,
    };
}

/// The angles at which loops are looked at, from 0.05 rad/s up to half the rate: even steps of
/// frequency in proportion, and evenly.
pub fn angles(rate_hz: f64) -> Vec<f64> {
    let first = 0.05 / rate_hz;
    let decades = libm::log10(std::f64::consts::PI / first);
    let steps = (40.0 * decades) as u32;
    let slow = (0..=steps).map(|i| first * libm::exp10(f64::from(i) / 40.0));
    let even = (1..=400).map(|i| std::f64::consts::PI * f64::from(i) / 400.0);
    let mut all: Vec<f64> = slow
        .filter(|theta| *theta < std::f64::consts::PI)
        .chain(even)
        .collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// The place on the circle.
pub fn on_circle(theta: f64, rate_hz: f64) -> Complex64 {
    Complex64::from_polar(libm::exp(GROWTH_PER_S / rate_hz), theta)
}

/// The margin of a loop gain `P H`, known at `angles` and computed between them.
pub fn margin(angles: &[f64], known: &[Complex64], at: &impl Fn(f64) -> Complex64) -> Margin {
    let crossings = crossings(angles, known, at);
    let mut outside = 0;
    let mut safe = Margin::ENDLESS;
    for Crossing {
        factor,
        theta,
        leaves,
    } in crossings
    {
        if factor > 1.0 && outside <= 0 && leaves {
            return Margin {
                factor: factor.min(FACTOR_MAX),
                theta,
            };
        }
        if factor > 1.0 && outside > 0 {
            break;
        }
        let before = outside;
        outside += if leaves { 1 } else { -1 };
        if before <= 0 && outside > 0 {
            safe = Margin { factor, theta };
        }
    }
    if outside > 0 { safe } else { Margin::ENDLESS }
}

/// Factors up to 1 at which pairs of poles leave the circle, and their angles.
pub fn leaving(
    angles: &[f64],
    known: &[Complex64],
    at: &impl Fn(f64) -> Complex64,
) -> Vec<(f64, f64)> {
    let left = |c: &Crossing| c.leaves && c.factor <= 1.0;
    let crossings = crossings(angles, known, at);
    let found = crossings.iter().filter(|c| left(c));
    found.map(|c| (c.factor, c.theta)).collect()
}

/// Every pair of poles on the circle at some factor, by rising factors.
fn crossings(angles: &[f64], known: &[Complex64], at: &impl Fn(f64) -> Complex64) -> Vec<Crossing> {
    let mut crossings = Vec::new();
    let points: Vec<Point> = angles
        .iter()
        .zip(known)
        .map(|(theta, gain)| Point::new(*theta, *gain))
        .collect();
    for pair in points.windows(2) {
        between(&pair[0], &pair[1], at, 0, &mut crossings);
    }
    // At half the rate the gain is real: a pole there is alone, and rings at every second tick.
    if let (Some(theta), Some(gain)) = (angles.last(), known.last()) {
        let factor = -1.0 / gain.re;
        if factor > 0.0 {
            crossings.push(Crossing {
                factor,
                theta: *theta,
                leaves: true,
            });
        }
    }
    crossings.sort_by(|a, b| a.factor.total_cmp(&b.factor));
    crossings
}

/// Finds crossings between two angles; halves them while the gain turns far.
fn between(
    low: &Point,
    high: &Point,
    at: &impl Fn(f64) -> Complex64,
    depth: u32,
    found: &mut Vec<Crossing>,
) {
    // Where a differentiator is blind the gain turns within nothing; so small a one meets -1 at no
    // factor that counts.
    if low.gain.norm_sqr().max(high.gain.norm_sqr()) < 1.0 / (FACTOR_MAX * FACTOR_MAX) {
        return;
    }
    let crosses = (low.gain.im < 0.0) != (high.gain.im < 0.0);
    // Far: by more than about a radian, or the real axis is met and it is not clear on which side.
    // Roots are taken only where squares leave it open.
    let along = (high.gain * low.gain.conj()).re;
    let (square, least) = (
        along * along,
        0.25 * low.gain.norm_sqr() * high.gain.norm_sqr(),
    );
    let far = match along > 0.0 && square.is_normal() {
        true if square > CLEAR * least => false,
        true if CLEAR * square < least => true,
        _ => along < 0.5 * low.norm() * high.norm(),
    };
    if (far && depth < 24) || (crosses && depth < 12) {
        let theta = 0.5 * (low.theta + high.theta);
        let middle = Point::new(theta, at(theta));
        between(low, &middle, at, depth + 1, found);
        between(&middle, high, at, depth + 1, found);
    } else if crosses {
        let part = low.gain.im / (low.gain.im - high.gain.im);
        let real = low.gain.re + part * (high.gain.re - low.gain.re);
        let factor = -1.0 / real;
        if real < 0.0 && !far {
            let theta = low.theta + part * (high.theta - low.theta);
            found.push(Crossing {
                factor,
                theta,
                leaves: low.gain.im < 0.0,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::key::{Hand, Held, Key};
    use super::super::response::Differentiator;
    use super::*;

    const RATE_HZ: f64 = 44_100.0;

    /// Steps the same loop, the window and the delays as lists, and tells whether it grows.
    fn rings(key: &Key, hand: &Hand, [k, b, m]: [f64; 3], window: u32) -> bool {
        let rate_hz = RATE_HZ;
        let half = f64::from(window / 2);
        let places: Vec<f64> = (0..window).map(|i| half - f64::from(i)).collect();
        let squares: f64 = places.iter().map(|j| j * j).sum();
        let bowl = |j: f64| j * j - half * (half + 1.0) / 3.0;
        let bowls: f64 = places.iter().map(|j| bowl(*j).powi(2)).sum();
        let weight = |i: usize| {
            let j = places[i];
            b * j / squares * rate_hz
                + m * 2.0 * bowl(j) / bowls * rate_hz * rate_hz
                + if i == 0 { k } else { 0.0 }
        };
        let weights: Vec<f64> = (0..window as usize).map(weight).collect();
        let fine = 8;
        let h = 1.0 / (rate_hz * f64::from(fine));
        let mut positions = std::collections::VecDeque::from(vec![0.0_f64; window as usize]);
        let mut commands = std::collections::VecDeque::from(vec![0.0_f64; 8]);
        let (mut x, mut v) = (0.0_f64, 0.01_f64);
        let (mass, damping) = (key.mass + hand.mass, key.damping + hand.damping);
        let mut peaks = [0.0_f64; 2];
        let ticks = 40_000;
        for tick in 0..ticks {
            positions.push_front(x);
            positions.pop_back();
            let force: f64 = weights.iter().zip(&positions).map(|(w, p)| w * p).sum();
            commands.push_front(force);
            commands.pop_back();
            let held = commands[key.delay_ticks as usize];
            for _ in 0..fine {
                // The middle of the step: exact enough for a growth of a thousandth.
                let a = |x: f64, v: f64| (-held - damping * v - hand.stiffness * x) / mass;
                let (xm, vm) = (x + 0.5 * h * v, v + 0.5 * h * a(x, v));
                (x, v) = (x + h * vm, v + h * a(xm, vm));
            }
            let part = if tick < ticks / 2 { 0 } else { 1 };
            if tick % (ticks / 2) > ticks / 4 {
                peaks[part] = peaks[part].max(v.abs());
            }
            if !v.is_finite() {
                return true;
            }
        }
        // What has settled is rounding.
        peaks[1] > peaks[0].max(1e-9)
    }

    #[test]
    fn the_border_is_where_a_stepped_loop_begins_to_ring() {
        let key = Key {
            mass: 0.06,
            damping: 0.2,
            friction: 0.0,
            delay_ticks: 2.0,
            bandwidth_hz: None,
            lag_hz: None,
            mode: None,
            sensor_lsb: 1e-7,
        };
        let hands = [
            Hand::FREE,
            Hand {
                mass: 0.05,
                damping: 1.0,
                stiffness: 2000.0,
            },
        ];
        let laws = [
            [400.0, 0.0, 0.0],
            [4000.0, 0.8, 0.0],
            [4000.0, 8.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 0.0, 0.1],
            [0.0, 0.0, -0.1],
        ];
        let angles = angles(RATE_HZ);
        let d = Differentiator::new(31, RATE_HZ);
        let mut bordered = 0;
        for hand in hands {
            for law in laws {
                let held = Held::new(&key, &hand, RATE_HZ);
                let gain = |theta: f64| {
                    let z = on_circle(theta, RATE_HZ);
                    let y = d.at(z);
                    held.at(z) * (y[0] * law[0] + y[1] * law[1] + y[2] * law[2])
                };
                let known: Vec<Complex64> = angles.iter().map(|theta| gain(*theta)).collect();
                let border = margin(&angles, &known, &gain);
                // A well damped spring has no border that is looked for.
                if border.factor >= FACTOR_MAX {
                    continue;
                }
                bordered += 1;
                for (factor, expected) in [(0.9, false), (1.1, true)] {
                    let scaled = law.map(|gain| gain * border.factor * factor);
                    let found = rings(&key, &hand, scaled, 31);
                    assert_eq!(
                        found, expected,
                        "{law:?} {hand:?} at {factor} of {border:?}"
                    );
                }
            }
        }
        assert!(bordered >= 8, "{bordered} of 12");
    }
}
