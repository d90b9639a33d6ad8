//! The recorder: what a run leaves in tables, in a trace and in numbers, tick by tick.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use whippen_compiler::lower::{ExportKind, LoweredEventKind};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;

use super::between::{self, Between};
use super::columns::{Recorded, Signal, arguments, choose, event_heading, marked};
use super::happenings::Happenings;
use crate::automation::{Automation, Change};
use crate::device::{Device, Drive};
use crate::engine::{Engine, EngineKind, Happened};
use crate::files::{FileError, OutputFile};
use crate::points::Point;
use crate::record::Record;
use crate::sound::SoundFile;
use crate::spectrogram::Spectrogram;
use crate::sticking::FrictionTally;
use crate::struck::StruckNotes;
use crate::trace::{Column, EventRow, EventTable, Form, Heading, Trace, TraceFile};

/// How much of a run is kept in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// What a summary lists ([`Emitted`](super::Emitted)).
    Nothing,
    /// Columns as an oscilloscope keeps them, the first events: what figures and pages show.
    Bounded,
    /// Every tick and every event.
    Everything,
}

impl Keep {
    /// So many strikes and so many other events are kept, the first ones. A figure marks strikes.
    fn events_max(self) -> (usize, usize) {
        match self {
            Keep::Nothing => (0, 0),
            Keep::Bounded => (20_000, 5_000),
            Keep::Everything => (usize::MAX, usize::MAX),
        }
    }
}

/// The key (MIDI number, C4) of the notes of a run, which has one key.
const KEY: u8 = 60;

/// What is recorded of a run.
pub struct Recording {
    /// The columns.
    columns: Vec<Recorded>,
    is_chosen: bool,
    /// When the first tick is (s).
    start_s: f64,
    keep: Keep,
    ticks: Option<(PathBuf, TraceFile<OutputFile>)>,
    events: Option<(PathBuf, EventTable<OutputFile>)>,
    sound: Option<SoundFile>,
    notes: Option<PathBuf>,
    stop: Option<&'static AtomicBool>,
    points: Vec<Point>,
    automation: Automation,
    steps: Option<Range<u64>>,
}

impl Recording {
    /// Columns in memory as far as they are to be kept.
    pub fn new(columns: Vec<Recorded>, keep: Keep) -> Recording {
        Recording {
            columns,
            is_chosen: false,
            start_s: 0.0,
            keep,
            ticks: None,
            events: None,
            sound: None,
            notes: None,
            stop: None,
            points: Vec::new(),
            automation: Automation::default(),
            steps: None,
        }
    }

    /// Those of the columns that are [named](choose), which figures then draw; all if none is.
    ///
    /// # Errors
    /// A name is unknown; all that are known, in words.
    pub fn choosing(
        columns: Vec<Recorded>,
        names: &[String],
        keep: Keep,
    ) -> Result<Recording, String> {
        if names.is_empty() {
            return Ok(Recording::new(columns, keep));
        }
        let chosen = choose(&columns, names)?;
        Ok(Recording {
            is_chosen: true,
            ..Recording::new(chosen, keep)
        })
    }

    /// Whether its columns were chosen by name.
    pub(super) fn is_chosen(&self) -> bool {
        self.is_chosen
    }

    /// The same with points of strings, each a column behind the others.
    #[must_use]
    pub fn with_points(mut self, points: Vec<Point>) -> Recording {
        self.columns.extend(between::columns(&points));
        Recording { points, ..self }
    }

    /// The titles of their columns.
    pub(super) fn point_titles(&self) -> Vec<String> {
        let headings = self.points.iter().map(|point| &point.heading);
        headings.map(Heading::title).collect()
    }

    /// The same, which ends with what there is once this is true.
    #[must_use]
    pub fn until(self, stop: Option<&'static AtomicBool>) -> Recording {
        Recording { stop, ..self }
    }

    /// The same, in which live values change.
    #[must_use]
    pub fn changing(self, automation: Automation) -> Recording {
        Recording { automation, ..self }
    }

    /// The changes of live values, with the ticks before which they are made.
    pub(super) fn changes(&self, rate: Rate) -> impl Iterator<Item = (usize, Change)> + use<> {
        self.automation.by_tick(self.start_s, rate)
    }

    /// What ends it early.
    pub(super) fn stop(&self) -> Option<&'static AtomicBool> {
        self.stop
    }

    /// The same with the cycles of every tick of a board, and every instruction of some ticks (the
    /// first is 0). Other engines have none.
    #[must_use]
    pub fn with_steps(self, ticks: Range<u64>) -> Recording {
        let steps = Some(ticks);
        Recording { steps, ..self }
    }

    /// The ticks whose instructions are kept.
    pub(super) fn steps(&self) -> Option<Range<u64>> {
        self.steps.clone()
    }

    /// Every tick of columns.
    pub fn everything(columns: Vec<Recorded>) -> Recording {
        Recording::new(columns, Keep::Everything)
    }

    /// The same from a time on (s).
    #[must_use]
    pub fn starting(self, start_s: f64) -> Recording {
        Recording { start_s, ..self }
    }

    /// The same with a table of ticks in a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn with_ticks(mut self, file: OutputFile, form: Form) -> Result<Recording, FileError> {
        let path = file.path().to_path_buf();
        let headings = self.columns.iter().map(|column| &column.heading);
        let table = TraceFile::new(&path, file, headings, form);
        let table = table.map_err(|e| FileError::not_written(&path, &e))?;
        self.ticks = Some((path, table));
        Ok(self)
    }

    /// The same with what is heard in a file.
    #[must_use]
    pub fn with_sound(self, file: SoundFile) -> Recording {
        Recording {
            sound: Some(file),
            ..self
        }
    }

    /// The same with what is struck in a MIDI file.
    #[must_use]
    pub fn with_notes(self, path: &Path) -> Recording {
        Recording {
            notes: Some(path.to_path_buf()),
            ..self
        }
    }

    /// The same with a table of events in a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn with_events(
        mut self,
        file: OutputFile,
        compiled: &Compiled,
        kind: EngineKind,
        form: Form,
    ) -> Result<Recording, FileError> {
        let path = file.path().to_path_buf();
        let table = EventTable::new(file, &arguments(compiled, kind), false, form);
        let table = table.map_err(|e| FileError::not_written(&path, &e))?;
        self.events = Some((path, table));
        Ok(self)
    }
}

/// Records a run.
pub(super) struct Recorder<'c> {
    compiled: &'c Compiled,
    /// Of the driven ports.
    drives: Vec<Drive>,
    sources: Vec<Signal>,
    keep: Keep,
    ticks: Option<(PathBuf, TraceFile<OutputFile>)>,
    events: Option<(PathBuf, EventTable<OutputFile>)>,
    sound: Option<SoundFile>,
    notes: Option<(PathBuf, StruckNotes)>,
    /// Columns that are channels of the sound, each with its spectrogram in the trace.
    heard: Vec<usize>,
    trace: Trace,
    happenings: Happenings,
    between: Between<'c>,
    /// The event that is a strike.
    marked: &'c str,
    row: Vec<f64>,
    /// When the last tick was (s).
    end_s: f64,
}

impl<'c> Recorder<'c> {
    pub(super) fn new(
        compiled: &'c Compiled,
        device: &Device,
        recording: Recording,
        (ticks, observes): (usize, bool),
    ) -> Recorder<'c> {
        let draws = recording.keep == Keep::Bounded;
        let wanted = (recording.points, draws, observes);
        let between = Between::new(compiled, device, wanted, ticks);
        let sources = recording.columns.iter().map(|c| c.source).collect();
        let mut trace = Trace {
            rate_hz: compiled.model.rate_hz,
            start_s: recording.start_s,
            ..Trace::default()
        };
        let mut heard = Vec::new();
        if recording.keep != Keep::Nothing {
            let columns = recording.columns.iter().enumerate();
            for (index, column) in columns.filter(|(_, c)| is_heard(compiled, c.source)) {
                heard.push(index);
                let name = &column.heading.name;
                let spectrogram = Spectrogram::new(name, compiled.model.rate_hz);
                trace.spectrograms.push(spectrogram);
            }
            let column = |c: Recorded| Column {
                record: record(compiled, recording.keep, &c.heading, c.source),
                heading: c.heading,
            };
            trace.columns = recording.columns.into_iter().map(column).collect();
        }
        Recorder {
            compiled,
            drives: device.drives_of(&compiled.model),
            sources,
            keep: recording.keep,
            ticks: recording.ticks,
            events: recording.events,
            sound: recording.sound,
            notes: recording.notes.map(|path| (path, StruckNotes::default())),
            heard,
            trace,
            happenings: Happenings::default(),
            between,
            marked: marked(&compiled.model),
            row: Vec::new(),
            end_s: 0.0,
        }
    }

    /// Whether there is a row of a tick.
    fn has_row(&self, tick: usize) -> bool {
        let wants = |table: &(PathBuf, TraceFile<OutputFile>)| table.1.wants(tick);
        self.keep != Keep::Nothing || self.ticks.as_ref().is_some_and(wants)
    }

    /// Looks at what a tick will find.
    pub(super) fn before(&mut self, engine: &Engine, tick: usize) -> Result<(), String> {
        let has_row = self.has_row(tick);
        self.between.before(engine, tick, has_row)
    }

    /// What a tick leaves behind.
    pub(super) fn tick(
        &mut self,
        engine: &mut Engine,
        tick: usize,
        drive: &[i16],
        body: &[f64],
    ) -> Result<(), FileError> {
        let t_s = self.trace.time_s(tick);
        self.end_s = t_s;
        self.between.after(engine, tick);
        if self.has_row(tick) {
            self.fill_row(engine, drive, body);
            for (column, value) in self.trace.columns.iter_mut().zip(&self.row) {
                column.record.push(*value);
            }
            for (spectrogram, column) in self.trace.spectrograms.iter_mut().zip(&self.heard) {
                spectrogram.push(self.row[*column]);
            }
        }
        if let Some((path, table)) = &mut self.ticks {
            let written = table.row(tick, t_s, &self.row);
            written.map_err(|e| FileError::not_written(path, &e))?;
        }
        if let Some(sound) = &mut self.sound {
            sound.tick(self.compiled, engine)?;
        }
        for happened in engine.drain() {
            self.event(t_s, happened)?;
        }
        Ok(())
    }

    fn fill_row(&mut self, engine: &Engine, drive: &[i16], body: &[f64]) {
        let exports = &self.compiled.lowered.exports;
        let value = |source: &Signal| match *source {
            Signal::Drive(number) => self.drives[number].force(drive[number]),
            Signal::Export(index) => engine.value(0, index, &exports[index]),
            Signal::Body(index) => body[index],
            Signal::Friction(number, signal) => self.between.friction(number, signal),
            Signal::Point(index) => self.between.point(index),
        };
        self.row.clear();
        self.row.extend(self.sources.iter().map(value));
    }

    fn event(&mut self, t_s: f64, happened: Happened) -> Result<(), FileError> {
        let kind = &self.compiled.lowered.events[happened.event].kind;
        let (event, titles) = event_heading(self.compiled, happened.event);
        let row = EventRow {
            t_s,
            key: happened.key,
            event,
            args: titles.into_iter().zip(happened.args).collect(),
        };
        if let Some((path, table)) = &mut self.events {
            let written = table.row(&row, None);
            written.map_err(|e| FileError::not_written(path, &e))?;
        }
        let strike = row.event == self.marked;
        self.happenings.events += 1;
        self.happenings.strikes += usize::from(strike);
        if matches!(kind, LoweredEventKind::Emission(_)) {
            self.happenings.add_emission(&row);
            if let Some((_, struck)) = &mut self.notes {
                let args: Vec<f64> = row.args.iter().map(|(_, value)| *value).collect();
                struck.event(t_s, KEY, &row.event, &args);
            }
        }
        let strikes = self.happenings.strikes;
        let others = self.happenings.events - strikes;
        let (strikes_max, others_max) = self.keep.events_max();
        if (strike && strikes <= strikes_max) || (!strike && others <= others_max) {
            self.trace.events.push(row);
        }
        Ok(())
    }

    /// Whether it is listened to.
    pub(super) fn listens(&self) -> bool {
        self.sound.is_some()
    }

    /// Ends the tables, which then have their names.
    pub(super) fn finish(
        mut self,
        engine: &mut Engine,
    ) -> Result<(Trace, Happenings, Vec<FrictionTally>), FileError> {
        if let Some(mut sound) = self.sound {
            sound.end(engine)?;
            self.happenings.clipped_samples = sound.finish()?;
        }
        if let Some((path, struck)) = self.notes {
            struck.write(&path, self.end_s)?;
        }
        if let Some((path, table)) = self.ticks {
            let file = table.into_inner();
            file.map_err(|e| FileError::not_written(&path, &e))?
                .finish()?;
        }
        if let Some((path, table)) = self.events {
            let file = table.into_inner();
            file.map_err(|e| FileError::not_written(&path, &e))?
                .finish()?;
        }
        let spectrograms = self.trace.spectrograms.iter_mut();
        spectrograms.for_each(Spectrogram::finish);
        let (vibrations, frictions) = self.between.finish();
        self.trace.vibrations = vibrations;
        Ok((self.trace, self.happenings, frictions))
    }
}

/// Whether a column is a channel of the sound.
fn is_heard(compiled: &Compiled, source: Signal) -> bool {
    match source {
        Signal::Export(index) => {
            matches!(compiled.lowered.exports[index].kind, ExportKind::Channel(_))
        }
        _ => false,
    }
}

/// How a column is kept. The loop of force over travel is drawn of the first ticks, one by one.
fn record(compiled: &Compiled, keep: Keep, heading: &Heading, source: Signal) -> Record {
    let kind = match source {
        Signal::Export(index) => Some(compiled.lowered.exports[index].kind),
        _ => None,
    };
    let in_loop = matches!(
        kind,
        Some(ExportKind::Sense(0) | ExportKind::Total(0) | ExportKind::Force(0))
    );
    match keep {
        Keep::Bounded if !heading.labels.is_empty() => Record::bounded_states(),
        Keep::Bounded if in_loop => Record::bounded().with_head(),
        Keep::Bounded => Record::bounded(),
        _ => Record::whole(),
    }
}
