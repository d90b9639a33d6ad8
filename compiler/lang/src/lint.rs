//! What a program that has a meaning surely does not mean: seen by intervals, not by the looks of
//! the text.
//!
//! ```text
//!   Model + Ranges ─ guards   a guard that always or never holds; a state that is never entered for it
//!                  ├ overlap  two transitions of one state whose guards can hold together
//!                  ├ writers  two writers of one variable that can act in one tick
//!                  ├ near_end a place on a string too near to its end
//!                  ├ beyond_knots  a table read where it has no knots
//!                  └ outside  a value that reaches beyond the range of the state it is written to
//!                       └── all ask `together`: can these bools hold at once? never, at such values, unknown
//! ```
//!
//! Everything here is a warning. Not here: what has no meaning (`check`, `range`), the feel of the
//! key.

mod beyond_knots;
mod guards;
mod near_end;
mod outside;
mod overlap;
pub mod together;
mod writers;

use crate::diag::{Code, Diagnostic};
use crate::model::{Model, NodeId, Rule, RuleKind};
use crate::range::Ranges;
use together::Solver;

/// Warnings about one instrument, in the order of the text. `ranges` are those of `model` as
/// checked.
pub fn lint(model: &Model, ranges: &Ranges) -> Vec<Diagnostic> {
    let mut solver = Solver::new(model, ranges);
    let mut found = Vec::new();
    let never = guards::check(model, ranges, &mut solver, &mut found);
    overlap::check(model, &never, &mut solver, &mut found);
    writers::check(model, &never, &mut solver, &mut found);
    outside::check(model, ranges, &mut found);
    near_end::check(model, ranges, &mut found);
    beyond_knots::check(model, ranges, &mut found);
    found.extend(silent(model));
    found.sort_by_key(|d| (d.span, d.code));
    // A term that is called twice is looked at twice.
    found.dedup_by(|a, b| (a.span, a.code, &a.message) == (b.span, b.code, &b.message));
    found
}

/// An instrument of a key that gives it nothing to feel.
fn silent(model: &Model) -> Option<Diagnostic> {
    let name = &model.name;
    let could_feel = model.is_of_key();
    let message = format!("the instrument `{name}` has no `force`: the player feels nothing of it");
    let is_silent = model.forces.is_empty() && model.sounds.is_empty();
    (is_silent && could_feel).then(|| {
        Diagnostic::new(Code::NoForce, model.span, message, "nothing to feel")
            .hint("add a line such as `force spring = 75 N/m * x`")
    })
}

/// What holds while a rule acts: its guard, and for a transition that its machine is in the state
/// it leaves.
fn facts(rule: &Rule) -> together::Facts {
    let state = match rule.kind {
        RuleKind::Transition { machine, from, .. } => Some((machine, from)),
        RuleKind::Event { .. } => None,
    };
    together::Facts {
        holds: vec![rule.guard],
        states: state.into_iter().collect(),
        ..Default::default()
    }
}

/// Adds the calls of terms in which a rule stands, innermost first.
fn in_calls(model: &Model, call: Option<u32>, diagnostic: Diagnostic) -> Diagnostic {
    model
        .calls_from(call)
        .fold(diagnostic, |d, span| d.also(span, "in this call"))
}

/// Whether the constants alone decide a node, without any range: then it was switched so on
/// purpose.
fn is_constant(model: &Model, node: NodeId) -> bool {
    model.dag.bool(node).is_some()
}
