//! The loop of key, hand and linear system: its margin in every hand, its poles where it rings.

use std::cell::RefCell;

use num_complex::Complex64;
use rustc_hash::FxHashMap;

use super::hands::hands;
use super::key::{Hand, Held, Key};
use super::linear::System;
use super::margin::{Margin, angles, leaving, margin, on_circle};
use super::modes::{FoundSystem, Mode};
use super::passive::Hold;
use super::pole;
use super::response::{Differentiator, forces, settles};
use whippen_lang::model::Model;

/// What a hand makes of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerHand {
    /// The hand.
    pub hand: Hand,
    /// The forces may be so many times what they are before the loop rings; below 1 it does.
    pub factor: f64,
    /// What it rings with (Hz): where it rings as it is, that of its fastest growing pole; else
    /// that at the border; 0 where there is none.
    pub ring_hz: f64,
    /// By how much that grows (1/s: by e in a second); 0 where it does not ring.
    pub growth_per_s: f64,
}
/// Whether a pole turns round; slower ones run away.
pub(super) fn turns(ring_hz: f64) -> bool {
    ring_hz >= 0.1
}

/// Everything about frequency that does not depend on the program's state: made once.
#[derive(Debug, Clone)]
pub(super) struct Loops {
    pub key: Key,
    pub rate_hz: f64,
    pub angles: Vec<f64>,
    pub differentiators: Vec<Differentiator>,
    pub hands: Vec<(Hand, Held, Vec<Complex64>)>,
    /// `x`, `x'`, `x''` of every sense at the angles: on the circle, and on the unit circle.
    inputs: [Vec<Vec<Complex64>>; 2],
    holds: Vec<Hold>,
}

/// What was found between the angles, by the angle's bits: hands and systems halve the same steps.
#[derive(Debug, Default)]
pub(super) struct Between {
    /// Of the key in a hand, by its number too.
    gains: FxHashMap<(usize, u64), Complex64>,
    inputs: FxHashMap<u64, Vec<Complex64>>,
    /// Of all terms of one system.
    sums: FxHashMap<u64, Complex64>,
}

impl Loops {
    pub fn new(model: &Model, key: &Key) -> Loops {
        let rate_hz = f64::from(model.rate_hz);
        let angles = angles(rate_hz);
        let held = |hand: Hand| {
            let held = Held::new(key, &hand, rate_hz);
            let gains = angles
                .iter()
                .map(|theta| held.at(on_circle(*theta, rate_hz)))
                .collect();
            (hand, held, gains)
        };
        let differentiators: Vec<Differentiator> = model
            .senses
            .iter()
            .map(|s| Differentiator::new(s.window, rate_hz))
            .collect();
        Loops {
            key: *key,
            rate_hz,
            inputs: all_inputs(&angles, &differentiators, rate_hz),
            hands: hands(model.turns()).into_iter().map(held).collect(),
            holds: angles
                .iter()
                .map(|theta| Hold::new(key, rate_hz, *theta))
                .collect(),
            differentiators,
            angles,
        }
    }

    /// What each term gives to the growing motion of a mode in its worst hand, in proportion: the
    /// part of its force that goes with the speed, by way of the delays, the hold and the coil; of
    /// a motion without turns, the part that goes with the way.
    pub fn gives(&self, mode: &Mode) -> Vec<f64> {
        let PerHand {
            hand,
            ring_hz,
            growth_per_s,
            ..
        } = mode.worst;
        let s = Complex64::new(growth_per_s, std::f64::consts::TAU * ring_hz);
        let z = (s / self.rate_hz).exp();
        let (mass, damping) = (self.key.mass + hand.mass, self.key.damping + hand.damping);
        let impedance = s * s * mass + s * damping + hand.stiffness;
        let held = self.hands.iter().find(|(own, ..)| *own == hand);
        let late = held.map_or(Complex64::ONE, |(_, held, _)| held.at(z) * impedance);
        let forces = forces(&mode.system, z, &inputs(&self.differentiators, z));
        let part = |force: Complex64| if turns(ring_hz) { force.im } else { force.re };
        forces.into_iter().map(|f| -part(f * late)).collect()
    }

    /// The sum of all terms at every angle.
    fn responses(
        &self,
        system: &System,
        inputs: &[Vec<Complex64>],
        z: impl Fn(f64) -> Complex64,
    ) -> Vec<Complex64> {
        let at = |(theta, inputs): (&f64, &Vec<Complex64>)| {
            forces(system, z(*theta), inputs).iter().sum()
        };
        self.angles.iter().zip(inputs).map(at).collect()
    }

    /// The margin in the hand that bears it least, with the frequency at its border.
    pub fn worst(&self, system: &System, between: &mut Between) -> PerHand {
        let least = |a: PerHand, b: PerHand| if b.factor < a.factor { b } else { a };
        let all = self.per_hand(system, between).into_iter();
        all.reduce(least).unwrap_or(PerHand {
            hand: Hand::FREE,
            factor: f64::INFINITY,
            ring_hz: 0.0,
            growth_per_s: 0.0,
        })
    }

    /// The margin in each hand, with the frequency at its border.
    pub fn per_hand(&self, system: &System, between: &mut Between) -> Vec<PerHand> {
        let system = &system.summed();
        let responses = self.responses(system, &self.inputs[0], |theta| {
            on_circle(theta, self.rate_hz)
        });
        between.sums.clear();
        let between = RefCell::new(between);
        let of = |number: usize| {
            let (hand, held, gains) = &self.hands[number];
            let at = |theta: f64| {
                let z = on_circle(theta, self.rate_hz);
                let Between {
                    gains,
                    inputs: known,
                    sums,
                } = &mut **between.borrow_mut();
                let gain = *gains
                    .entry((number, theta.to_bits()))
                    .or_insert_with(|| held.at(z));
                let sum = sums.entry(theta.to_bits()).or_insert_with(|| {
                    let inputs = known
                        .entry(theta.to_bits())
                        .or_insert_with(|| inputs(&self.differentiators, z));
                    forces(system, z, inputs).iter().sum()
                });
                gain * *sum
            };
            let known: Vec<Complex64> = gains.iter().zip(&responses).map(|(p, h)| p * h).collect();
            let Margin { factor, theta } = margin(&self.angles, &known, &at);
            PerHand {
                hand: *hand,
                factor,
                ring_hz: theta * self.rate_hz / std::f64::consts::TAU,
                growth_per_s: 0.0,
            }
        };
        (0..self.hands.len()).map(of).collect()
    }

    /// The same with the frequency and the growth of the loop as it is, where it rings: those of
    /// its fastest growing pole.
    pub fn as_it_is(&self, system: &System, found: PerHand) -> PerHand {
        let same = self.hands.iter().find(|(hand, ..)| *hand == found.hand);
        let (true, Some((_, held, gains))) = (found.factor <= 1.0, same) else {
            return found;
        };
        let system = system.summed();
        let gain = |z: Complex64| {
            let inputs = inputs(&self.differentiators, z);
            held.at(z) * forces(&system, z, &inputs).iter().sum::<Complex64>()
        };
        let at = |theta: f64| gain(on_circle(theta, self.rate_hz));
        let responses = self.responses(&system, &self.inputs[0], |theta| {
            on_circle(theta, self.rate_hz)
        });
        let known: Vec<Complex64> = gains.iter().zip(&responses).map(|(p, h)| p * h).collect();
        let poles = leaving(&self.angles, &known, &at)
            .into_iter()
            .filter_map(|(factor, theta)| {
                pole::followed(&gain, factor, on_circle(theta, self.rate_hz))
            });
        let fastest = poles.max_by(|a, b| a.norm().total_cmp(&b.norm()));
        fastest.map_or(found, |z| PerHand {
            ring_hz: z.arg().abs() * self.rate_hz / std::f64::consts::TAU,
            growth_per_s: libm::log(z.norm()) * self.rate_hz,
            ..found
        })
    }

    /// The same key and hands with the windows of all senses cut by half.
    pub fn with_half_windows(&self) -> Loops {
        let shorter =
            |d: &Differentiator| Differentiator::new(((d.window() / 2) | 1).max(3), self.rate_hz);
        let differentiators: Vec<Differentiator> =
            self.differentiators.iter().map(shorter).collect();
        Loops {
            inputs: all_inputs(&self.angles, &differentiators, self.rate_hz),
            differentiators,
            ..self.clone()
        }
    }

    /// What holds for a system.
    pub fn mode(&self, found: FoundSystem, between: &mut Between) -> Mode {
        let FoundSystem {
            name,
            bounded,
            coarse,
            places,
            system,
        } = found;
        let direct = |part: usize| {
            system
                .outputs
                .iter()
                .flat_map(move |o| o.direct.iter().skip(part).step_by(3))
                .sum()
        };
        Mode {
            name,
            gains: std::array::from_fn(direct),
            coupled: system.a.len(),
            settles: settles(&system.a, on_circle(0.0, self.rate_hz).re),
            damping_needed: self.damping_needed(&system),
            worst: self.as_it_is(&system, self.worst(&system, between)),
            bounded,
            coarse,
            places,
            system,
        }
    }

    /// Damping that the key needs to be passive.
    fn damping_needed(&self, system: &System) -> f64 {
        let responses = self.responses(&system.summed(), &self.inputs[1], on_unit);
        // Below 1 rad/s nothing is sampled: what is left there is the limit.
        let places = self.angles.iter().zip(self.holds.iter().zip(&responses));
        let places = places.filter(|(theta, _)| **theta * self.rate_hz >= 1.0);
        places
            .map(|(_, (hold, response))| hold.damping(*response))
            .fold(0.0, f64::max)
    }
}

fn on_unit(theta: f64) -> Complex64 {
    Complex64::from_polar(1.0, theta)
}

/// `x`, `x'`, `x''` of every sense for a unit of `x`.
fn inputs(differentiators: &[Differentiator], z: Complex64) -> Vec<Complex64> {
    differentiators.iter().flat_map(|d| d.at(z)).collect()
}

/// The inputs at all angles, on the circle and on the unit circle.
fn all_inputs(
    angles: &[f64],
    differentiators: &[Differentiator],
    rate_hz: f64,
) -> [Vec<Vec<Complex64>>; 2] {
    let all = |z: &dyn Fn(f64) -> Complex64| {
        let at = |theta: &f64| inputs(differentiators, z(*theta));
        angles.iter().map(at).collect()
    };
    [all(&|theta| on_circle(theta, rate_hz)), all(&on_unit)]
}
