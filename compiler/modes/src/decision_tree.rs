//! Decision trees by trace splitting: at every inner node one condition is decided and both sides
//! are partially evaluated under it; at a leaf the next mode is known.

use super::benefit::{Benefits, Candidate, Limit, Lists};
use super::graph::{Graph, Kind, NodeId};
use super::partial_eval::{PartialEval, Path};
use super::reach::{self, Limits};
use super::tick::Tick;
use super::tuning;
use super::{decision_order, facts};
use std::rc::Rc;
use std::sync::atomic::Ordering;
use whippen_kernel::{Op, Range, Type};
use whippen_target_info::BRANCH_CYCLES;

/// A cell by whose classes modes are told apart.
#[derive(Debug, Clone)]
pub(super) struct Discrete {
    pub cell: usize,
    /// Ranges, in order, without gaps.
    pub classes: Vec<Range>,
}

impl Discrete {
    /// The class that holds all of the range.
    pub fn class(&self, range: Range) -> Option<usize> {
        self.classes.iter().position(|class| class.contains(range))
    }
}

/// A tree of decisions.
#[derive(Debug)]
pub(super) enum Tree {
    Split {
        path: Rc<Path>,
        condition: NodeId,
        yes: Box<Tree>,
        no: Box<Tree>,
    },
    Leaf {
        path: Rc<Path>,
        tick: Tick,
        ranges: Vec<Range>,
    },
}

/// The trees would have too many leaves, or growing them would be too much work.
#[derive(Debug)]
pub(super) struct TooBig;

/// Which decisions are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Decisions {
    /// Those that tell the next mode, and those that save cycles.
    All,
    /// Those that tell the next mode: fewer leaves and less work.
    Successor,
}

impl Decisions {
    pub fn branch_threshold(self) -> u32 {
        match self {
            Decisions::All => tuning::BRANCH_THRESHOLD,
            Decisions::Successor => u32::MAX,
        }
    }

    pub fn trial_threshold(self) -> u32 {
        match self {
            Decisions::All => tuning::TRIAL_THRESHOLD,
            Decisions::Successor => u32::MAX,
        }
    }
}

/// What a tree is grown from.
pub(super) struct Grower<'a, 'k> {
    pub graph: &'a mut Graph<'k>,
    pub discrete: &'a [Discrete],
    /// What is left of it.
    pub limits: Limits<'a>,
    pub eval: PartialEval,
    pub lists: Lists,
    /// Least saving, in cycles, for a branch that is not needed to find the next mode.
    pub branch_threshold: u32,
    /// Least estimated saving on the better side for a condition to be tried out.
    pub trial_threshold: u32,
    /// Decisions on the path so far.
    pub depth: usize,
}

impl Grower<'_, '_> {
    /// The tree for a tick under these facts; none if they contradict each other.
    pub fn grow(&mut self, path: Rc<Path>, tick: &Tick) -> Result<Option<Tree>, TooBig> {
        let nodes = self.eval.nodes_below(self.graph, &path, &tick.roots());
        self.grow_over(path, tick, &nodes)
    }

    /// The same; `nodes` are all that the tick and what was decided are made of.
    fn grow_over(
        &mut self,
        path: Rc<Path>,
        tick: &Tick,
        nodes: &[NodeId],
    ) -> Result<Option<Tree>, TooBig> {
        self.deeper(|grower| {
            let Some(folded) = grower
                .eval
                .evaluate_over(grower.graph, &path, &tick.roots(), nodes)
            else {
                return Ok(None);
            };
            grower.grow_on(path, tick.with(&folded))
        })
    }

    /// Nodes that were visited.
    pub fn work(&self) -> u64 {
        self.eval.work + self.lists.work
    }

    /// One decision further down; what is found there is forgotten behind it.
    fn deeper<T>(
        &mut self,
        grow: impl FnOnce(&mut Self) -> Result<T, TooBig>,
    ) -> Result<T, TooBig> {
        let limits = &self.limits;
        if self.depth > tuning::DECISIONS_DEEP
            || self.work() > limits.work_max
            || limits.is_unasked.load(Ordering::Relaxed)
        {
            return Err(TooBig);
        }
        let mark = self.eval.mark();
        self.depth += 1;
        let tree = grow(self);
        self.depth -= 1;
        self.eval.undo_to(mark);
        tree
    }

    /// The tree for a folded tick.
    fn grow_on(&mut self, path: Rc<Path>, tick: Tick) -> Result<Option<Tree>, TooBig> {
        let roots = tick.roots();
        let chosen = self
            .choose(&path, &tick, &roots)
            .or_else(|| self.choose_by_trial(&path, &roots));
        let Some(condition) = chosen else {
            return self.leaf(path, tick).map(Some);
        };
        let if_yes = path.decided_so(self.graph, &self.eval, condition, true);
        let if_no = path.decided_so(self.graph, &self.eval, condition, false);
        // Both sides are decided by the same.
        let Some(either) = if_yes.as_ref().or(if_no.as_ref()) else {
            return Ok(None);
        };
        let nodes = self.eval.nodes_below(self.graph, either, &roots);
        // The other side is looked at first, because where it cannot be nothing is decided here.
        let no = if_no.and_then(|no| {
            Some((
                self.eval
                    .evaluate_and_undo(self.graph, &no, &roots, &nodes)?,
                Rc::new(no),
            ))
        });
        let (if_yes, (found, if_no)) = match (if_yes, no) {
            (Some(yes), Some(no)) => (Rc::new(yes), no),
            (Some(yes), None) => {
                return self.grow_given(&path, &yes, &tick, (condition, true), &nodes);
            }
            (None, Some((_, no))) => {
                return self.grow_given(&path, &no, &tick, (condition, false), &nodes);
            }
            (None, None) => return Ok(None),
        };
        let Some(yes) = self.grow_over(if_yes.clone(), &tick, &nodes)? else {
            return self.grow_given(&path, &if_no, &tick, (condition, false), &nodes);
        };
        let no = self.deeper(|grower| {
            grower.eval.replay(&found);
            grower.grow_on(if_no, tick.with(&found.roots))
        })?;
        let Some(no) = no else {
            return self.grow_given(&path, &if_yes, &tick, (condition, true), &nodes);
        };
        Ok(Some(Tree::Split {
            path,
            condition,
            yes: Box::new(yes),
            no: Box::new(no),
        }))
    }

    /// The tree where the condition cannot be otherwise. No branch says so, so nothing is concluded
    /// for the values it is made of; only what it tells of the next mode is assumed.
    fn grow_given(
        &mut self,
        path: &Path,
        strong: &Path,
        tick: &Tick,
        (condition, holds): (NodeId, bool),
        nodes: &[NodeId],
    ) -> Result<Option<Tree>, TooBig> {
        let mark = self.eval.mark();
        let roots = self
            .eval
            .evaluate_over(self.graph, strong, &tick.roots(), nodes);
        let ranges = roots.map(|roots| reach::ranges(self.graph, &self.eval, &tick.with(&roots)));
        self.eval.undo_to(mark);
        let Some(ranges) = ranges else {
            return Ok(None);
        };
        let mut tick = tick.clone();
        for discrete in self.discrete {
            let Some(id) = tick.cells[discrete.cell] else {
                continue;
            };
            let Range { low, high } = ranges[discrete.cell];
            let ty = self.graph.ty(id);
            tick.cells[discrete.cell] = Some(match ty {
                _ if low == high => self.graph.constant_node(ty, low),
                Type::I1 => id,
                _ => self.graph.node(Kind::Op(Op::Assume(low, high)), ty, &[id]),
            });
        }
        self.grow(Rc::new(path.decided_without_facts(condition, holds)), &tick)
    }

    fn leaf(&mut self, path: Rc<Path>, tick: Tick) -> Result<Tree, TooBig> {
        self.limits.leaves = self.limits.leaves.checked_sub(1).ok_or(TooBig)?;
        let ranges = reach::ranges(self.graph, &self.eval, &tick);
        Ok(Tree::Leaf { path, tick, ranges })
    }

    /// The condition that is best decided now; none if nothing is left that pays or must be.
    fn choose(&mut self, path: &Path, tick: &Tick, roots: &[NodeId]) -> Option<NodeId> {
        let successor_conditions = self.next_states(tick);
        let (branch_threshold, trial_threshold) = (self.branch_threshold, self.trial_threshold);
        let mut benefits = Benefits::new(self.graph, &mut self.lists, roots, &successor_conditions);
        let mut best: Option<((u32, u32), NodeId)> = None;
        for at in benefits.in_order() {
            let Candidate {
                condition,
                use_count,
                decides_successor,
                ..
            } = benefits.candidate(at);
            let score = (benefits.of_worse_side(at), use_count);
            if (decides_successor || score.0 >= branch_threshold)
                && best.is_none_or(|(most, _)| score > most)
            {
                best = Some((score, condition));
            }
        }
        let (_, best) = best?;
        // What would be tried out later counts as well: what one comparison tells, others need not
        // ask.
        let wanted = |benefits: &mut Benefits, at: usize| {
            benefits.candidate(at).decides_successor
                || benefits.of_worse_side(at) >= branch_threshold
                || benefits.of_better_side(at) >= trial_threshold
        };
        match benefits.compared_alike(best, wanted) {
            Some((of, limits)) if limits.len() > 1 => {
                Some(self.first_of(path, tick, of, &limits).unwrap_or(best))
            }
            _ => Some(benefits.most_shared(best)),
        }
    }

    /// Of several comparisons of one value with constants, the one that is best decided first; none
    /// if none pays.
    fn first_of(
        &mut self,
        path: &Path,
        tick: &Tick,
        of: NodeId,
        limits: &[Limit],
    ) -> Option<NodeId> {
        if limits.len() > tuning::COMPARISONS_WEIGHED {
            return Some(limits[limits.len() / 2].condition);
        }
        let successor_conditions: Vec<bool> =
            limits.iter().map(|limit| limit.decides_successor).collect();
        let Range { low, high } = self.eval.range(of);
        let lows: Vec<i64> = std::iter::once(low)
            .chain(limits.iter().map(|limit| limit.limit))
            .collect();
        let highs: Vec<i64> = limits
            .iter()
            .map(|limit| limit.limit - 1)
            .chain(std::iter::once(high))
            .collect();
        let nodes = self.eval.nodes_below(self.graph, path, &tick.roots());
        let mut costs: decision_order::Costs = vec![Vec::new(); lows.len()];
        for (at, low) in lows.iter().enumerate() {
            for (to, high) in highs.iter().enumerate().skip(at) {
                // Where something must be decided, nobody asks what it costs if it is not.
                let is_left = to == at || !successor_conditions[at..to].contains(&true);
                let within = (of, Range::new(*low, *high));
                let cost = if is_left {
                    self.cost_within(path, tick, &nodes, within)
                } else {
                    u32::MAX
                };
                costs[at].push(cost);
            }
        }
        decision_order::best_first(&successor_conditions, &costs, self.branch_threshold)
            .map(|at| limits[at].condition)
    }

    /// Cycles of what is left to do, and to decide for the next mode, where a node lies so.
    fn cost_within(
        &mut self,
        path: &Path,
        tick: &Tick,
        nodes: &[NodeId],
        (of, range): (NodeId, Range),
    ) -> u32 {
        let narrowed = facts::with(
            self.graph,
            &|id| self.eval.range(id),
            &path.facts,
            of,
            range,
        );
        let Some((facts, new_facts)) = narrowed else {
            return 0;
        };
        let (roots, mark) = (tick.roots(), self.eval.mark());
        let within = Path {
            facts,
            new_facts,
            decided: Vec::new(),
        };
        let folded = self.eval.evaluate_over(self.graph, &within, &roots, nodes);
        let cost = folded.map_or(0, |roots| {
            let successor_conditions = self.next_states(&tick.with(&roots)).len() as u32;
            self.eval.cost(self.graph, &roots) + BRANCH_CYCLES * successor_conditions
        });
        self.eval.undo_to(mark);
        cost
    }

    /// Where nothing is left that pays by itself: the condition that saves most once both ways are
    /// folded under what it tells of ranges, such as that of two limits one is never met; none if
    /// none pays.
    fn choose_by_trial(&mut self, path: &Path, roots: &[NodeId]) -> Option<NodeId> {
        let mut benefits = Benefits::new(self.graph, &mut self.lists, roots, &[]);
        let mut promising = benefits.in_order();
        promising.retain(|at| benefits.of_better_side(*at) >= self.trial_threshold);
        let promising: Vec<NodeId> = promising
            .into_iter()
            .map(|at| benefits.candidate(at).condition)
            .collect();
        if promising.is_empty() {
            return None;
        }
        let now = self.eval.cost(self.graph, roots);
        let mut best: Option<(u32, NodeId)> = None;
        for condition in promising {
            let sides = [true, false]
                .map(|holds| path.decided_so(self.graph, &self.eval, condition, holds));
            let [Some(if_yes), Some(if_no)] = sides else {
                continue;
            };
            // Both sides are decided by the same.
            let nodes = self.eval.nodes_below(self.graph, &if_yes, roots);
            let costs = [if_yes, if_no].map(|side| {
                let found = self
                    .eval
                    .evaluate_and_undo(self.graph, &side, roots, &nodes)?;
                Some(self.eval.cost(self.graph, &found.roots))
            });
            let [Some(yes), Some(no)] = costs else {
                continue;
            };
            let saved = now.saturating_sub(yes.max(no) + BRANCH_CYCLES);
            if saved >= self.branch_threshold && best.is_none_or(|(most, _)| saved > most) {
                best = Some((saved, condition));
            }
        }
        best.map(|(_, condition)| condition)
    }

    /// Bools that tell the class of a cell at the end.
    fn next_states(&mut self, tick: &Tick) -> Vec<NodeId> {
        let mut found = Vec::new();
        for discrete in self.discrete {
            let Some(id) = tick.cells[discrete.cell] else {
                continue;
            };
            let range = self
                .graph
                .constant(id)
                .map_or_else(|| self.eval.range(id), Range::point);
            if discrete.class(range).is_some() {
                continue;
            }
            if self.graph.ty(id) == Type::I1 {
                found.push(id);
                continue;
            }
            let inside = discrete
                .classes
                .iter()
                .find(|class| class.high >= range.low)
                .map_or(range.high, |c| c.high);
            let limit = self
                .eval
                .constant(self.graph, self.graph.ty(id), inside + 1);
            found.push(
                self.eval
                    .fold_pure(self.graph, Op::Lt, Type::I1, &[id, limit]),
            );
        }
        found
    }
}

impl Tick {
    /// All that the tick leaves.
    pub fn roots(&self) -> Vec<NodeId> {
        self.cells
            .iter()
            .flatten()
            .chain(&self.writes)
            .chain(std::iter::once(&self.last))
            .copied()
            .collect()
    }

    /// The same with these roots.
    pub fn with(&self, roots: &[NodeId]) -> Tick {
        let mut roots = roots.iter().copied();
        let mut next = |old: NodeId| roots.next().unwrap_or(old);
        let cells = self.cells.iter().map(|cell| cell.map(&mut next)).collect();
        let writes = self.writes.iter().map(|write| next(*write)).collect();
        Tick {
            cells,
            writes,
            last: next(self.last),
        }
    }
}
