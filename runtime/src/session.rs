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

mod columns;
mod recorder;

use std::fmt;
use std::time::{Duration, Instant};

use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::emulated::Load;
use crate::engine::{Engine, EngineKind};
use crate::files::FileError;
use crate::plot::Figure;
use crate::trace::Trace;

pub use columns::{
    ALL, Recorded, Signal, argument_title, argument_titles, arguments, choose, driven, marked,
    recorded, roles, roles_of_all, suffix, title, titles, unit, unit_of_cell,
};
use recorder::Recorder;
pub use recorder::{Emitted, Happenings, Keep, LISTED_MAX, Recording};

/// What a run counted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counts {
    /// Ticks run.
    pub ticks: usize,
    /// Ticks in which the position was beyond what the sensor reads.
    pub sensor_clipped: usize,
    /// Ticks in which the position was beyond the range the instrument senses.
    pub sense_clamped: usize,
    /// Ticks in which the force was beyond what the drive gives.
    pub drive_clipped: usize,
    /// Ticks in which the slew limit held the position back.
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
    /// What happened, in numbers.
    pub happenings: Happenings,
    /// What it took on the board, on the engine `emulated`.
    pub load: Option<Load>,
    /// Whether its columns were chosen, so that figures draw all of them.
    pub is_chosen: bool,
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
    /// Where the key is in a tick (m), after the drive's word of the tick before.
    fn position_m(&mut self, tick: usize, word: Option<i16>) -> f64;

    /// What is recorded of it in this tick, in the order of [`Signal::Body`].
    fn observe(&self) -> &[f64] {
        &[]
    }
}

/// A key that is where a motion says.
struct Prescribed<F>(F);

impl<F: FnMut(usize) -> f64> Body for Prescribed<F> {
    fn position_m(&mut self, tick: usize, _: Option<i16>) -> f64 {
        (self.0)(tick)
    }
}

/// Runs `compiled` over `positions_m`, one per tick, and keeps every tick. `progress` is told the
/// ticks done now and then.
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
    let recording = Recording::everything(recorded(compiled, device, kind, &[]));
    let position_m = |tick: usize| positions_m[tick];
    record(
        compiled,
        device,
        kind,
        (positions_m.len(), position_m),
        recording,
        progress,
    )
}

/// Runs `compiled` for so many ticks over the positions that are asked for one by one, and records
/// what is wanted. `progress` is told the ticks done now and then.
///
/// # Errors
/// The engine cannot be built on this machine, or a table cannot be written.
pub fn record(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    (ticks, position_m): (usize, impl FnMut(usize) -> f64),
    recording: Recording,
    progress: impl FnMut(usize),
) -> Result<Run, RunError> {
    let mut body = Prescribed(position_m);
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
    let is_chosen = recording.is_chosen();
    let mut recorder = Recorder::new(compiled, device, recording);
    let mut watch = Watch::new(compiled, device);
    let mut words = vec![0u16; compiled.model.senses.len()];
    let mut drive = [0i16];
    for tick in 0..ticks {
        let position_m = body.position_m(tick, (tick > 0).then_some(drive[0]));
        words.fill(watch.word(position_m));
        let before = Instant::now();
        if tick == 0 {
            engine.start(&words);
        }
        engine.tick(&words, &mut drive);
        watch.counts.engine_time += before.elapsed();
        watch.drive(drive[0]);
        let written = recorder.tick(&mut engine, tick, drive[0], body.observe());
        written.map_err(RunError::Output)?;
        if tick % 4096 == 0 {
            progress(tick);
        }
    }
    progress(ticks);
    if let Some(trouble) = engine.board().and_then(|board| board.trouble()) {
        return Err(RunError::Engine(trouble.to_string()));
    }
    let (trace, happenings) = recorder.finish().map_err(RunError::Output)?;
    Ok(Run {
        trace,
        happenings,
        counts: watch.counts,
        load: engine.board().map(|board| board.load()),
        is_chosen,
    })
}

/// The figure of a run: travel, force terms and their sum, coordinates, states, strikes; or what
/// was chosen.
pub fn figure<'r>(compiled: &Compiled, run: &'r Run) -> Figure<'r> {
    let roles = if run.is_chosen {
        roles_of_all(compiled, &run.trace)
    } else {
        roles(compiled)
    };
    Figure::of(&run.trace, &roles)
}

/// Counts what the converters and the ranges cut off.
struct Watch<'a> {
    device: &'a Device,
    model: &'a Model,
    /// Words the first sense accepts, and how far it lets them move in a tick.
    accepted: (i64, i64),
    step: Option<i64>,
    last: Option<i64>,
    counts: Counts,
}

impl<'a> Watch<'a> {
    fn new(compiled: &'a Compiled, device: &'a Device) -> Watch<'a> {
        let (model, scales) = (&compiled.model, device.scales());
        let sense = model.senses.first();
        let accepted = sense.map_or((0, 65_535), |s| scales.words_in(s.range));
        let step = sense
            .and_then(|s| s.slew_per_s)
            .map(|v| scales.words_per_tick(v, model.rate_hz));
        Watch {
            device,
            model,
            accepted,
            step,
            last: None,
            counts: Counts::default(),
        }
    }

    fn word(&mut self, position_m: f64) -> u16 {
        let (word, clipped) = self.device.word_of_position(position_m);
        let (low, high) = self.accepted;
        let wide = i64::from(word).clamp(low, high);
        let outside = self
            .model
            .senses
            .first()
            .is_some_and(|s| position_m < s.range.low || position_m > s.range.high);
        let held = match (self.last, self.step) {
            (Some(last), Some(step)) => wide.clamp(last - step, last + step),
            _ => wide,
        };
        self.counts.ticks += 1;
        self.counts.sensor_clipped += usize::from(clipped);
        self.counts.sense_clamped += usize::from(outside);
        self.counts.slew_held += usize::from(held != wide);
        self.last = Some(held);
        word
    }

    fn drive(&mut self, word: i16) {
        self.counts.drive_clipped += usize::from(word == i16::MIN || word == i16::MAX);
    }
}
