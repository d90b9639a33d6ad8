//! What is recorded of a run between its ticks: points of strings, what frictions do, how strings
//! vibrate. An engine's memory tells; no tick takes longer for it.

use whippen_compiler::pipeline::Compiled;

use super::columns::{Recorded, Signal};
use crate::device::Device;
use crate::engine::Engine;
use crate::points::Point;
use crate::sticking::{FrictionSignal, FrictionTally, WatchedFriction};
use crate::strands::Strands;
use crate::vibration::Vibration;

/// Looks at an engine between its ticks.
pub(super) struct Between<'c> {
    compiled: &'c Compiled,
    strings: Strands<'c>,
    points: Vec<Point>,
    frictions: Vec<Option<WatchedFriction>>,
    /// Of each string; none where no picture is drawn.
    vibrations: Vec<Vibration>,
    /// The second half of the run begins here.
    half: usize,
}

impl<'c> Between<'c> {
    /// For a run of so many ticks.
    pub fn new(
        compiled: &'c Compiled,
        device: &Device,
        (points, draws, observes): (Vec<Point>, bool, bool),
        ticks: usize,
    ) -> Between<'c> {
        let strings = Strands::new(compiled);
        let numbers = 0..if draws && observes { strings.len() } else { 0 };
        let vibration = |number| Vibration::new(compiled, device, number, ticks);
        let frictions = match observes {
            true => WatchedFriction::all(compiled, device),
            false => Vec::new(),
        };
        Between {
            compiled,
            points,
            frictions,
            vibrations: numbers.map(vibration).collect(),
            strings,
            half: ticks / 2,
        }
    }

    /// Looks at what a tick will find; `has_row` where points are asked for.
    pub fn before(&mut self, engine: &Engine, tick: usize, has_row: bool) -> Result<(), String> {
        let wants = |vibration: &Vibration| vibration.wants(tick);
        if has_row && !self.points.is_empty() || self.vibrations.iter().any(wants) {
            self.strings.read(engine)?;
        }
        for friction in self.frictions.iter_mut().flatten() {
            friction.before(engine, self.compiled);
        }
        Ok(())
    }

    /// What that tick has told of it.
    pub fn after(&mut self, engine: &Engine, tick: usize) {
        for friction in self.frictions.iter_mut().flatten() {
            friction.after(engine, self.compiled, tick >= self.half);
        }
        for (number, vibration) in self.vibrations.iter_mut().enumerate() {
            if vibration.wants(tick) {
                let frictions = self.frictions.iter().flatten();
                let mut rubs = frictions.filter_map(|friction| {
                    let (of, place_m) = friction.place(engine, self.compiled)?;
                    (of == number).then_some((friction.state(), place_m))
                });
                vibration.push(tick, self.strings.state(number), rubs.next());
            }
        }
    }

    /// A point's value.
    pub fn point(&self, index: usize) -> f64 {
        let point = &self.points[index];
        self.strings.at(point.string, point.reading, point.place_m)
    }

    /// A friction's value.
    pub fn friction(&self, number: usize, signal: FrictionSignal) -> f64 {
        let friction = self.frictions.get(number).and_then(Option::as_ref);
        friction.map_or(f64::NAN, |friction| friction.value(signal))
    }

    /// What is left of it after a run.
    pub fn finish(self) -> (Vec<Vibration>, Vec<FrictionTally>) {
        let frictions = self.frictions.iter().flatten();
        let tallies = frictions.map(WatchedFriction::tally).collect();
        (self.vibrations, tallies)
    }
}

/// The columns of points.
pub(super) fn columns(points: &[Point]) -> impl Iterator<Item = Recorded> {
    points.iter().enumerate().map(|(index, point)| Recorded {
        heading: point.heading.clone(),
        source: Signal::Point(index),
    })
}
