//! Strokes: how fast a key repeats, how softly and how loudly it strikes. Every stroke, and every
//! rate of repetition, is a key of one engine, so all of them run at once.

use whippen_compiler::lower::LoweredEventKind;
use whippen_compiler::pipeline::Compiled;

use super::Protocol;
use crate::device::Device;
use crate::engine::Engine;
use crate::gesture::Gesture;
use crate::session::marked;
use crate::session::watch::{Cut, WatchedPort};

/// No faster repetition is tried (Hz): no finger, and no two, comes near.
pub const REPETITION_MAX_HZ: f64 = 30.0;
/// Rates are tried at this distance (Hz).
const RATE_STEP_HZ: f64 = 0.5;
/// A repetition is so many strokes.
const REPEATED: usize = 6;
/// The greatest speeds of the key in single strokes (m/s): from a key that creeps down to the
/// fastest that players reach.
const KEY_SPEEDS: (f64, f64) = (0.02, 1.0);
/// So many single strokes are made, at equal ratios of speed.
const STROKES: usize = 40;
/// The greatest speed of a move of minimum jerk, times its time, over its way.
const PEAK: f64 = 15.0 / 8.0;
/// The rest before, and the time after, in which a hammer may still be on its way (s).
const REST_S: f64 = 0.3;

/// What strokes gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Struck {
    /// The fastest repetition at which each stroke still strikes (Hz).
    pub repetition_hz: Option<f64>,
    /// The slowest and the fastest strike (m/s), where strikes have a speed.
    pub speeds: Option<(f64, f64)>,
}

/// What one key struck: when (s), and the speed, where strikes have one.
type Strikes = Vec<(f64, Option<f64>)>;

/// Plays all strokes.
///
/// # Errors
/// The engine cannot be built on this machine, in words.
pub fn play(compiled: &Compiled, device: &Device, protocol: &Protocol) -> Result<Struck, String> {
    let dip_m = protocol.dip_m;
    let rates = (2..).map(|i| f64::from(i) * RATE_STEP_HZ);
    let rates: Vec<f64> = rates.take_while(|hz| *hz <= REPETITION_MAX_HZ).collect();
    let single = |i: usize| {
        let ratio = KEY_SPEEDS.1 / KEY_SPEEDS.0;
        let speed = KEY_SPEEDS.0 * libm::pow(ratio, i as f64 / (STROKES - 1) as f64);
        let press_s = PEAK * dip_m / speed;
        Gesture::new().stroke(REST_S, press_s, REST_S, 0.2, dip_m)
    };
    let repeated = |hz: &f64| Gesture::new().repeated(REST_S, *hz, REPEATED, dip_m);
    let gestures: Vec<Gesture> = (0..STROKES).map(single).collect();
    let alone = strikes(compiled, device, protocol, &gestures)?;
    let gestures: Vec<Gesture> = rates.iter().map(repeated).collect();
    let rows = strikes(compiled, device, protocol, &gestures)?;
    // A harpsichord of two rows plucks twice: a stroke strikes as often as one alone.
    let usual = alone.iter().map(Vec::len).max().unwrap_or(0);
    let tried: Vec<(&f64, Strikes)> = rates.iter().zip(rows).collect();
    let holds = |row: &&(&f64, Strikes)| strikes_evenly(&row.1, *row.0, usual);
    let fastest = tried.iter().rev().find(holds).map(|row| *row.0);
    let speeds = alone.into_iter().flatten().filter_map(|strike| strike.1);
    let speeds: Vec<f64> = speeds.filter(|speed| *speed > 0.0).collect();
    let softest = speeds.iter().copied().reduce(f64::min);
    let loudest = speeds.iter().copied().reduce(f64::max);
    Ok(Struck {
        repetition_hz: fastest,
        speeds: softest.zip(loudest),
    })
}

/// Whether each stroke of a repetition strikes, and as often as one alone: in each period, counted
/// from a quarter of one before the first strike.
fn strikes_evenly(strikes: &Strikes, rate_hz: f64, usual: usize) -> bool {
    let Some(first) = strikes.first() else {
        return false;
    };
    let begin_s = first.0 - 0.25 / rate_hz;
    let period = |strike: &(f64, Option<f64>)| ((strike.0 - begin_s) * rate_hz) as usize;
    let in_period = |number| strikes.iter().filter(|s| period(s) == number).count();
    // The first strike is that of the first stroke.
    begin_s < REST_S + 1.0 / rate_hz
        && strikes.len() == usual * REPEATED
        && (0..REPEATED).all(|number| in_period(number) == usual)
}

/// What each of some gestures strikes, all of them at once.
fn strikes(
    compiled: &Compiled,
    device: &Device,
    protocol: &Protocol,
    gestures: &[Gesture],
) -> Result<Vec<Strikes>, String> {
    let mut found = vec![Strikes::new(); gestures.len()];
    let model = &compiled.model;
    let name = marked(model);
    let mut emissions = model.emissions.iter().enumerate();
    let Some((emission, strike)) = emissions.find(|(_, e)| e.name == name) else {
        return Ok(found);
    };
    let is_speed = strike.args.first().is_some_and(|arg| arg.0 == "speed");
    let rate_hz = model.rate_hz;
    let ports = device.ports_of(model);
    let (Some(sense), Some(port)) = (model.senses.first(), ports.first()) else {
        return Ok(found);
    };
    let watched = |_: &Gesture| WatchedPort::new(sense, port, rate_hz);
    let mut keys: Vec<WatchedPort> = gestures.iter().map(watched).collect();
    let mut engine = Engine::new(protocol.engine, compiled, device, gestures.len())?;
    let outputs = compiled.lowered.kernel.outputs.len();
    let (mut words, mut drive) = (vec![0; gestures.len()], vec![0; gestures.len() * outputs]);
    let longest_s = gestures.iter().map(Gesture::duration_s).fold(0.0, f64::max);
    let ticks = ((longest_s + REST_S) * f64::from(rate_hz)) as usize;
    for tick in 0..ticks {
        let t_s = tick as f64 / f64::from(rate_hz);
        for ((word, key), gesture) in words.iter_mut().zip(&mut keys).zip(gestures) {
            *word = key.word(tick, gesture.at(t_s), &mut Cut::default());
        }
        if tick == 0 {
            engine.start(&words);
        }
        engine.tick(&words, &mut drive);
        for happened in engine.drain() {
            let kind = &compiled.lowered.events[happened.event].kind;
            if *kind == LoweredEventKind::Emission(emission as u32) {
                let speed = happened.args.first().copied().filter(|_| is_speed);
                found[happened.key as usize].push((t_s, speed));
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repetition_holds_only_if_every_stroke_strikes() {
        let even = |times: &[f64]| {
            let strikes: Strikes = times.iter().map(|t| (*t, None)).collect();
            strikes_evenly(&strikes, 10.0, 1)
        };
        assert!(even(&[0.35, 0.45, 0.55, 0.65, 0.75, 0.85]));
        assert!(even(&[0.35, 0.46, 0.54, 0.65, 0.77, 0.85]));
        // One that is missed and one that strikes twice make the same count.
        assert!(!even(&[0.35, 0.45, 0.47, 0.65, 0.75, 0.85]));
        assert!(!even(&[0.35, 0.45, 0.55, 0.65, 0.75]));
        assert!(!even(&[0.45, 0.55, 0.65, 0.75, 0.85, 0.95]));
        assert!(!even(&[]));
    }
}
