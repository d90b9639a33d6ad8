//! A stretch of a recording: the motion that a player repeats, and what was measured with it.

use std::path::Path;

use whippen_compiler::model::Model;
use whippen_compiler::rate::Rate;

use super::columns::{MEASURED, Part};
use super::file::Repeated;
use crate::files::FileError;
use crate::fit::data::{FitColumn, Fittable};
use crate::fit::description;
use crate::record::Record;
use crate::session::Recorded;
use crate::titles::split_title;
use crate::trace::{Column, Heading, Trace};
use crate::trajectory::Trajectory;

/// A stretch of a recording, at the rate of an instrument's ticks.
#[derive(Debug, Clone)]
pub struct Stretch {
    /// Where the key is at each tick.
    pub places: Trajectory,
    rate_hz: Rate,
    measured: Vec<FitColumn>,
}

impl Stretch {
    /// Reads one, whose description lies in a folder; what was measured has titles of the columns
    /// of an instrument.
    ///
    /// # Errors
    /// What is wrong with the description, or with a file that it names.
    pub fn read(
        repeated: &Repeated,
        folder: &Path,
        (model, columns): (&Model, &[Recorded]),
    ) -> Result<Stretch, FileError> {
        let fittable = Fittable {
            model,
            columns,
            renamed: &[],
            wanted: &[],
            lowpass_hz: None,
        };
        let path = folder.join(&repeated.description);
        let data = description::read_between(&path, &fittable, repeated.between_s)?;
        let places = data.places.into_iter().next();
        Ok(Stretch {
            places: places.unwrap_or_else(|| Vec::new().into()),
            rate_hz: model.rate_hz,
            measured: data.columns,
        })
    }

    /// What was measured, as names of an experiment speak of it: `measured.phi`.
    pub fn part(&self) -> Part {
        Part {
            name: MEASURED.to_string(),
            headings: self.measured.iter().map(heading).collect(),
            ..Part::default()
        }
    }

    /// What was measured, straight from row to row.
    pub fn trace(&self) -> Trace {
        let column = |measured: &FitColumn| {
            let mut record = Record::whole();
            (0..self.places.ticks()).for_each(|tick| record.push(self.at(measured, tick)));
            Column {
                heading: heading(measured),
                record,
            }
        };
        Trace {
            rate_hz: self.rate_hz,
            columns: self.measured.iter().map(column).collect(),
            ..Trace::default()
        }
    }

    fn at(&self, measured: &FitColumn, tick: usize) -> f64 {
        let place = tick as f64 / f64::from(self.rate_hz) * measured.rate_hz;
        let last = measured.values.len().saturating_sub(1);
        let row = |row: usize| measured.values.get(row.min(last)).copied().unwrap_or(0.0);
        let (before, after) = (row(place as usize), row(place as usize + 1));
        before + place.fract() * (after - before)
    }
}

fn heading(measured: &FitColumn) -> Heading {
    let (name, unit) = split_title(&measured.title);
    let suffix = measured.title.strip_prefix(name).filter(|_| unit.is_some());
    Heading {
        name: name.to_string(),
        unit: suffix.unwrap_or("").trim_start_matches('_').to_string(),
        ..Heading::default()
    }
}
