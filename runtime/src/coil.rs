//! What a drive makes of its words: converter, amplifier, coil and the coil's first mode, in steps
//! much finer than the ticks.
//!
//! ```text
//!   word --upper bits, delay, hold--> amplifier, or R/L of the coil --bandwidth--> first mode --> force
//! ```
//!
//! The input of a stage is constant over a step, so each is stepped by its exact solution; all are
//! linear but a winding behind a supply (`supplied`). A stage that the device does not name is not
//! there.
//!
//! Not here: what a motor stands (`motor`), and the same chain as a frequency response (the
//! compiler's `stability`).

mod supplied;

use std::collections::VecDeque;
use std::f64::consts::TAU;

use libm::{cos, exp, sin, sqrt};
use whippen_compiler::rate::Rate;
use whippen_compiler::stability::Resonance;

use crate::device::Drive;
use supplied::Supplied;

/// Steps in a tick.
pub const STEPS: usize = 16;

/// A drive at work.
#[derive(Debug, Clone)]
pub struct Coil {
    drive: Drive,
    /// Forces asked for, with the steps at which they begin to act.
    asked: VecDeque<(usize, f64)>,
    held: f64,
    /// In place of `lag` where the device names a supply.
    supplied: Option<Supplied>,
    lag: Option<Lag>,
    bandwidth: Lag,
    mode: Option<Ring>,
    step: usize,
}

/// A first-order lag.
#[derive(Debug, Clone, Copy)]
struct Lag {
    /// How much of the way to its input it goes in a step.
    follows: f64,
    level: f64,
}

/// A second-order mode.
#[derive(Debug, Clone, Copy)]
struct Ring {
    /// What a step makes of the distance from the input and its rate.
    step: [[f64; 2]; 2],
    level: f64,
    rate: f64,
}

impl Coil {
    /// A drive at rest.
    pub fn new(drive: Drive, rate_hz: Rate) -> Coil {
        let step_s = 1.0 / (f64::from(rate_hz) * STEPS as f64);
        let lag = drive.lag_hz().map(|hz| Lag::new(Some(hz), step_s));
        let behind_supply = drive.supply.zip(drive.winding);
        let supplied = behind_supply.map(|(supply, winding)| {
            let follows = drive.amplifier_hz.and(lag).map(|lag| lag.follows);
            Supplied::new(supply, winding, follows, step_s)
        });
        Coil {
            drive,
            asked: VecDeque::new(),
            held: 0.0,
            lag: lag.filter(|_| supplied.is_none()),
            supplied,
            bandwidth: Lag::new(drive.bandwidth_hz, step_s),
            mode: drive.mode.map(|mode| Ring::new(mode, step_s)),
            step: 0,
        }
    }

    /// The same that has held a force for ever.
    #[must_use]
    pub fn holding(self, force: f64) -> Coil {
        let at = |lag: Lag| Lag {
            level: force,
            ..lag
        };
        let still = |ring: Ring| Ring {
            level: force,
            rate: 0.0,
            ..ring
        };
        Coil {
            held: force,
            supplied: self.supplied.map(|winding| winding.at(force)),
            lag: self.lag.map(at),
            bandwidth: at(self.bandwidth),
            mode: self.mode.map(still),
            ..self
        }
    }

    /// Takes the word of a tick, before the steps of that tick.
    pub fn ask(&mut self, word: i16) {
        let begins = self.step + steps(self.drive.delay_samples);
        self.asked.push_back((begins, self.drive.force(word)));
    }

    /// Goes on by a step, of a key that goes down at a speed (m/s or rad/s): behind a supply it
    /// induces a voltage.
    pub fn advance(&mut self, speed: f64) {
        while let Some(&(begins, force)) = self.asked.front() {
            if begins > self.step {
                break;
            }
            self.held = force;
            self.asked.pop_front();
        }
        let mut input = self.held;
        if let Some(winding) = &mut self.supplied {
            input = winding.advance(input, speed);
        }
        if let Some(lag) = &mut self.lag {
            input = lag.advance(input);
        }
        input = self.bandwidth.advance(input);
        if let Some(mode) = &mut self.mode {
            mode.advance(input);
        }
        self.step += 1;
    }

    /// Takes the word of a tick and goes on to the next, of a key whose speed does not matter.
    pub fn tick(&mut self, word: i16) {
        self.ask(word);
        (0..STEPS).for_each(|_| self.advance(0.0));
    }

    /// What it pushes (N or N*m, up).
    pub fn force(&self) -> f64 {
        self.mode.map_or(self.bandwidth.level, |mode| mode.level)
    }
}

impl Lag {
    fn new(hz: Option<f64>, step_s: f64) -> Lag {
        Lag {
            follows: hz.map_or(1.0, |hz| 1.0 - exp(-TAU * hz * step_s)),
            level: 0.0,
        }
    }

    fn advance(&mut self, input: f64) -> f64 {
        self.level += self.follows * (input - self.level);
        self.level
    }
}

impl Ring {
    fn new(mode: Resonance, step_s: f64) -> Ring {
        let w = TAU * mode.hz;
        let (decay, rings) = (
            mode.damping * w,
            w * sqrt(1.0 - mode.damping * mode.damping),
        );
        let (s, c) = (sin(rings * step_s), cos(rings * step_s));
        let part = exp(-decay * step_s);
        Ring {
            step: [
                [part * (c + decay / rings * s), part / rings * s],
                [-part * w * w / rings * s, part * (c - decay / rings * s)],
            ],
            level: 0.0,
            rate: 0.0,
        }
    }

    fn advance(&mut self, input: f64) {
        let (off, rate) = (self.level - input, self.rate);
        let [to_level, to_rate] = self.step;
        self.level = input + to_level[0] * off + to_level[1] * rate;
        self.rate = to_rate[0] * off + to_rate[1] * rate;
    }
}

/// Whole steps of a delay in ticks.
pub fn steps(ticks: f64) -> usize {
    (ticks * STEPS as f64).round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Winding;

    const RATE_HZ: u32 = 44_100;

    /// The answer to a step of the word, step by step: time from the tick of the word (s), force.
    fn answer(drive: Drive, word: i16, ticks: usize) -> Vec<(f64, f64)> {
        let mut coil = Coil::new(drive, RATE_HZ.into());
        let mut out = Vec::new();
        for _ in 0..ticks {
            coil.ask(word);
            for _ in 0..STEPS {
                coil.advance(0.0);
                let t_s = coil.step as f64 / (STEPS as f64 * f64::from(RATE_HZ));
                out.push((t_s, coil.force()));
            }
        }
        out
    }

    const PLAIN: Drive = Drive {
        full_scale: 2.0,
        ..Drive::NONE
    };

    #[test]
    fn a_coil_follows_a_voltage_by_its_resistance_and_inductance() {
        let winding = Winding {
            resistance_ohm: 5.0,
            inductance_h: 1e-3,
        };
        let drive = Drive {
            winding: Some(winding),
            ..PLAIN
        };
        for (t_s, force) in answer(drive, 16_384, 40) {
            let exact = 1.0 - (-t_s * 5.0 / 1e-3).exp();
            assert!((force - exact).abs() < 1e-12, "{t_s}: {force} {exact}");
        }
        // A transconductance amplifier makes its own bandwidth of it.
        let amplified = Drive {
            amplifier_hz: Some(40_000.0),
            ..drive
        };
        for (t_s, force) in answer(amplified, 16_384, 4) {
            let exact = 1.0 - (-t_s * TAU * 40_000.0).exp();
            assert!((force - exact).abs() < 1e-12, "{t_s}: {force} {exact}");
        }
    }

    #[test]
    fn a_mode_rings_and_decays_as_it_says() {
        let (hz, damping) = (3000.0, 0.05);
        let drive = Drive {
            mode: Some(Resonance { hz, damping }),
            ..PLAIN
        };
        let w = TAU * hz;
        let rings = w * f64::sqrt(1.0 - damping * damping);
        for (t_s, force) in answer(drive, 16_384, 200) {
            let (s, c) = (rings * t_s).sin_cos();
            let exact = 1.0 - (-damping * w * t_s).exp() * (c + damping * w / rings * s);
            assert!((force - exact).abs() < 1e-9, "{t_s}: {force} {exact}");
        }
    }

    #[test]
    fn a_delay_is_that_many_samples_and_a_converter_takes_the_upper_bits() {
        for delay_samples in [0.0, 1.0, 2.5] {
            let drive = Drive {
                delay_samples,
                ..PLAIN
            };
            let all = answer(drive, 16_384, 6);
            let late = all.iter().filter(|(_, force)| *force == 0.0).count();
            assert_eq!(late as f64, delay_samples * STEPS as f64);
        }
        let drive = Drive { bits: 12, ..PLAIN };
        for (word, taken) in [
            (15, 0),
            (16, 16),
            (-1, -16),
            (i16::MAX, 32_752),
            (i16::MIN, i16::MIN),
        ] {
            assert_eq!(drive.force(word), PLAIN.force(taken), "{word}");
        }
    }
}
