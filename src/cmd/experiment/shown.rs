//! What an experiment says: lines, JSON, a section of the gallery.

use serde_json::{Value, json};
use whippen_runtime::experiment::Verdict;
use whippen_runtime::report::{Cell, Row, Section, Table, chart, id};

use super::play::Played;
use crate::say::say;

fn outcome(held: bool) -> &'static str {
    if held { "held" } else { "FAILED" }
}

/// A line per assertion.
pub fn tell(played: &Played) {
    let experiment = played.experiment;
    say!("{}: {}", experiment.name, experiment.title);
    played
        .warnings
        .iter()
        .for_each(|warning| say!("  note: {warning}"));
    for verdict in &played.verdicts {
        let Verdict {
            claim,
            why,
            held,
            found,
        } = verdict;
        let why = if why.is_empty() {
            String::new()
        } else {
            format!(" ({why})")
        };
        say!("  {:<6}  {claim}: {found}{why}", outcome(*held));
    }
    let held = held_of(played);
    say!("  {held} of {} held", played.verdicts.len());
}

fn held_of(played: &Played) -> usize {
    played
        .verdicts
        .iter()
        .filter(|verdict| verdict.held)
        .count()
}

/// Everything as one line of JSON.
pub fn json(played: &Played) -> Value {
    let verdict = |v: &Verdict| json!({ "assertion": v.claim, "held": v.held, "found": v.found, "why": v.why });
    let instants = played.bound.instants(&played.trace).into_iter();
    let instants: serde_json::Map<String, Value> = instants
        .map(|(name, seconds)| (name, json!(seconds)))
        .collect();
    json!({
        "kind": "experiment",
        "name": played.experiment.name,
        "title": played.experiment.title,
        "source": played.experiment.source,
        "held": played.held(),
        "instants_s": instants,
        "assertions": played.verdicts.iter().map(verdict).collect::<Vec<_>>(),
        "notes": played.warnings,
    })
}

/// The figure and the assertions on the gallery page.
pub fn section(played: &Played) -> Section {
    let experiment = played.experiment;
    let fact = |name: &str, value: String| (name.to_string(), value);
    let mut facts = vec![fact(
        "assertions",
        format!("{} of {} held", held_of(played), played.verdicts.len()),
    )];
    if !experiment.source.is_empty() {
        facts.push(fact("after", experiment.source.clone()));
    }
    let instants = played.bound.instants(&played.trace);
    let instants = instants
        .iter()
        .filter_map(|(name, seconds)| Some(format!("{name} {:.4} s", (*seconds)?)));
    facts.push(fact("instants", instants.collect::<Vec<_>>().join(", ")));
    let failed = played.verdicts.iter().filter(|verdict| !verdict.held);
    let failed = failed.map(|verdict| format!("failed: {}: {}", verdict.claim, verdict.found));
    Section {
        id: section_id(played),
        title: format!("{}: {}", experiment.name, experiment.title),
        doc: experiment.doc.clone(),
        facts,
        warnings: failed.chain(played.warnings.iter().cloned()).collect(),
        data: vec![("chart", chart(&played.bound.figure(&played.trace)))],
        tables: vec![assertions(&played.verdicts)],
        sources: played.sources.clone(),
    }
}

/// What links name it by.
fn section_id(played: &Played) -> String {
    id(&played.experiment.name)
}

fn assertions(verdicts: &[Verdict]) -> Table {
    let row = |verdict: &Verdict| Row {
        cells: vec![
            Cell::text(outcome(verdict.held)),
            Cell::text(&verdict.claim),
            Cell::text(&verdict.found),
            Cell::text(&verdict.why),
        ],
        ..Row::default()
    };
    Table {
        title: "Assertions".into(),
        heads: ["outcome", "assertion", "found", "why"]
            .map(String::from)
            .to_vec(),
        rows: verdicts.iter().map(row).collect(),
        ..Table::default()
    }
}

/// The line of the table over all experiments.
pub fn row(played: &Played) -> Row {
    let (held, all) = (held_of(played), played.verdicts.len());
    Row {
        cells: vec![
            Cell::text(&played.experiment.name),
            Cell::text(&played.experiment.title),
            Cell::text(&played.experiment.source),
            Cell::number(held as f64, format!("{held} of {all}")),
        ],
        section: Some(section_id(played)),
        ..Row::default()
    }
}

/// The table over all experiments.
pub fn overview(rows: Vec<Row>) -> Table {
    Table {
        title: "Experiments".into(),
        note:
            "Each plays its instruments, draws its figure, and says whether what it asserts holds."
                .into(),
        heads: ["experiment", "what", "after", "held"]
            .map(String::from)
            .to_vec(),
        rows,
    }
}
