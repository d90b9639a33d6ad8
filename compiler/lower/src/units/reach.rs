//! Reachability over a step's graph: nodes that a tick needs, and sums whose constant is left to
//! their users.

use crate::simplify::Step;
use whippen_ids::IdMap;
use whippen_lang::model::{Action, Dag, Node, NodeId};

/// Whose constant is left to its users: sums that nothing but sums and comparisons with constants
/// use in every tick.
pub fn left(step: &Step) -> IdMap<NodeId, bool> {
    let model = &step.model;
    let dag = &model.dag;
    let mut left: IdMap<NodeId, bool> = dag
        .nodes()
        .map(|(_, node)| matches!(node, Node::Linear(..)))
        .collect();
    let nexts = model.nexts.iter().map(|&(_, node)| node);
    let stored: Vec<NodeId> = step
        .rates
        .iter()
        .chain(&step.coordinates)
        .copied()
        .chain(nexts)
        .collect();
    stored.iter().for_each(|node| left[node] = false);
    let guards = model.rules.iter().map(|rule| rule.guard);
    let every_tick = reachable(
        dag,
        stored
            .iter()
            .copied()
            .chain(guards)
            .chain(step.drives.iter().copied())
            .collect(),
    );
    for (_, node) in dag
        .nodes()
        .zip(every_tick)
        .filter(|(_, used)| *used)
        .map(|(node, _)| node)
    {
        match *node {
            Node::Linear(..) => {}
            Node::Compare(_, _, b) if dag.real(b).is_some() => {}
            _ => node
                .operands()
                .into_iter()
                .for_each(|operand| left[operand] = false),
        }
    }
    left
}

/// What the roots are made of.
fn reachable(dag: &Dag, mut open: Vec<NodeId>) -> IdMap<NodeId, bool> {
    let mut seen = IdMap::filled(false, dag.len());
    while let Some(id) = open.pop() {
        if !std::mem::replace(&mut seen[id], true) {
            open.extend(dag.get(id).operands());
        }
    }
    seen
}

/// What a tick computes even if nobody watches.
pub(super) fn needed(step: &Step) -> IdMap<NodeId, bool> {
    let model = &step.model;
    let actions =
        model
            .rules
            .iter()
            .flat_map(|rule| &rule.actions)
            .flat_map(|action| match action {
                Action::Write { value, .. } | Action::Fire { value, .. } => vec![*value],
                Action::Emit { args, .. } => args.clone(),
            });
    let moved = step.rates.iter().chain(&step.coordinates).copied();
    let nexts = model.nexts.iter().map(|&(_, node)| node);
    let guards = model.rules.iter().map(|rule| rule.guard);
    reachable(
        &model.dag,
        moved
            .chain(nexts)
            .chain(guards)
            .chain(actions)
            .chain(step.drives.iter().copied())
            .collect(),
    )
}
