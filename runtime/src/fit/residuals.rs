//! How far a run is from what was measured, row by row.
//!
//! A column's residuals are in units of its spread, a time's in milliseconds, an argument's in
//! twentieths of its typical size. Every column of a recording, and its events, have the same say,
//! however many rows they have; a recording's weight multiplies it.

use std::collections::BTreeMap;
use std::ops::Range;

use whippen_compiler::pipeline::Compiled;

use super::data::{FitColumn, FitData, FitEvent};
use crate::device::Device;
use crate::engine::EngineKind;
use crate::session::{self, Keep, Recording, choose, recorded};
use crate::titles::split_title;
use crate::trace::{EventRow, Trace};

/// A time that is so far off (s) counts as much as a column that is off by its spread.
const TIME_S: f64 = 1e-3;

/// An argument that is off by this part of its size does.
const ARGUMENT: f64 = 0.05;

/// What an event that did not happen, or one too many, counts.
const MISSED: f64 = 10.0;

/// What the rows of a list of residuals are.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualPart {
    /// The recording, by number.
    pub recording: usize,
    /// The run's column, or `events`.
    pub title: String,
    /// Its rows.
    pub rows: Range<usize>,
    /// What a residual of 1 is, without its weight (SI); none for events.
    pub unit: Option<f64>,
    /// What residuals are multiplied with.
    pub weight: f64,
}

/// The parts of the residuals of recordings, in their order.
pub fn parts(all: &[FitData]) -> Vec<ResidualPart> {
    let mut sizes = Vec::new();
    for (recording, data) in all.iter().enumerate() {
        for column in &data.columns {
            let rows = column.values.len();
            sizes.push((recording, column.title.clone(), rows, Some(column.spread)));
        }
        let events = rows_of_events(&data.events);
        if events > 0 {
            sizes.push((recording, "events".to_string(), events, None));
        }
    }
    let total: usize = sizes.iter().map(|size| size.2).sum();
    let mean = total as f64 / sizes.len().max(1) as f64;
    let mut start = 0;
    let part = |(recording, title, rows, unit): (usize, String, usize, Option<f64>)| {
        let weight = (all[recording].weight * mean / rows as f64).sqrt();
        start += rows;
        ResidualPart {
            recording,
            title,
            rows: start - rows..start,
            unit,
            weight,
        }
    };
    sizes.into_iter().map(part).collect()
}

/// Plays a recording's motion; gives what a run keeps of the columns that were measured.
///
/// # Errors
/// The engine cannot be built.
pub fn play(
    compiled: &Compiled,
    device: &Device,
    engine: EngineKind,
    data: &FitData,
) -> Result<Trace, String> {
    let ticks = data.places.iter().map(|place| place.ticks()).max();
    let move_to = |tick: usize, places: &mut [f64]| {
        for (place, trajectory) in places.iter_mut().zip(&data.places) {
            *place = trajectory.at(tick);
        }
    };
    let titles: Vec<String> = data.columns.iter().map(|c| c.title.clone()).collect();
    let columns = choose(&recorded(compiled, device, engine, &[]), &titles)?;
    let recording = Recording::new(columns, Keep::Everything).starting(data.start_s);
    let motion = (ticks.unwrap_or(0), move_to);
    let run = session::record(compiled, device, engine, motion, recording, |_| {});
    run.map(|run| run.trace).map_err(|why| why.to_string())
}

/// The residuals of one recording, with the weights of its parts; none where a value is no number.
pub fn of_recording(trace: &Trace, data: &FitData, parts: &[&ResidualPart]) -> Option<Vec<f64>> {
    let mut all = Vec::new();
    for part in parts {
        let column = data
            .columns
            .iter()
            .find(|column| column.title == part.title);
        let own = match column {
            Some(column) => of_column(trace, column)?,
            None => of_events(&trace.events, &data.events),
        };
        all.extend(own.into_iter().map(|residual| residual * part.weight));
    }
    all.iter().all(|r| r.is_finite()).then_some(all)
}

/// A run's values at the times of a column's rows.
pub fn at_rows(trace: &Trace, column: &FitColumn) -> Option<Vec<f64>> {
    let values = trace.column(&column.title)?.values();
    let ticks_a_row = f64::from(trace.rate_hz) / column.rate_hz;
    let last = values.len().checked_sub(1)?;
    let at = |row: usize| {
        let tick = row as f64 * ticks_a_row;
        let (before, part) = ((tick as usize).min(last), tick.fract());
        let after = (before + 1).min(last);
        values[before] * (1.0 - part) + values[after] * part
    };
    Some((0..column.values.len()).map(at).collect())
}

fn of_column(trace: &Trace, column: &FitColumn) -> Option<Vec<f64>> {
    let computed = at_rows(trace, column)?;
    let pairs = computed.iter().zip(&column.values);
    Some(pairs.map(|(c, m)| (c - m) / column.spread).collect())
}

/// By name of an event, those that were measured.
fn by_name(events: &[FitEvent]) -> BTreeMap<&str, Vec<&FitEvent>> {
    let mut names: BTreeMap<&str, Vec<&FitEvent>> = BTreeMap::new();
    for event in events {
        names.entry(&event.name).or_default().push(event);
    }
    names
}

/// A row for the number of each name, one for each time, one for each argument.
fn rows_of_events(events: &[FitEvent]) -> usize {
    by_name(events).len() + events.iter().map(|e| 1 + e.args.len()).sum::<usize>()
}

/// Events of one name are taken in their order.
fn of_events(computed: &[EventRow], measured: &[FitEvent]) -> Vec<f64> {
    let mut all = Vec::new();
    for (name, measured) in by_name(measured) {
        let own: Vec<&EventRow> = computed.iter().filter(|e| e.event == name).collect();
        all.push(MISSED * (own.len() as f64 - measured.len() as f64));
        for (number, event) in measured.iter().enumerate() {
            let own = own.get(number);
            all.push(own.map_or(MISSED, |own| (own.t_s - event.t_s) / TIME_S));
            for (title, value) in &event.args {
                let is_it = |arg: &&(String, f64)| split_title(&arg.0).0 == title;
                let found = own.and_then(|own| own.args.iter().find(is_it));
                let size = ARGUMENT * value.abs().max(f64::MIN_POSITIVE);
                all.push(found.map_or(MISSED, |found| (found.1 - value) / size));
            }
        }
    }
    all
}
