//! The decisions of one mode: at every node of the tree one condition is decided, and both ways are
//! folded anew under what that says; at a leaf the next mode is known.

use super::fold::{Fold, Path};
use super::gain::{Asking, Gains, Limit, Lists};
use super::graph::{Graph, NodeId, Kind};
use super::tick::Tick;
use super::{cost, facts, order, reach};
use std::rc::Rc;
use whippen_kernel::{Op, Range, Type};

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

/// The tree would have too many leaves.
#[derive(Debug)]
pub(super) struct TooBig;

/// What a tree is grown from.
pub(super) struct Grower<'a, 'k> {
    pub graph: &'a mut Graph<'k>,
    pub discrete: &'a [Discrete],
    /// How many leaves are left.
    pub leaves: usize,
    pub fold: Fold,
    pub lists: Lists,
    /// Cycles that a decision must save which does not tell the next mode.
    pub worth: u32,
    /// Cycles that a condition must seem to save on its cheaper side to be tried out.
    pub promising: u32,
    /// How many decisions the way so far has.
    pub depth: usize,
}

/// Decisions on one way; no instrument comes near, and what goes down a tree needs stack.
const DEPTH: usize = 100;

impl Grower<'_, '_> {
    /// The tree for a tick under these facts; none if they contradict each other.
    pub fn grow(&mut self, path: Rc<Path>, tick: &Tick) -> Result<Option<Tree>, TooBig> {
        let nodes = self.fold.nodes(self.graph, &path, &tick.roots());
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
                .fold
                .run_over(grower.graph, &path, &tick.roots(), nodes)
            else {
                return Ok(None);
            };
            grower.grow_on(path, tick.with(&folded))
        })
    }

    /// One decision further down; what is found there is forgotten behind it.
    fn deeper<T>(
        &mut self,
        grow: impl FnOnce(&mut Self) -> Result<T, TooBig>,
    ) -> Result<T, TooBig> {
        if self.depth > DEPTH {
            return Err(TooBig);
        }
        let mark = self.fold.mark();
        self.depth += 1;
        let tree = grow(self);
        self.depth -= 1;
        self.fold.back(mark);
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
        let if_yes = path.on(self.graph, &self.fold, condition, true);
        let if_no = path.on(self.graph, &self.fold, condition, false);
        // Both ways are decided by the same.
        let Some(either) = if_yes.as_ref().or(if_no.as_ref()) else {
            return Ok(None);
        };
        let nodes = self.fold.nodes(self.graph, either, &roots);
        // The other side is looked at first, because where it cannot be nothing is decided here.
        let no = if_no.and_then(|no| {
            Some((
                self.fold.try_run(self.graph, &no, &roots, &nodes)?,
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
            grower.fold.again(&found);
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
        let mark = self.fold.mark();
        let told = self.fold.run_over(self.graph, strong, &tick.roots(), nodes);
        let told = told.map(|roots| reach::ranges(self.graph, &self.fold, &tick.with(&roots)));
        self.fold.back(mark);
        let Some(told) = told else { return Ok(None) };
        let mut tick = tick.clone();
        for discrete in self.discrete {
            let Some(id) = tick.cells[discrete.cell] else {
                continue;
            };
            let Range { low, high } = told[discrete.cell];
            let ty = self.graph.ty(id);
            tick.cells[discrete.cell] = Some(match ty {
                _ if low == high => self.graph.number(ty, low),
                Type::I1 => id,
                _ => self.graph.node(Kind::Op(Op::Assume(low, high)), ty, &[id]),
            });
        }
        self.grow(Rc::new(path.given(condition, holds)), &tick)
    }

    fn leaf(&mut self, path: Rc<Path>, tick: Tick) -> Result<Tree, TooBig> {
        self.leaves = self.leaves.checked_sub(1).ok_or(TooBig)?;
        let ranges = reach::ranges(self.graph, &self.fold, &tick);
        Ok(Tree::Leaf { path, tick, ranges })
    }

    /// The condition that is best decided now; none if nothing is left that pays or must be.
    fn choose(&mut self, path: &Path, tick: &Tick, roots: &[NodeId]) -> Option<NodeId> {
        let musts = self.next_states(tick);
        let (worth, promising) = (self.worth, self.promising);
        let mut gains = Gains::new(self.graph, &mut self.lists, roots, &musts);
        let mut best: Option<((u32, u32), NodeId)> = None;
        for at in gains.in_order() {
            let Asking {
                condition,
                asked,
                must,
                ..
            } = gains.asking(at);
            let score = (gains.of(at), asked);
            if (must || score.0 >= worth) && best.is_none_or(|(most, _)| score > most) {
                best = Some((score, condition));
            }
        }
        let (_, best) = best?;
        // What would be tried out later counts as well: what one comparison tells, others need not
        // ask.
        let wanted = |gains: &mut Gains, at: usize| {
            gains.asking(at).must || gains.of(at) >= worth || gains.of_cheaper(at) >= promising
        };
        match gains.compared_alike(best, wanted) {
            Some((of, limits)) if limits.len() > 1 => {
                Some(self.first_of(path, tick, of, &limits).unwrap_or(best))
            }
            _ => Some(gains.most_shared(best)),
        }
    }

    /// Of several comparisons of one value with constants, the one that is best decided first; none
    /// if none pays.
    fn first_of(&mut self, path: &Path, tick: &Tick, of: NodeId, limits: &[Limit]) -> Option<NodeId> {
        if limits.len() > order::AT_ONCE {
            return Some(limits[limits.len() / 2].condition);
        }
        let musts: Vec<bool> = limits.iter().map(|limit| limit.must).collect();
        let Range { low, high } = self.fold.range(of);
        let lows: Vec<i64> = std::iter::once(low)
            .chain(limits.iter().map(|limit| limit.limit))
            .collect();
        let highs: Vec<i64> = limits
            .iter()
            .map(|limit| limit.limit - 1)
            .chain(std::iter::once(high))
            .collect();
        let nodes = self.fold.nodes(self.graph, path, &tick.roots());
        let mut costs: order::Costs = vec![Vec::new(); lows.len()];
        for (at, low) in lows.iter().enumerate() {
            for (to, high) in highs.iter().enumerate().skip(at) {
                // Where something must be decided, nobody asks what it costs if it is not.
                let is_left = to == at || !musts[at..to].contains(&true);
                let within = (of, Range::new(*low, *high));
                let cost = if is_left {
                    self.cost_within(path, tick, &nodes, within)
                } else {
                    u32::MAX
                };
                costs[at].push(cost);
            }
        }
        order::first(&musts, &costs, self.worth).map(|at| limits[at].condition)
    }

    /// Cycles of what is left to do, and to decide for the next mode, where a node lies so.
    fn cost_within(
        &mut self,
        path: &Path,
        tick: &Tick,
        nodes: &[NodeId],
        (of, range): (NodeId, Range),
    ) -> u32 {
        let told = facts::with(
            self.graph,
            &|id| self.fold.range(id),
            &path.facts,
            of,
            range,
        );
        let Some((facts, latest)) = told else {
            return 0;
        };
        let (roots, mark) = (tick.roots(), self.fold.mark());
        let within = Path {
            facts,
            latest,
            decided: Vec::new(),
        };
        let folded = self.fold.run_over(self.graph, &within, &roots, nodes);
        let cost = folded.map_or(0, |roots| {
            let musts = self.next_states(&tick.with(&roots)).len() as u32;
            self.fold.cost(self.graph, &roots) + cost::BRANCH * musts
        });
        self.fold.back(mark);
        cost
    }

    /// Where nothing is left that pays by itself: the condition that saves most once both ways are
    /// folded under what it tells of ranges, such as that of two limits one is never met; none if
    /// none pays.
    fn choose_by_trial(&mut self, path: &Path, roots: &[NodeId]) -> Option<NodeId> {
        let mut gains = Gains::new(self.graph, &mut self.lists, roots, &[]);
        let mut promising = gains.in_order();
        promising.retain(|at| gains.of_cheaper(*at) >= self.promising);
        let promising: Vec<NodeId> = promising
            .into_iter()
            .map(|at| gains.asking(at).condition)
            .collect();
        if promising.is_empty() {
            return None;
        }
        let now = self.fold.cost(self.graph, roots);
        let mut best: Option<(u32, NodeId)> = None;
        for condition in promising {
            let sides =
                [true, false].map(|holds| path.on(self.graph, &self.fold, condition, holds));
            let [Some(if_yes), Some(if_no)] = sides else {
                continue;
            };
            // Both ways are decided by the same.
            let nodes = self.fold.nodes(self.graph, &if_yes, roots);
            let costs = [if_yes, if_no].map(|side| {
                let found = self.fold.try_run(self.graph, &side, roots, &nodes)?;
                Some(self.fold.cost(self.graph, &found.roots))
            });
            let [Some(yes), Some(no)] = costs else {
                continue;
            };
            let saved = now.saturating_sub(yes.max(no) + cost::BRANCH);
            if saved >= self.worth && best.is_none_or(|(most, _)| saved > most) {
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
                .map_or_else(|| self.fold.range(id), Range::point);
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
            let limit = self.fold.number(self.graph, self.graph.ty(id), inside + 1);
            found.push(self.fold.pure(self.graph, Op::Lt, Type::I1, &[id, limit]));
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
