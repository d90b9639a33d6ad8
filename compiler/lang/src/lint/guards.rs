//! Guards that always or never hold, and states that are never entered because of them.

use super::together::{Solver, Together};
use super::{facts, in_calls, is_constant};
use crate::diag::{Code, Diagnostic};
use crate::model::{Model, Node, NodeId, Rule, RuleKind};
use crate::range::Ranges;
use whippen_source::Span;

/// Warns, and says of each rule whether it can never act.
pub(super) fn check(
    model: &Model,
    ranges: &Ranges,
    solver: &mut Solver,
    found: &mut Vec<Diagnostic>,
) -> Vec<bool> {
    let cannot = |rule: &Rule| {
        ranges.get(rule.guard).high == 0.0 || solver.ask(&facts(rule)) == Together::Never
    };
    let never: Vec<bool> = model.rules.iter().map(cannot).collect();
    let reported = unreachable(model, &never, found);
    for (index, rule) in model.rules.iter().enumerate() {
        if is_constant(model, rule.guard) || reported.contains(&index) {
            continue;
        }
        let name = words(model, &rule.kind);
        let place = place(model, rule.guard, rule.span);
        let (code, message, label, hint) = if never[index] {
            (
                Code::NeverHolds,
                format!(
                    "the guard of {name} never holds: the ranges of its values leave no room for it"
                ),
                "never true",
                "look at the units and ranges of both sides, or take it away",
            )
        } else if ranges.get(rule.guard).low == 1.0 {
            (
                Code::AlwaysHolds,
                format!("the guard of {name} always holds, whatever its values are"),
                "always true",
                match rule.kind {
                    RuleKind::Event { .. } => {
                        "an event happens when its guard turns true, so this one never happens"
                    }
                    RuleKind::Transition { .. } => "look at the units and ranges of both sides",
                },
            )
        } else {
            continue;
        };
        found.push(in_calls(
            model,
            rule.call,
            Diagnostic::new(code, place, message, label).hint(hint),
        ));
    }
    never
}

/// Where a guard stands, if that is inside of its rule; else the rule.
fn place(model: &Model, guard: NodeId, rule: Span) -> Span {
    let own = model.spans.get(guard).copied().flatten();
    own.filter(|s| s.file == rule.file && rule.start <= s.start && s.end <= rule.end)
        .unwrap_or(rule)
}

/// Whether a part of a guard is off for ever, which is chosen so: a row of jacks that is always on
/// is never silent.
fn is_shut(model: &Model, guard: NodeId) -> bool {
    match *model.dag.get(guard) {
        Node::And(a, b) => is_shut(model, a) || is_shut(model, b),
        Node::Not(a) => model.dag.bool(a) == Some(true),
        _ => model.dag.bool(guard) == Some(false),
    }
}

/// States that are entered by such transitions only as can never be taken; gives the rules of those
/// that it reported.
fn unreachable(model: &Model, never: &[bool], found: &mut Vec<Diagnostic>) -> Vec<usize> {
    let mut reported = Vec::new();
    for (index, machine) in model.machines.iter().enumerate() {
        let steps: Vec<(usize, usize, usize)> = steps(model, index).collect();
        let all = reached(
            machine.states.len(),
            steps.iter().map(|&(_, from, to)| (from, to)),
        );
        let possible = steps
            .iter()
            .filter(|(rule, ..)| !never[*rule] || is_shut(model, model.rules[*rule].guard));
        let taken = reached(
            machine.states.len(),
            possible.map(|&(_, from, to)| (from, to)),
        );
        for (state, name) in machine
            .states
            .iter()
            .enumerate()
            .filter(|(s, _)| all[*s] && !taken[*s])
        {
            let into = || {
                steps
                    .iter()
                    .filter(|(.., to)| *to == state)
                    .map(|(rule, ..)| *rule)
            };
            let Some(rule) = into().find(|&r| never[r]).or_else(|| into().next()) else {
                continue;
            };
            reported.extend(into().filter(|&r| never[r]));
            let (rule, never) = (&model.rules[rule], never[rule]);
            let message =
                format!("the state `{name}` is never entered: no transition to it can be taken");
            let label = if never {
                "this guard never holds"
            } else {
                "nor is the state that it leaves"
            };
            let hint = "look at the units and ranges in the guards on the way to it";
            let place = place(model, rule.guard, rule.span);
            let diagnostic =
                Diagnostic::new(Code::UnreachableState, place, message, label).hint(hint);
            found.push(in_calls(model, rule.call, diagnostic));
        }
    }
    reported
}

/// The transitions of a machine: rule, state left, state entered.
fn steps(model: &Model, machine: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    model
        .rules
        .iter()
        .enumerate()
        .filter_map(move |(rule, r)| match r.kind {
            RuleKind::Transition {
                machine: m,
                from,
                to,
            } if m.0 as usize == machine => Some((rule, from as usize, to as usize)),
            _ => None,
        })
}

/// Which states can be entered from the first.
fn reached(states: usize, steps: impl Iterator<Item = (usize, usize)> + Clone) -> Vec<bool> {
    let mut reached = vec![false; states];
    let mut open = vec![0];
    while let Some(state) = open.pop() {
        if state < states && !std::mem::replace(&mut reached[state], true) {
            open.extend(
                steps
                    .clone()
                    .filter(|(from, _)| *from == state)
                    .map(|(_, to)| to),
            );
        }
    }
    reached
}

/// A rule in a sentence.
pub(super) fn words(model: &Model, kind: &RuleKind) -> String {
    match kind {
        RuleKind::Event { name } => format!("the event `{name}`"),
        RuleKind::Transition { machine, from, to } => {
            let machine = &model.machines[machine];
            let state = |s: u32| machine.states.get(s as usize).map_or("", String::as_str);
            format!("`{}` ({} -> {})", machine.name, state(*from), state(*to))
        }
    }
}
