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
//! unseen = "1.2 mm"                # what the sensor does not show of the first way,
//! unseen_over = "0.4 mm"           # lost over this way; the dip stays
//! lowpass = "200 Hz"
//!
//! [measured.rise_m]                # the title of a run's column
//! column = 1
//! calibration = "hammer.csv"
//! times = "12.8"                   # from where it was measured to where it counts
//! most = "48.2 mm"                 # the sensor reads no more, so nor does what is computed
//!
//! [strokes]                        # speeds of strokes are compared like for like
//! title = "rise_m"                 # of which column
//! rows = 15                        # its greatest slope over so many
//! times = "1"                      # from a slope to a speed
//! copies = 20                      # of the motion, each with
//! noise = "30 um"                  # so much noise of a row
//! scale = "0.003"                  # and so much of another scale
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
use whippen_compiler::rate::Rate;
use whippen_compiler::units::Dim;

use super::data::{FitColumn, FitData, Fittable};
use super::strokes::StrokeRule;
use crate::fields::{Fields, FileText};
use crate::files::{FileError, InputKind, read_text};
use crate::motion::{self, Disturbance, Layout, MotionOptions, Stops, Unseen};
use crate::trajectory::Trajectory;

const TOP: [&str; 6] = ["file", "rate", "motion", "measured", "strokes", "stretch"];
const MOTION: [&str; 8] = [
    "column",
    "calibration",
    "rest",
    "full",
    "dip",
    "unseen",
    "unseen_over",
    "lowpass",
];
const MEASURED: [&str; 6] = ["column", "calibration", "times", "lowpass", "least", "most"];
const STROKES: [&str; 6] = ["title", "rows", "times", "copies", "noise", "scale"];
const STRETCH: [&str; 3] = ["from", "to", "held_out"];

/// The most copies of a motion.
const COPIES_MAX: usize = 1000;

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
    opened(path, fittable, |top| stretches(path, top, fittable))
}

/// Reads the stretch between two times (s) of what a description describes, whatever stretches it
/// has itself, without strokes to be judged.
///
/// # Errors
/// As [`read`]; the recording has no such times.
pub fn read_between(
    path: &Path,
    fittable: &Fittable,
    (from_s, to_s): (f64, f64),
) -> Result<FitData, FileError> {
    opened(path, fittable, |top| {
        let whole = Whole::read(top, fittable, false)?;
        let stretch = whole.stretch(path, (from_s, to_s));
        stretch.map_err(|what| top.source.error(1, what))
    })
}

/// Opens a description, for an instrument of one key.
fn opened<T>(
    path: &Path,
    fittable: &Fittable,
    then: impl FnOnce(&Fields) -> Result<T, FileError>,
) -> Result<T, FileError> {
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
    then(&top)
}

/// The stretches that the description has.
fn stretches(path: &Path, top: &Fields, fittable: &Fittable) -> Result<Stretches, FileError> {
    let whole = Whole::read(top, fittable, true)?;
    let stretches = top.tables("stretch", "[[stretch]]", &STRETCH)?;
    if stretches.is_empty() {
        let what = "a recording has [[stretch]] tables: from and to";
        return Err(top.source.error(1, what));
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
        let time = |key: &'static str| {
            let time = fields.quantity(key, Dim::TIME, "1.5 s")?;
            time.ok_or_else(|| fields.error(key, "is a time, such as \"1.5 s\""))
        };
        let stretch = whole.stretch(path, (time("from")?, time("to")?));
        to.push(stretch.map_err(|what| fields.source.error(fields.line, what))?);
    }
    Ok(out)
}

/// All of a recording.
struct Whole {
    /// Ticks a second, and where the key is in each.
    tick_rate_hz: f64,
    places: Trajectory,
    /// Rows a second of what was measured, with the title of the run's column.
    rate_hz: f64,
    measured: Vec<MeasuredColumn>,
    /// How strokes are judged, and the places of the key in each copy of the motion.
    strokes: Option<(StrokeRule, Vec<Trajectory>)>,
}

/// The title of a run's column, its values, what the sensor reads (SI).
type MeasuredColumn = (String, Vec<f64>, (f64, f64));

impl Whole {
    fn read(top: &Fields, fittable: &Fittable, with_strokes: bool) -> Result<Whole, FileError> {
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
            unseen: unseen(&motion)?,
            turns: fittable.model.turns(),
            ..options(&motion, rate_hz)?
        };
        let tick_rate_hz = fittable.model.rate_hz;
        let load = |disturbance: Option<Disturbance>| {
            let own = MotionOptions {
                disturbance,
                ..own.clone()
            };
            Ok(motion::load(&file, &own, tick_rate_hz)?.positions)
        };
        let measured = measured(top, &file, rate_hz, fittable)?;
        if measured.is_empty() {
            return Err(top
                .source
                .error(1, "nothing to fit to: add [measured.title] tables"));
        }
        let strokes = strokes(top, &measured)?.filter(|_| with_strokes);
        let strokes = strokes.map(|(strokes, copies)| {
            let copies: Result<_, FileError> = copies.into_iter().map(|d| load(Some(d))).collect();
            Ok::<_, FileError>((strokes, copies?))
        });
        Ok(Whole {
            tick_rate_hz: f64::from(tick_rate_hz),
            places: load(None)?,
            strokes: strokes.transpose()?,
            rate_hz,
            measured,
        })
    }

    /// A stretch of it, or in words why there is none.
    fn stretch(&self, path: &Path, (from_s, to_s): (f64, f64)) -> Result<FitData, String> {
        let last_s = self.places.ticks() as f64 / self.tick_rate_hz;
        if !(0.0 <= from_s && from_s < to_s && to_s <= last_s) {
            return Err(format!(
                "a stretch is within 0 s .. {last_s:.3} s, from before to"
            ));
        }
        // It begins with a row.
        let row = |s: f64| (s * self.rate_hz).round() as usize;
        let start_s = row(from_s) as f64 / self.rate_hz;
        let tick = |s: f64| ((s * self.tick_rate_hz).round() as usize).min(self.places.ticks());
        let ticks = tick(start_s)..tick(to_s);
        let cut = |places: &Trajectory| -> Trajectory {
            Trajectory::from(ticks.clone().map(|at| places.at(at)).collect::<Vec<f64>>())
        };
        let strokes = self.strokes.as_ref().map(|(strokes, copies)| StrokeRule {
            copies: copies.iter().map(cut).collect(),
            ..strokes.clone()
        });
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
            places: vec![cut(&self.places)],
            start_s,
            columns: self.measured.iter().map(column).collect(),
            events: Vec::new(),
            weight: 1.0,
            strokes,
            unused: Vec::new(),
        })
    }
}

/// What was measured.
fn measured(
    top: &Fields,
    file: &Path,
    rate_hz: f64,
    fittable: &Fittable,
) -> Result<Vec<MeasuredColumn>, FileError> {
    let mut measured = Vec::new();
    for (title, fields) in top.named_tables("measured", "[measured.title]", &MEASURED)? {
        if !fittable.is_wanted(&title) {
            let what = format!("`{title}` is no column that can be fitted to");
            return Err(top.source.error(fields.line, what));
        }
        // At its own rate nothing is resampled.
        let values = motion::load(
            file,
            &options(&fields, rate_hz)?,
            Rate::whole(rate_hz as u32),
        )?;
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
    Ok(measured)
}

/// How strokes are judged, and what disturbs the copies of their motion.
fn strokes(
    top: &Fields,
    measured: &[MeasuredColumn],
) -> Result<Option<(StrokeRule, Vec<Disturbance>)>, FileError> {
    let Some(fields) = top.table("strokes", "[strokes]", &STROKES)? else {
        return Ok(None);
    };
    let title = fields.text("title", measured[0].0.as_str())?.text;
    if !measured.iter().any(|column| column.0 == title) {
        return Err(fields.error("title", "is the title of a [measured] table"));
    }
    let rows = fields
        .count("rows")?
        .filter(|rows| (2..=1000).contains(rows));
    let rows = rows.ok_or_else(|| fields.error("rows", "is from 2 to 1000"))?;
    let copies = fields.count("copies")?.unwrap_or(1);
    if copies > COPIES_MAX {
        return Err(fields.error("copies", &format!("are at most {COPIES_MAX}")));
    }
    let noise_m = fields
        .quantity("noise", Dim::LENGTH, "30 um")?
        .unwrap_or(0.0);
    let scale = fields
        .quantity("scale", Dim::NUMBER, "0.003")?
        .unwrap_or(0.0);
    let disturbance = |seed| Disturbance {
        seed,
        noise_m,
        scale,
    };
    let strokes = StrokeRule {
        title,
        rows,
        times: fields.any_quantity("times")?.unwrap_or(1.0),
        copies: Vec::new(),
    };
    Ok(Some((
        strokes,
        (1..=copies as u64).map(disturbance).collect(),
    )))
}

/// What the sensor does not show near rest.
fn unseen(fields: &Fields) -> Result<Option<Unseen>, FileError> {
    let length = |key| fields.quantity(key, Dim::LENGTH, "0.4 mm");
    match (length("unseen")?, length("unseen_over")?) {
        (None, None) => Ok(None),
        (Some(way_m), Some(over_m)) if way_m >= 0.0 && over_m > 0.0 => {
            Ok(Some(Unseen { way_m, over_m }))
        }
        _ => Err(fields.error("unseen", "and `unseen_over` belong together, above 0 mm")),
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
