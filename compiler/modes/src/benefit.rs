//! Benefit estimates of decisions: cycles that deciding a condition saves, without trying it out.
//!
//! Once a condition is decided its choices vanish, and with them whatever only the side needs that
//! is not taken: the maximal fanout-free cones of that side. With `x < 3` decided, so may be other
//! comparisons of `x`, and with them what they choose. The side that saves less counts.

use super::graph::{Graph, Kind, NodeId};
use super::tuning;
use whippen_ids::IdMap;
use whippen_kernel::{Op, Type};
use whippen_target_info::BRANCH_CYCLES;

/// A condition that may be decided, and what uses it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// The bool.
    pub condition: NodeId,
    /// The last of the nodes that the condition chooses between: where it holds, where not.
    sides: [u32; 2],
    /// How many of those are choices of one of two.
    choices: u32,
    /// How many choices, guards and next states it is part of.
    pub use_count: u32,
    /// Whether the next mode depends on it.
    pub decides_successor: bool,
}

/// A comparison of some value with a constant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    /// It holds below this.
    pub limit: i64,
    pub condition: NodeId,
    /// Whether the next mode depends on it.
    pub decides_successor: bool,
}

/// No place in a list.
const NOWHERE: u32 = u32::MAX;

/// Lists that are used again from tick to tick.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// How often each node is used; nothing but 0 between two ticks.
    uses: IdMap<NodeId, u32>,
    /// Where the condition stands among the conditions, by node; nowhere but in a tick.
    places: IdMap<NodeId, u32>,
    /// The nodes of the tick, in no certain order.
    all: Vec<NodeId>,
    conditions: Vec<Candidate>,
    /// The nodes of sides, each with the one before it on its side.
    sides: Vec<(NodeId, u32)>,
    /// Comparisons of a value with constants: the value, the constant, the place of the condition;
    /// in order.
    compared: Vec<(NodeId, i64, usize)>,
    gone: Vec<NodeId>,
    /// Conditions still to be noted.
    open: Vec<(NodeId, [Option<NodeId>; 2])>,
    /// Nodes that were visited, all ticks together.
    pub work: u64,
}

/// Uses of each node, and the users of each condition.
pub(super) struct Benefits<'a, 'k> {
    graph: &'a Graph<'k>,
    lists: &'a mut Lists,
}

impl Lists {
    /// Forgets the tick before.
    fn clear(&mut self, nodes: usize) {
        self.all.drain(..).for_each(|id| self.uses[id] = 0);
        self.conditions
            .iter()
            .for_each(|candidate| self.places[candidate.condition] = NOWHERE);
        self.conditions.clear();
        self.sides.clear();
        self.compared.clear();
        self.uses.resize(nodes, 0);
        self.places.resize(nodes, NOWHERE);
    }

    /// Counts uses; nodes that are used for the first time are nodes of the tick from here on.
    fn used(&mut self, nodes: &[NodeId]) {
        for id in nodes {
            let uses = &mut self.uses[id];
            if *uses == 0 {
                self.all.push(*id);
            }
            *uses += 1;
        }
    }
}

impl<'a, 'k> Benefits<'a, 'k> {
    /// For a tick with these roots, and bools that the next mode depends on.
    pub fn new(
        graph: &'a Graph<'k>,
        lists: &'a mut Lists,
        roots: &[NodeId],
        successor_conditions: &[NodeId],
    ) -> Benefits<'a, 'k> {
        lists.clear(graph.len());
        lists.used(roots);
        let (mut benefits, mut at) = (Benefits { graph, lists }, 0);
        while let Some(id) = benefits.lists.all.get(at).copied() {
            at += 1;
            let args = graph.args(id);
            benefits.lists.used(args);
            match graph.kind(id) {
                Kind::Op(Op::Select) => {
                    benefits.note_uses(args[0], false, [Some(args[1]), Some(args[2])])
                }
                Kind::Effect(_) => benefits.note_uses(args[0], false, [Some(id), None]),
                _ => {}
            }
        }
        successor_conditions
            .iter()
            .for_each(|condition| benefits.note_uses(*condition, true, [None, None]));
        for place in 0..benefits.lists.conditions.len() {
            if let Some((of, limit)) = benefits.limit(place) {
                benefits.lists.compared.push((of, limit, place));
            }
        }
        benefits.lists.compared.sort_unstable();
        benefits.lists.work += benefits.lists.all.len() as u64;
        benefits
    }

    /// The candidate at a place.
    pub fn candidate(&self, place: usize) -> Candidate {
        self.lists.conditions[place]
    }

    /// Of `x < k`, both.
    fn limit(&self, place: usize) -> Option<(NodeId, i64)> {
        let id = self.candidate(place).condition;
        match self.graph.args(id) {
            [x, k] if self.graph.op(id) == Some(Op::Lt) => Some((*x, self.graph.constant(*k)?)),
            _ => None,
        }
    }

    /// Counts a use of a condition and of the bools it is made of.
    fn note_uses(
        &mut self,
        condition: NodeId,
        decides_successor: bool,
        sides: [Option<NodeId>; 2],
    ) {
        let mut open = std::mem::take(&mut self.lists.open);
        open.push((condition, sides));
        for _ in 0..tuning::CONDITION_PARTS {
            let Some((condition, sides)) = open.pop() else {
                break;
            };
            if self.graph.constant(condition).is_some() {
                continue;
            }
            if self.graph.op(condition) == Some(Op::Not) {
                let [yes, no] = sides;
                open.push((self.graph.args(condition)[0], [no, yes]));
                continue;
            }
            self.note_use(condition, decides_successor, sides);
            if self.is_compound(condition) {
                // One part alone can decide that a conjunction does not hold, or that a disjunction
                // does.
                let sides = match self.graph.op(condition) {
                    Some(Op::And) => [sides[0], None],
                    Some(Op::Or) => [None, sides[1]],
                    _ => [None, None],
                };
                open.extend(self.graph.args(condition).iter().map(|part| (*part, sides)));
            }
        }
        open.clear();
        self.lists.open = open;
    }

    fn note_use(&mut self, condition: NodeId, decides_successor: bool, sides: [Option<NodeId>; 2]) {
        let Lists {
            places,
            conditions,
            sides: all_sides,
            ..
        } = &mut *self.lists;
        let place = &mut places[condition];
        if *place == NOWHERE {
            *place = conditions.len() as u32;
            conditions.push(Candidate {
                condition,
                sides: [NOWHERE; 2],
                choices: 0,
                use_count: 0,
                decides_successor: false,
            });
        }
        let candidate = &mut conditions[*place as usize];
        candidate.use_count += 1;
        candidate.decides_successor |= decides_successor;
        candidate.choices += u32::from(sides.iter().all(Option::is_some));
        for (last, node) in candidate.sides.iter_mut().zip(sides) {
            if let Some(node) = node {
                all_sides.push((node, *last));
                *last = all_sides.len() as u32 - 1;
            }
        }
    }

    /// Places of the conditions, in the order of nodes.
    pub fn in_order(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.lists.conditions.len()).collect();
        places.sort_unstable_by_key(|at| self.candidate(*at).condition);
        places
    }

    /// The part of a condition with most uses, so that deciding it serves others too; the condition
    /// itself if it shares nothing.
    pub fn most_shared(&self, condition: NodeId) -> NodeId {
        let place = |id: NodeId| self.lists.places[id] as usize;
        let use_count = |id: NodeId| {
            self.lists
                .conditions
                .get(place(id))
                .map_or(0, |candidate| candidate.use_count)
        };
        let mut best = condition;
        loop {
            let (mut open, from) = (vec![best], best);
            for _ in 0..tuning::CONDITION_PARTS {
                let Some(id) = open.pop() else { break };
                if use_count(id) > use_count(best) {
                    best = id;
                }
                if self.graph.ty(id) == Type::I1 && self.is_compound(id) {
                    open.extend_from_slice(self.graph.args(id));
                }
            }
            if best == from || !self.is_compound(best) {
                return best;
            }
        }
    }

    fn is_compound(&self, id: NodeId) -> bool {
        matches!(
            self.graph.op(id),
            Some(Op::And | Op::Or | Op::Not | Op::Select)
        )
    }

    /// Cycles that deciding the condition at a place saves on the side where it saves less, the
    /// branch paid.
    pub fn of_worse_side(&mut self, place: usize) -> u32 {
        let saved = [true, false].map(|holds| self.saved(place, holds));
        saved[0].min(saved[1]).saturating_sub(BRANCH_CYCLES)
    }

    /// The same on the side where it saves more.
    pub fn of_better_side(&mut self, place: usize) -> u32 {
        let saved = [true, false].map(|holds| self.saved(place, holds));
        saved[0].max(saved[1]).saturating_sub(BRANCH_CYCLES)
    }

    /// Cycles saved where it holds, or where it does not.
    fn saved(&mut self, place: usize, holds: bool) -> u32 {
        let mut gone = std::mem::take(&mut self.lists.gone);
        let mut choices = 0;
        let mut decide = |place: usize| {
            let candidate = self.candidate(place);
            choices += candidate.choices;
            let mut side = candidate.sides[usize::from(holds)];
            while let Some((node, before)) = self.lists.sides.get(side as usize) {
                gone.push(*node);
                side = *before;
            }
        };
        match self.limit(place) {
            None => decide(place),
            Some((of, limit)) => self
                .decided(of, limit, holds)
                .iter()
                .for_each(|(_, _, place)| decide(*place)),
        }
        let (cycles, visits) = unused(self.graph, &mut self.lists.uses, &mut gone);
        self.lists.work += visits;
        gone.clear();
        self.lists.gone = gone;
        2 * choices + cycles
    }

    /// The value that this condition compares with a constant, and all such comparisons of it that
    /// are wanted, in the order of the constants; none if it is no comparison.
    pub fn compared_alike(
        &mut self,
        condition: NodeId,
        wanted: impl Fn(&mut Self, usize) -> bool,
    ) -> Option<(NodeId, Vec<Limit>)> {
        let place = *self.lists.places.get(condition)?;
        let (of, _) = if place == NOWHERE {
            None
        } else {
            self.limit(place as usize)
        }?;
        let all = self.compared(of).to_vec();
        let wanted = all
            .into_iter()
            .filter(|(_, _, place)| wanted(self, *place))
            .collect::<Vec<_>>();
        let limit = |(_, limit, place): (NodeId, i64, usize)| {
            let Candidate {
                condition,
                decides_successor,
                ..
            } = self.candidate(place);
            Limit {
                limit,
                condition,
                decides_successor,
            }
        };
        Some((of, wanted.into_iter().map(limit).collect()))
    }

    /// The comparisons of a value with constants.
    fn compared(&self, of: NodeId) -> &[(NodeId, i64, usize)] {
        let first = self
            .lists
            .compared
            .partition_point(|(other, ..)| *other < of);
        let count = self.lists.compared[first..].partition_point(|(other, ..)| *other == of);
        &self.lists.compared[first..first + count]
    }

    /// The comparisons that hold (or do not) where the one of this value with this limit does (or
    /// does not).
    fn decided(&self, of: NodeId, limit: i64, holds: bool) -> &[(NodeId, i64, usize)] {
        let all = self.compared(of);
        let first = all.partition_point(|(_, other, _)| *other < limit);
        let end = all.partition_point(|(_, other, _)| *other <= limit);
        if holds { &all[first..] } else { &all[..end] }
    }
}

/// Cycles of what only these uses of nodes need, and how many nodes were visited; the list grows by
/// what falls with them.
///
/// A side of a choice that itself falls is listed twice: by what it is a side of, and as what the
/// choice used. What falls so often counts as often, which chose better than once did for the
/// bundled instruments; nested choices would double it each time, so that a limit ends it.
fn unused(graph: &Graph, uses: &mut IdMap<NodeId, u32>, gone: &mut Vec<NodeId>) -> (u32, u64) {
    let (mut at, mut cycles, mut visits) = (0, 0_u32, 0_u64);
    while let Some(id) = gone.get(at).copied() {
        visits += 1;
        let falls_again = uses[id] == 0;
        if falls_again {
            gone.swap_remove(at);
        } else {
            at += 1;
            uses[id] -= 1;
        }
        if uses[id] == 0 && (!falls_again || visits < tuning::FALLEN) {
            cycles = cycles.saturating_add(graph.cycles(id));
            gone.extend_from_slice(graph.args(id));
        }
    }
    gone.iter().for_each(|id| uses[id] += 1);
    (cycles, visits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_kernel::Kernel;

    /// Choices in the sides of choices, all decided by one comparison: each falls as what the one
    /// around it used and as a side of its own, and so does all that it holds.
    #[test]
    fn nested_choices_are_visited_a_bounded_number_of_times() {
        let kernel = Kernel::default();
        let mut graph = Graph::new(&kernel);
        let condition = graph.constant_node(Type::I1, 1);
        let mut choice = graph.constant_node(Type::I32, 0);
        let (mut sides, mut roots) = (Vec::new(), Vec::new());
        for at in 1..=60 {
            sides.push(choice);
            let other = graph.constant_node(Type::I32, at);
            let args = [condition, other, choice];
            choice = graph.node(Kind::Op(Op::Select), Type::I32, &args);
            roots.push(choice);
        }
        let mut uses: IdMap<NodeId, u32> = IdMap::new();
        uses.resize(graph.len(), 0);
        for id in &roots {
            graph.args(*id).iter().for_each(|arg| uses[arg] += 1);
        }
        uses[choice] += 1;
        let before = uses.clone();
        let mut gone = sides;
        let (cycles, visits) = unused(&graph, &mut uses, &mut gone);
        assert!(cycles > 0);
        assert!(visits < 1000, "{visits} nodes");
        assert_eq!(uses, before, "every use is given back");
    }
}
