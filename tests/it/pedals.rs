//! The standard library's terms for sound, each beside what an independent formula says of it.

mod dynamics;
mod filters;
mod modulation;
mod strings;

use std::f64::consts::TAU;

use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;

use crate::common;
use crate::player::Player;

/// Ticks per second.
const RATE_HZ: f64 = common::RATE_HZ as f64;
/// Tick length (s).
const TICK_S: f64 = 1.0 / RATE_HZ;

/// An instrument that hears its key as a `signal` from 0 to 1. Silence lies a little below its
/// range, as no word of a sensor is an exact 0.
fn pedal(declarations: &str) -> Compiled {
    let text = format!(
        "instrument pedal {{
            sense x: length in -0.5 mm .. 10 mm over 1 ms
            let signal = max(x, 0 mm) / 10 mm
            {declarations}
        }}"
    );
    common::compiled("pedal.whip", &text, &[]).remove(0)
}

/// Plays a signal; what the named values were in each tick, after the signal as the instrument has
/// it.
fn played<const N: usize>(
    compiled: &Compiled,
    kind: EngineKind,
    signal: &[f64],
    names: [&str; N],
) -> (Vec<f64>, [Vec<f64>; N]) {
    let mut player = Player::new(compiled, kind);
    let heard = player.index("signal");
    let at = names.map(|name| player.index(name));
    let (mut fed, mut found) = (Vec::new(), names.map(|_| Vec::new()));
    for value in signal {
        player.tick(if *value == 0.0 { -0.1e-3 } else { 0.01 * value });
        fed.push(player.value_at(heard));
        for (values, index) in found.iter_mut().zip(at) {
            values.push(player.value_at(index));
        }
    }
    (fed, found)
}

/// Complex numbers, as far as responses need them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Complex(f64, f64);

impl Complex {
    fn turn(turns: f64) -> Complex {
        Complex((TAU * turns).cos(), (TAU * turns).sin())
    }

    fn add(self, other: Complex) -> Complex {
        Complex(self.0 + other.0, self.1 + other.1)
    }

    fn mul(self, other: Complex) -> Complex {
        let (a, b) = (self, other);
        Complex(a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
    }

    fn scale(self, factor: f64) -> Complex {
        Complex(self.0 * factor, self.1 * factor)
    }

    fn over(self, other: Complex) -> Complex {
        let square = other.0 * other.0 + other.1 * other.1;
        self.mul(Complex(other.0, -other.1)).scale(1.0 / square)
    }

    fn size(self) -> f64 {
        self.0.hypot(self.1)
    }
}

/// What a signal has of a frequency.
fn part_of(signal: &[f64], f_hz: f64) -> Complex {
    let parts = signal.iter().enumerate();
    let parts = parts.map(|(n, v)| Complex::turn(-f_hz * n as f64 / RATE_HZ).scale(*v));
    parts.fold(Complex(0.0, 0.0), Complex::add)
}

/// White noise between 0 and 1 that lasts a while, and silence after it.
fn burst(noise_s: f64, silence_s: f64) -> Vec<f64> {
    let mut random = Rng::new(0x9eda15);
    let ticks = |seconds: f64| (seconds * RATE_HZ) as usize;
    let noise = (0..ticks(noise_s)).map(|_| random.next() as u32 as f64 / f64::from(u32::MAX));
    noise.chain((0..ticks(silence_s)).map(|_| 0.0)).collect()
}

fn db(ratio: f64) -> f64 {
    20.0 * ratio.log10()
}
