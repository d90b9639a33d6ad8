//! What a page draws of a run, as JSON with packed numbers.
//!
//! ```text
//!   { "rate_hz", "start", "ticks", "columns": [ { name, unit, factor, within, t, v } ], "panels": [ { title, unit, columns } ],
//!     "machines": [ { name, states, t, s } ], "travel", "total", "marks": [[seconds, label]],
//!     "measured": null or { press, back }, each { x, y } }
//! ```
//!
//! `t` are the ticks of the knots, each as the difference to the one before it, in seven bits a
//! byte, the lowest first (LEB128); `v`, `x` and `y` are 32-bit floats, `s` one byte each; all in
//! base64.
//! The other side is `report/data.js`.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::knots::{Knots, Truth, knots};
use crate::measured_loop::{MeasuredLoop, Point};
use crate::plot::decimate::{Change, Run, changes, runs};
use crate::plot::frame::{felt, moved, shown};
use crate::plot::layout::by_unit;
use crate::plot::{Figure, Machine, Series};
use crate::rate;

/// So many changes of a state are kept one by one; beyond them short visits are kept and others may
/// be lost.
const CHANGES_MAX: usize = 16_384;

/// The JSON of a figure.
pub fn chart(figure: &Figure) -> Value {
    let mut columns = Columns::default();
    let mut panels = Vec::new();
    let travel = figure.travel.as_ref().map(|series| {
        let (title, unit, factor) = moved(figure.port, series.unit);
        let at = columns.add(series, (unit.clone(), factor));
        panels.push(panel(&title, &unit, &[at]));
        at
    });
    let mut forces: Vec<usize> = figure
        .forces
        .iter()
        .map(|series| columns.add(series, shown(series.unit)))
        .collect();
    let total = figure
        .total
        .as_ref()
        .map(|series| columns.add(series, shown(series.unit)));
    forces.extend(total);
    if let Some(first) = figure.forces.first().or(figure.total.as_ref()) {
        let title = match (first.unit, figure.port) {
            (unit, Some(port)) => felt(Some(port), unit),
            ("n_m", None) => "torque".to_string(),
            (_, None) => "force".to_string(),
        };
        panels.push(panel(&title, &shown(first.unit).0, &forces));
    }
    for group in by_unit(&figure.coordinates) {
        let members: Vec<usize> = group
            .iter()
            .map(|series| columns.add(series, shown(series.unit)))
            .collect();
        let names: Vec<&str> = group.iter().map(|series| series.name).collect();
        panels.push(panel(&names.join(", "), &shown(group[0].unit).0, &members));
    }
    let machines: Vec<Value> = figure.machines.iter().map(machine).collect();
    let marks: Vec<Value> = figure
        .marks
        .iter()
        .map(|mark| json!([mark.t_s, mark.label]))
        .collect();
    json!({
        "rate_hz": rate::number(figure.rate_hz), "start": figure.start_s, "ticks": figure.ticks(), "columns": columns.list, "panels": panels, "machines": machines,
        "travel": travel, "total": total, "mark": figure.mark_name, "marks": marks,
        "measured": figure.measured.map(measured),
    })
}

/// A measured loop, in SI.
fn measured(of: &MeasuredLoop) -> Value {
    let branch = |points: &[Point]| {
        let (x, y) = (points.iter().map(|p| p.0), points.iter().map(|p| p.1));
        json!({ "x": packed(x), "y": packed(y) })
    };
    json!({ "press": branch(&of.press), "back": branch(&of.back) })
}

/// Numbers as 32-bit floats in base64.
fn packed(numbers: impl Iterator<Item = f64>) -> String {
    let bytes: Vec<u8> = numbers.flat_map(|v| (v as f32).to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

fn panel(title: &str, unit: &str, columns: &[usize]) -> Value {
    json!({ "title": title, "unit": unit, "columns": columns })
}

/// The columns so far; panels refer to them by index.
#[derive(Default)]
struct Columns {
    list: Vec<Value>,
}

impl Columns {
    fn add(&mut self, series: &Series, (unit, factor): (String, f64)) -> usize {
        let Knots { kept, truth } = knots(series.record);
        let ticks = kept.iter().map(|k| k.0);
        let values = packed(kept.iter().map(|k| k.1));
        let (within, every) = match truth {
            Truth::Within(tolerance) => (Some(tolerance), None),
            Truth::Extremes(every) => (None, Some(every)),
        };
        self.list.push(json!({
            "name": series.name, "unit": unit, "factor": factor, "within": within, "every": every,
            "t": STANDARD.encode(differences(ticks)), "v": values,
        }));
        self.list.len() - 1
    }
}

/// A machine as the ticks at which its state changes.
fn machine(machine: &Machine) -> Value {
    let (ticks, states) = (machine.record.ticks(), machine.states.len());
    let all = changes(machine.record.points(), states);
    let changes: Vec<(usize, usize)> = if all.len() > CHANGES_MAX {
        let every = ticks.div_ceil(CHANGES_MAX);
        let visible = runs(&all, (ticks, states), |tick| tick as f64 / every as f64);
        let change = |run: &Run| (run.0 as usize * every, run.2);
        visible.iter().map(change).collect()
    } else {
        let change = |(tick, state): &Change| (*tick, state.unwrap_or_default());
        all.iter().map(change).collect()
    };
    let states: Vec<u8> = changes.iter().map(|c| c.1.min(255) as u8).collect();
    json!({
        "name": machine.name, "states": machine.states,
        "t": STANDARD.encode(differences(changes.iter().map(|c| c.0))), "s": STANDARD.encode(states),
    })
}

/// Rising numbers as differences in LEB128.
pub fn differences(numbers: impl Iterator<Item = usize>) -> Vec<u8> {
    let (mut bytes, mut before) = (Vec::new(), 0);
    for number in numbers {
        let mut rest = number - before;
        before = number;
        while rest >= 0x80 {
            bytes.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    bytes
}
