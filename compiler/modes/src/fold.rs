//! Partial evaluation: the same graph under facts, bit for bit, with what they decide decided.
//!
//! Nodes are taken in their order. Each is made anew from its folded operands: its range follows by
//! the table of operators, a range of one value is a constant, and what choices, limits and bools
//! come to is in `rules`.

mod divide;
mod rules;

use super::facts::{self, Facts, meet};
use super::graph::{Graph, NodeId, Kind, Walk};
use std::cell::RefCell;
use whippen_ids::{Id, IdMap};
use whippen_kernel::op::Effect;
use whippen_kernel::{Op, Range, Type};

/// A way through the decisions.
#[derive(Debug, Clone, Default)]
pub(super) struct Path {
    /// What it says.
    pub facts: Facts,
    /// The conditions; what they are made of has been computed, and stays as it is.
    pub decided: Vec<NodeId>,
    /// The nodes of which it says more than the path that it goes on from.
    pub latest: Vec<NodeId>,
}

impl Path {
    /// On from here, where the condition is so; none if it cannot be.
    pub fn on(&self, graph: &Graph, fold: &Fold, condition: NodeId, holds: bool) -> Option<Path> {
        let range = Range::point(holds.into());
        let (facts, latest) =
            facts::with(graph, &|id| fold.range(id), &self.facts, condition, range)?;
        let decided = self
            .decided
            .iter()
            .copied()
            .chain(std::iter::once(condition))
            .collect();
        Some(Path {
            facts,
            decided,
            latest,
        })
    }

    /// On from here, where the condition cannot be otherwise. No branch will say so, so nothing is
    /// concluded from it.
    pub fn given(&self, condition: NodeId, holds: bool) -> Path {
        let mut path = self.clone();
        path.facts.insert(condition, Range::point(holds.into()));
        path.decided.push(condition);
        path.latest = vec![condition];
        path
    }
}

/// Where nodes lie on a path. A run goes on from the one before, and looks only at what follows
/// from what is new; so that the other side of a decision can be taken, it can be [taken
/// back](Fold::back).
#[derive(Debug, Default)]
pub(super) struct Fold {
    ranges: IdMap<NodeId, Range>,
    /// Whether a decision is made of it.
    kept: IdMap<NodeId, bool>,
    /// What the last run made of a node that is not as it was, by node.
    folded: IdMap<NodeId, (u32, NodeId)>,
    /// The last run with new facts of a node.
    told: IdMap<NodeId, u32>,
    /// Which run this is.
    run: u32,
    /// Something lies nowhere: the path cannot be taken.
    impossible: bool,
    /// What to take back, the latest last.
    trail: Vec<Undo>,
    /// How many rules deep this is.
    depth: usize,
    /// By node: where it lies, for those ranges of its operands that it was asked for last.
    lies: RefCell<IdMap<NodeId, Lies>>,
    walk: Walk,
}

/// Where a node lies for some ranges of its operands; none if the table cannot tell.
#[derive(Debug, Clone, Copy)]
struct Lies {
    operands: [Range; 3],
    result: Option<Range>,
}

/// Rules that lead to rules, at most: behind that an operator stands as it is, so that long chains
/// need no stack.
const DEPTH: usize = 64;

/// What a run found, taken back, to be had again without another run.
#[derive(Debug)]
pub(super) struct Found {
    /// The folded roots.
    pub roots: Vec<NodeId>,
    ranges: Vec<(NodeId, Range)>,
    kept: Vec<NodeId>,
}

#[derive(Debug, Clone, Copy)]
enum Undo {
    Range(NodeId, Range),
    Kept(NodeId),
}

const UNKNOWN: Range = Range {
    low: i64::MIN,
    high: i64::MAX,
};

impl Fold {
    /// Where a node lies that the runs came by.
    pub fn range(&self, id: NodeId) -> Range {
        self.ranges.get(id).copied().unwrap_or(UNKNOWN)
    }

    /// Where the fold stands, for [`Fold::back`].
    pub fn mark(&self) -> usize {
        self.trail.len()
    }

    /// Forgets all since the mark.
    pub fn back(&mut self, mark: usize) {
        for undo in self.trail.drain(mark..).rev() {
            match undo {
                Undo::Range(id, range) => self.ranges[id] = range,
                Undo::Kept(id) => self.kept[id] = false,
            }
        }
    }

    /// A run that is taken back at once; none if its facts contradict each other.
    pub fn try_run(
        &mut self,
        graph: &mut Graph,
        path: &Path,
        roots: &[NodeId],
        nodes: &[NodeId],
    ) -> Option<Found> {
        let mark = self.mark();
        let found = self.run_over(graph, path, roots, nodes).map(|roots| {
            let (mut ranges, mut kept) = (Vec::new(), Vec::new());
            for undo in &self.trail[mark..] {
                match undo {
                    Undo::Range(id, _) => ranges.push((*id, self.range(*id))),
                    Undo::Kept(id) => kept.push(*id),
                }
            }
            Found {
                roots,
                ranges,
                kept,
            }
        });
        self.back(mark);
        found
    }

    /// What such a run found, from where it began.
    pub fn again(&mut self, found: &Found) {
        found
            .ranges
            .iter()
            .for_each(|(id, range)| self.put(*id, *range));
        for id in &found.kept {
            self.kept[id] = true;
            self.trail.push(Undo::Kept(*id));
        }
    }

    /// The roots on this path, which goes on from that of the run before; none if its facts
    /// contradict each other.
    pub fn run(&mut self, graph: &mut Graph, path: &Path, roots: &[NodeId]) -> Option<Vec<NodeId>> {
        let nodes = self.nodes(graph, path, roots);
        self.run_over(graph, path, roots, &nodes)
    }

    /// All that the roots and what was decided are made of, operands first.
    pub fn nodes(&mut self, graph: &Graph, path: &Path, roots: &[NodeId]) -> Vec<NodeId> {
        self.walk
            .over(graph, roots.iter().chain(&path.decided).copied())
    }

    /// Cycles of all that the roots need.
    pub fn cost(&mut self, graph: &Graph, roots: &[NodeId]) -> u32 {
        let nodes = self.walk.over(graph, roots.iter().copied());
        nodes
            .into_iter()
            .map(|id| graph.cycles(id))
            .fold(0, u32::saturating_add)
    }

    /// The same over [those nodes](Fold::nodes).
    pub fn run_over(
        &mut self,
        graph: &mut Graph,
        path: &Path,
        roots: &[NodeId],
        nodes: &[NodeId],
    ) -> Option<Vec<NodeId>> {
        self.start(graph, path);
        for id in nodes {
            if self.is_stale(graph, *id) {
                self.renew(graph, &path.facts, *id);
            }
            if self.impossible {
                return None;
            }
        }
        Some(roots.iter().map(|root| self.now(*root)).collect())
    }

    fn start(&mut self, graph: &Graph, path: &Path) {
        self.run += 1;
        self.impossible = false;
        self.ranges.resize(graph.len(), UNKNOWN);
        self.kept.resize(graph.len(), false);
        self.folded.resize(graph.len(), (0, NodeId(0)));
        self.told.resize(graph.len(), 0);
        path.latest
            .iter()
            .for_each(|id| self.told[id] = self.run);
        for id in self
            .walk
            .over(graph, path.decided.last().copied().into_iter())
        {
            if !std::mem::replace(&mut self.kept[id], true) {
                self.trail.push(Undo::Kept(id));
            }
        }
    }

    /// What the last run made of a node.
    fn now(&self, id: NodeId) -> NodeId {
        let (run, folded) = self.folded[id];
        if run == self.run { folded } else { id }
    }

    fn is_stale(&self, graph: &Graph, id: NodeId) -> bool {
        let is_new = self.told[id] == self.run || self.ranges[id] == UNKNOWN;
        is_new
            || graph
                .args(id)
                .iter()
                .any(|arg| self.folded[arg].0 == self.run)
    }

    fn renew(&mut self, graph: &mut Graph, facts: &Facts, id: NodeId) {
        let before = self.range(id);
        let new = if self.kept[id] {
            self.put(id, self.natural(graph, id));
            self.learn(graph, facts, id, id)
        } else {
            self.fold(graph, facts, id)
        };
        if new != id || self.range(id) != before {
            self.folded[id] = (self.run, new);
        }
    }

    fn fold(&mut self, graph: &mut Graph, facts: &Facts, id: NodeId) -> NodeId {
        let old = graph.args(id);
        let (mut few, many);
        let args: &[NodeId] = if old.len() <= 3 {
            few = [NodeId(0); 3];
            few.iter_mut()
                .zip(old)
                .for_each(|(new, old)| *new = self.now(*old));
            &few[..old.len()]
        } else {
            many = old.iter().map(|arg| self.now(*arg)).collect::<Vec<NodeId>>();
            &many
        };
        // Of the same operands it is the same node, unless there is something simpler.
        let same = (args == old).then_some(id);
        graph.origin = graph.origin_of(id);
        let ty = graph.ty(id);
        let new = match graph.kind(id) {
            Kind::Op(op) if op.row().effect == Effect::Pure => {
                self.pure_or(graph, op, ty, args, same)
            }
            Kind::Result(_) if !matches!(graph.kind(args[0]), Kind::Effect(_)) => {
                // The effect does not happen; nobody looks at its results.
                let low = self.natural(graph, id).low;
                self.number(graph, ty, low)
            }
            kind => self.other(graph, kind, ty, args),
        };
        self.learn(graph, facts, id, new)
    }

    /// What the facts say of a node, and of the one it comes from.
    fn learn(&mut self, graph: &mut Graph, facts: &Facts, old: NodeId, new: NodeId) -> NodeId {
        let mut range = self.range(new);
        for id in [old, new] {
            range = facts.get(&id).map_or(range, |fact| meet(range, *fact));
        }
        self.impossible |= range.is_empty();
        self.put(new, range);
        let becomes_known = range.low == range.high && graph.constant(new) != Some(range.low);
        if becomes_known && !graph.is_done(new) {
            return self.number(graph, graph.ty(new), range.low);
        }
        new
    }

    pub(super) fn put(&mut self, id: NodeId, range: Range) {
        if self.ranges.get(id).is_none() {
            self.ranges.resize(id.index() + 1, UNKNOWN);
        }
        let old = std::mem::replace(&mut self.ranges[id], range);
        if old != range {
            self.trail.push(Undo::Range(id, old));
        }
    }

    pub(super) fn number(&mut self, graph: &mut Graph, ty: Type, value: i64) -> NodeId {
        let id = graph.number(ty, value);
        self.put(id, Range::point(value));
        id
    }

    /// Reads, writes, effects.
    fn other(&mut self, graph: &mut Graph, kind: Kind, ty: Type, args: &[NodeId]) -> NodeId {
        match kind {
            Kind::Effect(_) if graph.constant(args[0]) == Some(0) => return args[1],
            _ => {}
        }
        let id = graph.node(kind, ty, args);
        let range = self.natural(graph, id);
        self.put(id, range);
        id
    }

    /// A pure operator of folded operands.
    pub(super) fn pure(&mut self, graph: &mut Graph, op: Op, ty: Type, args: &[NodeId]) -> NodeId {
        self.pure_or(graph, op, ty, args, None)
    }

    /// The same, if it is known which node that is.
    fn pure_or(
        &mut self,
        graph: &mut Graph,
        op: Op,
        ty: Type,
        args: &[NodeId],
        known: Option<NodeId>,
    ) -> NodeId {
        self.depth += 1;
        let simpler = if self.depth <= DEPTH {
            self.simpler(graph, op, ty, args)
        } else {
            None
        };
        self.depth -= 1;
        if let Some(id) = simpler {
            return id;
        }
        let id = known.unwrap_or_else(|| graph.node(Kind::Op(op), ty, args));
        let range = self.natural(graph, id);
        if range.low == range.high {
            return self.number(graph, ty, range.low);
        }
        self.put(id, range);
        id
    }

    /// Where a node lies, given where its operands lie.
    pub fn natural(&self, graph: &Graph, id: NodeId) -> Range {
        self.proven(graph, id).unwrap_or(graph.ty(id).range())
    }

    /// The same; none if the table cannot tell, because the result might not fit its type.
    pub fn proven(&self, graph: &Graph, id: NodeId) -> Option<Range> {
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
                self.lies(graph, id, op, operands)
            }
        }
    }

    fn lies(&self, graph: &Graph, id: NodeId, op: Op, operands: [Range; 3]) -> Option<Range> {
        let mut known = self.lies.borrow_mut();
        if known.len() < graph.len() {
            // No operand lies nowhere, so these are asked for never.
            let never = Lies {
                operands: [Range::new(1, 0); 3],
                result: None,
            };
            known.resize(graph.len(), never);
        }
        let lies = &mut known[id];
        if lies.operands != operands {
            *lies = Lies {
                operands,
                result: graph.lies(id, op, operands),
            };
        }
        lies.result
    }
}
