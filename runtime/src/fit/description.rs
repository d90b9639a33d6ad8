//! Recordings of bare columns: a file that says what they are and which stretches count.
//!
//! ```toml
//! file = "key_and_hammer.txt"      # beside this file
//! rate = "2 kHz"
//!
//! [motion]
//! column = 2
//! calibration = "key.csv"
//! rest = "0.88 mm"
//! full = "12.7 mm"
//! dip = "10 mm"
//! lowpass = "200 Hz"
//!
//! [measured.rise_m]                # the title of a run's column
//! column = 1
//! calibration = "hammer.csv"
//! times = "12.8"                   # from where it was measured to where it counts
//! most = "48.2 mm"                 # the sensor reads no more, so nor does what is computed
//!
//! [[stretch]]
//! from = "24.6 s"
//! to = "25.4 s"
//!
//! [[stretch]]
//! from = "27.4 s"
//! to = "28.2 s"
//! held_out = "yes"
//! ```

use std::path::{Path, PathBuf};

use toml::de::DeTable;
use whippen_compiler::units::Dim;

use super::data::{FitColumn, FitData, Fittable};
use crate::fields::{Fields, FileText};
use crate::files::{FileError, InputKind, read_text};
use crate::motion::{self, Layout, MotionOptions, Stops};
use crate::trajectory::Trajectory;

const TOP: [&str; 5] = ["file", "rate", "motion", "measured", "stretch"];
const MOTION: [&str; 6] = ["column", "calibration", "rest", "full", "dip", "lowpass"];
const MEASURED: [&str; 6] = ["column", "calibration", "times", "lowpass", "least", "most"];
const STRETCH: [&str; 3] = ["from", "to", "held_out"];

/// The stretches of a recording: those that are fitted, and those that are held out.
#[derive(Debug, Clone, Default)]
pub struct Stretches {
    /// Fitted.
    pub fitted: Vec<FitData>,
    /// Judged only.
    pub held_out: Vec<FitData>,
}

/// Reads a description and what it describes, for an instrument of one key.
///
/// # Errors
/// What is wrong with it, and in which line; or with a file that it names.
pub fn read(path: &Path, fittable: &Fittable) -> Result<Stretches, FileError> {
    let text = read_text(path, InputKind::DESCRIPTION)?;
    let source = FileText { path, text: &text };
    let table = DeTable::parse(&text).map_err(|e| {
        let line = e.span().map_or(1, |span| source.line(span.start));
        source.error(line, e.message())
    })?;
    let top = Fields::new(source, table.get_ref(), 1, "a recording", &TOP)?;
    if !fittable.model.is_of_key() {
        let what = "bare columns are of one key; write a table with a column for each port";
        return Err(source.error(1, what));
    }
    let whole = Whole::read(&top, fittable)?;
    let stretches = top.tables("stretch", "[[stretch]]", &STRETCH)?;
    if stretches.is_empty() {
        return Err(source.error(1, "a recording has [[stretch]] tables: from and to"));
    }
    let mut out = Stretches::default();
    for fields in &stretches {
        let is_held_out = match fields.find("held_out")?.as_ref().map(|w| w.text.as_str()) {
            None | Some("no") => false,
            Some("yes") => true,
            Some(_) => return Err(fields.error("held_out", "is \"yes\" or \"no\"")),
        };
        let to = if is_held_out {
            &mut out.held_out
        } else {
            &mut out.fitted
        };
        to.push(whole.stretch(path, fields)?);
    }
    Ok(out)
}

/// All of a recording.
struct Whole {
    /// Ticks a second, and where the key is in each.
    tick_rate_hz: f64,
    places: Vec<f64>,
    /// Rows a second of what was measured, with the title of the run's column.
    rate_hz: f64,
    measured: Vec<MeasuredColumn>,
}

/// The title of a run's column, its values, what the sensor reads (SI).
type MeasuredColumn = (String, Vec<f64>, (f64, f64));

impl Whole {
    fn read(top: &Fields, fittable: &Fittable) -> Result<Whole, FileError> {
        let frequency = "2 kHz";
        let rate_hz = top.quantity("rate", Dim::PER_TIME, frequency)?;
        let rate_hz = rate_hz.filter(|rate| (1.0..=1e6).contains(rate) && rate.fract() == 0.0);
        let rate_hz = rate_hz
            .ok_or_else(|| top.error("rate", "is rows a second, such as \"2 kHz\", whole hertz"))?;
        let file = beside(top, &top.text("file", "recording.txt")?.text);
        let motion = top.table("motion", "[motion]", &MOTION)?;
        let motion = motion.ok_or_else(|| top.error("motion", "says where the key was"))?;
        let own = MotionOptions {
            stops: stops(&motion)?,
            turns: fittable.model.turns(),
            ..options(&motion, rate_hz)?
        };
        let own = motion::load(&file, &own, fittable.model.rate_hz)?;
        let mut measured = Vec::new();
        for (title, fields) in top.named_tables("measured", "[measured.title]", &MEASURED)? {
            if !fittable.is_wanted(&title) {
                let what = format!("`{title}` is no column that can be fitted to");
                return Err(top.source.error(fields.line, what));
            }
            // At its own rate nothing is resampled.
            let values = motion::load(&file, &options(&fields, rate_hz)?, rate_hz as u32)?;
            let times = fields
                .quantity("times", Dim::NUMBER, "12.8")?
                .unwrap_or(1.0);
            let values = values
                .positions
                .to_vec()
                .iter()
                .map(|v| v * times)
                .collect();
            let end = |key, other: f64| Ok(fields.any_quantity(key)?.unwrap_or(other));
            let reads = (
                end("least", f64::NEG_INFINITY)?,
                end("most", f64::INFINITY)?,
            );
            measured.push((title, values, reads));
        }
        if measured.is_empty() {
            return Err(top
                .source
                .error(1, "nothing to fit to: add [measured.title] tables"));
        }
        Ok(Whole {
            tick_rate_hz: f64::from(fittable.model.rate_hz),
            places: own.positions.to_vec(),
            rate_hz,
            measured,
        })
    }

    fn stretch(&self, path: &Path, fields: &Fields) -> Result<FitData, FileError> {
        let time = |key: &'static str| {
            let time = fields.quantity(key, Dim::TIME, "1.5 s")?;
            time.ok_or_else(|| fields.error(key, "is a time, such as \"1.5 s\""))
        };
        let (from_s, to_s) = (time("from")?, time("to")?);
        let last_s = self.places.len() as f64 / self.tick_rate_hz;
        if !(0.0 <= from_s && from_s < to_s && to_s <= last_s) {
            let what = format!("a stretch is within 0 s .. {last_s:.3} s, from before to");
            return Err(fields.source.error(fields.line, what));
        }
        // It begins with a row.
        let row = |s: f64| (s * self.rate_hz).round() as usize;
        let start_s = row(from_s) as f64 / self.rate_hz;
        let tick = |s: f64| ((s * self.tick_rate_hz).round() as usize).min(self.places.len());
        let column = |(title, values, reads): &MeasuredColumn| {
            let values =
                values[row(from_s).min(values.len())..row(to_s).min(values.len())].to_vec();
            FitColumn {
                reads: *reads,
                ..FitColumn::new(title.clone(), self.rate_hz, values)
            }
        };
        Ok(FitData {
            name: format!("{} {from_s} s .. {to_s} s", path.display()),
            places: vec![Trajectory::from(
                self.places[tick(start_s)..tick(to_s)].to_vec(),
            )],
            start_s,
            columns: self.measured.iter().map(column).collect(),
            events: Vec::new(),
            weight: 1.0,
            unused: Vec::new(),
        })
    }
}

/// A file that a description names, beside it.
fn beside(fields: &Fields, name: &str) -> PathBuf {
    let folder = fields.source.path.parent();
    folder.map_or_else(|| PathBuf::from(name), |folder| folder.join(name))
}

fn options(fields: &Fields, rate_hz: f64) -> Result<MotionOptions, FileError> {
    let column = fields.count("column")?;
    let column = column.ok_or_else(|| fields.error("column", "is counted from 1"))?;
    let calibration = fields.find("calibration")?;
    Ok(MotionOptions {
        layout: Layout::Raw {
            rate_hz,
            column,
            calibration: calibration.map(|written| beside(fields, &written.text)),
        },
        lowpass_hz: fields.quantity("lowpass", Dim::PER_TIME, "200 Hz")?,
        ..MotionOptions::default()
    })
}

/// What the key reads at its stops.
fn stops(fields: &Fields) -> Result<Option<Stops>, FileError> {
    let length = |key| fields.quantity(key, Dim::LENGTH, "10 mm");
    match (length("rest")?, length("full")?, length("dip")?) {
        (None, None, None) => Ok(None),
        (Some(rest_m), Some(full_m), dip_m) => Ok(Some(Stops {
            rest_m,
            full_m,
            dip_m: dip_m.unwrap_or(10e-3),
        })),
        _ => Err(fields.error("rest", "and `full` belong together, and `dip` to them")),
    }
}
