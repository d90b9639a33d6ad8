//! Reachability of modes: a fixed point with widening, from the cells' values after `init`, tick by
//! tick.
//!
//! A mode is a class for every discrete cell. With it goes the range of every other cell whenever
//! the mode is entered; a range that grows is widened to all that the cell declares, so that this
//! ends after few rounds. The precision lost is recovered afterwards (`narrow`).

mod narrow;

use super::benefit::Lists;
use super::decision_tree::{Decisions, Discrete, Grower, TooBig, Tree};
use super::facts::{Facts, meet};
use super::graph::{Graph, Kind, NodeId};
use super::partial_eval::{PartialEval, Path};
use super::tick::{self, Tick};
use super::tuning;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use whippen_kernel::{Kernel, Op, Range, Type};

/// A mode that occurs.
#[derive(Debug)]
pub(super) struct Reached {
    /// The class of each discrete cell.
    pub classes: Vec<usize>,
    /// Where cells lie when it is entered.
    pub cells: Vec<Range>,
    pub tree: Rc<Tree>,
}

/// Where cells lie after `init`.
pub(super) fn after_init(kernel: &Kernel) -> Vec<Range> {
    let mut graph = Graph::new(kernel);
    let init = tick::read(
        &mut graph,
        &kernel.init,
        &tick::in_memory(kernel, &kernel.init),
    );
    let before: Vec<Range> = kernel
        .cells
        .iter()
        .map(|cell| Range::point(cell.init))
        .collect();
    let path = Path {
        facts: entry(&mut graph, &before),
        ..Path::default()
    };
    let mut eval = PartialEval::default();
    let folded = eval
        .evaluate(&mut graph, &path, &init.roots())
        .unwrap_or_else(|| init.roots());
    ranges(&graph, &eval, &init.with(&folded))
}

/// Where cells lie at the end of a folded tick.
pub(super) fn ranges(graph: &Graph, eval: &PartialEval, tick: &Tick) -> Vec<Range> {
    let range = |(at, cell): (usize, &Option<NodeId>)| match cell {
        Some(id) => graph
            .constant(*id)
            .map_or_else(|| eval.range(*id), Range::point),
        None => graph.kernel.cells[at].range,
    };
    tick.cells.iter().enumerate().map(range).collect()
}

/// Cells that may tell modes apart: bools, and counters at rest at 0.
pub(super) fn discrete(graph: &Graph, tick: &Tick, start: &[Range]) -> Vec<Discrete> {
    let mut found = Vec::new();
    for (cell, declared) in graph
        .kernel
        .cells
        .iter()
        .enumerate()
        .filter(|(cell, _)| tick.cells[*cell].is_some())
    {
        let Range { low, high } = declared.range;
        let classes = match declared.ty {
            Type::I1 if low < high => vec![Range::point(0), Range::point(1)],
            Type::I32 if low == 0 && high > 0 && rests(graph, cell) => {
                vec![Range::point(0), Range::new(1, high)]
            }
            _ => continue,
        };
        let discrete = Discrete { cell, classes };
        if discrete.class(start[cell]).is_some() {
            found.push(discrete);
        }
    }
    found
}

/// Whether something asks if the cell is 0, or about to be.
fn rests(graph: &Graph, cell: usize) -> bool {
    let is_cell = |id: &NodeId| graph.op(*id) == Some(Op::Get(cell as u32));
    let is_rest = |id: &NodeId| {
        graph
            .constant(*id)
            .is_some_and(|value| (0..=1).contains(&value))
    };
    (0..graph.len() as u32).map(NodeId).any(|id| {
        let args = graph.args(id);
        matches!(graph.op(id), Some(Op::Lt | Op::Le | Op::Eq))
            && args.iter().any(is_cell)
            && args.iter().any(is_rest)
    })
}

/// The facts of a mode.
pub(super) fn entry(graph: &mut Graph, cells: &[Range]) -> Facts {
    let mut facts = Facts::default();
    for (cell, range) in cells.iter().enumerate() {
        let declared = &graph.kernel.cells[cell];
        if declared.len == 1 && declared.range != *range {
            let get = graph.node(Kind::Op(Op::Get(cell as u32)), declared.ty, &[]);
            facts.insert(get, *range);
        }
    }
    facts
}

/// How far trees may grow.
pub(super) struct Limits<'a> {
    /// Leaves, of all trees.
    pub leaves: usize,
    /// Nodes that may be visited.
    pub work_max: u64,
    /// Whether nobody asks any more.
    pub is_unasked: &'a AtomicBool,
}

/// All modes that occur, told apart by these cells, the first one first; and how many nodes were
/// visited.
pub(super) fn reach(
    graph: &mut Graph,
    tick: &Tick,
    (discrete, decisions): (&[Discrete], Decisions),
    start: &[Range],
    limits: Limits,
) -> (Result<Vec<Reached>, TooBig>, u64) {
    let mut grower = Grower {
        graph,
        discrete,
        limits,
        eval: PartialEval::default(),
        lists: Lists::default(),
        branch_threshold: decisions.branch_threshold(),
        trial_threshold: decisions.trial_threshold(),
        depth: 0,
    };
    let reached = reach_with(&mut grower, tick, start);
    (reached, grower.work())
}

fn reach_with(grower: &mut Grower, tick: &Tick, start: &[Range]) -> Result<Vec<Reached>, TooBig> {
    let (discrete, leaves) = (grower.discrete, grower.limits.leaves);
    let mut reach = Reach {
        kernel: grower.graph.kernel,
        discrete,
        modes: Vec::new(),
        open: Vec::new(),
        again: Vec::new(),
    };
    reach.enter(start);
    reach.grow_all(grower, tick)?;
    let modes = reach.into_reached()?;
    grower.limits.leaves = leaves;
    Ok(narrow_all(grower, tick, modes, start))
}

/// The modes with narrower ranges of their cells, as long as their trees say that there are some.
fn narrow_all(
    grower: &mut Grower,
    tick: &Tick,
    mut modes: Vec<Reached>,
    start: &[Range],
) -> Vec<Reached> {
    let discrete = grower.discrete;
    for _ in 0..tuning::NARROWING_ROUNDS {
        let Some(entries) = narrow::narrower(&modes, discrete, start) else {
            break;
        };
        let grown = narrow::regrown(entries, &modes, (discrete, start), |cells| {
            grow(grower, cells, tick)
        });
        let Some(narrower) = grown else { break };
        modes = narrower;
    }
    modes
}

fn grow(grower: &mut Grower, cells: &[Range], tick: &Tick) -> Result<Option<Tree>, TooBig> {
    let path = Path {
        facts: entry(grower.graph, cells),
        ..Path::default()
    };
    grower.grow(Rc::new(path), tick)
}

struct Open {
    classes: Vec<usize>,
    cells: Vec<Range>,
    tree: Option<Tree>,
}

struct Reach<'a> {
    kernel: &'a Kernel,
    discrete: &'a [Discrete],
    modes: Vec<Open>,
    /// Modes whose tree is to be grown.
    open: Vec<usize>,
    /// Those whose tree is to be grown anew: when nothing else is left, so that ranges have stopped
    /// growing.
    again: Vec<usize>,
}

impl Reach<'_> {
    /// Grows trees until every mode that they end in has one; all have at most as many leaves as
    /// the grower began with.
    fn grow_all(&mut self, grower: &mut Grower, tick: &Tick) -> Result<(), TooBig> {
        let leaves = grower.limits.leaves;
        while let Some(at) = self.open.pop().or_else(|| self.again.pop()) {
            let trees = self.modes.iter().filter_map(|mode| mode.tree.as_ref());
            let others: usize = trees.map(Tree::leaves).sum();
            grower.limits.leaves = leaves.checked_sub(others).ok_or(TooBig)?;
            let tree = grow(grower, &self.modes[at].cells, tick)?;
            for ranges in tree.iter().flat_map(Tree::ends) {
                self.enter(ranges);
            }
            self.modes[at].tree = tree;
        }
        Ok(())
    }

    /// The modes with their trees. A mode that is entered can be; where its tree says otherwise,
    /// nothing is made.
    fn into_reached(self) -> Result<Vec<Reached>, TooBig> {
        let done = |mode: Open| {
            Some(Reached {
                classes: mode.classes,
                cells: mode.cells,
                tree: Rc::new(mode.tree?),
            })
        };
        let all: Option<Vec<Reached>> = self.modes.into_iter().map(done).collect();
        all.ok_or(TooBig)
    }

    /// The mode of these cells is entered with them.
    fn enter(&mut self, cells: &[Range]) {
        let Some(classes) = classes(self.discrete, cells) else {
            return;
        };
        let Some(at) = self.modes.iter().position(|mode| mode.classes == classes) else {
            self.open.push(self.modes.len());
            self.modes.push(Open {
                classes,
                cells: cells.to_vec(),
                tree: None,
            });
            return;
        };
        let mode = &mut self.modes[at];
        let mut grown = false;
        for (index, (held, new)) in mode.cells.iter_mut().zip(cells).enumerate() {
            if !held.contains(*new) {
                let class = self
                    .discrete
                    .iter()
                    .zip(&mode.classes)
                    .find(|(discrete, _)| discrete.cell == index);
                let all = self.kernel.cells[index].range;
                *held = class.map_or(all, |(discrete, class)| meet(all, discrete.classes[*class]));
                grown = true;
            }
        }
        if grown && !self.open.contains(&at) && !self.again.contains(&at) {
            self.again.push(at);
        }
    }
}

/// The class of each discrete cell, if each has one.
pub(super) fn classes(discrete: &[Discrete], cells: &[Range]) -> Option<Vec<usize>> {
    discrete
        .iter()
        .map(|discrete| discrete.class(cells[discrete.cell]))
        .collect()
}

impl Tree {
    /// Where cells lie at each leaf.
    pub fn ends(&self) -> Vec<&[Range]> {
        let mut all = Vec::new();
        self.add_ends(&mut all);
        all
    }

    fn add_ends<'a>(&'a self, all: &mut Vec<&'a [Range]>) {
        match self {
            Tree::Leaf { ranges, .. } => all.push(ranges),
            Tree::Split { yes, no, .. } => {
                yes.add_ends(all);
                no.add_ends(all);
            }
        }
    }

    pub fn leaves(&self) -> usize {
        match self {
            Tree::Leaf { .. } => 1,
            Tree::Split { yes, no, .. } => yes.leaves() + no.leaves(),
        }
    }
}
