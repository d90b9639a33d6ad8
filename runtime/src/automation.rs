//! Automation: live values that change while a run plays, from a table or from the notes of a
//! MIDI file.
//!
//! ```text
//!   t_s,volume,strings[0].pitch_hz --.
//!                                    +--> changes by time --> Engine::set_live before their tick
//!   notes --strings they are on -----'
//! ```
//!
//! A value holds until the next one; a program that wants it smooth declares `glide`. Values are in
//! SI, and outside of what is declared they are refused, as `--set` refuses them.
//!
//! Not here: values that hold for the whole run, which are settings; notes that strike keys
//! (`keyboard`).

mod notes;

use std::path::Path;

use whippen_compiler::model::{Live, Model};
use whippen_compiler::rate::Rate;
use whippen_compiler::units::{Dim, Unit, shown, shown_range, unit_suffix};

use crate::files::{FileError, InputKind};
use crate::motion::table::Rows;
use crate::titles::{join_title, split_title};
pub use notes::{Fingered, finger};

/// Of a pitch.
const FREQUENCY: Dim = Dim::NUMBER.div(Dim::TIME);

/// The most changes a run may have.
const CHANGES_MAX: usize = 1 << 24;

/// A live value changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// When (s).
    pub t_s: f64,
    /// Which: an index into the model's live values.
    pub live: usize,
    /// To what (SI; a bool is 0 or 1).
    pub value: f64,
}

/// Changes of live values, by time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Automation {
    changes: Vec<Change>,
}

impl Automation {
    /// Of changes in any order; those of one time stay in theirs.
    pub fn new(mut changes: Vec<Change>) -> Automation {
        changes.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        Automation { changes }
    }

    /// Reads a table: a column of time, and one for each live value, whose title is its name with
    /// its unit (`volume`, `pitch_hz`, `strings[0].pitch_hz`). An empty cell changes nothing.
    ///
    /// # Errors
    /// A title is no live value of the model, a cell is no number or outside of the declared range,
    /// or time goes back.
    pub fn load(path: &Path, model: &Model) -> Result<Automation, FileError> {
        let mut rows = Rows::open(path, InputKind::RECORDING)?;
        let at_titles = |message| FileError::new(path, message).at_line(1);
        let columns = columns(rows.titles(), model).map_err(at_titles)?;
        let mut changes: Vec<Change> = Vec::new();
        let mut before_s = f64::NEG_INFINITY;
        while let Some(line) = rows.next_row()? {
            let at = |column: usize, message: String| {
                (FileError::new(path, message).at_line(line)).at_column(column + 1)
            };
            let t_s = columns.time_unit.to_si(rows.number(columns.time)?);
            if t_s < before_s {
                let message = format!("time goes back: {t_s} s follows {before_s} s");
                return Err(at(columns.time, message));
            }
            before_s = t_s;
            for of in &columns.lives {
                if rows.text(of.column).is_empty() {
                    continue;
                }
                let value = of.unit.to_si(rows.number(of.column)?);
                check(&model.lives[of.live], value).map_err(|why| at(of.column, why))?;
                let live = of.live;
                changes.push(Change { t_s, live, value });
            }
            if changes.len() > CHANGES_MAX {
                let message = format!("has more than {CHANGES_MAX} values, the most there may be");
                return Err(FileError::new(path, message));
            }
        }
        Ok(Automation { changes })
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Automation) -> Automation {
        Automation::new([self.changes, other.changes].concat())
    }

    /// How many changes there are.
    pub fn len(&self) -> usize {
        self.changes.len()
    }

    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// The changes with the ticks before which they are made, where the first tick is at `start_s`:
    /// the first that is not before its time.
    pub(crate) fn by_tick(
        &self,
        start_s: f64,
        rate: Rate,
    ) -> impl Iterator<Item = (usize, Change)> + use<> {
        // A time that is written as that of a tick is not moved by the last bit of a quotient.
        let tick = move |t_s: f64| ((t_s - start_s) * f64::from(rate) - 1e-6).ceil().max(0.0);
        let changes = self.changes.clone().into_iter();
        changes.map(move |change| (tick(change.t_s) as usize, change))
    }
}

/// Where a table has what.
struct LiveColumns {
    time: usize,
    time_unit: Unit,
    lives: Vec<LiveColumn>,
}

/// The column of a live value.
struct LiveColumn {
    column: usize,
    live: usize,
    unit: Unit,
}

fn columns(titles: &[String], model: &Model) -> Result<LiveColumns, String> {
    let is_time = |title: &String| split_title(title).1.filter(|unit| unit.dim == Dim::TIME);
    let mut times = titles.iter().enumerate();
    let time = times.find_map(|(at, title)| Some((at, is_time(title)?)));
    let Some((time, time_unit)) = time else {
        return Err("a title must name the time with its unit, such as `t_s`".to_string());
    };
    let mut lives = Vec::new();
    for (column, title) in titles.iter().enumerate().filter(|(at, _)| *at != time) {
        let (name, unit) = split_title(title);
        let fits = |live: &Live| {
            if live.dim.is_none_or(Dim::is_number) && *title == live.name {
                return Some(Unit::ONE);
            }
            unit.filter(|unit| name == live.name && Some(unit.dim) == live.dim)
        };
        let mut all = model.lives.iter().enumerate();
        let found = all.find_map(|(live, of)| Some((live, fits(of)?)));
        let (live, unit) = found.ok_or_else(|| unknown(title, model))?;
        lives.push(LiveColumn { column, live, unit });
    }
    match lives.is_empty() {
        true => Err(format!(
            "there is no column but the time; {}",
            titles_of(model)
        )),
        false => Ok(LiveColumns {
            time,
            time_unit,
            lives,
        }),
    }
}

fn unknown(title: &str, model: &Model) -> String {
    format!(
        "`{title}` is no live parameter of `{}` with its unit; {}",
        model.name,
        titles_of(model)
    )
}

/// The titles that a table for a model may have.
fn titles_of(model: &Model) -> String {
    let title = |live: &Live| match live.dim {
        Some(FREQUENCY) => join_title(&live.name, "hz"),
        Some(dim) if !dim.is_number() => {
            join_title(&live.name, &unit_suffix(&dim.unit_without_angle()))
        }
        _ => live.name.clone(),
    };
    let titles: Vec<String> = model.lives.iter().map(title).collect();
    match titles.is_empty() {
        true => "it has none".to_string(),
        false => format!("titles may be `t_s`, `{}`", titles.join("`, `")),
    }
}

/// Whether a live value may be this.
fn check(live: &Live, value: f64) -> Result<(), String> {
    let Some(dim) = live.dim else {
        let is_bool = value == 0.0 || value == 1.0;
        return is_bool
            .then_some(())
            .ok_or_else(|| format!("`{}` is 0 or 1", live.name));
    };
    if (live.range.low..=live.range.high).contains(&value) {
        return Ok(());
    }
    let (value, range) = (shown(value, dim), shown_range(live.range, dim));
    Err(format!("`{}` is in {range}, not {value}", live.name))
}

#[cfg(test)]
mod tests;
