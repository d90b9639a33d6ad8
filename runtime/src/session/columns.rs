//! The columns of a run: which values there are, what they are called, which are wanted.

use whippen_compiler::lower::{Export, ExportKind, LoweredEventKind};
use whippen_compiler::model::{CellId, CellKind, EmissionId, Model};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::{Dim, unit_suffix};

use super::Run;
use crate::device::Device;
use crate::engine::EngineKind;
use crate::plot::Roles;
use crate::sticking::{self, FrictionSignal};
use crate::titles::{identifier, join_title};
use crate::trace::{Argument, Column, Heading, Trace};

/// Where the values of a column come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// The force that a drive was told to give (its number among the driven ports).
    Drive(usize),
    /// A value of the program (index of the export).
    Export(usize),
    /// What is observed of the body that moves (its index there).
    Body(usize),
    /// What a friction does (its number among those of the program).
    Friction(usize, FrictionSignal),
    /// A chosen point of a string (its index among them).
    Point(usize),
}

/// A column that a run can have.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What it is called.
    pub heading: Heading,
    /// Where its values come from.
    pub source: Signal,
}

/// The columns of a run on an engine: the drives, then senses with their derivatives, the sum of
/// forces, forces, `let`s, coordinates, rates, states, what frictions do, and what is observed of
/// the body. An engine without values inside of ticks has the drives alone. A title that occurs
/// again gets a number.
pub fn recorded(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    body: &[Heading],
) -> Vec<Recorded> {
    let model = &compiled.model;
    let words = kind != EngineKind::Ideal;
    let scales = device.scales().of(model);
    let drive = |(number, port): (usize, usize)| {
        let heading = Heading {
            name: model.name_of_driven("drive", port),
            unit: unit_suffix(&model.dim_of_driven(port).unit()),
            step: Some(scales[port].drive_lsb),
            ..Heading::default()
        };
        (heading, Signal::Drive(number))
    };
    let drives = model.drives();
    let mut columns: Vec<(Heading, Signal)> = drives.into_iter().enumerate().map(drive).collect();
    let exports = compiled.lowered.exports.iter().enumerate();
    let shown = exports.filter(|(_, e)| kind.board().is_none() && has_column(model, e));
    columns.extend(shown.map(|(index, export)| {
        let heading = Heading {
            name: export.name.clone(),
            unit: suffix(model, export),
            labels: labels(model, export),
            step: words.then_some(export.lsb),
        };
        (heading, Signal::Export(index))
    }));
    let frictions = sticking::headings(compiled, kind).into_iter();
    columns.extend(frictions.map(|(heading, n, signal)| (heading, Signal::Friction(n, signal))));
    let body = body.iter().cloned().enumerate();
    columns.extend(body.map(|(index, heading)| (heading, Signal::Body(index))));
    let mut named: Vec<Recorded> = Vec::new();
    for (mut heading, source) in columns {
        let name = heading.name.clone();
        let taken = |title: &str| named.iter().any(|r| r.heading.title() == title);
        let mut number = 1;
        while taken(&heading.title()) {
            number += 1;
            heading.name = format!("{name}_{number}");
        }
        named.push(Recorded { heading, source });
    }
    named
}

/// What stands for all columns.
pub const ALL: &str = "all";

/// The columns that are named, in that order: by title (`x_m`) or by name (`x`, which may be
/// several), or [`ALL`].
///
/// # Errors
/// A name is unknown; all that are known, in words.
pub fn choose(columns: &[Recorded], names: &[String]) -> Result<Vec<Recorded>, String> {
    let mut chosen: Vec<Recorded> = Vec::new();
    for name in names {
        let is_named = |r: &&Recorded| {
            let heading = &r.heading;
            let names = [
                heading.title(),
                heading.name.clone(),
                identifier(&heading.name),
            ];
            name == ALL || names.contains(name)
        };
        let before = chosen.len();
        for column in columns.iter().filter(is_named) {
            if !chosen.contains(column) {
                chosen.push(column.clone());
            }
        }
        if chosen.len() == before && !chosen.iter().any(|c| is_named(&c)) {
            let known: Vec<String> = columns.iter().map(|c| c.heading.title()).collect();
            return Err(format!(
                "there is no column `{name}`; there are {}",
                known.join(", ")
            ));
        }
    }
    Ok(chosen)
}

/// The event that a figure marks: `note`, or else the first that the program emits with an
/// argument, or else the first that it emits.
pub fn marked(model: &Model) -> &str {
    let all = || model.emissions.iter();
    let note = all().find(|e| e.name == "note");
    let telling = || all().find(|e| !e.args.is_empty());
    let found = note.or_else(telling).or_else(|| all().next());
    found.map_or("note", |e| &e.name)
}

/// Which columns of a run's trace play which part in a figure.
pub fn roles(compiled: &Compiled) -> Roles {
    let model = &compiled.model;
    let coordinate = |kind| match kind {
        ExportKind::Cell(id) => model.cells[id].kind == CellKind::Coordinate,
        _ => false,
    };
    let first = |wanted: ExportKind| {
        titles(compiled, &|kind| kind == wanted)
            .into_iter()
            .next()
            .unwrap_or_default()
    };
    // The first port that is driven has panels of its own, with the forces that act on it; the
    // others follow, by unit.
    let main = model.drives().first().copied().unwrap_or(0);
    let is_first = |force: u32| model.forces[force as usize].port == main;
    let senses = titles(
        compiled,
        &|kind| matches!(kind, ExportKind::Sense(s) if s as usize != main),
    );
    let others = titles(compiled, &|kind| match kind {
        ExportKind::Force(force) => !is_first(force),
        ExportKind::Total(drive) => drive > 0,
        _ => false,
    });
    let coordinates = titles(compiled, &coordinate);
    let heard = titles(compiled, &|kind| matches!(kind, ExportKind::Channel(_)));
    // Where nothing is felt there is no panel of zeros.
    let total = (!model.forces.is_empty()).then(|| first(ExportKind::Total(0)));
    Roles {
        title: model.name.replace('_', " "),
        is_of_key: model.is_of_key(),
        travel: first(ExportKind::Sense(main as u32)),
        forces: titles(
            compiled,
            &|kind| matches!(kind, ExportKind::Force(f) if is_first(f)),
        ),
        total: total.unwrap_or_default(),
        coordinates: [senses, others, coordinates, heard].concat(),
        machines: titles(compiled, &|kind| matches!(kind, ExportKind::Machine(_))),
        mark: marked(model).to_string(),
    }
}

/// The titles of the columns that say when frictions stick, for which a picture is too coarse.
pub fn sticking_titles(compiled: &Compiled) -> Vec<String> {
    let all = sticking::headings(compiled, EngineKind::Jit).into_iter();
    let states = all.filter(|(.., signal)| *signal == FrictionSignal::State);
    states.map(|(heading, ..)| heading.title()).collect()
}

/// The same with the points of strings that were chosen.
pub fn roles_of_run(compiled: &Compiled, run: &Run) -> Roles {
    let mut roles = match run.is_chosen {
        true => roles_of_all(compiled, &run.trace),
        false => roles(compiled),
    };
    let points = run
        .points
        .iter()
        .filter(|title| !roles.coordinates.contains(title));
    let points: Vec<String> = points.cloned().collect();
    roles.coordinates.extend(points);
    roles
}

/// The same where all columns of a trace are drawn, because they were chosen.
pub fn roles_of_all(compiled: &Compiled, trace: &Trace) -> Roles {
    let roles = roles(compiled);
    let has_place = |title: &String| {
        [&roles.travel, &roles.total].contains(&title) || roles.forces.contains(title)
    };
    let (machines, numbers): (Vec<&Column>, Vec<&Column>) = trace
        .columns
        .iter()
        .partition(|c| !c.heading.labels.is_empty());
    let coordinates = numbers.iter().map(|c| c.title());
    Roles {
        coordinates: coordinates.filter(|title| !has_place(title)).collect(),
        machines: machines.iter().map(|c| c.title()).collect(),
        ..roles
    }
}

/// The titles of the columns of exports of some kinds, in the order of the exports.
pub fn titles(compiled: &Compiled, wanted: &dyn Fn(ExportKind) -> bool) -> Vec<String> {
    let exports = compiled.lowered.exports.iter();
    exports
        .filter(|e| wanted(e.kind))
        .map(|e| title(&compiled.model, e))
        .collect()
}

/// The title of the column of an export.
pub fn title(model: &Model, export: &Export) -> String {
    identifier(&join_title(&export.name, &suffix(model, export)))
}

/// What the device of an instrument drives.
pub fn driven(model: &Model) -> &'static str {
    if model.turns() { "torque" } else { "force" }
}

/// Everything has a column but what a pulse counts.
fn has_column(model: &Model, export: &Export) -> bool {
    match export.kind {
        ExportKind::Cell(id) => model.cells[id].kind != CellKind::Pulse,
        _ => true,
    }
}

/// The unit of an export as a column title writes it.
pub fn suffix(model: &Model, export: &Export) -> String {
    unit_suffix(&unit(model, export))
}

/// The unit of an export as a program writes it (`rad/s`); an angle is known by its sense or its
/// body.
pub fn unit(model: &Model, export: &Export) -> String {
    let Some(dim) = export.dim else {
        return String::new();
    };
    match export.kind {
        ExportKind::Sense(s) if model.port_turns(s as usize) => "rad".into(),
        ExportKind::Slope(s) | ExportKind::Curvature(s) if model.port_turns(s as usize) => {
            dim.unit()
        }
        ExportKind::Cell(id) => unit_of_cell(model, id),
        _ => dim.unit_without_angle(),
    }
}

/// The unit of what is remembered as a program writes it.
pub fn unit_of_cell(model: &Model, id: CellId) -> String {
    let (kind, dim) = (model.cells[id].kind, model.cells[id].dim);
    match kind {
        CellKind::Coordinate if dim.is_number() => "rad".into(),
        CellKind::Rate => dim.unit(),
        _ => dim.unit_without_angle(),
    }
}

fn labels(model: &Model, export: &Export) -> Vec<String> {
    match export.kind {
        ExportKind::Machine(id) => model.machines[id].states.clone(),
        // A bool.
        _ if export.dim.is_none() => ["false", "true"].map(String::from).to_vec(),
        _ => Vec::new(),
    }
}

/// The arguments of the events of a program, each title once: the columns of its table of events.
pub fn arguments(compiled: &Compiled, kind: EngineKind) -> Vec<Argument> {
    let titles = argument_titles(&compiled.model);
    let words = kind != EngineKind::Ideal;
    let all = compiled.lowered.events.iter().filter_map(|event| {
        let LoweredEventKind::Emission(e) = event.kind else {
            return None;
        };
        let steps = event.arg_lsbs.iter().map(move |lsb| words.then_some(*lsb));
        let argument = |(title, step): (&String, Option<f64>)| Argument {
            title: title.clone(),
            step,
        };
        Some(
            titles[e as usize]
                .iter()
                .zip(steps)
                .map(argument)
                .collect::<Vec<_>>(),
        )
    });
    Argument::merged(all.flatten())
}

/// Titles of the arguments of every emission.
pub fn argument_titles(model: &Model) -> Vec<Vec<String>> {
    let titles = |args: &[(String, Dim)]| args.iter().map(argument_title).collect();
    model.emissions.iter().map(|e| titles(&e.args)).collect()
}

/// The title of an argument (`speed_m_per_s`).
pub fn argument_title((name, dim): &(String, Dim)) -> String {
    join_title(name, &unit_suffix(&dim.unit_without_angle()))
}

/// The events of a program, and the titles of their arguments.
pub fn event_headings(compiled: &Compiled) -> Vec<(String, Vec<String>)> {
    let events = 0..compiled.lowered.events.len();
    events.map(|event| event_heading(compiled, event)).collect()
}

/// The name of an event and the titles of its arguments.
pub(super) fn event_heading(compiled: &Compiled, event: usize) -> (String, Vec<String>) {
    let model = &compiled.model;
    match &compiled.lowered.events[event].kind {
        LoweredEventKind::Emission(e) => {
            let emission = &model.emissions[EmissionId(*e)];
            let titles = emission.args.iter().map(argument_title);
            (emission.name.clone(), titles.collect())
        }
        LoweredEventKind::Rule(name) => (name.clone(), Vec::new()),
    }
}
