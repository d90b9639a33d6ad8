//! What `run` writes: tables while it runs, figures and pages of what was kept.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::files::{FileError, OutputFile};
use whippen_runtime::plot;
use whippen_runtime::points::Point;
use whippen_runtime::session::{self, Keep, Recorded, Recording, Run};
use whippen_runtime::sound::SoundFile;
use whippen_runtime::struck::StruckNotes;
use whippen_runtime::trace::Form;

use super::super::file_plan::FilePlan;
use super::super::option;
use super::beside;
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// What to write.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "What to write")]
pub struct Outputs {
    /// Trace: a row per tick with ports, force terms, coordinates, states and every `let`, as a
    /// table or as numpy's arrays; or, in a WAV file, what the program lets hear; written while it
    /// runs. May be given twice
    #[arg(long, value_name = "FILE.csv|FILE.npz|FILE.wav", value_hint = ValueHint::FilePath)]
    pub out: Vec<PathBuf>,
    /// Only every N-th row of the trace
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = option::every)]
    pub every: u32,
    /// Only these columns, in this order: titles (x_m) or names of the program (x', phi, jack.out),
    /// or all; for traces, pictures and pages. Pictures and pages draw x' and the values of `let`
    /// only where they are asked for here
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// Points of strings, as columns and lines of their own: `line.u@12%`, `strings[2].u@40mm`, or
    /// the rate there, `line.u'@12%`
    #[arg(long, value_name = "NAME@PLACE,..", value_delimiter = ',')]
    pub points: Vec<String>,
    /// Tables with all digits of a 64-bit float; otherwise as many as tell neighbouring words apart
    #[arg(long)]
    pub exact: bool,
    /// Events: emitted ones, named ones and transitions
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub events: Option<PathBuf>,
    /// What was struck, as a MIDI file with velocities of 14 bits (control change 88), as firmware
    /// sends it; a run of one key plays C4
    #[arg(long, value_name = "FILE.mid", value_hint = ValueHint::FilePath)]
    pub midi_out: Option<PathBuf>,
    /// Picture: forces against time and travel, hammer and states against time
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    pub plot: Vec<PathBuf>,
    /// Page to explore: plots to zoom, force loop, strikes, numbers, the program; one file that
    /// needs no network
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    pub report: Option<PathBuf>,
    /// A measured loop of force over travel below the computed one, in pictures and pages, and how
    /// far the two are apart: a recording as `import` reads it (x_mm,force_gf). Without --motion
    /// the key is pressed slowly over its travel
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath, conflicts_with_all = ["midi", "errors"])]
    pub compare: Option<PathBuf>,
}

impl Outputs {
    /// Adds them to the files of a command.
    pub fn plan(&self, plan: FilePlan) -> FilePlan {
        plan.writes("--out", &self.out, &["csv", "npz", "wav"])
            .writes("--events", &self.events, &["csv"])
            .writes("--midi-out", &self.midi_out, &["mid", "midi"])
            .writes("--plot", &self.plot, &["svg", "png"])
            .writes("--report", &self.report, &["html"])
    }

    /// The file of the trace.
    fn trace(&self) -> Result<Option<&Path>, Failure> {
        self.only_out(false)
    }

    /// The file of the sound.
    pub fn sound(&self) -> Result<Option<&Path>, Failure> {
        self.only_out(true)
    }

    /// The only file of a kind that `--out` names.
    fn only_out(&self, is_sound: bool) -> Result<Option<&Path>, Failure> {
        let is_wav = |path: &&PathBuf| {
            let ending = path.extension().and_then(|ending| ending.to_str());
            ending.is_some_and(|ending| ending.eq_ignore_ascii_case("wav")) == is_sound
        };
        let mut found = self.out.iter().filter(is_wav).map(PathBuf::as_path);
        match (found.next(), found.next()) {
            (Some(_), Some(second)) => Err(Failure::Usage(format!(
                "--out: `{}` is a second file of its kind; one trace and one sound are written",
                second.display()
            ))),
            (first, _) => Ok(first),
        }
    }

    /// How tables are written.
    pub fn form(&self) -> Form {
        Form {
            every: self.every as usize,
            exact: self.exact,
        }
    }

    /// What a run records of the columns there are: tables in files, and in memory what figures and
    /// pages show.
    pub fn recording(
        &self,
        columns: Vec<Recorded>,
        compiled: &Compiled,
        kind: EngineKind,
    ) -> Result<Recording, Failure> {
        let usage = |e: FileError| Failure::Usage(e.to_string());
        let draws = !self.plot.is_empty() || self.report.is_some();
        let keep = if !draws && self.compare.is_none() {
            Keep::Nothing
        } else {
            Keep::Bounded
        };
        if self.compare.is_some() {
            beside::check_columns(compiled, &columns, &self.columns)?;
        }
        let mut recording = Recording::choosing(columns, &self.columns, keep)
            .map_err(|why| Failure::Usage(format!("--columns: {why}")))?
            .with_points(self.chosen_points(compiled, kind)?);
        if let Some(path) = self.sound()? {
            recording = recording.with_sound(SoundFile::create(path, compiled).map_err(usage)?);
        }
        if let Some(path) = self.trace()? {
            let file = OutputFile::create(path).map_err(usage)?;
            recording = recording.with_ticks(file, self.form()).map_err(usage)?;
        }
        if let Some(path) = &self.midi_out {
            check_notes(compiled)?;
            recording = recording.with_notes(path);
        }
        if let Some(path) = &self.events {
            let file = OutputFile::create(path).map_err(usage)?;
            let with_events = recording.with_events(file, compiled, kind, self.form());
            recording = with_events.map_err(usage)?;
        }
        Ok(recording)
    }

    /// The points of strings that are asked for, each once.
    fn chosen_points(&self, compiled: &Compiled, kind: EngineKind) -> Result<Vec<Point>, Failure> {
        let mut points: Vec<Point> = Vec::new();
        for text in &self.points {
            let point = Point::parse(text, compiled, kind)
                .map_err(|why| Failure::Usage(format!("--points: {why}")))?;
            if !points.iter().any(|known| known.heading == point.heading) {
                points.push(point);
            }
        }
        Ok(points)
    }

    /// Draws the pictures of a finished run. Gives what was written and where, tables too.
    pub fn draw(
        &self,
        compiled: &Compiled,
        run: &Run,
    ) -> Result<Vec<(&'static str, &Path)>, Failure> {
        for path in &self.plot {
            plot::save(&session::figure(compiled, run), path)
                .map_err(|e| Failure::Usage(e.to_string()))?;
        }
        let events = self.events.as_deref();
        let tables = [
            ("trace", self.trace()?),
            ("sound", self.sound()?),
            ("events", events),
            ("notes", self.midi_out.as_deref()),
        ];
        let tables = tables
            .into_iter()
            .filter_map(|(what, path)| Some((what, path?)));
        let plots = self.plot.iter().map(|path| ("plot", path.as_path()));
        Ok(tables.chain(plots).collect())
    }

    /// Draws the pictures and says where everything is.
    pub fn finish(&self, compiled: &Compiled, run: &Run) -> Outcome {
        for (what, path) in self.draw(compiled, run)? {
            say!("{what}: {}", path.display());
        }
        Ok(())
    }
}

/// That an instrument strikes notes.
pub fn check_notes(compiled: &Compiled) -> Outcome {
    match StruckNotes::of_instrument(compiled) {
        true => Ok(()),
        false => Err(Failure::Usage(format!(
            "--midi-out: `{}` emits no `note` with a speed, so there is nothing to write",
            compiled.model.name
        ))),
    }
}
