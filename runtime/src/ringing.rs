//! Whether a key rings where the stability analysis cannot prove that it does not: short closed
//! loops of program and plant, pushed out of balance.
//!
//! ```text
//!   Place --led there--> Ideal --force F--> Plant balanced by F, pushed --> a swing that lasts?
//! ```
//!
//! The program is the Model in f64 (`ideal`) behind the converters' words; the key is the plant,
//! dry friction, coil, delays and stops included. A key stands where it is pushed; a force that
//! falls with speed shows only on one that moves, so that one is led along too.
//!
//! What lasts is what has not become smaller from the third quarter of a run to the last by more
//! than a few percent, and is more than a few words of the sensor. That a key comes to rest here
//! proves nothing of other places and pushes.

use std::f64::consts::TAU;

use whippen_compiler::diag::Diagnostic;
use whippen_compiler::ideal::Ideal;
use whippen_compiler::model::Model;
use whippen_compiler::stability::{self, Hand, Oscillation, PerHand, Place, Seen, Trial};

use crate::device::Device;
use crate::judged::{JudgedPort, judge};
use crate::plant::{Plant, Player};

/// Positions within a place that are tried, as parts of it.
const PARTS: [f64; 3] = [0.5, 0.04, 0.96];

/// How far pushes move the key, as parts of the sensed range.
const PUSHES: [f64; 3] = [0.001, 0.01, 0.1];

/// How fast a key is led along, in sensed ranges per second.
const SPEEDS: [f64; 8] = [-16.0, 16.0, -4.0, 4.0, -1.0, 1.0, -0.25, 0.25];

/// A run lasts so many periods of what the linear loop does, within bounds (s).
const PERIODS: f64 = 60.0;
const SECONDS: (f64, f64) = (0.3, 1.2);

/// The frequency where the linear loop has none (Hz).
const USUAL_HZ: f64 = 30.0;

/// What moves by no more than a word or two in so many periods, and this time (s), has come to
/// rest.
const REST: (f64, f64) = (2.0, 0.03);
const WORDS_AT_REST: f64 = 2.0;

/// So does what has become this part of what it was: a smaller push tries that.
const PART_AT_REST: f64 = 0.06;

/// A key that is led along swings where its speed does so by this part at least.
const SPEED_PART: f64 = 0.1;

/// The key is led to its place in this time, and held there for as long (s).
const LED_S: f64 = 0.05;

/// Half of the drive's range: beyond, nothing is balanced.
const FORCE_PART: f64 = 0.5;

/// A swing that keeps this share from one quarter of a run to the next lasts.
const LASTS: f64 = 0.97;

/// One that becomes larger by this factor grows; its run is made twice as long, so often.
const GROWS: f64 = 1.05;
const LONGER: u32 = 3;

/// Smaller swings (words of the sensor) are those of the converters.
const WORDS_LEAST: f64 = 4.0;

/// So many periods must be seen.
const PERIODS_LEAST: usize = 4;

/// Values that may be computed in all, of all trials: about a second of one core.
const WORK_MAX: u64 = 150_000_000;

/// What a tick costs besides the program's values: plant and converters, in values.
const WORK_OF_PLANT: u64 = 100;

/// What is said of the loops of an instrument on a device, tried out where they are not proven
/// stable; nothing where the device does not say how its ports move.
pub fn warnings(model: &Model, device: &Device) -> Vec<Diagnostic> {
    let ports = judge(model, device, None);
    ports.iter().flat_map(warnings_of).collect()
}

/// The same of what the analysis has found of one port.
pub fn warnings_of(port: &JudgedPort) -> Vec<Diagnostic> {
    let Ok(found) = &port.found else {
        return Vec::new();
    };
    let mut bench = Bench::new(&port.model, &port.device);
    stability::warnings(&port.model, found, &mut |trial| bench.see(trial))
}

/// Runs trials of one instrument on one device, as long as there is work left.
pub struct Bench<'a> {
    model: &'a Model,
    device: &'a Device,
    work: u64,
    /// Where and in which hands nothing rang.
    quiet: Vec<(Place, Hand)>,
}

/// A key in balance somewhere, and the program as it is there.
struct Balance<'m> {
    ideal: Ideal<'m>,
    x: f64,
    force: f64,
}

impl<'a> Bench<'a> {
    /// Nothing is done yet; a device without mechanics tries nothing.
    pub fn new(model: &'a Model, device: &'a Device) -> Bench<'a> {
        Bench {
            model,
            device,
            work: WORK_MAX,
            quiet: Vec::new(),
        }
    }

    /// Runs a trial until something rings.
    pub fn see(&mut self, trial: &Trial) -> Seen {
        let mut tried = false;
        let known = self.quiet.clone();
        for (number, place) in trial.places.iter().enumerate() {
            let rings = |found| {
                Seen::Rings(Oscillation {
                    place: number,
                    ..found
                })
            };
            let model = with_parameters(self.model, place);
            for part in PARTS {
                let Some(balance) = self.balance(&model, place, part) else {
                    continue;
                };
                for hand in &trial.hands {
                    tried = true;
                    if known.contains(&(place.clone(), hand.hand)) {
                        continue;
                    }
                    let stands = place.speed.low <= 0.0 && place.speed.high >= 0.0;
                    if stands && let Some(found) = self.pushed(&balance, hand) {
                        return rings(found);
                    }
                    let led = trial.falls_with_speed && hand.hand.stiffness > 0.0;
                    if led
                        && part != PARTS[0]
                        && let Some(found) = self.led(&balance, place, hand)
                    {
                        return rings(found);
                    }
                }
            }
        }
        for place in trial.places {
            let hands = trial.hands.iter().map(|p| (place.clone(), p.hand));
            self.quiet.extend(hands);
        }
        if tried && self.work > 0 {
            Seen::Quiet
        } else {
            Seen::NotTried
        }
    }

    /// Takes what some ticks cost; false where nothing is left.
    fn spend(&mut self, ticks: usize) -> bool {
        let windows: u64 = self.model.senses.iter().map(|s| u64::from(s.window)).sum();
        let points: u64 = self.model.strands.iter().map(|s| u64::from(s.parts)).sum();
        let tick = self.model.dag.len() as u64 + windows + points + WORK_OF_PLANT;
        let cost = ticks as u64 * tick;
        let enough = cost <= self.work;
        self.work = if enough { self.work - cost } else { 0 };
        enough
    }

    /// The range that the sense and the stops leave.
    fn way(&self) -> Option<(f64, f64)> {
        let range = self.model.senses.first()?.range;
        let stops = self.device.port().mechanics?.stops;
        Some(stops.map_or((range.low, range.high), |s| {
            (range.low.max(s.low), range.high.min(s.high))
        }))
    }

    /// Leads a key to a part of a place and holds it there.
    fn balance<'m>(&mut self, model: &'m Model, place: &Place, part: f64) -> Option<Balance<'m>> {
        let way = self.way()?;
        let (low, high) = (place.x.low.max(way.0), place.x.high.min(way.1));
        if low > high {
            return None;
        }
        let x = low + part * (high - low);
        let rate_hz = f64::from(model.rate_hz);
        let windows = model.senses.iter().map(|s| s.window as usize).max()?;
        let ticks = ((LED_S * rate_hz) as usize).max(2 * windows);
        if !self.spend(2 * ticks) {
            return None;
        }
        let mut ideal = Ideal::new(model, &self.device.scales(), 1);
        let (mut sum, mut words) = (0.0, vec![0; model.senses.len()]);
        for tick in 0..2 * ticks {
            // Down as a finger goes, without a jump of speed.
            let done = (tick as f64 / ticks as f64).min(1.0);
            let at = way.0 + (x - way.0) * done * done * (3.0 - 2.0 * done);
            words.fill(self.device.word_of_position(at).0);
            ideal.tick(&words);
            if 2 * tick >= 3 * ticks {
                sum += ideal.force_n(0);
            }
        }
        let force = sum / (ticks - ticks / 2) as f64;
        let fits = force.abs() <= FORCE_PART * self.device.drive().full_scale;
        fits.then_some(Balance { ideal, x, force })
    }

    /// Pushes of several sizes.
    fn pushed(&mut self, balance: &Balance, found: &PerHand) -> Option<Oscillation> {
        let range = self.model.senses.first()?.range.width();
        PUSHES.iter().find_map(|push| {
            let hz = frequency(found);
            let player = held(found.hand, vec![balance.x]);
            let push = push * range * TAU * hz;
            let start = (balance.x, balance.force, push);
            let mut ticks = self.ticks(hz);
            let mut run = |ticks: usize| {
                let positions = self.run(&balance.ideal, (player.clone(), start), (ticks, hz))?;
                self.lasting(&positions)
            };
            let mut swing = run(ticks)?;
            // What still grows is looked at for longer.
            for _ in 0..LONGER {
                ticks *= 2;
                let later = if swing.grows { run(ticks) } else { None };
                let Some(later) = later else { break };
                swing = later;
            }
            Some(Oscillation {
                place: 0,
                hz: swing.hz,
                amplitude: swing.amplitude,
                grows: swing.grows,
                x: balance.x,
                push,
                speed: 0.0,
                force: balance.force,
                hand: found.hand,
            })
        })
    }

    /// Led along by the hand from there, as far as the way goes, with speeds of the place.
    fn led(&mut self, balance: &Balance, place: &Place, found: &PerHand) -> Option<Oscillation> {
        let (range, way) = (self.model.senses.first()?.range.width(), self.way()?);
        let rate_hz = f64::from(self.model.rate_hz);
        let speeds = SPEEDS.iter().map(|ranges_per_s| ranges_per_s * range);
        let mut speeds = speeds.filter(|v| (place.speed.low..=place.speed.high).contains(v));
        let long = 0.5 * (way.1 - way.0);
        speeds.find_map(|speed| {
            let end = if speed > 0.0 { way.1 } else { way.0 };
            if (end - balance.x).abs() < long {
                return None;
            }
            let ticks = ((end - balance.x) / speed * rate_hz).max(0.0) as usize;
            let hz = frequency(found);
            let ticks = ticks.min(self.ticks(hz));
            let target = (0..ticks).map(|i| balance.x + speed * i as f64 / rate_hz);
            let player = held(found.hand, target.collect());
            let start = (balance.x, balance.force, speed);
            let positions = self.run(&balance.ideal, (player, start), (ticks, hz))?;
            let swing = self.lasting(&positions)?;
            let swings = TAU * swing.hz * swing.amplitude >= SPEED_PART * speed.abs();
            swings.then_some(Oscillation {
                place: 0,
                hz: swing.hz,
                amplitude: swing.amplitude,
                grows: swing.grows,
                x: balance.x,
                push: 0.0,
                speed,
                force: balance.force,
                hand: found.hand,
            })
        })
    }

    fn ticks(&self, hz: f64) -> usize {
        let seconds = (PERIODS / hz).clamp(SECONDS.0, SECONDS.1);
        (seconds * f64::from(self.model.rate_hz)) as usize
    }

    /// Where the key is at each tick; none where it comes to rest, or no work is left.
    fn run(
        &mut self,
        ideal: &Ideal,
        (player, start): (Player, (f64, f64, f64)),
        (ticks, hz): (usize, f64),
    ) -> Option<Vec<f64>> {
        let rate_hz = f64::from(self.model.rate_hz);
        let part = (((REST.0 / hz).max(REST.1) * rate_hz) as usize).max(1);
        let still = WORDS_AT_REST * self.device.port().scales().sensor_lsb;
        let (mut ideal, scales) = (ideal.clone(), self.device.port().scales());
        let mut plant = Plant::balanced(self.device.port(), self.model.rate_hz, player, start)?;
        let mut words = vec![0; self.model.senses.len()];
        let mut positions = Vec::with_capacity(ticks);
        let updates = self.device.sensor().update_hz.map(|hz| hz / rate_hz);
        let mut read = None;
        let mut least = still;
        for tick in 0..ticks {
            if tick % part == 0 {
                let (low, high) = ends(&positions[tick.saturating_sub(part)..]);
                if !self.spend(part) || high - low <= least && tick > 0 {
                    return None;
                }
                if tick == part {
                    least = still.max(PART_AT_REST * (high - low));
                }
            }
            // A sensor that is read less often holds what it has read.
            let update = updates.map_or(tick, |updates| (tick as f64 * updates.min(1.0)) as usize);
            if read.replace(update) != Some(update) {
                words.fill(self.device.word_of_position(plant.sensed()).0);
            }
            ideal.tick(&words);
            positions.push(plant.position());
            let word = (ideal.force_n(0) / scales.drive_lsb).round();
            plant.tick(word.clamp(-32_768.0, 32_767.0) as i16);
        }
        Some(positions)
    }

    fn lasting(&self, positions: &[f64]) -> Option<Swing> {
        let swing = swing(positions, f64::from(self.model.rate_hz))?;
        (swing.amplitude > WORDS_LEAST * self.device.port().scales().sensor_lsb).then_some(swing)
    }
}

/// The model with the parameters of a place.
fn with_parameters(model: &Model, place: &Place) -> Model {
    let mut model = model.clone();
    let lives = model.lives.iter_mut().zip(&place.lives);
    lives.for_each(|(live, value)| live.value = *value);
    let keyed = model.keyed.iter_mut().zip(&place.keyed);
    keyed.for_each(|(keyed, value)| keyed.values = vec![*value]);
    model
}

/// What the linear loop does, if it turns.
fn frequency(found: &PerHand) -> f64 {
    if found.ring_hz < 1.0 {
        USUAL_HZ
    } else {
        found.ring_hz
    }
}

/// A hand that wants the key somewhere at each tick.
fn held(hand: Hand, target: Vec<f64>) -> Player {
    Player::Hand {
        hand,
        target: target.into(),
    }
}

/// How a key swings at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Hz.
    pub hz: f64,
    /// Half of the way from one end to the other (m or rad).
    pub amplitude: f64,
    /// It becomes larger.
    pub grows: bool,
}

/// The swing in the last half of some positions, if it lasts.
pub fn swing(positions: &[f64], rate_hz: f64) -> Option<Swing> {
    let quarter = positions.len() / 4;
    if quarter < 2 {
        return None;
    }
    let end = &positions[positions.len() - 2 * quarter..];
    let (before, last) = (level(&end[..quarter]), level(&end[quarter..]));
    if size(&last) < LASTS * size(&before) {
        return None;
    }
    let all = level(end);
    // Crossings count only between excursions to both sides, so that a tremble counts none.
    let least = 0.5 * size(&all);
    let (mut below, mut crossings) = (false, Vec::new());
    for (at, pair) in all.windows(2).enumerate() {
        below |= pair[1] < -least;
        if below && pair[0] < 0.0 && pair[1] >= 0.0 {
            crossings.push(at as f64 + pair[0] / (pair[0] - pair[1]));
            below = false;
        }
    }
    let periods = crossings.len().checked_sub(1)?;
    let (first, final_one) = (crossings.first()?, crossings.last()?);
    let (lowest, highest) = ends(&last);
    (periods >= PERIODS_LEAST).then_some(Swing {
        hz: periods as f64 / (final_one - first) * rate_hz,
        amplitude: 0.5 * (highest - lowest),
        grows: size(&last) > GROWS * size(&before),
    })
}

/// Without the straight line through it.
fn level(positions: &[f64]) -> Vec<f64> {
    let n = positions.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = positions.iter().sum::<f64>() / n;
    let along = |(i, x): (usize, &f64)| (i as f64 - middle) * (x - mean);
    let slope = positions.iter().enumerate().map(along).sum::<f64>() * 12.0 / (n * (n * n - 1.0));
    let rest = |(i, x): (usize, &f64)| x - mean - slope * (i as f64 - middle);
    positions.iter().enumerate().map(rest).collect()
}

/// The lowest and the highest of some positions.
fn ends(positions: &[f64]) -> (f64, f64) {
    let wider = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
    positions
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), wider)
}

/// Root of the mean square.
fn size(level: &[f64]) -> f64 {
    libm::sqrt(level.iter().map(|x| x * x).sum::<f64>() / level.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(hz: f64, grows: f64) -> Vec<f64> {
        let at = |i: i32| f64::from(i) / 10_000.0;
        (0..10_000)
            .map(|i| {
                3e-3 + 1e-4 * at(i) + 2e-4 * libm::exp(grows * at(i)) * libm::sin(TAU * hz * at(i))
            })
            .collect()
    }

    #[test]
    fn a_swing_that_lasts_is_measured_and_one_that_ends_is_none() {
        let found = swing(&wave(41.3, 0.0), 10_000.0).expect("it lasts");
        assert!((found.hz / 41.3 - 1.0).abs() < 1e-3, "{found:?}");
        assert!((found.amplitude / 2e-4 - 1.0).abs() < 0.05, "{found:?}");
        assert!(swing(&wave(41.3, 1.0), 10_000.0).is_some());
        assert_eq!(swing(&wave(41.3, -0.5), 10_000.0), None);
        assert_eq!(swing(&[3e-3; 10_000], 10_000.0), None);
        // What falls is no swing.
        assert_eq!(swing(&wave(0.7, 0.0), 10_000.0), None);
    }
}
