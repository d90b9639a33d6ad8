//! A fixed-point engine beside `ideal` on the same words: how far apart they run, and whether the
//! same things happen.
//!
//! Both run free, each on its own memory, so what is measured is the error a player meets, drift
//! and feedback included. (The bound that `check --numbers` prints is another thing: what one tick
//! adds.)

use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::engine::{Engine, EngineKind, Happened};
use crate::session::watch::{Cut, WatchedPort};
use crate::trajectory::Trajectory;

/// So many events that only one engine had are listed.
pub const LISTED_MAX: usize = 20;

/// How far one exported value was from `ideal` over a run (SI).
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Index of the export.
    pub export: usize,
    /// Largest absolute difference.
    pub max: f64,
    /// The tick of the largest.
    pub max_tick: usize,
    /// Largest absolute difference in all other ticks: where a value jumps, one that jumps a tick
    /// apart says nothing of the rest.
    pub max_else: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Root of the mean square of the value itself.
    pub signal_rms: f64,
    /// Smallest and largest value seen.
    pub seen: (f64, f64),
}

impl Deviation {
    /// Signal to error in dB; infinite where both agree in every tick.
    pub fn snr_db(&self) -> f64 {
        20.0 * libm::log10(self.signal_rms / self.rms)
    }
}

/// What two runs say of each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// One per export that is a number, in the order of the exports.
    pub deviations: Vec<Deviation>,
    /// Events that happened in both in the same tick.
    pub events_together: usize,
    /// Events that only one of them had in that tick.
    pub events_apart: usize,
    /// The first of them: tick and name.
    pub first_apart: Vec<(usize, String)>,
    /// Largest relative difference of an event's argument, over events that happened together.
    pub args_relative_max: f64,
}

/// Runs `kind` and `ideal` over the same places, a trajectory for each port.
///
/// # Errors
/// The engine cannot be built on this machine.
pub fn compare(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    places: &[Trajectory],
    mut progress: impl FnMut(usize),
) -> Result<Comparison, String> {
    let mut engine = Engine::new(kind, compiled, device, 1)?;
    let mut ideal = Engine::new(EngineKind::Ideal, compiled, device, 1)?;
    let mut sums = Sums::new(compiled);
    let mut out = Comparison::default();
    let mut drive = vec![0i16; compiled.lowered.kernel.outputs.len()];
    let mut ports = Vec::new();
    for (sense, port) in compiled
        .model
        .senses
        .iter()
        .zip(device.ports_of(&compiled.model))
    {
        ports.push(WatchedPort::new(sense, port, compiled.model.rate_hz));
    }
    let mut words = vec![0; ports.len()];
    let ticks = places.iter().map(Trajectory::ticks).max().unwrap_or(0);
    for tick in 0..ticks {
        for ((word, port), place) in words.iter_mut().zip(&mut ports).zip(places) {
            *word = port.word(tick, place.at(tick), &mut Cut::default());
        }
        for e in [&mut engine, &mut ideal] {
            if tick == 0 {
                e.start(&words);
            }
            e.tick(&words, &mut drive);
        }
        sums.add(tick, &engine, &ideal, compiled);
        out.events(compiled, tick, &engine.drain(), &ideal.drain());
        if tick % 4096 == 0 {
            progress(tick);
        }
    }
    out.deviations = sums.finish(ticks);
    Ok(out)
}

impl Comparison {
    fn events(&mut self, compiled: &Compiled, tick: usize, mine: &[Happened], ideal: &[Happened]) {
        let mut rest: Vec<&Happened> = ideal.iter().collect();
        let mut apart = |h: &Happened| {
            let name = compiled.lowered.kernel.events[h.event].name.clone();
            self.events_apart += 1;
            if self.first_apart.len() < LISTED_MAX {
                self.first_apart.push((tick, name));
            }
        };
        for event in mine {
            let Some(found) = rest.iter().position(|other| other.event == event.event) else {
                apart(event);
                continue;
            };
            let other = rest.remove(found);
            self.events_together += 1;
            for (a, b) in event.args.iter().zip(&other.args) {
                self.args_relative_max = self.args_relative_max.max(((a - b) / b).abs());
            }
        }
        rest.into_iter().for_each(apart);
    }
}

/// Sums per export.
struct Sums {
    rows: Vec<Deviation>,
}

impl Sums {
    fn new(compiled: &Compiled) -> Sums {
        let exports = compiled.lowered.exports.iter().enumerate();
        let row = |export| Deviation {
            export,
            max: 0.0,
            max_tick: 0,
            max_else: 0.0,
            rms: 0.0,
            signal_rms: 0.0,
            seen: (f64::INFINITY, f64::NEG_INFINITY),
        };
        Sums {
            rows: exports
                .filter(|(_, e)| e.dim.is_some())
                .map(|(i, _)| row(i))
                .collect(),
        }
    }

    fn add(&mut self, tick: usize, engine: &Engine, ideal: &Engine, compiled: &Compiled) {
        for row in &mut self.rows {
            let export = &compiled.lowered.exports[row.export];
            let (a, b) = (
                engine.value(0, row.export, export),
                ideal.value(0, row.export, export),
            );
            let error = (a - b).abs();
            row.max_else = row.max_else.max(error.min(row.max));
            if error > row.max {
                (row.max, row.max_tick) = (error, tick);
            }
            row.rms += error * error;
            row.signal_rms += b * b;
            row.seen = (row.seen.0.min(b), row.seen.1.max(b));
        }
    }

    fn finish(mut self, ticks: usize) -> Vec<Deviation> {
        for row in &mut self.rows {
            row.rms = (row.rms / ticks as f64).sqrt();
            row.signal_rms = (row.signal_rms / ticks as f64).sqrt();
        }
        self.rows
    }
}
