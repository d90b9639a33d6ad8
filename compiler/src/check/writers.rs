//! Two writers of one variable: of two writes in one tick the later in the text wins, which is rarely meant.
//!
//! The test is conservative: it warns unless the guards can be seen to exclude each other, as two steps of one machine
//! do, or two states of one machine, a bool and its opposite, comparisons of one value that leave no room.

use super::diags::Diags;
use crate::diag::{Code, Diagnostic};
use crate::model::{Action, CellId, Cmp, MachineId, Model, Node, NodeId, Rule, RuleKind};
use crate::source::Span;

/// What holds whenever a rule acts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fact {
    /// A machine is in a state.
    In(MachineId, u32),
    /// A bool has a value.
    Is(NodeId, bool),
    /// `a < b`, or `a <= b`.
    Below { a: NodeId, b: NodeId, strict: bool },
}

/// Warns of writers that may act in one tick.
pub fn check(model: &Model, diags: &mut Diags) {
    let facts: Vec<Vec<Fact>> = model.rules.iter().map(|rule| facts(model, rule)).collect();
    let writes: Vec<(usize, CellId, Span)> =
        model.rules.iter().enumerate().flat_map(|(r, rule)| writes(rule).map(move |(c, s)| (r, c, s))).collect();
    for (index, &(later, cell, span)) in writes.iter().enumerate() {
        for &(earlier, other, first) in &writes[..index] {
            if cell == other && !exclusive(model, (earlier, later), &facts) {
                diags.push(warning(model, cell, (earlier, later), span, first));
                break;
            }
        }
    }
}

fn writes(rule: &Rule) -> impl Iterator<Item = (CellId, Span)> {
    rule.actions.iter().filter_map(|action| match action {
        Action::Write { cell, span, .. } => Some((*cell, *span)),
        _ => None,
    })
}

fn exclusive(model: &Model, (a, b): (usize, usize), facts: &[Vec<Fact>]) -> bool {
    let machine = |rule: usize| match model.rules[rule].kind {
        RuleKind::Transition { machine, .. } => Some(machine),
        RuleKind::Event { .. } => None,
    };
    let one_machine = a != b && machine(a).is_some() && machine(a) == machine(b);
    one_machine || facts[a].iter().any(|x| facts[b].iter().any(|y| contradict(model, *x, *y)))
}

fn contradict(model: &Model, x: Fact, y: Fact) -> bool {
    match (x, y) {
        (Fact::In(m, s), Fact::In(n, t)) => m == n && s != t,
        (Fact::Is(a, v), Fact::Is(b, w)) => a == b && v != w,
        (Fact::Below { a, b, strict }, Fact::Below { a: c, b: d, strict: also }) => {
            let room = |low: NodeId, high: NodeId| leaves_room(model, low, high, strict || also);
            (b == c && !room(a, d)) || (d == a && !room(c, b))
        }
        _ => false,
    }
}

/// Whether something can lie between `low` and `high`, as far as this can be seen.
fn leaves_room(model: &Model, low: NodeId, high: NodeId, strict: bool) -> bool {
    match (model.dag.real(low), model.dag.real(high)) {
        (Some(low), Some(high)) => low < high || (low == high && !strict),
        _ => !(low == high && strict),
    }
}

/// What is known while a rule acts: the parts of its guard joined by `and`, and the state its machine is in.
fn facts(model: &Model, rule: &Rule) -> Vec<Fact> {
    let mut facts = Vec::new();
    if let RuleKind::Transition { machine, from, .. } = rule.kind {
        facts.push(Fact::In(machine, from));
    }
    let mut waiting = vec![(rule.guard, true)];
    while let Some((id, value)) = waiting.pop() {
        match (model.dag.get(id), value) {
            (&Node::And(a, b), true) | (&Node::Or(a, b), false) => waiting.extend([(a, value), (b, value)]),
            (&Node::Not(a), _) => waiting.push((a, !value)),
            (&Node::Is(machine, state), true) => facts.push(Fact::In(machine, state)),
            (&Node::Compare(cmp, a, b), _) => facts.push(below(if value { cmp } else { opposite(cmp) }, a, b)),
            _ => {}
        }
        facts.push(Fact::Is(id, value));
    }
    facts
}

fn below(cmp: Cmp, a: NodeId, b: NodeId) -> Fact {
    match cmp {
        Cmp::Lt => Fact::Below { a, b, strict: true },
        Cmp::Le => Fact::Below { a, b, strict: false },
        Cmp::Gt => Fact::Below { a: b, b: a, strict: true },
        Cmp::Ge => Fact::Below { a: b, b: a, strict: false },
    }
}

fn opposite(cmp: Cmp) -> Cmp {
    match cmp {
        Cmp::Lt => Cmp::Ge,
        Cmp::Le => Cmp::Gt,
        Cmp::Gt => Cmp::Le,
        Cmp::Ge => Cmp::Lt,
    }
}

fn warning(model: &Model, cell: CellId, (earlier, later): (usize, usize), span: Span, first: Span) -> Diagnostic {
    let name = &model.cells[cell.0 as usize].name;
    let (one, other) = (describe(model, earlier), describe(model, later));
    let (message, hint) = if earlier == later {
        (format!("`{name}` is written twice by {one}"), "take the first write away: the later wins")
    } else {
        (
            format!("`{name}` may be written by {one} and by {other} in one tick; then the later wins"),
            "let their guards exclude each other, if that is not meant",
        )
    };
    Diagnostic::new(Code::TwoWriters, span, message, "this one wins").also(first, "this one is lost").hint(hint)
}

fn describe(model: &Model, rule: usize) -> String {
    match &model.rules[rule].kind {
        RuleKind::Event { name } => format!("the event `{name}`"),
        RuleKind::Transition { machine, from, to } => {
            let machine = &model.machines[machine.0 as usize];
            let state = |s: u32| machine.states.get(s as usize).map_or("", String::as_str);
            format!("`{}` ({} -> {})", machine.name, state(*from), state(*to))
        }
    }
}
