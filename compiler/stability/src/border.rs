//! How stiff a virtual spring with a damper may be: the map of stiffness over damping.

use num_complex::Complex64;

use super::key::{Hand, Held, Key};
use super::margin::{FACTOR_MAX, angles, margin, on_circle};
use super::passive::Hold;
use super::response::Differentiator;

/// Stiffness that a factor of 1 stands for (N/m), so that borders up to a hundred times of it are
/// found.
const UNIT: f64 = 1e3;

/// The borders of `k * x + B * x'` on a device.
#[derive(Debug, Clone)]
pub struct Borders {
    key: Key,
    rate_hz: f64,
    angles: Vec<f64>,
    differentiator: Differentiator,
    holds: Vec<Hold>,
}

impl Borders {
    /// At a rate, with differentiators over so many ticks.
    pub fn new(key: &Key, rate_hz: f64, window: u32) -> Borders {
        let angles = angles(rate_hz);
        Borders {
            key: *key,
            rate_hz,
            differentiator: Differentiator::new(window, rate_hz),
            holds: angles
                .iter()
                .map(|theta| Hold::new(key, rate_hz, *theta))
                .collect(),
            angles,
        }
    }

    /// The stiffness at which it begins to ring in a hand, with this much virtual damping (N*s/m);
    /// 0 where the damping rings by itself, the largest that is looked for where nothing does
    /// (N/m).
    pub fn stable(&self, hand: &Hand, damping: f64) -> f64 {
        let held = Held::new(&self.key, hand, self.rate_hz);
        let damped = |theta: f64| {
            let z = on_circle(theta, self.rate_hz);
            (
                held.at(z),
                held.at(z) * self.differentiator.at(z)[1] * damping,
            )
        };
        let of = |f: &dyn Fn(f64) -> Complex64| {
            let known: Vec<Complex64> = self.angles.iter().map(|theta| f(*theta)).collect();
            margin(&self.angles, &known, &|theta| f(theta)).factor
        };
        if damping > 0.0 && of(&|theta| damped(theta).1) <= 1.0 {
            return 0.0;
        }
        let spring = |theta: f64| {
            let (gives, damps) = damped(theta);
            gives * UNIT / (1.0 + damps)
        };
        UNIT * of(&spring)
    }

    /// The stiffness up to which it is passive, with this much virtual damping; none where the
    /// damping alone is not.
    pub fn passive(&self, damping: f64) -> Option<f64> {
        let needed = |stiffness: f64| {
            let environment = |theta: f64| {
                let z = Complex64::from_polar(1.0, theta);
                self.differentiator.at(z)[1] * damping + stiffness
            };
            let places = self
                .angles
                .iter()
                .zip(&self.holds)
                .filter(|(theta, _)| **theta * self.rate_hz >= 1.0);
            places
                .map(|(theta, hold)| hold.damping(environment(*theta)))
                .fold(0.0, f64::max)
        };
        let good = |stiffness: f64| needed(stiffness) <= self.key.damping;
        if !good(0.0) {
            return None;
        }
        let (mut low, mut high) = (0.0, UNIT * FACTOR_MAX);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if good(middle) {
                low = middle
            } else {
                high = middle
            }
        }
        Some(low)
    }
}
