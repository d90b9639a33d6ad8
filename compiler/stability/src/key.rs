//! The key that is held: from the force that the program asks for to the position at the next
//! samples, exactly.
//!
//! ```text
//!   u[k] --delay--> hold --lag--> bandwidth --> first mode --> force on   m x'' = -b x' - k x - f
//!                                                  m, b, k: key and hand together
//!                                                  sampled at every tick
//! ```
//!
//! Between two samples the held force changes once (where the delay is no whole number of ticks),
//! so the continuous system is stepped over two parts of the tick by matrix exponentials.

use libm::{exp, floor, log2};
use num_complex::Complex64;

use super::response::solve;

/// The device's loop around a program: what moves, what is lost, what is late. Lengths in m and
/// forces in N, or angles and torques where the device turns (masses are then inertias).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Effective mass where `x` is measured (kg or kg*m^2).
    pub mass: f64,
    /// Viscous friction (N*s/m or N*m*s/rad).
    pub damping: f64,
    /// Dry friction (N or N*m).
    pub friction: f64,
    /// From the instant of measurement to the instant the force begins to act, in ticks; what is
    /// computed meanwhile is part of it.
    pub delay_ticks: f64,
    /// Where the force falls behind by 45 degrees (Hz); none for a drive without limit.
    pub bandwidth_hz: Option<f64>,
    /// Where what lies before that, amplifier or winding, falls behind by 45 degrees (Hz); none
    /// where nothing does.
    pub lag_hz: Option<f64>,
    /// The first mode of the drive, if it is known.
    pub mode: Option<Resonance>,
    /// What one word of the sensor is (m or rad).
    pub sensor_lsb: f64,
}

/// A second-order mode that a force goes through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Its frequency without damping (Hz), above 0.
    pub hz: f64,
    /// Its damping as a part of the critical one, above 0 and below 1.
    pub damping: f64,
}

/// What holds the key: a mass on it, and a spring and a damper to where the player wants it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// kg or kg*m^2.
    pub mass: f64,
    /// N*s/m or N*m*s/rad.
    pub damping: f64,
    /// N/m or N*m/rad.
    pub stiffness: f64,
}

impl Hand {
    /// Nobody.
    pub const FREE: Hand = Hand {
        mass: 0.0,
        damping: 0.0,
        stiffness: 0.0,
    };
}

/// Position, speed, and the states of the drive, of which the last is that behind the hold.
type Matrix<const N: usize> = [[f64; N]; N];

/// A key with a hand, sampled: as many states as its drive has stages.
#[derive(Debug, Clone)]
pub enum Held {
    /// With the bandwidth alone.
    Plain(Sampled<3>),
    /// With a lag before it.
    Lagging(Sampled<4>),
    /// With both and the mode.
    Ringing(Sampled<6>),
}

/// A linear system, sampled.
#[derive(Debug, Clone)]
pub struct Sampled<const N: usize> {
    step: Matrix<N>,
    /// What the force of `whole` and of `whole + 1` ticks ago does in a tick.
    new: [f64; N],
    old: [f64; N],
    whole: i32,
}

impl Held {
    /// The key in a hand, at a rate.
    pub fn new(key: &Key, hand: &Hand, rate_hz: f64) -> Held {
        let (mass, damping) = (key.mass + hand.mass, key.damping + hand.damping);
        // A drive without limit is one far beyond the rate.
        let corner = |hz: Option<f64>| hz.map_or(200.0 * rate_hz, |hz| std::f64::consts::TAU * hz);
        let (own, lag) = (corner(key.bandwidth_hz), corner(key.lag_hz));
        let (k, b, f) = (-hand.stiffness / mass, -damping / mass, -1.0 / mass);
        if let Some(Resonance { hz, damping }) = key.mode {
            let w = std::f64::consts::TAU * hz;
            let system = [
                [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
                [k, b, f, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, -w * w, -2.0 * damping * w, w * w, 0.0],
                [0.0, 0.0, 0.0, 0.0, -own, own],
                [0.0, 0.0, 0.0, 0.0, 0.0, -lag],
            ];
            Held::Ringing(Sampled::new(&system, lag, key.delay_ticks, rate_hz))
        } else if key.lag_hz.is_some() {
            let system = [
                [0.0, 1.0, 0.0, 0.0],
                [k, b, f, 0.0],
                [0.0, 0.0, -own, own],
                [0.0, 0.0, 0.0, -lag],
            ];
            Held::Lagging(Sampled::new(&system, lag, key.delay_ticks, rate_hz))
        } else {
            let system = [[0.0, 1.0, 0.0], [k, b, f], [0.0, 0.0, -own]];
            Held::Plain(Sampled::new(&system, own, key.delay_ticks, rate_hz))
        }
    }

    /// How far down (m) for each unit of force upwards, at `z`: positive where it gives way.
    pub fn at(&self, z: Complex64) -> Complex64 {
        match self {
            Held::Plain(sampled) => sampled.at(z),
            Held::Lagging(sampled) => sampled.at(z),
            Held::Ringing(sampled) => sampled.at(z),
        }
    }
}

impl<const N: usize> Sampled<N> {
    /// A system whose last state follows what is held with a corner (rad/s).
    fn new(system: &Matrix<N>, corner: f64, delay_ticks: f64, rate_hz: f64) -> Sampled<N> {
        let whole = floor(delay_ticks);
        let late = (delay_ticks - whole) / rate_hz;
        let rest = 1.0 / rate_hz - late;
        let (first, from_first) = stepped(system, corner, late);
        let (second, from_second) = stepped(system, corner, rest);
        Sampled {
            step: product(&second, &first),
            new: from_second,
            old: applied(&second, &from_first),
            whole: whole as i32,
        }
    }

    fn at(&self, z: Complex64) -> Complex64 {
        let entry = |i: usize, j: usize| if i == j { z } else { Complex64::ZERO } - self.step[i][j];
        let mut matrix: [[Complex64; N]; N] =
            std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        let back = z.inv();
        let mut right: [Complex64; N] = std::array::from_fn(|i| back * self.old[i] + self.new[i]);
        solve(&mut matrix, &mut right);
        -right[0] * back.powi(self.whole)
    }
}

/// Over a time: how the state moves on, and what a constant input adds to it.
fn stepped<const N: usize>(system: &Matrix<N>, corner: f64, time_s: f64) -> (Matrix<N>, [f64; N]) {
    // The input enters at the last state only, whose own step is known; halving keeps the series
    // short.
    let largest = system
        .iter()
        .flatten()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let halvings = log2((largest * time_s).max(1e-9)).ceil().max(0.0) as i32 + 4;
    let part = time_s / 2.0_f64.powi(halvings);
    let mut step = series(system, part, |n| 1.0 / n);
    let input = series(system, part, |n| 1.0 / (n + 1.0));
    let mut entering = [0.0; N];
    entering[N - 1] = corner * part;
    let mut added = applied(&input, &entering);
    for _ in 0..halvings {
        let carried = applied(&step, &added);
        added = std::array::from_fn(|i| added[i] + carried[i]);
        step = product(&step, &step);
    }
    // What has settled has settled.
    step[N - 1][N - 1] = exp(-corner * time_s);
    (step, added)
}

/// `1 + f(1) A t + f(1) f(2) (A t)^2 + ..`
fn series<const N: usize>(
    system: &Matrix<N>,
    time_s: f64,
    factor: impl Fn(f64) -> f64,
) -> Matrix<N> {
    let one = |i, j| if i == j { 1.0 } else { 0.0 };
    let mut term = std::array::from_fn(|i| std::array::from_fn(|j| one(i, j)));
    let mut sum = term;
    for n in 1..=12 {
        let f = factor(f64::from(n)) * time_s;
        let next = product(&term, system);
        term = next.map(|row| row.map(|v| v * f));
        for (row, more) in sum.iter_mut().zip(&term) {
            row.iter_mut().zip(more).for_each(|(v, m)| *v += m);
        }
    }
    sum
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

fn applied<const N: usize>(a: &Matrix<N>, v: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|k| a[i][k] * v[k]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = Key {
        mass: 0.1,
        damping: 0.5,
        friction: 0.0,
        delay_ticks: 1.25,
        bandwidth_hz: Some(3000.0),
        lag_hz: None,
        mode: None,
        sensor_lsb: 1e-7,
    };

    /// The same by small steps of the differential equation.
    #[test]
    fn a_pulse_of_force_moves_it_as_the_differential_equation_says() {
        let hand = Hand {
            mass: 0.05,
            damping: 1.0,
            stiffness: 2000.0,
        };
        let (rate_hz, fine) = (44_100.0, 4000);
        let Held::Plain(held) = Held::new(&KEY, &hand, rate_hz) else {
            panic!("a drive with a bandwidth alone")
        };
        let (mut x, mut v, mut f) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut exact = [0.0; 3];
        let corner = std::f64::consts::TAU * 3000.0;
        let h = 1.0 / (rate_hz * f64::from(fine));
        for tick in 0..6 {
            assert!(
                (exact[0] - x).abs() <= 2e-3 * x.abs() + 1e-15,
                "tick {tick}: {} {x}",
                exact[0]
            );
            for i in 0..fine {
                let age = f64::from(tick) + f64::from(i) / f64::from(fine) - KEY.delay_ticks;
                let u = f64::from((0.0..1.0).contains(&age));
                f += h * corner * (u - f);
                v += h * (-f - 1.5 * v - 2000.0 * x) / 0.15;
                x += h * v;
            }
            // The command of tick 0 acts from 1.25: as `new` in tick 1, as `old` in tick 2.
            let forced: [f64; 3] = match tick {
                1 => held.new,
                2 => held.old,
                _ => [0.0; 3],
            };
            let moved = applied(&held.step, &exact);
            exact = std::array::from_fn(|i| moved[i] + forced[i]);
        }
        assert!(x < 0.0);
    }

    /// What a drive with a mode makes of a force, far above the sampled key's own frequencies: the
    /// continuous response, but for the hold and the delay.
    #[test]
    fn stages_of_a_drive_are_in_the_response() {
        let rate_hz = 1e6;
        let key = Key {
            delay_ticks: 0.0,
            bandwidth_hz: Some(5000.0),
            lag_hz: Some(800.0),
            mode: Some(Resonance {
                hz: 3000.0,
                damping: 0.05,
            }),
            ..KEY
        };
        let hand = Hand::FREE;
        let (held, w0) = (Held::new(&key, &hand, rate_hz), std::f64::consts::TAU);
        for hz in [20.0, 800.0, 2900.0, 3000.0, 6000.0] {
            let s = Complex64::new(0.0, w0 * hz);
            let lag = |corner: f64| (Complex64::ONE + s / (w0 * corner)).inv();
            let w = w0 * 3000.0;
            let mode = Complex64::from(w * w) / (s * s + 2.0 * 0.05 * w * s + w * w);
            let hold = (Complex64::ONE - (-s / rate_hz).exp()) / (s / rate_hz);
            let body = (KEY.mass * s * s + KEY.damping * s).inv();
            let exact = lag(5000.0) * lag(800.0) * mode * hold * body;
            let found = held.at((s / rate_hz).exp());
            let off = (found / exact - 1.0).norm();
            assert!(off < 2e-3, "{hz} Hz: {off}");
        }
    }

    #[test]
    fn slowly_it_gives_way_as_its_stiffness_says() {
        let hand = Hand {
            mass: 0.05,
            damping: 1.0,
            stiffness: 2000.0,
        };
        let ring = Resonance {
            hz: 3000.0,
            damping: 0.02,
        };
        let drives = [
            (None, None, None),
            (Some(3000.0), None, None),
            (Some(3000.0), Some(800.0), None),
            (None, Some(40_000.0), Some(ring)),
        ];
        for (bandwidth_hz, lag_hz, mode) in drives {
            let key = Key {
                bandwidth_hz,
                lag_hz,
                mode,
                ..KEY
            };
            let held = Held::new(&key, &hand, 44_100.0);
            let slow = held.at(Complex64::ONE);
            assert!(
                (slow.re * 2000.0 - 1.0).abs() < 1e-6 && slow.im == 0.0,
                "{slow}"
            );
        }
    }
}
