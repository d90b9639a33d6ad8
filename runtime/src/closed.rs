//! A closed loop: the program's force moves the key, and a hand or a force does.
//!
//! ```text
//!   Plant --position--> word --> Engine --> word --> Plant       player: a force, or a hand that wants the key somewhere
//! ```

use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;

use crate::device::Device;
use crate::engine::EngineKind;
use crate::plant::{Energy, Plant, Player};
use crate::session::{self, Body, Recorded, Recording, Run, RunError, record_body};
use crate::trace::Heading;

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
    /// What the program did, and what was recorded of key and player.
    pub run: Run,
    /// What the strokes took of the player.
    pub strokes: Strokes,
}

impl Closed {
    /// Where the key was at each tick (m), of a run that kept every tick.
    pub fn positions(&self) -> &[f64] {
        let mut columns = self.run.trace.columns.iter();
        let column = columns.find(|c| c.heading.name == POSITION);
        column.map_or(&[], |c| c.values())
    }
}

/// What strokes took of the player.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Strokes {
    /// How many there were.
    pub count: usize,
    /// The first of them; the last of all may be unfinished.
    pub first: Vec<StrokeEnergy>,
    /// What the player did in all of them.
    pub all: Energy,
}

/// So many strokes are kept.
const STROKES_MAX: usize = 1000;

/// The name of the column of the key's true position.
const POSITION: &str = "key_position";

/// What is recorded of key and player: names, whether it is a place, a speed, a force or an energy,
/// and the step in which it is written, finer than any sensor's or drive's (SI).
const OBSERVED: [(&str, Quantity, f64); 8] = [
    ("hand_target", Quantity::Place, 1e-9),
    ("hand_force", Quantity::Force, 1e-6),
    (POSITION, Quantity::Place, 1e-9),
    ("key_speed", Quantity::Speed, 1e-7),
    ("coil_force", Quantity::Force, 1e-6),
    ("stop_force", Quantity::Force, 1e-6),
    ("energy_given", Quantity::Energy, 1e-9),
    ("energy_returned", Quantity::Energy, 1e-9),
];

/// What a column of a closed loop is; places and forces are angles and torques on what turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Place,
    Speed,
    Force,
    Energy,
}

impl Quantity {
    fn unit(self, turns: bool) -> &'static str {
        match (self, turns) {
            (Quantity::Place, false) => "m",
            (Quantity::Place, true) => "rad",
            (Quantity::Speed, false) => "m_per_s",
            (Quantity::Speed, true) => "rad_per_s",
            (Quantity::Force, false) => "n",
            (Quantity::Force, true) => "n_m",
            (Quantity::Energy, _) => "j",
        }
    }
}

/// The columns of a closed loop: those of any run, and where the hand wants the key, what it
/// pushes, where the key truly is and how fast it goes down, what the coil and the stops push, what
/// the player has put in and got back since the beginning.
pub fn recorded(compiled: &Compiled, device: &Device, kind: EngineKind) -> Vec<Recorded> {
    let turns = compiled.model.turns();
    let heading = |(name, quantity, step): (&str, Quantity, f64)| Heading {
        name: name.to_string(),
        unit: quantity.unit(turns).to_string(),
        step: Some(step),
        ..Heading::default()
    };
    session::recorded(compiled, device, kind, &OBSERVED.map(heading))
}

/// The part of the range of the first sense above which a key is in a stroke.
const STROKE: f64 = 0.1;

/// Runs `compiled` in a closed loop for so many ticks, with the key at `start_m` and still, and
/// keeps every tick. `progress` is told the ticks done now and then.
///
/// # Errors
/// The device does not say how its key moves, or the engine cannot be built on this machine.
pub fn run(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    from: (Player, f64),
    ticks: usize,
    progress: impl FnMut(usize),
) -> Result<Closed, RunError> {
    let recording = Recording::everything(recorded(compiled, device, kind));
    record(compiled, device, kind, from, ticks, recording, progress)
}

/// As [`run`], recording what is wanted.
///
/// # Errors
/// As [`run`]; or a table cannot be written.
pub fn record(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (player, start_m): (Player, f64),
    ticks: usize,
    recording: Recording,
    progress: impl FnMut(usize),
) -> Result<Closed, RunError> {
    let rate_hz = compiled.model.rate_hz;
    if compiled.model.senses.len() > 1 {
        let why = "a closed loop is of one port; give `--motion` for several";
        return Err(RunError::Engine(why.to_string()));
    }
    let plant = Plant::new(device, rate_hz, player, start_m).ok_or_else(|| {
        RunError::Engine(format!(
            "the device `{}` does not say how its key moves: add `[mechanics]` with `mass`, `damping` and `friction` to its file",
            device.name
        ))
    })?;
    let range = compiled
        .model
        .senses
        .first()
        .map_or((0.0, 1.0), |s| (s.range.low, s.range.high));
    let begins = range.0.max(0.0) + STROKE * (range.1 - range.0.max(0.0));
    let mut body = PlayedKey {
        plant,
        observer: Observer {
            begins,
            rate_hz,
            since: None,
            energy: Energy::default(),
            total: Energy::default(),
            strokes: Strokes::default(),
        },
        observed: [0.0; OBSERVED.len()],
    };
    let run = record_body(
        compiled,
        device,
        kind,
        (ticks, &mut body),
        recording,
        progress,
    )?;
    Ok(Closed {
        strokes: body.observer.finish(run.counts.ticks),
        run,
    })
}

/// A key in motion, and what is recorded of it.
struct PlayedKey {
    plant: Plant,
    observer: Observer,
    /// The values of the columns of this tick.
    observed: [f64; OBSERVED.len()],
}

impl Body for PlayedKey {
    fn move_to(&mut self, tick: usize, drive: Option<&[i16]>, places: &mut [f64]) {
        if let Some(word) = drive.and_then(<[i16]>::first) {
            self.plant.tick(*word);
        }
        let plant = &mut self.plant;
        self.observer
            .tick(tick, plant.position(), plant.take_energy());
        let all = self.observer.total;
        self.observed = [
            plant.target().unwrap_or(f64::NAN),
            plant.player_force(),
            plant.position(),
            plant.speed(),
            plant.coil_force(),
            plant.stop_force(),
            all.given_j,
            all.returned_j,
        ];
        places.fill(plant.sensed());
    }

    fn observe(&self) -> &[f64] {
        &self.observed
    }
}

/// Adds up the energy of each stroke, with what led up to it since the one before.
struct Observer {
    begins: f64,
    rate_hz: Rate,
    /// The first tick of the stroke that goes on.
    since: Option<usize>,
    energy: Energy,
    /// What the player did since the beginning.
    total: Energy,
    strokes: Strokes,
}

impl Observer {
    fn tick(&mut self, tick: usize, x: f64, energy: Energy) {
        self.energy.add(energy);
        self.total.add(energy);
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
            self.strokes.count += 1;
            self.strokes.all.add(energy);
            if self.strokes.first.len() < STROKES_MAX {
                self.strokes.first.push(StrokeEnergy {
                    start_s: second(start),
                    seconds: second(tick - start),
                    energy,
                });
            }
        }
    }

    fn finish(mut self, ticks: usize) -> Strokes {
        self.close(ticks);
        self.strokes
    }
}
