//! Partial evaluation with interval analysis: the same graph under the facts of a path, bit for
//! bit, with what they decide decided.
//!
//! Nodes are visited in order, operands first. Each is made again from its folded operands: its
//! range follows by the table of operators, and a range of one value is a constant. Simplification
//! of choices, limits and bools is in `rules`, division by constants in `divide`.

mod divide;
mod rules;

use super::facts::{self, Facts, meet};
use super::graph::{Graph, Kind, NodeId, Walk};
use super::tuning;
use std::cell::RefCell;
use whippen_ids::{Id, IdMap};
use whippen_kernel::{Op, Range, Type};

/// A path through the decisions.
#[derive(Debug, Clone, Default)]
pub(super) struct Path {
    /// The facts that hold on it.
    pub facts: Facts,
    /// The conditions; what they are made of has been computed, and stays as it is.
    pub decided: Vec<NodeId>,
    /// The nodes with facts that the path before did not have.
    pub new_facts: Vec<NodeId>,
}

impl Path {
    /// The path on from here where the condition holds, or does not; none if that cannot be.
    pub fn decided_so(
        &self,
        graph: &Graph,
        eval: &PartialEval,
        condition: NodeId,
        holds: bool,
    ) -> Option<Path> {
        let range = Range::point(holds.into());
        let (facts, new_facts) =
            facts::with(graph, &|id| eval.range(id), &self.facts, condition, range)?;
        let decided = self
            .decided
            .iter()
            .copied()
            .chain(std::iter::once(condition))
            .collect();
        Some(Path {
            facts,
            decided,
            new_facts,
        })
    }

    /// The path on from here where the condition cannot be otherwise. No branch decides it, so
    /// nothing is concluded about its operands.
    pub fn decided_without_facts(&self, condition: NodeId, holds: bool) -> Path {
        let mut path = self.clone();
        path.facts.insert(condition, Range::point(holds.into()));
        path.decided.push(condition);
        path.new_facts = vec![condition];
        path
    }
}

/// Known ranges along the current path; incremental, with an undo trail.
///
/// An evaluation goes on from the one before and visits only what follows from new facts. To take
/// the other side of a decision, it is [undone](PartialEval::undo_to) first.
#[derive(Debug, Default)]
pub(super) struct PartialEval {
    ranges: IdMap<NodeId, Range>,
    /// Nodes that a decision on the path is made of: computed already, so they are not replaced.
    frozen: IdMap<NodeId, bool>,
    /// The epoch that last changed a node, and what it folded to then.
    folded: IdMap<NodeId, (u32, NodeId)>,
    /// The last epoch with new facts of a node.
    fact_epoch: IdMap<NodeId, u32>,
    /// Counts evaluations.
    epoch: u32,
    /// A range is empty: the path cannot be taken.
    impossible: bool,
    /// What to undo, the latest last.
    trail: Vec<Undo>,
    /// How many rules deep this is.
    depth: usize,
    /// The range of each node for those ranges of its operands that were asked for last.
    range_cache: RefCell<IdMap<NodeId, CachedRange>>,
    walk: Walk,
    /// Nodes that were visited, all evaluations together.
    pub work: u64,
}

/// The range of a node for some ranges of its operands; none if the table cannot tell.
#[derive(Debug, Clone, Copy)]
struct CachedRange {
    operands: [Range; 3],
    result: Option<Range>,
}

/// An evaluation that was undone, to be [replayed](PartialEval::replay) without evaluating again.
#[derive(Debug)]
pub(super) struct Evaluation {
    /// The folded roots.
    pub roots: Vec<NodeId>,
    ranges: Vec<(NodeId, Range)>,
    frozen: Vec<NodeId>,
}

#[derive(Debug, Clone, Copy)]
enum Undo {
    Range(NodeId, Range),
    Frozen(NodeId),
}

const UNKNOWN: Range = Range {
    low: i64::MIN,
    high: i64::MAX,
};

impl PartialEval {
    /// The range of a node on the current path.
    pub fn range(&self, id: NodeId) -> Range {
        self.ranges.get(id).copied().unwrap_or(UNKNOWN)
    }

    /// The present end of the undo trail, for [`PartialEval::undo_to`].
    pub fn mark(&self) -> usize {
        self.trail.len()
    }

    /// Undoes all since the mark.
    pub fn undo_to(&mut self, mark: usize) {
        for undo in self.trail.drain(mark..).rev() {
            match undo {
                Undo::Range(id, range) => self.ranges[id] = range,
                Undo::Frozen(id) => self.frozen[id] = false,
            }
        }
    }

    /// An evaluation that is undone at once; none if its facts contradict each other.
    pub fn evaluate_and_undo(
        &mut self,
        graph: &mut Graph,
        path: &Path,
        roots: &[NodeId],
        nodes: &[NodeId],
    ) -> Option<Evaluation> {
        let mark = self.mark();
        let found = self.evaluate_over(graph, path, roots, nodes).map(|roots| {
            let mut ranges = Vec::new();
            let mut frozen = Vec::new();
            for undo in &self.trail[mark..] {
                match undo {
                    Undo::Range(id, _) => ranges.push((*id, self.range(*id))),
                    Undo::Frozen(id) => frozen.push(*id),
                }
            }
            Evaluation {
                roots,
                ranges,
                frozen,
            }
        });
        self.undo_to(mark);
        found
    }

    /// Restores the ranges of an evaluation, from where it began.
    pub fn replay(&mut self, evaluation: &Evaluation) {
        evaluation
            .ranges
            .iter()
            .for_each(|(id, range)| self.set_range(*id, *range));
        for id in &evaluation.frozen {
            self.frozen[id] = true;
            self.trail.push(Undo::Frozen(*id));
        }
    }

    /// The folded roots on this path, which goes on from that of the evaluation before; none if its
    /// facts contradict each other.
    pub fn evaluate(
        &mut self,
        graph: &mut Graph,
        path: &Path,
        roots: &[NodeId],
    ) -> Option<Vec<NodeId>> {
        let nodes = self.nodes_below(graph, path, roots);
        self.evaluate_over(graph, path, roots, &nodes)
    }

    /// All that the roots and what was decided are made of, operands first.
    pub fn nodes_below(&mut self, graph: &Graph, path: &Path, roots: &[NodeId]) -> Vec<NodeId> {
        let nodes = self
            .walk
            .over(graph, roots.iter().chain(&path.decided).copied());
        self.work += nodes.len() as u64;
        nodes
    }

    /// Cycles of all that the roots need.
    pub fn cost(&mut self, graph: &Graph, roots: &[NodeId]) -> u32 {
        let nodes = self.walk.over(graph, roots.iter().copied());
        self.work += nodes.len() as u64;
        nodes
            .into_iter()
            .map(|id| graph.cycles(id))
            .fold(0, u32::saturating_add)
    }

    /// The same over [given nodes](PartialEval::nodes_below).
    pub fn evaluate_over(
        &mut self,
        graph: &mut Graph,
        path: &Path,
        roots: &[NodeId],
        nodes: &[NodeId],
    ) -> Option<Vec<NodeId>> {
        self.begin_epoch(graph, path);
        self.work += nodes.len() as u64;
        for id in nodes {
            if self.is_stale(graph, *id) {
                self.reevaluate(graph, &path.facts, *id);
            }
            if self.impossible {
                return None;
            }
        }
        Some(roots.iter().map(|root| self.folded(*root)).collect())
    }

    fn begin_epoch(&mut self, graph: &Graph, path: &Path) {
        self.epoch += 1;
        self.impossible = false;
        self.ranges.resize(graph.len(), UNKNOWN);
        self.frozen.resize(graph.len(), false);
        self.folded.resize(graph.len(), (0, NodeId(0)));
        self.fact_epoch.resize(graph.len(), 0);
        path.new_facts
            .iter()
            .for_each(|id| self.fact_epoch[id] = self.epoch);
        for id in self
            .walk
            .over(graph, path.decided.last().copied().into_iter())
        {
            if !std::mem::replace(&mut self.frozen[id], true) {
                self.trail.push(Undo::Frozen(id));
            }
        }
    }

    /// What this epoch folded a node to.
    fn folded(&self, id: NodeId) -> NodeId {
        let (epoch, folded) = self.folded[id];
        if epoch == self.epoch { folded } else { id }
    }

    fn is_stale(&self, graph: &Graph, id: NodeId) -> bool {
        let is_new = self.fact_epoch[id] == self.epoch || self.ranges[id] == UNKNOWN;
        is_new
            || graph
                .args(id)
                .iter()
                .any(|arg| self.folded[arg].0 == self.epoch)
    }

    fn reevaluate(&mut self, graph: &mut Graph, facts: &Facts, id: NodeId) {
        let before = self.range(id);
        let new = if self.frozen[id] {
            self.set_range(id, self.range_from_operands(graph, id));
            self.apply_facts(graph, facts, id, id)
        } else {
            self.fold_node(graph, facts, id)
        };
        if new != id || self.range(id) != before {
            self.folded[id] = (self.epoch, new);
        }
    }

    fn fold_node(&mut self, graph: &mut Graph, facts: &Facts, id: NodeId) -> NodeId {
        let old = graph.args(id);
        let (mut few, many);
        let args: &[NodeId] = if old.len() <= 3 {
            few = [NodeId(0); 3];
            few.iter_mut()
                .zip(old)
                .for_each(|(new, old)| *new = self.folded(*old));
            &few[..old.len()]
        } else {
            many = old
                .iter()
                .map(|arg| self.folded(*arg))
                .collect::<Vec<NodeId>>();
            &many
        };
        // Of the same operands it is the same node, unless there is something simpler.
        let same = (args == old).then_some(id);
        graph.origin = graph.origin_of(id);
        let ty = graph.ty(id);
        let new = match graph.kind(id) {
            Kind::Op(op) if op.row().effect.is_pure() => {
                self.fold_pure_or(graph, op, ty, args, same)
            }
            Kind::Result(_) if !matches!(graph.kind(args[0]), Kind::Effect(_)) => {
                // The effect does not happen; nobody looks at its results.
                let low = self.range_from_operands(graph, id).low;
                self.constant(graph, ty, low)
            }
            kind => self.fold_effect(graph, kind, ty, args),
        };
        self.apply_facts(graph, facts, id, new)
    }

    /// Intersects a node's range with the facts about it and about the node it was folded from; a
    /// range of one value makes it a constant.
    fn apply_facts(
        &mut self,
        graph: &mut Graph,
        facts: &Facts,
        old: NodeId,
        new: NodeId,
    ) -> NodeId {
        let mut range = self.range(new);
        for id in [old, new] {
            range = facts.get(&id).map_or(range, |fact| meet(range, *fact));
        }
        self.impossible |= range.is_empty();
        self.set_range(new, range);
        let becomes_known = range.low == range.high && graph.constant(new) != Some(range.low);
        if becomes_known && !graph.has_no_value(new) {
            return self.constant(graph, graph.ty(new), range.low);
        }
        new
    }

    pub(super) fn set_range(&mut self, id: NodeId, range: Range) {
        if self.ranges.get(id).is_none() {
            self.ranges.resize(id.index() + 1, UNKNOWN);
        }
        let old = std::mem::replace(&mut self.ranges[id], range);
        if old != range {
            self.trail.push(Undo::Range(id, old));
        }
    }

    pub(super) fn constant(&mut self, graph: &mut Graph, ty: Type, value: i64) -> NodeId {
        let id = graph.constant_node(ty, value);
        self.set_range(id, Range::point(value));
        id
    }

    /// Folds a read, a write or an effect.
    fn fold_effect(&mut self, graph: &mut Graph, kind: Kind, ty: Type, args: &[NodeId]) -> NodeId {
        match kind {
            Kind::Effect(_) if graph.constant(args[0]) == Some(0) => return args[1],
            _ => {}
        }
        let id = graph.node(kind, ty, args);
        let range = self.range_from_operands(graph, id);
        self.set_range(id, range);
        id
    }

    /// Folds a pure operator of folded operands.
    pub(super) fn fold_pure(
        &mut self,
        graph: &mut Graph,
        op: Op,
        ty: Type,
        args: &[NodeId],
    ) -> NodeId {
        self.fold_pure_or(graph, op, ty, args, None)
    }

    /// The same, if it is known which node that is.
    fn fold_pure_or(
        &mut self,
        graph: &mut Graph,
        op: Op,
        ty: Type,
        args: &[NodeId],
        known: Option<NodeId>,
    ) -> NodeId {
        self.depth += 1;
        let simplified = if self.depth <= tuning::RULES_DEEP {
            self.simplified(graph, op, ty, args)
        } else {
            None
        };
        self.depth -= 1;
        if let Some(id) = simplified {
            return id;
        }
        let id = known.unwrap_or_else(|| graph.node(Kind::Op(op), ty, args));
        let range = self.range_from_operands(graph, id);
        if range.low == range.high {
            return self.constant(graph, ty, range.low);
        }
        self.set_range(id, range);
        id
    }

    /// The range of a node by the table of operators, given the ranges of its operands.
    pub fn range_from_operands(&self, graph: &Graph, id: NodeId) -> Range {
        self.proven_range(graph, id).unwrap_or(graph.ty(id).range())
    }

    /// The same; none if the table cannot tell, because the result might not fit its type.
    pub fn proven_range(&self, graph: &Graph, id: NodeId) -> Option<Range> {
        let ty = graph.ty(id);
        match graph.kind(id) {
            Kind::Start | Kind::Effect(_) => Some(ty.range()),
            Kind::Result(index) => graph
                .result_info(graph.args(id)[0], index)
                .map(|info| info.range),
            Kind::Op(Op::Const(value)) => Some(Range::point(value)),
            Kind::Op(op) => {
                let mut operands = [Range::point(0); 3];
                for (range, arg) in operands.iter_mut().zip(graph.args(id)) {
                    *range = meet(self.range(*arg), graph.ty(*arg).range());
                }
                self.cached_range(graph, id, op, operands)
            }
        }
    }

    fn cached_range(
        &self,
        graph: &Graph,
        id: NodeId,
        op: Op,
        operands: [Range; 3],
    ) -> Option<Range> {
        let mut known = self.range_cache.borrow_mut();
        if known.len() < graph.len() {
            // No operand lies nowhere, so these are asked for never.
            let never = CachedRange {
                operands: [Range::new(1, 0); 3],
                result: None,
            };
            known.resize(graph.len(), never);
        }
        let cached = &mut known[id];
        if cached.operands != operands {
            *cached = CachedRange {
                operands,
                result: graph.op_range(id, op, operands),
            };
        }
        cached.result
    }
}
