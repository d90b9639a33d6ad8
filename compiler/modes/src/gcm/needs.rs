//! Anticipated computations: which nodes every path below a decision needs, and which only some.

use super::Plan;
use super::sorted::{common, union};
use crate::decision_tree::Tree;
use crate::graph::Kind;
use crate::graph::{Graph, NodeId};
use crate::partial_eval::Path;
use crate::{ModeId, reach};
use whippen_kernel::{Op, Type};

/// A tree with what stands in it.
pub(super) struct Needs<'a> {
    pub path: &'a Path,
    /// Needed by every leaf.
    pub by_all: Vec<NodeId>,
    /// Needed by some leaf.
    pub by_some: Vec<NodeId>,
    pub then: Then<'a>,
}

/// What follows.
pub(super) enum Then<'a> {
    Split(NodeId, Box<Needs<'a>>, Box<Needs<'a>>),
    Next(ModeId),
}

/// What a mode's tree needs; none where a leaf leads to no mode.
pub(super) fn needs<'a>(
    graph: &mut Graph,
    plan: &Plan,
    at: ModeId,
    tree: &'a Tree,
) -> Option<Needs<'a>> {
    match tree {
        Tree::Leaf { path, tick, ranges } => {
            let classes = reach::classes(plan.discrete, ranges)?;
            let mut modes = plan.modes.enumerated();
            let (next, _) = modes.find(|(_, mode)| mode.classes == classes)?;
            let mut roots: Vec<NodeId> = tick
                .writes
                .iter()
                .copied()
                .chain(std::iter::once(tick.last))
                .collect();
            for (cell, end) in tick
                .cells
                .iter()
                .enumerate()
                .filter_map(|(cell, end)| Some((cell, (*end)?)))
            {
                let unchanged =
                    graph.op(end) == Some(Op::Get(cell as u32)) && !plan.known[at][cell];
                if !plan.known[next][cell] && !unchanged {
                    roots.push(graph.node(Kind::Op(Op::Set(cell as u32)), Type::I1, &[end]));
                }
            }
            let all = graph.reachable(&roots);
            Some(Needs {
                path,
                by_all: all.clone(),
                by_some: all,
                then: Then::Next(next),
            })
        }
        Tree::Split {
            path,
            condition,
            yes,
            no,
        } => {
            let yes = needs(graph, plan, at, yes)?;
            let no = needs(graph, plan, at, no)?;
            let decided = graph.reachable(&[*condition]);
            let by_all = union(&common(&yes.by_all, &no.by_all), &decided);
            let by_some = union(&union(&yes.by_some, &no.by_some), &decided);
            Some(Needs {
                path,
                by_all,
                by_some,
                then: Then::Split(*condition, Box::new(yes), Box::new(no)),
            })
        }
    }
}
