//! One run as a section: what happened, what it is made of, what its numbers can hold.

use std::fmt::Write;

use serde_json::Value;
use whippen_compiler::lower::{Export, ExportKind};
use whippen_compiler::model::CellKind;
use whippen_compiler::pipeline::Compiled;

use super::chart::chart;
use super::html::{Cell, Row, Table, escape};
use super::strings::strings;
use crate::device::Device;
use crate::engine::EngineKind;
use crate::plot::frame::{heading, moved, shown};
use crate::plot::{Figure, Roles};
use crate::resting;
use crate::session::{self, Run};
use crate::titles::split_title;
use crate::trace::EventRow;

/// So many strikes and so many other events are listed; a table of events has all.
const LISTED_MAX: usize = 5_000;

/// How a run came about: what the run itself does not know.
#[derive(Debug, Clone)]
pub struct Made<'a> {
    /// What ran it.
    pub engine: EngineKind,
    /// Where the motion came from, in sentences.
    pub motion: &'a [String],
    /// Sensor and drive.
    pub device: &'a Device,
    /// Parameters that were set from outside.
    pub settings: &'a [(String, String)],
    /// The program's files: names and texts.
    pub sources: &'a [(String, String)],
}

/// A section of a page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// What links name it by: unlike any other's on the page, small letters, digits and `-` only.
    pub id: String,
    /// Heading.
    pub title: String,
    /// A sentence or more below it.
    pub doc: String,
    /// What there is to know at a glance: a word and a value.
    pub facts: Vec<(String, String)>,
    /// What should worry a reader.
    pub warnings: Vec<String>,
    /// What the scripts draw: the kind (`chart`, `keys`) and its data.
    pub data: Vec<(&'static str, Value)>,
    /// Tables, the first beside the loop.
    pub tables: Vec<Table>,
    /// Texts of the program: names and contents.
    pub sources: Vec<(String, String)>,
}

impl Section {
    /// The section of one run.
    pub fn of_run(compiled: &Compiled, run: &Run, made: &Made) -> Section {
        let model = &compiled.model;
        let facts = [
            outcome(compiled, run),
            made.motion
                .iter()
                .map(|note| ("motion".to_string(), note.clone()))
                .collect(),
            vec![
                ("engine".to_string(), made.engine.to_string()),
                ("device".to_string(), device(made.device)),
            ],
            made.settings
                .iter()
                .map(|(name, value)| ("set".to_string(), format!("{name} = {value}")))
                .collect(),
            run.beside
                .iter()
                .map(|beside| ("measured".to_string(), beside.told.clone()))
                .collect(),
            (made.device.told_converters().into_iter())
                .map(|told| ("converter".to_string(), told))
                .collect(),
            noise(compiled, made.device).into_iter().collect(),
            not_drawn(compiled, run).into_iter().collect(),
        ];
        let told = run.counts.told(session::driven(model));
        Section {
            id: id(&model.name),
            title: model.name.replace('_', " "),
            doc: model.doc.clone(),
            facts: facts.concat(),
            warnings: told
                .iter()
                .map(|(count, what)| format!("{count} of {} ticks {what}", run.counts.ticks))
                .collect(),
            data: std::iter::once(("chart", chart(&figure(compiled, run))))
                .chain(strings(&run.trace).map(|strings| ("strings", strings)))
                .collect(),
            tables: vec![
                events(run, session::marked(&compiled.model)),
                numbers(compiled, run),
            ],
            sources: made.sources.to_vec(),
        }
    }

    /// The section as HTML.
    pub(super) fn write(&self, out: &mut String) {
        let id = escape(&self.id);
        let _ = writeln!(out, "<section id=\"{id}\"><h2>{}</h2>", escape(&self.title));
        if !self.doc.is_empty() {
            let _ = writeln!(out, "<p class=\"doc\">{}</p>", escape(&self.doc));
        }
        out.push_str("<dl class=\"facts\">");
        for (name, value) in &self.facts {
            let _ = write!(
                out,
                "<div><dt>{}</dt><dd>{}</dd></div>",
                escape(name),
                escape(value)
            );
        }
        out.push_str("</dl>\n");
        for warning in &self.warnings {
            let _ = writeln!(out, "<p class=\"warn\">{}</p>", escape(warning));
        }
        for (kind, _) in &self.data {
            let _ = writeln!(out, "<div class=\"plots\" data-kind=\"{kind}\"></div>");
        }
        self.tables
            .iter()
            .for_each(|table| out.push_str(&table.html()));
        for (name, text) in &self.sources {
            let _ = writeln!(
                out,
                "<details class=\"source\"><summary>{}</summary><pre><code>{}</code></pre></details>",
                escape(name),
                escape(text)
            );
        }
        out.push_str("</section>\n");
    }
}

/// A name as a link names it.
pub fn id(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    name.chars().map(plain).collect()
}

fn device(device: &Device) -> String {
    let (low, high, full_scale) = (
        device.sensor().low,
        device.sensor().high,
        device.drive().full_scale,
    );
    let text = if device.turns() {
        let (low, high) = (low.to_degrees(), high.to_degrees());
        format!(
            "{}: sensor {low:.1} to {high:.1} deg, drive ±{} mN·m",
            device.name,
            full_scale * 1e3
        )
    } else {
        format!(
            "{}: sensor {:.3} to {:.3} mm, drive ±{full_scale} N",
            device.name,
            low * 1e3,
            high * 1e3
        )
    };
    text.replace('-', "−")
}

/// Strikes, the greatest force, how deep, how long.
fn outcome(compiled: &Compiled, run: &Run) -> Vec<(String, String)> {
    let trace = &run.trace;
    let ticks = run.counts.ticks;
    let rate_hz = f64::from(trace.rate_hz);
    // The greatest value of an export, with its unit, and when.
    let peak = |wanted: ExportKind, shown: &dyn Fn(&str) -> (String, f64)| {
        let export = compiled.lowered.exports.iter().find(|e| e.kind == wanted)?;
        let suffix = session::suffix(&compiled.model, export);
        let column = trace.column(&session::title(&compiled.model, export))?;
        let (tick, value) = column
            .record
            .points()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(b.0.cmp(&a.0)))?;
        let (unit, factor) = shown(&suffix);
        Some(minus(format!(
            "{:.3} {unit} at {:.4} s",
            value * factor,
            trace.time_s(tick)
        )))
    };
    let mut facts = vec![
        ("strikes".to_string(), run.happenings.strikes.to_string()),
        (
            "played".to_string(),
            format!(
                "{:.2} s, {ticks} ticks at {} Hz",
                ticks as f64 / rate_hz,
                trace.rate_hz
            ),
        ),
    ];
    let force = session::driven(&compiled.model);
    let travel = if compiled.model.turns() || !compiled.model.is_of_key() {
        "furthest"
    } else {
        "deepest"
    };
    let at = peak(ExportKind::Total(0), &shown).map(|at| (format!("greatest {force}"), at));
    let moved = |suffix: &str| {
        let (_, unit, factor) = moved(None, suffix);
        (unit, factor)
    };
    facts.extend(at);
    facts.extend(peak(ExportKind::Sense(0), &moved).map(|at| (travel.to_string(), at)));
    facts
}

/// The figure of a page: that of a plot, with rates and states; or what was chosen.
fn figure<'r>(compiled: &Compiled, run: &'r Run) -> Figure<'r> {
    let roles = session::roles_of_run(compiled, run);
    if run.is_chosen {
        return session::figure(compiled, run);
    }
    let rest = session::titles(compiled, &|kind| match kind {
        ExportKind::Cell(id) => {
            [CellKind::Rate, CellKind::State].contains(&compiled.model.cells[id].kind)
        }
        _ => false,
    });
    let roles = Roles {
        coordinates: [roles.coordinates, rest].concat(),
        machines: [roles.machines, session::sticking_titles(compiled)].concat(),
        ..roles
    };
    Figure {
        measured: run.beside.as_ref().map(|beside| &beside.measured),
        ..Figure::of(&run.trace, &roles)
    }
}

/// What the sensor's noise becomes while nobody plays.
fn noise(compiled: &Compiled, device: &Device) -> Option<(String, String)> {
    let noise = resting::noise(compiled, device).ok().flatten()?;
    Some(("noise".to_string(), noise.told(compiled.model.turns())))
}

/// So many names of what is not drawn are told.
const NAMED_MAX: usize = 6;

/// What a page leaves out unless it is asked for, and how that is done.
fn not_drawn(compiled: &Compiled, run: &Run) -> Option<(String, String)> {
    let is_left_out = |kind: ExportKind| {
        matches!(
            kind,
            ExportKind::Slope(_) | ExportKind::Curvature(_) | ExportKind::Named(_)
        )
    };
    let exports = compiled.lowered.exports.iter();
    let names = exports
        .filter(|export| is_left_out(export.kind))
        .map(|export| &*export.name);
    let mut names: Vec<&str> = names.collect();
    let more = names.len().saturating_sub(NAMED_MAX);
    names.truncate(NAMED_MAX);
    // Without values inside of ticks nothing is there to be asked for.
    if run.is_chosen || names.is_empty() {
        return None;
    }
    let and_more = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    let asked = "`--columns all` draws them too, `--columns force,..` what it names";
    Some((
        "not drawn".to_string(),
        format!("{}{and_more}; {asked}", names.join(", ")),
    ))
}

/// The first strikes, and the first of everything else that happened.
fn events(run: &Run, marked: &str) -> Table {
    let (trace, all) = (&run.trace, &run.happenings);
    let mut titles: Vec<&str> = Vec::new();
    for (title, _) in trace.events.iter().flat_map(|e| &e.args) {
        if !titles.contains(&title.as_str()) {
            titles.push(title);
        }
    }
    let others = all.events - all.strikes;
    let (mut strikes, mut listed) = (0, 0);
    let mut rows = Vec::new();
    for event in &trace.events {
        let strike = event.event == marked;
        let count = if strike { &mut strikes } else { &mut listed };
        *count += 1;
        if *count <= LISTED_MAX {
            rows.push(event_row(event, strike.then_some(strikes), &titles));
        }
    }
    let cut = |count: usize, what: &str| {
        if count > LISTED_MAX {
            format!("Of {count} {what} the first {LISTED_MAX} are listed. ")
        } else {
            String::new()
        }
    };
    let note = cut(all.strikes, "strikes") + &cut(others, "other events");
    let argument = |title: &&str| {
        let (name, unit) = split_title(title);
        heading(
            name,
            &unit.map_or(String::new(), |unit| unit.dim.unit_without_angle()),
        )
    };
    let heads = ["#", "time (s)", "event"]
        .map(String::from)
        .into_iter()
        .chain(titles.iter().map(argument))
        .collect();
    Table {
        title: "Strikes and events".into(),
        note: note.trim_end().into(),
        heads,
        rows,
    }
}

fn event_row(event: &EventRow, strike: Option<usize>, titles: &[&str]) -> Row {
    let number = strike.map_or(Cell::text(""), |n| Cell::number(n as f64, n.to_string()));
    let argument = |title: &&str| match event.args.iter().find(|(name, _)| name == title) {
        Some((_, value)) => Cell::number(*value, minus(format!("{value:.4}"))),
        None => Cell::text(""),
    };
    let fixed = [
        number,
        Cell::number(event.t_s, format!("{:.5}", event.t_s)),
        Cell::text(&event.event),
    ];
    let cells = fixed
        .into_iter()
        .chain(titles.iter().map(argument))
        .collect();
    Row {
        cells,
        at_s: Some(event.t_s),
        minor: strike.is_none(),
        ..Row::default()
    }
}

/// What every value can be, how it is kept, and what it was in this run.
fn numbers(compiled: &Compiled, run: &Run) -> Table {
    let heads = [
        "value",
        "unit",
        "proven low",
        "proven high",
        "format",
        "LSB",
        "error of one tick",
        "seen low",
        "seen high",
        "margin",
    ];
    let rows = compiled.lowered.exports.iter().filter(|e| e.dim.is_some());
    let note = "Proven range and format of every value; the largest error one tick adds; what this run used of the range (margin: how \
                many times the largest value seen fits)."
        .to_string();
    Table {
        title: "Numbers".into(),
        note,
        heads: heads.map(String::from).to_vec(),
        rows: rows
            .map(|export| number_row(compiled, run, export))
            .collect(),
    }
}

fn number_row(compiled: &Compiled, run: &Run, export: &Export) -> Row {
    let suffix = session::suffix(&compiled.model, export);
    let (unit, factor) = shown(&suffix);
    let value = |v: f64, digits| Cell::number(v * factor, minus(significant(v * factor, digits)));
    let seen = run
        .trace
        .column(&session::title(&compiled.model, export))
        .and_then(|column| column.record.extent());
    let blank = || Cell::text("");
    let (low, high, margin) = match seen {
        None => (blank(), blank(), blank()),
        Some((low, high)) => {
            let times = export.range.magnitude() / low.abs().max(high.abs());
            let margin = if times.is_finite() {
                Cell::number(times, format!("{}×", significant(times, 3)))
            } else {
                blank()
            };
            (value(low, 5), value(high, 5), margin)
        }
    };
    let (name, unit, format) = (
        Cell::text(&export.name),
        Cell::text(unit),
        Cell::text(export.format()),
    );
    let (lowest, highest) = (value(export.range.low, 5), value(export.range.high, 5));
    let cells = vec![
        name,
        unit,
        lowest,
        highest,
        format,
        value(export.lsb, 3),
        value(export.error, 2),
        low,
        high,
        margin,
    ];
    Row {
        cells,
        ..Row::default()
    }
}

/// A number with so many significant digits, plain where that is short.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let scientific = format!("{value:.*e}", digits - 1);
    let power: i32 = scientific
        .split_once('e')
        .and_then(|(_, p)| p.parse().ok())
        .unwrap_or(0);
    if !(-4..=6).contains(&power) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - power).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// With a proper minus sign.
pub fn minus(text: String) -> String {
    text.replace('-', "−")
}
