//! Two writers of one variable: of two writes in one tick the later in the text wins, which is
//! rarely meant.
//!
//! It warns unless the guards are proven to exclude each other: a lost write is worse than a
//! needless warning.

use super::together::{Solver, Together};
use super::{facts, guards::words, in_calls};
use crate::diag::{Code, Diagnostic};
use crate::model::{Action, CellId, Model, Rule, RuleKind};
use whippen_source::Span;

/// Warns of writers that may act in one tick.
pub(super) fn check(
    model: &Model,
    never: &[bool],
    solver: &mut Solver,
    found: &mut Vec<Diagnostic>,
) {
    let acting = model.rules.iter().enumerate().filter(|(r, _)| !never[*r]);
    let writes: Vec<(usize, CellId, Span)> = acting
        .flat_map(|(r, rule)| writes(rule).map(move |(c, s)| (r, c, s)))
        .collect();
    for (index, &(later, cell, span)) in writes.iter().enumerate() {
        for &(earlier, _, first) in writes[..index]
            .iter()
            .filter(|(_, other, _)| *other == cell)
        {
            let values = match both(model, (earlier, later), solver) {
                Together::Never => continue,
                Together::At(values) => Some(values).filter(|v| earlier != later && !v.is_empty()),
                Together::Unknown => None,
            };
            let diagnostic = warning(model, cell, (earlier, later), (span, first), values);
            found.push(in_calls(model, model.rules[later].call, diagnostic));
            break;
        }
    }
}

fn writes(rule: &Rule) -> impl Iterator<Item = (CellId, Span)> {
    rule.actions.iter().filter_map(|action| match action {
        Action::Write { cell, span, .. } => Some((*cell, *span)),
        _ => None,
    })
}

fn both(model: &Model, (a, b): (usize, usize), solver: &mut Solver) -> Together {
    let machine = |rule: usize| match model.rules[rule].kind {
        RuleKind::Transition { machine, .. } => Some(machine),
        RuleKind::Event { .. } => None,
    };
    // A machine takes one step in a tick.
    if a != b && machine(a).is_some() && machine(a) == machine(b) {
        return Together::Never;
    }
    solver.ask(&facts(&model.rules[a]).and(facts(&model.rules[b])))
}

fn warning(
    model: &Model,
    cell: CellId,
    (earlier, later): (usize, usize),
    (span, first): (Span, Span),
    values: Option<String>,
) -> Diagnostic {
    let name = &model.cells[cell].name;
    let (one, other) = (
        words(model, &model.rules[earlier].kind),
        words(model, &model.rules[later].kind),
    );
    let (message, hint) = if earlier == later {
        (
            format!("`{name}` is written twice by {one}"),
            "take the first write away: the later wins",
        )
    } else {
        (
            format!(
                "`{name}` may be written by {one} and by {other} in one tick; then the later wins"
            ),
            "let their guards exclude each other, if that is not meant",
        )
    };
    let lost = values.map_or("this one is lost".to_string(), |v| {
        format!("this one is lost, such as when {v}")
    });
    Diagnostic::new(Code::TwoWriters, span, message, "this one wins")
        .also(first, lost)
        .hint(hint)
}
