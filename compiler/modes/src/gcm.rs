//! Global code motion: from trees of decisions to blocks, each computation in the block where it is
//! scheduled.
//!
//! ```text
//!            a, b, compare          early: what every leaf below needs, as high as its operands allow
//!           /             \         what only one side needs is computed on that side
//!      c, set x a        set x b    bools per use, so that a branch follows its comparison
//! ```
//!
//! Computations are scheduled early; those whose result would only take a register down to the
//! blocks below are sunk again (`sink`).
//!
//! | part | what it settles |
//! | --- | --- |
//! | `needs` | what each node of the tree of decisions needs, on all paths and on some |
//! | `emit` | a node of the graph as instructions at the end of a block |
//! | `branch` | decisions as branches |
//! | `sink` | rematerialization below instead of a live register |
//! | `block_order` | topological order of the blocks |
//! | `sorted` | sets of nodes as sorted lists |

mod block_order;
mod branch;
mod emit;
mod needs;
mod sink;
mod sorted;

use super::decision_tree::Discrete;
use super::graph::{Graph, Kind, NodeId};
use super::partial_eval::PartialEval;
use super::reach::Reached;
use super::{Block, BlockId, End, Mode, ModeId, merge};
use block_order::{empty_block, in_order};
use needs::{Needs, Then, needs};
use rustc_hash::{FxHashMap, FxHashSet};
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_kernel::{Op, Range, Type, Value, ValueInfo};

/// What all modes know of each other.
pub(super) struct Plan<'a> {
    pub discrete: &'a [Discrete],
    pub modes: &'a IdMap<ModeId, Reached>,
    /// Which cells a mode knows, by mode.
    pub known: &'a IdMap<ModeId, Vec<bool>>,
}

/// The blocks of all modes.
pub(super) fn modes(graph: &mut Graph, plan: &Plan) -> Option<IdMap<ModeId, Mode>> {
    let needs = plan
        .modes
        .enumerated()
        .map(|(at, reached)| needs(graph, plan, at, &reached.tree));
    let needs: Vec<Needs> = needs.collect::<Option<_>>()?;
    let graph = &*graph;
    let placed = parallel::map_with(needs, PartialEval::default, |eval, needs| {
        blocks(graph, eval, &needs)
    });
    let modes = plan
        .modes
        .iter()
        .zip(plan.known)
        .zip(placed)
        .map(|((reached, known), placed)| {
            let (values, blocks) = placed?;
            let name = name(graph, plan, reached);
            Some(Mode {
                name,
                cells: reached.cells.clone(),
                known: known.clone(),
                values,
                blocks,
            })
        });
    modes.collect()
}

/// The values of a mode, and its blocks.
type Code = (IdMap<Value, ValueInfo>, IdMap<BlockId, Block>);

/// The code of a mode; none if it becomes too large.
fn blocks(graph: &Graph, eval: &mut PartialEval, needs: &Needs) -> Option<Code> {
    let mut scheduler = Scheduler {
        graph,
        eval,
        values: IdMap::new(),
        blocks: vec![empty_block()].into(),
        at: BlockId(0),
        placed: FxHashMap::default(),
        here: FxHashMap::default(),
        results: FxHashMap::default(),
        trail: Vec::new(),
        depth: 0,
    };
    let placed = scheduler.schedule(needs, BlockId(0));
    let Scheduler {
        values,
        blocks,
        eval,
        ..
    } = scheduler;
    eval.undo_to(0);
    placed?;
    let blocks = in_order(merge::equal_tails(in_order(blocks), &values));
    Some((values, blocks))
}

fn name(graph: &Graph, plan: &Plan, reached: &Reached) -> String {
    let word = |(discrete, class): (&Discrete, &usize)| {
        let name = &graph.kernel.cells[discrete.cell].name;
        let Range { low, high } = discrete.classes[*class];
        if low == high {
            format!("{name}={low}")
        } else {
            format!("{name}={low}..{high}")
        }
    };
    let words: Vec<String> = plan
        .discrete
        .iter()
        .zip(&reached.classes)
        .map(word)
        .collect();
    if words.is_empty() {
        "any".to_string()
    } else {
        words.join(" ")
    }
}

/// Schedules the computations of one mode, from the first block down.
struct Scheduler<'a, 'k> {
    graph: &'a Graph<'k>,
    eval: &'a mut PartialEval,
    values: IdMap<Value, ValueInfo>,
    blocks: IdMap<BlockId, Block>,
    /// The block that is filled.
    at: BlockId,
    /// Nodes that stand in this block or above.
    placed: FxHashMap<NodeId, Value>,
    /// Constants and bools in this block.
    here: FxHashMap<NodeId, Value>,
    /// Results of effects.
    results: FxHashMap<NodeId, Vec<Value>>,
    /// What was placed, in order.
    trail: Vec<NodeId>,
    /// How deep in bools this is.
    depth: usize,
}

impl Scheduler<'_, '_> {
    /// Fills a block with what this part of the tree needs there, and all blocks below.
    fn schedule(&mut self, needs: &Needs, block: BlockId) -> Option<()> {
        let above = self.trail.len();
        self.enter_block(block);
        for id in &needs.by_all {
            let natural = self.eval.range_from_operands(self.graph, *id);
            let fact = needs.path.facts.get(id).copied().unwrap_or(natural);
            self.eval.set_range(*id, super::facts::meet(natural, fact));
        }
        match &needs.then {
            Then::Next(next) => {
                self.schedule_all(&needs.by_all)?;
                self.blocks[block].end = End::Next(*next);
            }
            Then::Split(condition, yes, no) => {
                let early = self.schedulable_early(needs);
                let staying = sink::without_sunk(self, needs, *condition, early);
                self.schedule_all(&staying)?;
                let (yes_block, no_block) = self.branch(*condition)?;
                self.schedule(yes, yes_block)?;
                self.schedule(no, no_block)?;
            }
        }
        for id in self.trail.split_off(above) {
            self.placed.remove(&id);
        }
        Some(())
    }

    /// What follows goes to this block.
    fn enter_block(&mut self, block: BlockId) {
        self.at = block;
        self.here.clear();
    }

    /// Puts all that does not stand yet into the block. What is overwritten at the end is read
    /// before.
    fn schedule_all(&mut self, all: &[NodeId]) -> Option<()> {
        for writes in [false, true] {
            for id in all {
                let free = !self.placed.contains_key(id)
                    && !self.is_made_per_use(*id)
                    && self.is_write(*id) == writes;
                if free {
                    self.emit(*id)?;
                }
            }
        }
        Some(())
    }

    /// What may stand here, above decisions that are still to come.
    fn schedulable_early(&self, needs: &Needs) -> Vec<NodeId> {
        let mut all = Vec::new();
        let mut there = FxHashSet::default();
        for writes in [false, true] {
            for id in needs
                .by_all
                .iter()
                .filter(|id| !self.placed.contains_key(id))
            {
                let is_ready = self
                    .graph
                    .args(*id)
                    .iter()
                    .all(|arg| self.placed.contains_key(arg) || there.contains(arg));
                if self.is_made_per_use(*id) {
                    if is_ready {
                        there.insert(*id);
                    }
                } else if self.is_write(*id) == writes
                    && is_ready
                    && self.may_hoist(needs, *id, &there)
                {
                    there.insert(*id);
                    all.push(*id);
                }
            }
        }
        all
    }

    /// Whether it does the same here as below.
    fn may_hoist(&self, needs: &Needs, id: NodeId, there: &FxHashSet<NodeId>) -> bool {
        if self.eval.proven_range(self.graph, id).is_none() {
            return false;
        }
        let later = |reads: &dyn Fn(Op) -> bool| {
            let open = |id: &NodeId| !self.placed.contains_key(id) && !there.contains(id);
            needs
                .by_some
                .iter()
                .any(|id| open(id) && self.graph.contains_op(*id, reads))
        };
        match self.graph.kind(id) {
            Kind::Op(Op::Set(cell)) => !later(&|op| op == Op::Get(cell)),
            Kind::Op(Op::Push(line)) => {
                !later(&|op| matches!(op, Op::Delay(l, _) | Op::DelayAt(l) if l == line))
            }
            Kind::Effect(_) => self.graph.constant(self.graph.args(id)[0]) == Some(1),
            _ => true,
        }
    }

    fn is_write(&self, id: NodeId) -> bool {
        self.graph
            .op(id)
            .is_some_and(|op| op.row().result.is_none())
    }

    /// Whether each block that uses it computes it anew: constants and bools.
    fn is_made_per_use(&self, id: NodeId) -> bool {
        match self.graph.op(id) {
            Some(Op::Const(_)) => true,
            Some(op) => {
                matches!(op.row().meaning, whippen_kernel::op::Meaning::Exact(_))
                    && self.graph.ty(id) == Type::I1
            }
            None => false,
        }
    }
}
