//! Two transitions of one state whose guards can hold together: the first in the text is taken,
//! which is rarely meant.

use super::together::{Solver, Together};
use super::{facts, guards::words, in_calls};
use crate::diag::{Code, Diagnostic};
use crate::model::{Model, Rule, RuleKind};

/// Warns where values were found at which both guards hold and it makes a difference which is
/// taken.
pub(super) fn check(
    model: &Model,
    never: &[bool],
    solver: &mut Solver,
    found: &mut Vec<Diagnostic>,
) {
    for (index, later) in model.rules.iter().enumerate() {
        for (earlier, first) in model.rules[..index].iter().enumerate() {
            if never[index] || never[earlier] || !differ(first, later) {
                continue;
            }
            let Together::At(values) = solver.ask(&facts(first).and(facts(later))) else {
                continue;
            };
            let (one, other) = (words(model, &first.kind), words(model, &later.kind));
            let message = format!(
                "the guards of {one} and {other} can hold together; then the first in the text is taken"
            );
            let when = if values.is_empty() {
                String::new()
            } else {
                format!(" when {values}")
            };
            let diagnostic = Diagnostic::new(
                Code::OverlappingGuards,
                later.span,
                message,
                format!("passed over{when}"),
            )
            .also(first.span, "taken")
            .hint(
                "let the guards exclude each other, or give both one target if it does not matter",
            );
            found.push(in_calls(model, later.call, diagnostic));
            break;
        }
    }
}

/// Whether two rules leave one state of one machine, and do different things.
fn differ(a: &Rule, b: &Rule) -> bool {
    match (&a.kind, &b.kind) {
        (
            RuleKind::Transition {
                machine: m,
                from: f,
                to: t,
            },
            RuleKind::Transition {
                machine: n,
                from: g,
                to: u,
            },
        ) => m == n && f == g && (t != u || !a.actions.is_empty() || !b.actions.is_empty()),
        _ => false,
    }
}
