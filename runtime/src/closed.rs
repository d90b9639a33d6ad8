//! A closed loop: the program's force moves the key, and a hand or a force does.
//!
//! ```text
//!   Plant --position--> word --> Engine --> word --> Plant       player: a force, or a hand that wants the key somewhere
//! ```

use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::engine::EngineKind;
use crate::plant::{Energy, Plant, Player};
use crate::session::{Run, looped};

/// What a stroke took, from where the key leaves its rest until it is back. It may begin and end in
/// motion, so that only the sum over strokes that begin at rest says whether a key gave more than
/// it got.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrokeEnergy {
    /// When it began (s).
    pub start_s: f64,
    /// How long it took (s).
    pub seconds: f64,
    /// What the player did.
    pub energy: Energy,
}

/// A finished closed loop.
#[derive(Debug, Clone)]
pub struct Closed {
    /// What the program did.
    pub run: Run,
    /// Where the key was at each tick (m).
    pub positions: Vec<f64>,
    /// What each stroke took of the player; the last may be unfinished.
    pub strokes: Vec<StrokeEnergy>,
}

/// The part of the range of the first sense above which a key is in a stroke.
const STROKE: f64 = 0.1;

/// Runs `compiled` in a closed loop for so many ticks, with the key at `start_m` and still.
/// `progress` is told the ticks done now and then.
///
/// # Errors
/// The device does not say how its key moves, or the engine cannot be built on this machine; in
/// words.
pub fn run(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (player, start_m): (Player, f64),
    ticks: usize,
    progress: impl FnMut(usize),
) -> Result<Closed, String> {
    let rate_hz = compiled.model.rate_hz;
    let mut plant = Plant::new(device, rate_hz, player, start_m).ok_or_else(|| {
        format!(
            "the device `{}` does not say how its key moves: add `[mechanics]` with `mass`, `damping` and `friction` to its file",
            device.name
        )
    })?;
    let range = compiled
        .model
        .senses
        .first()
        .map_or((0.0, 1.0), |s| (s.range.low, s.range.high));
    let begins = range.0.max(0.0) + STROKE * (range.1 - range.0.max(0.0));
    let mut observer = Observer {
        begins,
        rate_hz,
        since: None,
        energy: Energy::default(),
        strokes: Vec::new(),
    };
    let mut positions = Vec::with_capacity(ticks);
    let run = looped(compiled, device, kind, ticks, progress, |tick, word| {
        if let Some(word) = word {
            plant.tick(word);
        }
        positions.push(plant.position());
        observer.tick(tick, plant.position(), plant.take_energy());
        plant.sensed()
    })?;
    Ok(Closed {
        run,
        positions,
        strokes: observer.finish(ticks),
    })
}

/// Adds up the energy of each stroke, with what led up to it since the one before.
struct Observer {
    begins: f64,
    rate_hz: u32,
    /// The first tick of the stroke that goes on.
    since: Option<usize>,
    energy: Energy,
    strokes: Vec<StrokeEnergy>,
}

impl Observer {
    fn tick(&mut self, tick: usize, x: f64, energy: Energy) {
        self.energy.given_j += energy.given_j;
        self.energy.returned_j += energy.returned_j;
        match (self.since, x > self.begins) {
            (None, true) => self.since = Some(tick),
            (Some(_), false) => self.close(tick),
            _ => {}
        }
    }

    fn close(&mut self, tick: usize) {
        let second = |tick: usize| tick as f64 / f64::from(self.rate_hz);
        if let Some(start) = self.since.take() {
            let energy = std::mem::take(&mut self.energy);
            self.strokes.push(StrokeEnergy {
                start_s: second(start),
                seconds: second(tick - start),
                energy,
            });
        }
    }

    fn finish(mut self, ticks: usize) -> Vec<StrokeEnergy> {
        self.close(ticks);
        self.strokes
    }
}
