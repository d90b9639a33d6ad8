//! An experiment is played: its instruments are read, compiled and moved, one after the other.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS};
use whippen_compiler::check::{Options, midi_number};
use whippen_compiler::diag::{Severity, nearest};
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::closed;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::experiment::bundled::PROGRAMS;
use whippen_runtime::experiment::{Bound, Experiment, Instrument, Mover, Part, Stretch, Verdict};
use whippen_runtime::plant::Player;
use whippen_runtime::session::{self, Recorded, Recording, Run};
use whippen_runtime::trace::Trace;
use whippen_runtime::trajectory::Trajectory;

use super::super::hand::Grip;
use super::super::load;
use super::super::opened::Opened;
use super::super::progress::Progress;
use super::super::run::stopped;
use crate::device;
use crate::exit::Failure;

/// What became of an experiment.
pub struct Played<'e> {
    pub experiment: &'e Experiment,
    pub bound: Bound<'e>,
    pub trace: Trace,
    pub verdicts: Vec<Verdict>,
    /// The programs: names and texts.
    pub sources: Vec<(String, String)>,
    /// What was cut off by converters and ranges, in words.
    pub warnings: Vec<String>,
}

impl Played<'_> {
    pub fn held(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.held)
    }
}

/// An instrument that can be played.
struct Ready {
    compiled: Compiled,
    device: Device,
    columns: Vec<Recorded>,
}

/// Where the files lie that an experiment names.
#[derive(Clone, Copy)]
pub struct Places<'p> {
    /// Its own file; none of a bundled one.
    pub file: Option<&'p Path>,
    /// The folder of recordings; that of the file where none is named.
    pub recordings: Option<&'p Path>,
}

impl Places<'_> {
    /// The folder in which the description of a recording lies, as far as it is known.
    fn of_recordings(&self) -> Option<PathBuf> {
        let beside_file = self.file.map(|file| beside(Some(file), ""));
        self.recordings.map(Path::to_path_buf).or(beside_file)
    }

    /// Whether everything is known that an experiment plays.
    pub fn suffice(&self, experiment: &Experiment) -> bool {
        experiment.repeated.is_none() || self.of_recordings().is_some()
    }
}

/// Plays it, unless `stop` becomes true.
pub fn play<'e>(
    experiment: &'e Experiment,
    places: Places,
    kind: EngineKind,
    stop: &'static AtomicBool,
) -> Result<Played<'e>, Failure> {
    let mut sources: Vec<(String, String)> = Vec::new();
    let (mut all, mut parts) = (Vec::new(), Vec::new());
    for instrument in &experiment.instruments {
        let read = program(instrument, places.file)?;
        let ready = ready(experiment, instrument, places.file, &read, kind)?;
        parts.push(part(instrument, &ready));
        all.push(ready);
        sources.extend(
            read.into_iter()
                .filter(|source| !sources.contains(source))
                .collect::<Vec<_>>(),
        );
    }
    one_rate(&all)?;
    let stretch = stretch(experiment, places, &all[0])?;
    parts.extend(stretch.as_ref().map(Stretch::part));
    let bound = Bound::new(experiment, &parts).map_err(|e| Failure::Usage(e.to_string()))?;
    let (mut traces, mut warnings): (Vec<Trace>, _) = (Vec::new(), Vec::new());
    for (ready, part) in all.into_iter().zip(&parts) {
        let driven = session::driven(&ready.compiled.model);
        let mover = mover(experiment, &traces, &stretch, &ready);
        let run = moved(mover, ready, kind, stop)?;
        if run.counts.ticks < run.ticks_wanted {
            return Err(Failure::Interrupted);
        }
        let told = run.counts.told(driven).into_iter();
        warnings.extend(told.map(|(n, what)| part.called(&format!("{n} ticks {what}"))));
        traces.push(run.trace);
    }
    traces.extend(stretch.as_ref().map(Stretch::trace));
    let trace = Part::joined(&parts, traces);
    Ok(Played {
        verdicts: bound.verdicts(&trace),
        experiment,
        bound,
        trace,
        sources,
        warnings,
    })
}

/// What names of an experiment find in an instrument.
fn part(instrument: &Instrument, ready: &Ready) -> Part {
    let columns = ready.columns.iter();
    Part {
        name: instrument.name.clone(),
        headings: columns.map(|column| column.heading.clone()).collect(),
        events: session::event_headings(&ready.compiled),
        turns: ready.compiled.model.turns(),
    }
}

/// What moves the next instrument, after those whose traces are there, and its way.
fn mover<'e>(
    experiment: &'e Experiment,
    traces: &[Trace],
    stretch: &Option<Stretch>,
    ready: &Ready,
) -> (&'e Mover, Trajectory) {
    let instrument = &experiment.instruments[traces.len()];
    if let Some(by) = instrument.pushed_by {
        return (&Mover::Force, force_of_hand(&traces[by]));
    }
    let way = match stretch {
        Some(stretch) => stretch.places.clone(),
        None => experiment.trajectory(ready.compiled.model.rate_hz),
    };
    (&experiment.mover, way)
}

/// The stretch of the recording that is played; the titles of what was measured are those of the
/// first instrument's columns.
fn stretch(
    experiment: &Experiment,
    places: Places,
    first: &Ready,
) -> Result<Option<Stretch>, Failure> {
    let Some(repeated) = &experiment.repeated else {
        return Ok(None);
    };
    let folder = places.of_recordings().ok_or_else(|| {
        Failure::Usage(format!(
            "`{}` plays a recording; name the folder in which `{}` lies with --recordings FOLDER",
            experiment.name, repeated.description
        ))
    })?;
    let columns = (&first.compiled.model, &first.columns[..]);
    let stretch = Stretch::read(repeated, &folder, columns);
    stretch.map(Some).map_err(|e| Failure::Usage(e.to_string()))
}

/// What a hand pushed in a run: where it pulled, a finger lets go.
fn force_of_hand(trace: &Trace) -> Trajectory {
    let mut columns = trace.columns.iter();
    let column = columns.find(|column| column.heading.name == "hand_force");
    let forces = column.map_or(&[][..], |column| column.values());
    let pushed: Vec<f64> = forces.iter().map(|force| force.max(0.0)).collect();
    pushed.into()
}

/// Instruments side by side tick together.
fn one_rate(all: &[Ready]) -> Result<(), Failure> {
    let mut rates = all.iter().map(|ready| ready.compiled.model.rate_hz);
    let first = rates.next();
    match rates.find(|rate| Some(*rate) != first) {
        Some(rate) => Err(Failure::Usage(format!(
            "the runs of an experiment tick together, and one has {} ticks a second, another {rate}",
            first.unwrap_or_default()
        ))),
        None => Ok(()),
    }
}

/// The files that an experiment names.
pub fn files(experiment: &Experiment, places: Places) -> Result<Vec<PathBuf>, Failure> {
    let file = places.file;
    let mut files: Vec<PathBuf> = Vec::new();
    if let (Some(repeated), Some(folder)) = (&experiment.repeated, places.of_recordings()) {
        files.push(folder.join(&repeated.description));
    }
    for instrument in &experiment.instruments {
        if is_file(&instrument.program) {
            let opened = Opened::files(&[beside(file, &instrument.program)])?;
            files.extend(opened.paths().cloned());
        }
    }
    files.extend(device::file(named_device(experiment, file).as_deref()));
    Ok(files)
}

fn is_file(program: &str) -> bool {
    program.ends_with(".whip")
}

/// A file whose place is told from the folder of the experiment.
fn beside(file: Option<&Path>, name: &str) -> PathBuf {
    file.and_then(Path::parent)
        .unwrap_or(Path::new(""))
        .join(name)
}

fn named_device(experiment: &Experiment, file: Option<&Path>) -> Option<OsString> {
    let name = experiment.device.as_ref()?;
    Some(if name.ends_with(".toml") {
        beside(file, name).into_os_string()
    } else {
        name.into()
    })
}

/// The files of an instrument's program: names and texts.
fn program(instrument: &Instrument, file: Option<&Path>) -> Result<Vec<(String, String)>, Failure> {
    let name = &instrument.program;
    if is_file(name) {
        return Ok(Opened::files(&[beside(file, name)])?.sources);
    }
    let all = || INSTRUMENTS.iter().chain(KEYBOARDS);
    let stem = |file: &'static str| file.trim_end_matches(".whip");
    if KEYBOARDS.iter().any(|(file, _)| stem(file) == name) {
        // A keyboard plays several of the others.
        let text = |(file, text): &(&str, &str)| (format!("instruments/{file}"), text.to_string());
        let own = KEYBOARDS.iter().filter(|(file, _)| stem(file) == name);
        return Ok(own.chain(INSTRUMENTS).map(text).collect());
    }
    if let Some((file, text)) = PROGRAMS.iter().find(|(file, _)| stem(file) == name) {
        let path = format!("instruments/experiments/{file}");
        return Ok(vec![(path, text.to_string())]);
    }
    if let Some((file, text)) = all().find(|(file, _)| stem(file) == name) {
        return Ok(vec![(format!("instruments/{file}"), text.to_string())]);
    }
    let all = || all().chain(PROGRAMS);
    let near = nearest(name, all().map(|(file, _)| stem(file)));
    let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    let names: Vec<&str> = all().map(|(file, _)| stem(file)).collect();
    Err(Failure::Usage(format!(
        "there is no bundled program `{name}`{near}; there are {}; a file ends in .whip",
        names.join(", ")
    )))
}

/// Checks and compiles an instrument, for its device.
fn ready(
    experiment: &Experiment,
    instrument: &Instrument,
    file: Option<&Path>,
    sources: &[(String, String)],
    kind: EngineKind,
) -> Result<Ready, Failure> {
    let options = Options {
        sets: instrument.sets.clone(),
        ..Options::default()
    };
    let (map, program) = load::checked(sources, &options, Severity::Warning)?;
    let key = match &instrument.key {
        None => None,
        Some(note) => Some(midi_number(note).ok_or_else(|| {
            Failure::Usage(format!(
                "the key `{note}` is no note, such as C4, F#3 or Bb5"
            ))
        })?),
    };
    let model: Model = load::one_key(&program, instrument.instrument.as_deref(), key)?;
    if model.senses.len() > 1 {
        let why = format!(
            "`{}` has several ports, and an experiment moves one",
            model.name
        );
        return Err(Failure::Usage(why));
    }
    let wanted = named_device(experiment, file);
    let device = load::device(wanted.as_deref(), &map, &program, &model)?;
    let compiled = load::compiled(&map, model, &device, true)?;
    let columns = match &experiment.mover {
        Mover::Motion => session::recorded(&compiled, &device, kind, &[]),
        _ => closed::recorded(&compiled, &device, kind, &[0]),
    };
    Ok(Ready {
        compiled,
        device,
        columns,
    })
}

/// Plays one instrument along a way, and keeps every tick.
fn moved(
    (mover, way): (&Mover, Trajectory),
    ready: Ready,
    kind: EngineKind,
    stop: &'static AtomicBool,
) -> Result<Run, Failure> {
    let (compiled, device) = (&ready.compiled, &ready.device);
    let rate_hz = compiled.model.rate_hz;
    let ticks = way.ticks();
    let recording = Recording::everything(ready.columns).until(Some(stop));
    let progress = Progress::new(ticks, rate_hz);
    let at = |ticks| progress.at(ticks);
    let player = match mover {
        Mover::Motion => {
            let move_to = |tick: usize, places: &mut [f64]| places.fill(way.at(tick));
            let run = session::record(compiled, device, kind, (ticks, move_to), recording, at);
            progress.done();
            return run.map_err(|why| stopped(kind, why));
        }
        Mover::Force => (Player::Force(way), 0.0),
        Mover::Hand(grip) => {
            let grip: Grip = grip.parse().map_err(Failure::Usage)?;
            let hand = grip.hand(compiled.model.turns()).map_err(Failure::Usage)?;
            let start_m = way.at(0);
            (Player::Hand { hand, target: way }, start_m)
        }
    };
    let (player, start_m) = player;
    let movers = vec![closed::PortMover::Loop { player, start_m }];
    let closed = closed::record(compiled, device, kind, (movers, ticks), recording, at);
    progress.done();
    closed
        .map(|closed| closed.run)
        .map_err(|why| stopped(kind, why))
}
