//! What a bow has made of a string: how often it slips, how long it sticks, what sounds.

use std::f64::consts::TAU;

use super::player::{Bow, Player};

pub const RATE_HZ: f64 = 44_100.0;

/// A string: its pitch (Hz), length (m), mass per length (kg/m), and stiffness over that (m^2/s).
#[derive(Debug, Clone, Copy)]
pub struct Line {
    pub name: &'static str,
    pub pitch_hz: f64,
    pub length_m: f64,
    pub rho: f64,
    pub kappa: f64,
}

impl Line {
    /// The wave impedance (kg/s), from the pitch.
    pub fn impedance(&self) -> f64 {
        2.0 * self.length_m * self.pitch_hz * self.rho
    }

    /// The press (N) from which on Schelleng lets no bow keep a slip a period, and the height (N)
    /// of the saw that Helmholtz's motion draws at the bridge.
    pub fn limit(&self, speed: f64, beta: f64) -> f64 {
        2.0 * self.impedance() * speed / beta
    }
}

/// What a bow has made of a string.
#[derive(Debug)]
pub struct Motion {
    pub slips_per_period: f64,
    /// Share of ticks.
    pub stuck: f64,
    /// What sounds.
    pub pitch_hz: f64,
    /// Harmonics of the force on the bridge (N).
    pub harmonics: [f64; 4],
}

/// How often a row of slips leaves what sticks, and the share of ticks in which it does.
pub fn sticking(line: &Line, slips: &[f64], speed: f64) -> (f64, f64) {
    let (mut stuck, mut is_stuck, mut count) = (0_usize, true, 0_usize);
    for slip in slips {
        let size = slip.abs();
        stuck += usize::from(size < 0.2 * speed);
        count += usize::from(is_stuck && size > 0.5 * speed);
        is_stuck = size < 0.2 * speed || is_stuck && size <= 0.5 * speed;
    }
    let periods = slips.len() as f64 / RATE_HZ * line.pitch_hz;
    (count as f64 / periods, stuck as f64 / slips.len() as f64)
}

/// The last second of so many.
pub fn played(line: &Line, player: &mut impl Player, bow: Bow, seconds: usize) -> Motion {
    player.bow(bow);
    let rate = RATE_HZ as usize;
    (0..(seconds - 1) * rate).for_each(|_| {
        player.tick();
    });
    let heard: Vec<[f64; 3]> = (0..rate).map(|_| player.tick()).collect();
    let slips: Vec<f64> = heard.iter().map(|h| h[0]).collect();
    let (slips_per_period, stuck) = sticking(line, &slips, bow.speed);
    // The pitch under the bow, from how often it slips, is near that of the string.
    let bridge: Vec<f64> = heard.iter().map(|h| h[2]).collect();
    let pitch = loudest(line, &bridge);
    Motion {
        slips_per_period,
        stuck,
        pitch_hz: pitch,
        harmonics: [1.0, 2.0, 3.0, 4.0].map(|n| partial(&bridge, n * pitch)),
    }
}

/// Size of a partial in a Hann window over all.
fn partial(signal: &[f64], f_hz: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (i, value) in signal.iter().enumerate() {
        let window = 1.0 - (TAU * i as f64 / signal.len() as f64).cos();
        let angle = TAU * f_hz * i as f64 / RATE_HZ;
        re += window * value * angle.cos();
        im -= window * value * angle.sin();
    }
    2.0 * re.hypot(im) / signal.len() as f64
}

/// The frequency near the pitch at which most is heard.
fn loudest(line: &Line, signal: &[f64]) -> f64 {
    let all = (-40..=20).map(|step| line.pitch_hz * (f64::from(step) / 1200.0).exp2());
    let louder = |a: &f64, b: &f64| partial(signal, *a).total_cmp(&partial(signal, *b));
    all.max_by(louder).unwrap_or(line.pitch_hz)
}
