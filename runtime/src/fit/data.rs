//! What parameters are fitted to: recordings of a motion beside what was measured with it, and
//! tables of what happened.
//!
//! A recording is a table as `run --out` writes one: time, what each port sensed, and any columns
//! of a run under their titles, in any unit of the same kind. A table of events is one of
//! `run --events`.

use std::collections::BTreeMap;
use std::path::Path;

use whippen_compiler::model::Model;
use whippen_compiler::units::Unit;

use super::strokes::StrokeRule;
use crate::files::{FileError, InputKind};
use crate::motion::table::Rows;
use crate::motion::{self, MotionOptions};
use crate::session::Recorded;
use crate::titles::split_title;
use crate::trace::Heading;
use crate::trajectory::Trajectory;

/// One recording.
#[derive(Debug, Clone)]
pub struct FitData {
    /// Its file's name.
    pub name: String,
    /// What each port senses.
    pub places: Vec<Trajectory>,
    /// When the first tick is (s).
    pub start_s: f64,
    /// What was measured.
    pub columns: Vec<FitColumn>,
    /// What happened, in the order of time.
    pub events: Vec<FitEvent>,
    /// How much it counts beside others.
    pub weight: f64,
    /// How its strokes are judged.
    pub strokes: Option<StrokeRule>,
    /// Titles that are not of a run and were not used.
    pub unused: Vec<String>,
}

/// A column that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct FitColumn {
    /// The title of the run's column.
    pub title: String,
    /// Rows a second; the first is at the first tick.
    pub rate_hz: f64,
    /// Its values (SI).
    pub values: Vec<f64>,
    /// How far they are from their mean (root of the mean square); never 0.
    pub spread: f64,
    /// What the sensor can read (SI): what is computed is held at its ends too.
    pub reads: (f64, f64),
}

impl FitColumn {
    /// A column of a sensor that reads everything.
    pub(super) fn new(title: String, rate_hz: f64, values: Vec<f64>) -> FitColumn {
        FitColumn {
            title,
            rate_hz,
            spread: spread(&values),
            values,
            reads: (f64::NEG_INFINITY, f64::INFINITY),
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct FitEvent {
    /// When (s).
    pub t_s: f64,
    /// Its name.
    pub name: String,
    /// Its arguments that were measured: title and value (SI).
    pub args: Vec<(String, f64)>,
}

/// What may be fitted to: the columns of a run, other names for them, and which are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Fittable<'a> {
    /// The instrument.
    pub model: &'a Model,
    /// The columns of its runs.
    pub columns: &'a [Recorded],
    /// A title of a recording, and the title of a run that it stands for.
    pub renamed: &'a [(String, String)],
    /// The titles of a run that count; all that are measured if there is none.
    pub wanted: &'a [String],
    /// Corner of a low-pass filter without delay for the motion (Hz).
    pub lowpass_hz: Option<f64>,
}

impl Fittable<'_> {
    /// Reads a recording, and a table of what happened in it.
    ///
    /// # Errors
    /// A file cannot be read, or there is nothing in it to be fitted to.
    pub fn read(&self, path: &Path, events: Option<&Path>) -> Result<FitData, FileError> {
        let (places, start_s) = self.motion(path)?;
        let (mut found, mut unused) = (Vec::new(), Vec::new());
        let columns = motion::load_columns(path, |titles| {
            (found, unused) = self.sort(titles);
            Ok(found.iter().map(|(at, _, unit)| (*at, *unit)).collect())
        })?;
        let titles = found.into_iter().map(|(_, title, _)| title);
        let pairs = titles.zip(columns.values);
        let columns = pairs.map(|(title, values)| FitColumn::new(title, columns.rate_hz, values));
        let data = FitData {
            name: path.display().to_string(),
            places,
            start_s,
            columns: columns.collect(),
            events: events.map(read_events).transpose()?.unwrap_or_default(),
            weight: 1.0,
            strokes: None,
            unused,
        };
        if data.columns.is_empty() && events.is_none() {
            return Err(FileError::new(path, self.nothing_measured(&data.unused)).at_line(1));
        }
        Ok(data)
    }

    fn motion(&self, path: &Path) -> Result<(Vec<Trajectory>, f64), FileError> {
        let model = self.model;
        if model.is_of_key() {
            let options = MotionOptions {
                turns: model.turns(),
                lowpass_hz: self.lowpass_hz,
                ..MotionOptions::default()
            };
            let read = motion::load(path, &options, model.rate_hz)?;
            return Ok((vec![read.positions], read.start_s));
        }
        let ports = motion::wanted_ports(model);
        let read = motion::load_ports(path, &ports, self.lowpass_hz, model.rate_hz)?;
        Ok((read.places, read.start_s))
    }

    /// The titles that are columns of a run: where they stand, the run's title, the unit; and those
    /// that are not.
    fn sort(&self, titles: &[String]) -> (Vec<(usize, String, Unit)>, Vec<String>) {
        let (mut found, mut unused) = (Vec::new(), Vec::new());
        for (at, title) in titles.iter().enumerate() {
            match self.column_of(title) {
                Some((own, unit)) => {
                    let counts = self.wanted.is_empty() || self.wanted.contains(&own);
                    if counts {
                        found.push((at, own, unit));
                    }
                }
                None if self.is_known(title) => {}
                None => unused.push(title.clone()),
            }
        }
        (found, unused)
    }

    /// The title of the run's column that a title stands for.
    fn column_of(&self, title: &str) -> Option<(String, Unit)> {
        let (name, unit) = split_title(title);
        let renamed = self.renamed.iter().find(|(from, _)| from == title);
        let unit = unit.unwrap_or(Unit::ONE);
        let fits = |own: &str| {
            let (own_name, own_unit) = split_title(own);
            let own_unit = own_unit.unwrap_or(Unit::ONE);
            let same_name = match renamed {
                Some((_, to)) => own == to,
                None => own_name == name,
            };
            same_name && own_unit.dim == unit.dim
        };
        let own = self.titles().find(|own| fits(own))?;
        Some((own, unit))
    }

    /// The columns of a run that can be fitted to: numbers that do not follow from the motion
    /// alone.
    fn titles(&self) -> impl Iterator<Item = String> {
        let of_motion = |name: &str| {
            let senses = &self.model.senses;
            senses.iter().any(|s| s.name == name.trim_end_matches('\''))
        };
        let all = self.columns.iter().map(|column| &column.heading);
        let all = all.filter(move |h| h.labels.is_empty() && !of_motion(&h.name));
        all.map(Heading::title)
    }

    /// Whether a title is of time, of the motion, or of a state: it is known, and not fitted to.
    fn is_known(&self, title: &str) -> bool {
        let (name, _) = split_title(title);
        let is_sensed = self.model.senses.iter().any(|sense| sense.name == name);
        let columns = || self.columns.iter().map(|column| column.heading.title());
        name == "t" || is_sensed || columns().any(|own| own == title)
    }

    fn nothing_measured(&self, unused: &[String]) -> String {
        let known: Vec<String> = self.titles().collect();
        let here = match (self.wanted, unused) {
            ([], []) => "there is only a motion".to_string(),
            ([], some) => format!("`{}` are no columns of a run", some.join("`, `")),
            (wanted, _) => format!("none of the columns `{}` is here", wanted.join("`, `")),
        };
        format!(
            "nothing to fit to: {here}; there could be {}, and --as f_n={} gives a title of yours that name",
            known.join(", "),
            known.first().map_or("force_n", String::as_str)
        )
    }

    /// Whether a title is that of a column which can be fitted to.
    pub(super) fn is_wanted(&self, title: &str) -> bool {
        self.titles().any(|own| own == title)
    }

    /// That all columns which are wanted are known.
    ///
    /// # Errors
    /// One is not, in words.
    pub fn check(&self) -> Result<(), String> {
        let known: Vec<String> = self.titles().collect();
        let asked = self.renamed.iter().map(|(_, to)| to).chain(self.wanted);
        match asked.into_iter().find(|title| !known.contains(title)) {
            Some(title) => Err(format!(
                "`{title}` is no column that can be fitted to; there are {}",
                known.join(", ")
            )),
            None => Ok(()),
        }
    }
}

/// Gives columns of one title one spread, that of all recordings that are fitted; what is held out
/// is judged by it too.
pub fn share_spreads(fitted: &mut [FitData], held_out: &mut [FitData]) {
    let mut sums: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    for column in fitted.iter().flat_map(|data| &data.columns) {
        let rows = column.values.len() as f64;
        let sum = sums.entry(column.title.clone()).or_default();
        *sum = (sum.0 + rows * column.spread * column.spread, sum.1 + rows);
    }
    for column in fitted
        .iter_mut()
        .chain(held_out)
        .flat_map(|data| &mut data.columns)
    {
        if let Some((square, rows)) = sums.get(&column.title) {
            column.spread = (square / rows).sqrt();
        }
    }
}

/// Root of the mean square of what values are from their mean; 1 where all are the same.
fn spread(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    if square > 0.0 { square.sqrt() } else { 1.0 }
}

/// A table of events: `t_s,event` and titles of arguments.
fn read_events(path: &Path) -> Result<Vec<FitEvent>, FileError> {
    let mut rows = Rows::open(path, InputKind::RECORDING)?;
    let titles = rows.titles().to_vec();
    let at = |wanted: &str| {
        let found = titles.iter().position(|title| title == wanted);
        found.ok_or_else(|| {
            let message = format!(
                "a table of events has the titles `t_s` and `event`; here are `{}`",
                titles.join("`, `")
            );
            FileError::new(path, message).at_line(1)
        })
    };
    let (time, event) = (at("t_s")?, at("event")?);
    let is_argument = |i: &usize| ![time, event].contains(i) && titles[*i] != "key";
    let arguments: Vec<usize> = (0..titles.len()).filter(is_argument).collect();
    let mut events: Vec<FitEvent> = Vec::new();
    while let Some(line) = rows.next_row()? {
        let t_s = rows.number(time)?;
        if events.last().is_some_and(|before| before.t_s > t_s) {
            return Err(FileError::new(path, "events are in the order of time").at_line(line));
        }
        let mut args = Vec::new();
        for &argument in &arguments {
            if !rows.text(argument).is_empty() {
                let (name, unit) = split_title(&titles[argument]);
                let value = unit.unwrap_or(Unit::ONE).to_si(rows.number(argument)?);
                args.push((name.to_string(), value));
            }
        }
        let name = rows.text(event).to_string();
        events.push(FitEvent { t_s, name, args });
    }
    Ok(events)
}
