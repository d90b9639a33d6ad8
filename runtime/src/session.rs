//! A run: an engine, a motion, a trace.
//!
//! ```text
//!   positions (m) -> sensor words -> Engine -> drive words, values, events -> Trace
//! ```
//!
//! The motion is prescribed: the key is where it was recorded to be, whatever force answers
//! (`closed` lets the force move it). All keys of an engine get the same motion; the trace shows
//! the first.

use std::time::{Duration, Instant};

use whippen_compiler::lower::{Export, ExportKind, LoweredEventKind};
use whippen_compiler::model::{CellKind, EmissionId, Model};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::Dim;

use crate::device::Device;
use crate::emulated::Load;
use crate::engine::{Engine, EngineKind, Happened};
use crate::plot::{Figure, Roles};
use crate::titles::join_title;
use crate::trace::{Column, EventRow, Trace};

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
    /// What was cut off, and how it is told: ticks and words; only what happened.
    pub fn told(&self) -> Vec<(usize, &'static str)> {
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
                "with more force than the drive gives, clipped",
            ),
        ];
        all.into_iter().filter(|(count, _)| *count > 0).collect()
    }
}

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    /// What was recorded.
    pub trace: Trace,
    /// What was counted.
    pub counts: Counts,
    /// What it took on the board, on the engine `emulated`.
    pub load: Option<Load>,
}

/// Runs `compiled` over `positions_m`, one per tick. `progress` is told the ticks done now and
/// then.
///
/// # Errors
/// The engine cannot be built on this machine.
pub fn run(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    positions_m: &[f64],
    progress: impl FnMut(usize),
) -> Result<Run, String> {
    looped(
        compiled,
        device,
        kind,
        positions_m.len(),
        progress,
        |tick, _| positions_m[tick],
    )
}

/// Runs `compiled` for so many ticks; `position_m` is told the tick and the drive's word of the one
/// before, and says where the key then is.
pub(crate) fn looped(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    ticks: usize,
    mut progress: impl FnMut(usize),
    mut position_m: impl FnMut(usize, Option<i16>) -> f64,
) -> Result<Run, String> {
    let mut engine = Engine::new(kind, compiled, device, 1)?;
    let senses = compiled.model.senses.len();
    let mut recorder = Recorder::new(compiled, ticks, engine.observes());
    let mut watch = Watch::new(compiled, device);
    let mut words = vec![0u16; senses];
    let mut drive = [0i16];
    for tick in 0..ticks {
        words.fill(watch.word(position_m(tick, (tick > 0).then_some(drive[0]))));
        let before = Instant::now();
        if tick == 0 {
            engine.start(&words);
        }
        engine.tick(&words, &mut drive);
        watch.counts.engine_time += before.elapsed();
        watch.drive(drive[0]);
        recorder.tick(&mut engine, tick, device.force_of_word(drive[0]));
        if tick % 4096 == 0 {
            progress(tick);
        }
    }
    progress(ticks);
    if let Some(trouble) = engine.board().and_then(|board| board.trouble()) {
        return Err(trouble.to_string());
    }
    Ok(Run {
        trace: recorder.trace,
        counts: watch.counts,
        load: engine.board().map(|board| board.load()),
    })
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

/// The event that a summary lists and a figure marks: `note`, or else the first that the program
/// emits with an argument.
pub fn marked(model: &Model) -> &str {
    let first = || {
        model
            .emissions
            .iter()
            .find(|e| !e.args.is_empty())
            .map(|e| e.name.as_str())
    };
    if model.emissions.iter().any(|e| e.name == "note") {
        "note"
    } else {
        first().unwrap_or("note")
    }
}

/// The figure of a run: travel, force terms and their sum, coordinates, states, strikes.
pub fn figure<'r>(compiled: &Compiled, run: &'r Run) -> Figure<'r> {
    Figure::of(&run.trace, &roles(compiled))
}

/// Which columns of a run's trace play which part in a figure.
pub fn roles(compiled: &Compiled) -> Roles {
    let model = &compiled.model;
    let coordinate = |kind| match kind {
        ExportKind::Cell(id) => model.cells[id].kind == CellKind::Coordinate,
        _ => false,
    };
    let first = |wanted: ExportKind| {
        titles(compiled, &|kind| kind == wanted)
            .into_iter()
            .next()
            .unwrap_or_default()
    };
    Roles {
        title: model.name.replace('_', " "),
        travel: first(ExportKind::Sense(0)),
        forces: titles(compiled, &|kind| matches!(kind, ExportKind::Force(_))),
        total: first(ExportKind::Total),
        coordinates: titles(compiled, &coordinate),
        mark: marked(model).to_string(),
    }
}

/// The titles of the columns of exports of some kinds, in the order of the exports.
pub fn titles(compiled: &Compiled, wanted: &dyn Fn(ExportKind) -> bool) -> Vec<String> {
    let title = |e: &Export| join_title(&e.name, &suffix(&compiled.model, e));
    compiled
        .lowered
        .exports
        .iter()
        .filter(|e| wanted(e.kind))
        .map(title)
        .collect()
}

/// Fills a trace: the drive, then senses, the sum of forces, forces, coordinates, rates, states.
struct Recorder<'c> {
    compiled: &'c Compiled,
    /// Exports that have a column, by index.
    shown: Vec<usize>,
    titles: Vec<Vec<String>>,
    trace: Trace,
}

impl<'c> Recorder<'c> {
    /// Without values inside of ticks there is the drive alone.
    fn new(compiled: &'c Compiled, ticks: usize, observes: bool) -> Recorder<'c> {
        let exports = &compiled.lowered.exports;
        let column = |name: &str, unit: String, labels: Vec<String>| Column {
            name: name.to_string(),
            unit,
            labels,
            values: Vec::with_capacity(ticks),
        };
        let shown: Vec<usize> = (0..exports.len())
            .filter(|&i| observes && has_column(&compiled.model, &exports[i]))
            .collect();
        let mut columns = vec![column("drive", drive_unit(&compiled.model), Vec::new())];
        for &index in &shown {
            let export = &exports[index];
            columns.push(column(
                &export.name,
                suffix(&compiled.model, export),
                labels(&compiled.model, export),
            ));
        }
        let trace = Trace {
            rate_hz: compiled.model.rate_hz,
            columns,
            events: Vec::new(),
        };
        Recorder {
            compiled,
            shown,
            titles: argument_titles(&compiled.model),
            trace,
        }
    }

    fn tick(&mut self, engine: &mut Engine, tick: usize, drive_n: f64) {
        self.trace.columns[0].values.push(drive_n);
        for (column, &index) in self.trace.columns[1..].iter_mut().zip(&self.shown) {
            column
                .values
                .push(engine.value(0, index, &self.compiled.lowered.exports[index]));
        }
        let t_s = self.trace.time_s(tick);
        for happened in engine.drain() {
            self.trace.events.push(self.row(t_s, happened));
        }
    }

    fn row(&self, t_s: f64, happened: Happened) -> EventRow {
        let model = &self.compiled.model;
        let (event, titles) = match &self.compiled.lowered.events[happened.event].kind {
            LoweredEventKind::Emission(e) => (
                model.emissions[EmissionId(*e)].name.clone(),
                self.titles[*e as usize].clone(),
            ),
            LoweredEventKind::Rule(name) => (name.clone(), Vec::new()),
        };
        EventRow {
            t_s,
            key: happened.key,
            event,
            args: titles.into_iter().zip(happened.args).collect(),
        }
    }
}

/// The unit of what the device drives, as a column title writes it.
fn drive_unit(model: &Model) -> String {
    if model.turns() {
        Dim::TORQUE.suffix()
    } else {
        Dim::FORCE.suffix()
    }
}

/// Ports, force terms, coordinates, rates, pulses and states have columns; `let`s do not.
fn has_column(model: &Model, export: &Export) -> bool {
    match export.kind {
        ExportKind::Named(_) => false,
        ExportKind::Cell(id) => model.cells[id].kind != CellKind::Pulse,
        _ => true,
    }
}

/// The unit of an export as a column title writes it; an angle is known by its sense or its body.
pub fn suffix(model: &Model, export: &Export) -> String {
    let Some(dim) = export.dim else {
        return String::new();
    };
    match export.kind {
        ExportKind::Sense(_) if dim.is_number() => "rad".into(),
        ExportKind::Cell(id) if dim.is_number() && model.cells[id].kind == CellKind::Coordinate => {
            "rad".into()
        }
        ExportKind::Cell(id) if dim == Dim::PER_TIME && model.cells[id].kind == CellKind::Rate => {
            "rad_per_s".into()
        }
        _ => dim.suffix(),
    }
}

/// The unit of an export as a program writes it (`rad/s`).
pub fn unit(model: &Model, export: &Export) -> String {
    match suffix(model, export).as_str() {
        "rad" => "rad".to_string(),
        "rad_per_s" => "rad/s".to_string(),
        _ => export.dim.map_or(String::new(), |dim| dim.unit()),
    }
}

fn labels(model: &Model, export: &Export) -> Vec<String> {
    match export.kind {
        ExportKind::Machine(id) => model.machines[id].states.clone(),
        _ => Vec::new(),
    }
}

/// Titles of the arguments of every emission (`speed_m_per_s`).
pub fn argument_titles(model: &Model) -> Vec<Vec<String>> {
    let title = |(name, dim): &(String, Dim)| join_title(name, &dim.suffix());
    model
        .emissions
        .iter()
        .map(|e| e.args.iter().map(title).collect())
        .collect()
}
