//! A closed loop: the program's force moves the key, and a hand or a force does.
//!
//! ```text
//!   Plant --position--> word --> Engine --> word --> Plant       player: a force, or a hand that wants the key somewhere
//! ```
//!
//! Of an instrument with several ports each that is driven may have a loop of its own, all in the
//! same tick; the others are where a motion says. A loop feels the others through the program
//! alone: arms are taken as moving in each direction by itself.

use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;

use whippen_compiler::model::{Model, Sense};

use crate::device::{Device, Port};
use crate::engine::EngineKind;
use crate::plant::{Energy, Plant, Player};
use crate::session::{self, Body, Recorded, Recording, Run, RunError, record_body};
use crate::trace::Heading;
use crate::trajectory::Trajectory;

/// What moves a port.
#[derive(Debug, Clone, PartialEq)]
pub enum PortMover {
    /// It is where the motion says at each tick (m), whatever force answers; the last place stays.
    Motion(Trajectory),
    /// The program's force and a player do, from a place at which it is still (m).
    Loop {
        /// What acts on it besides the drive.
        player: Player,
        /// Where it is before the first tick.
        start_m: f64,
    },
}

impl PortMover {
    /// Whether it closes a loop.
    pub fn is_loop(&self) -> bool {
        matches!(self, PortMover::Loop { .. })
    }
}

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
    /// What the strokes took of the player, for each loop.
    pub loops: Vec<LoopStrokes>,
}

/// What strokes on a port took of the player.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopStrokes {
    /// The name of the port; empty for the only one.
    pub port: String,
    /// The strokes.
    pub strokes: Strokes,
}

impl Closed {
    /// Where the first port with a loop was at each tick (m), of a run that kept every tick.
    pub fn positions(&self) -> &[f64] {
        let port = self.loops.first().map_or("", |first| &first.port);
        let mut columns = self.run.trace.columns.iter();
        let column = columns.find(|c| c.heading.name == name_of(port, POSITION));
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

/// The name of a column: with the port's, where there are several.
fn name_of(port: &str, column: &str) -> String {
    if port.is_empty() {
        column.to_string()
    } else {
        format!("{port}.{column}")
    }
}

/// What a loop's columns and notes call a port: nothing where it is the only one.
fn name_of_port(model: &Model, port: usize) -> &str {
    match model.senses.get(port) {
        Some(sense) if model.senses.len() > 1 => &sense.name,
        _ => "",
    }
}

/// The columns of closed loops: those of any run, and of each port that has a loop where the hand
/// wants the key, what it pushes, where the key truly is and how fast it goes down, what the coil
/// and the stops push, what the player has put in and got back since the beginning.
pub fn recorded(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    ports: &[usize],
) -> Vec<Recorded> {
    let model = &compiled.model;
    let heading = |port: usize, (name, quantity, step): (&str, Quantity, f64)| Heading {
        name: name_of(name_of_port(model, port), name),
        unit: quantity.unit(model.port_turns(port)).to_string(),
        step: Some(step),
        ..Heading::default()
    };
    let columns = |port: &usize| OBSERVED.map(|column| heading(*port, column));
    let headings: Vec<Heading> = ports.iter().flat_map(columns).collect();
    session::recorded(compiled, device, kind, &headings)
}

/// The part of the range of its sense above which a port is in a stroke.
const STROKE: f64 = 0.1;

/// Runs `compiled` in a closed loop of its only port for so many ticks, with the key at `start_m`
/// and still, and keeps every tick. `progress` is told the ticks done now and then.
///
/// # Errors
/// The device does not say how its key moves, or the engine cannot be built on this machine.
pub fn run(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (player, start_m): (Player, f64),
    ticks: usize,
    progress: impl FnMut(usize),
) -> Result<Closed, RunError> {
    let movers = vec![PortMover::Loop { player, start_m }];
    let recording = Recording::everything(recorded(compiled, device, kind, &[0]));
    record(compiled, device, kind, (movers, ticks), recording, progress)
}

/// Runs `compiled` for so many ticks with a mover for each of its ports, recording what is wanted:
/// of the columns of [`recorded`] for the ports that have a loop.
///
/// # Errors
/// The device does not say how a port with a loop moves, or no force acts there; the engine cannot
/// be built on this machine, or a table cannot be written.
pub fn record(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (movers, ticks): (Vec<PortMover>, usize),
    recording: Recording,
    progress: impl FnMut(usize),
) -> Result<Closed, RunError> {
    let model = &compiled.model;
    let ports = device.ports_of(model);
    let mut body = PlayedPorts {
        ports: Vec::new(),
        observed: Vec::new(),
    };
    for (number, mover) in movers.into_iter().enumerate() {
        let moved = match mover {
            PortMover::Motion(way) => MovedPort::Along(way),
            PortMover::Loop { player, start_m } => {
                let port = ports.get(number).copied().unwrap_or(device.port());
                check(model, device, number).map_err(RunError::Engine)?;
                let plant = Plant::new(port, model.rate_hz, player, start_m);
                let plant = plant.ok_or_else(|| RunError::Engine(motionless(device, port)))?;
                let observer = Observer::new(model.senses.get(number), model.rate_hz);
                MovedPort::Played(Box::new(PlayedPort {
                    name: name_of_port(model, number).to_string(),
                    drive: model.drives().iter().position(|port| *port == number),
                    plant,
                    observer,
                }))
            }
        };
        body.ports.push(moved);
    }
    let run = record_body(
        compiled,
        device,
        kind,
        (ticks, &mut body),
        recording,
        progress,
    )?;
    let ticks = run.counts.ticks;
    let loops = body.ports.into_iter().filter_map(|port| port.finish(ticks));
    Ok(Closed {
        loops: loops.collect(),
        run,
    })
}

/// Whether a loop can be closed around a port (its number among the senses).
///
/// # Errors
/// No force acts there, or the device does not say how it moves; in words.
pub fn check(model: &Model, device: &Device, port: usize) -> Result<(), String> {
    let own = device.ports_of(model).get(port).copied();
    let own = own.unwrap_or(device.port());
    if !model.drives().contains(&port) {
        let name = &model.senses[port].name;
        return Err(format!(
            "no force of `{}` acts on `{name}`, so that no loop can be closed there",
            model.name
        ));
    }
    match own.mechanics {
        Some(_) => Ok(()),
        None => Err(motionless(device, own)),
    }
}

/// That a device does not say how something moves.
fn motionless(device: &Device, port: &Port) -> String {
    let (what, table) = match &*port.name {
        "" => ("its key".to_string(), "mechanics".to_string()),
        name => (
            format!("its port `{name}`"),
            format!("port.{name}.mechanics"),
        ),
    };
    format!(
        "the device `{}` does not say how {what} moves: add `[{table}]` with `mass`, `damping` and `friction` to its file",
        device.name
    )
}

/// The ports of an instrument in motion, and what is recorded of those with a loop.
struct PlayedPorts {
    /// By sense.
    ports: Vec<MovedPort>,
    /// The values of the columns of this tick.
    observed: Vec<f64>,
}

enum MovedPort {
    Along(Trajectory),
    Played(Box<PlayedPort>),
}

impl MovedPort {
    fn finish(self, ticks: usize) -> Option<LoopStrokes> {
        match self {
            MovedPort::Along(_) => None,
            MovedPort::Played(played) => Some(LoopStrokes {
                port: played.name,
                strokes: played.observer.finish(ticks),
            }),
        }
    }
}

/// A port with a loop.
struct PlayedPort {
    name: String,
    /// Its number among the driven ones.
    drive: Option<usize>,
    plant: Plant,
    observer: Observer,
}

impl PlayedPort {
    /// Goes on to a tick, and tells what is to be recorded.
    fn go_on(&mut self, tick: usize, drive: Option<&[i16]>) -> [f64; OBSERVED.len()] {
        let word = self.drive.and_then(|number| drive?.get(number));
        if let Some(word) = word {
            self.plant.tick(*word);
        }
        let plant = &mut self.plant;
        self.observer
            .tick(tick, plant.position(), plant.take_energy());
        let all = self.observer.total;
        [
            plant.target().unwrap_or(f64::NAN),
            plant.player_force(),
            plant.position(),
            plant.speed(),
            plant.coil_force(),
            plant.stop_force(),
            all.given_j,
            all.returned_j,
        ]
    }
}

impl Body for PlayedPorts {
    fn move_to(&mut self, tick: usize, drive: Option<&[i16]>, places: &mut [f64]) {
        self.observed.clear();
        for (number, moved) in self.ports.iter_mut().enumerate() {
            let at = match moved {
                MovedPort::Along(way) => way.at(tick),
                MovedPort::Played(played) => {
                    self.observed.extend(played.go_on(tick, drive));
                    played.plant.sensed()
                }
            };
            // What senses nothing has a key all the same.
            if let Some(place) = places.get_mut(number) {
                *place = at;
            }
        }
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
    fn new(sense: Option<&Sense>, rate_hz: Rate) -> Observer {
        let (low, high) = sense.map_or((0.0, 1.0), |s| (s.range.low, s.range.high));
        Observer {
            begins: low.max(0.0) + STROKE * (high - low.max(0.0)),
            rate_hz,
            since: None,
            energy: Energy::default(),
            total: Energy::default(),
            strokes: Strokes::default(),
        }
    }

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
