//! A run: an engine, a motion, and what is recorded of it.
//!
//! ```text
//!   position (m) -> sensor word -> Engine -> drive word, values, events -> Recorder -> tables, Trace
//! ```
//!
//! Everything streams: positions are asked for tick by tick, rows are written as they come, and a
//! [`Trace`] is kept only as far as it is wanted ([`Keep`]), so a run takes as much memory after an
//! hour as after a second.
//!
//! The motion is prescribed: the key is where it was recorded to be, whatever force answers
//! (`closed` lets the force move it). All keys of an engine get the same motion; the trace shows
//! the first.

mod between;
mod columns;
mod happenings;
mod recorder;
pub(crate) mod watch;

use std::fmt;
use std::iter::Peekable;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use whippen_compiler::pipeline::Compiled;

use crate::automation::Change;
use crate::coil::Coil;
use crate::device::Device;
use crate::emulated::{BoardSteps, Emulated, Load};
use crate::engine::{Engine, EngineKind};
use crate::files::FileError;
use crate::measured_loop::{LoopDistance, MeasuredLoop};
use crate::plot::Figure;
use crate::sticking::FrictionTally;
use crate::trace::{Heading, Trace};

pub use columns::{
    ALL, Recorded, Signal, argument_title, argument_titles, arguments, choose, driven,
    event_headings, marked, recorded, roles, roles_of_all, roles_of_run, sticking_titles, suffix,
    title, titles, unit, unit_of_cell,
};
pub use happenings::{Emitted, Happenings, LISTED_MAX};
use recorder::Recorder;
pub use recorder::{Keep, Recording};

/// What a run counted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counts {
    /// Ticks run.
    pub ticks: usize,
    /// Ticks in which a position was beyond what its sensor reads.
    pub sensor_clipped: usize,
    /// Ticks in which a position was beyond the range the instrument senses.
    pub sense_clamped: usize,
    /// Ticks in which a force was beyond what its drive gives.
    pub drive_clipped: usize,
    /// Ticks in which a slew limit held a position back.
    pub slew_held: usize,
    /// Time spent in the engine.
    pub engine_time: Duration,
}

impl Counts {
    /// What was cut off, and how it is told: ticks and words; only what happened. `drives` is what
    /// the drive gives ([`driven`]).
    pub fn told(&self, drives: &str) -> Vec<(usize, String)> {
        let sensed = self.sense_clamped - self.sensor_clipped.min(self.sense_clamped);
        let all = [
            (
                self.sensor_clipped,
                "beyond the sensor's range, read as its end",
            ),
            (sensed, "beyond the range the instrument senses"),
            (self.slew_held, "held back by the slew limit"),
            (
                self.drive_clipped,
                &*format!("with more {drives} than the drive gives, clipped"),
            ),
        ];
        let happened = all.into_iter().filter(|(count, _)| *count > 0);
        happened.map(|(n, what)| (n, what.to_string())).collect()
    }
}

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    /// What was kept of it.
    pub trace: Trace,
    /// What was counted.
    pub counts: Counts,
    /// How many ticks it would have had, had nothing ended it early.
    pub ticks_wanted: usize,
    /// What happened, in numbers.
    pub happenings: Happenings,
    /// What it took on the board, on the engine `emulated`.
    pub load: Option<Load>,
    /// What the board did, instruction by instruction, where that was wanted.
    pub steps: Option<BoardSteps>,
    /// Whether its columns were chosen, so that figures draw all of them.
    pub is_chosen: bool,
    /// Titles of the columns of chosen points of strings.
    pub points: Vec<String>,
    /// What each friction did, as far as it is known.
    pub frictions: Vec<FrictionTally>,
    /// What was measured, where its loop is compared with that.
    pub beside: Option<Beside>,
}

/// A measured loop beside that of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Beside {
    /// What was measured.
    pub measured: MeasuredLoop,
    /// How far the run is from it.
    pub distance: LoopDistance,
    /// The same in words.
    pub told: String,
}

/// Why a run did not come to its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunError {
    /// The engine could not be built or could not go on, in words.
    Engine(String),
    /// A table could not be written.
    Output(FileError),
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RunError::Engine(why) => f.write_str(why),
            RunError::Output(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RunError {}

/// What moves the key.
pub(crate) trait Body {
    /// Puts what each port senses in a tick (m, or as its sense says) into `places`, after the
    /// drives' words of the tick before.
    fn move_to(&mut self, tick: usize, drive: Option<&[i16]>, places: &mut [f64]);

    /// What is recorded of it in this tick, in the order of [`Signal::Body`].
    fn observe(&self) -> &[f64] {
        &[]
    }
}

/// Ports that are where a motion says, whatever the first drive pushes.
struct Prescribed<F> {
    place: F,
    coil: Option<Coil>,
    /// What its coil pushes, as [`recorded_of_motion`] has a column for.
    pushed: [f64; 1],
}

impl<F: FnMut(usize, &mut [f64])> Body for Prescribed<F> {
    fn move_to(&mut self, tick: usize, drive: Option<&[i16]>, places: &mut [f64]) {
        if let (Some(coil), Some(word)) = (&mut self.coil, drive.and_then(<[i16]>::first)) {
            coil.tick(*word);
            self.pushed = [coil.force()];
        }
        (self.place)(tick, places);
    }

    fn observe(&self) -> &[f64] {
        &self.pushed[..usize::from(self.coil.is_some())]
    }
}

/// The columns of a run over a motion: those of any run, and what the coil of the first drive
/// pushes, where the device says how that follows.
pub fn recorded_of_motion(compiled: &Compiled, device: &Device, kind: EngineKind) -> Vec<Recorded> {
    let unit = if device.turns() { "n_m" } else { "n" };
    let heading = Heading {
        name: "coil_force".to_string(),
        unit: unit.to_string(),
        step: Some(1e-6),
        ..Heading::default()
    };
    let has_stages = device.drive().has_stages();
    let observed = has_stages.then_some(heading);
    recorded(compiled, device, kind, observed.as_slice())
}

/// Runs `compiled` over `positions_m`, one per tick and the same for each port, and keeps every
/// tick. `progress` is told the ticks done now and then.
///
/// # Errors
/// The engine cannot be built on this machine.
pub fn run(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    positions_m: &[f64],
    progress: impl FnMut(usize),
) -> Result<Run, RunError> {
    let recording = Recording::everything(recorded_of_motion(compiled, device, kind));
    let move_to = |tick: usize, places: &mut [f64]| places.fill(positions_m[tick]);
    let motion = (positions_m.len(), move_to);
    record(compiled, device, kind, motion, recording, progress)
}

/// Runs `compiled` for so many ticks over the places of its ports that are asked for tick by tick,
/// and records what is wanted. `progress` is told the ticks done now and then.
///
/// # Errors
/// The engine cannot be built on this machine, or a table cannot be written.
pub fn record(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (ticks, move_to): (usize, impl FnMut(usize, &mut [f64])),
    recording: Recording,
    progress: impl FnMut(usize),
) -> Result<Run, RunError> {
    let drive = device.drive();
    let coil = || Coil::new(drive, compiled.model.rate_hz);
    let mut body = Prescribed {
        place: move_to,
        coil: drive.has_stages().then(coil),
        pushed: [0.0],
    };
    record_body(
        compiled,
        device,
        kind,
        (ticks, &mut body),
        recording,
        progress,
    )
}

/// Runs `compiled` for so many ticks with what moves the key.
pub(crate) fn record_body(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (ticks, body): (usize, &mut dyn Body),
    recording: Recording,
    mut progress: impl FnMut(usize),
) -> Result<Run, RunError> {
    let mut engine = Engine::new(kind, compiled, device, 1).map_err(RunError::Engine)?;
    let (is_chosen, stop) = (recording.is_chosen(), recording.stop());
    let steps = recording.steps();
    let is_stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
    let points = recording.point_titles();
    let mut changes = recording.changes(compiled.model.rate_hz).peekable();
    let observes = engine.observes();
    let mut recorder = Recorder::new(compiled, device, recording, (ticks, observes));
    let mut watch = Watch::new(compiled, device);
    let kernel = &compiled.lowered.kernel;
    let mut places = vec![0.0; compiled.model.senses.len()];
    let (mut words, mut drive) = (vec![0; places.len()], vec![0; kernel.outputs.len()]);
    keep(&mut engine, recorder.listens(), steps).map_err(RunError::Engine)?;
    for tick in 0..ticks {
        body.move_to(tick, (tick > 0).then_some(&drive), &mut places);
        watch.words(tick, &places, &mut words);
        if tick == 0 {
            engine.start(&words);
        }
        change_lives(&mut engine, &mut changes, tick).map_err(RunError::Engine)?;
        recorder.before(&engine, tick).map_err(RunError::Engine)?;
        let before = Instant::now();
        engine.tick(&words, &mut drive);
        watch.counts.engine_time += before.elapsed();
        watch.drive(&drive);
        let written = recorder.tick(&mut engine, tick, &drive, body.observe());
        written.map_err(RunError::Output)?;
        let is_told = tick % 1024 == 0;
        is_told.then(|| progress(tick));
        if is_told && is_stopped() {
            break;
        }
    }
    progress(watch.counts.ticks);
    if let Some(trouble) = engine.board().and_then(|board| board.trouble()) {
        return Err(RunError::Engine(trouble.to_string()));
    }
    let finished = recorder.finish(&mut engine);
    let (trace, happenings, frictions) = finished.map_err(RunError::Output)?;
    Ok(Run {
        trace,
        happenings,
        counts: watch.counts,
        ticks_wanted: ticks,
        load: engine.board().map(|board| board.load()),
        steps: engine.board_mut().and_then(Emulated::take_steps),
        is_chosen,
        points,
        frictions,
        beside: None,
    })
}

/// Tells a board what it is to keep: what it lets hear, the instructions of ticks.
fn keep(engine: &mut Engine, sound: bool, steps: Option<Range<u64>>) -> Result<(), String> {
    if sound {
        engine.listen()?;
    }
    if let (Some(ticks), Some(board)) = (steps, engine.board_mut()) {
        board.record_steps(ticks);
    }
    Ok(())
}

/// Makes the changes of live values that are due in a tick.
fn change_lives(
    engine: &mut Engine,
    changes: &mut Peekable<impl Iterator<Item = (usize, Change)>>,
    tick: usize,
) -> Result<(), String> {
    while let Some((_, change)) = changes.next_if(|(at, _)| *at <= tick) {
        engine.set_live(change.live, change.value)?;
    }
    Ok(())
}

/// The figure of a run: travel, force terms and their sum, coordinates, states, strikes; or what
/// was chosen.
pub fn figure<'r>(compiled: &Compiled, run: &'r Run) -> Figure<'r> {
    Figure {
        measured: run.beside.as_ref().map(|beside| &beside.measured),
        ..Figure::of(&run.trace, &roles_of_run(compiled, run))
    }
}

/// Counts what the converters and the ranges cut off.
struct Watch<'a> {
    ports: Vec<watch::WatchedPort<'a>>,
    counts: Counts,
}

impl<'a> Watch<'a> {
    fn new(compiled: &'a Compiled, device: &'a Device) -> Watch<'a> {
        let model = &compiled.model;
        let ports = model.senses.iter().zip(device.ports_of(model));
        let watched = |(sense, port)| watch::WatchedPort::new(sense, port, model.rate_hz);
        Watch {
            ports: ports.map(watched).collect(),
            counts: Counts::default(),
        }
    }

    /// The words of all ports in a tick; a tick counts once, whatever many ports are cut off.
    fn words(&mut self, tick: usize, places: &[f64], words: &mut [u16]) {
        let mut cut = watch::Cut::default();
        for ((port, place), word) in self.ports.iter_mut().zip(places).zip(words) {
            *word = port.word(tick, *place, &mut cut);
        }
        self.counts.ticks += 1;
        self.counts.sensor_clipped += usize::from(cut.at_sensor);
        self.counts.sense_clamped += usize::from(cut.at_range);
        self.counts.slew_held += usize::from(cut.held);
    }

    fn drive(&mut self, words: &[i16]) {
        let is_clipped = |word: &i16| *word == i16::MIN || *word == i16::MAX;
        self.counts.drive_clipped += usize::from(words.iter().any(is_clipped));
    }
}
