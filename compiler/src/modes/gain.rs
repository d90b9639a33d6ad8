//! What deciding a condition saves, without trying it out.
//!
//! Once a condition is decided its choices vanish, and with them whatever only the side needs that is not taken (in the
//! words of logic synthesis: the maximal fanout-free cones of that side). With `x < 3` decided, so may be other comparisons of
//! `x`, and with them what they choose. What counts is the dearer way on.

use super::cost;
use super::graph::{Graph, Id, Kind};
use crate::kernel::{Op, Type};
use rustc_hash::FxHashMap;

/// What asks for a condition.
#[derive(Debug, Default)]
pub(super) struct Asking {
    /// The nodes that the condition chooses between: where it holds, where not.
    pub sides: [Vec<Id>; 2],
    /// How many of those are choices of one of two.
    choices: u32,
    /// How many choices, guards and next states it is part of.
    pub asked: u32,
    /// Whether the next mode depends on it.
    pub must: bool,
}

/// How often each node is used, and who asks for which condition.
pub(super) struct Gains<'a, 'k> {
    graph: &'a Graph<'k>,
    uses: Vec<u32>,
    pub conditions: Vec<(Id, Asking)>,
    /// Where the condition stands in that list, by node; past its end if it is none.
    places: Vec<u32>,
    /// The places of comparisons of a value with constants, in the order of the constants, by value.
    compared: FxHashMap<Id, Vec<(i64, usize)>>,
}

/// Parts of a condition that are looked at. Long chains are decided from their start, and go on from there.
const PARTS: usize = 256;

impl<'a, 'k> Gains<'a, 'k> {
    /// For a tick with these roots, and bools that the next mode depends on.
    pub fn new(graph: &'a Graph<'k>, roots: &[Id], musts: &[Id]) -> Gains<'a, 'k> {
        let (uses, places) = (vec![0; graph.len()], vec![u32::MAX; graph.len()]);
        let mut gains = Gains { graph, uses, conditions: Vec::new(), places, compared: FxHashMap::default() };
        roots.iter().for_each(|root| gains.uses[root.index()] += 1);
        for id in graph.reachable(roots) {
            let args = graph.args(id);
            args.iter().for_each(|arg| gains.uses[arg.index()] += 1);
            match graph.kind(id) {
                Kind::Op(Op::Select) => gains.ask(args[0], false, [Some(args[1]), Some(args[2])]),
                Kind::Effect(_) => gains.ask(args[0], false, [Some(id), None]),
                _ => {}
            }
        }
        musts.iter().for_each(|must| gains.ask(*must, true, [None, None]));
        for place in 0..gains.conditions.len() {
            if let Some((of, limit)) = gains.limit(place) {
                gains.compared.entry(of).or_default().push((limit, place));
            }
        }
        gains.compared.values_mut().for_each(|places| places.sort_unstable());
        gains
    }

    /// Of `x < k`, both.
    fn limit(&self, place: usize) -> Option<(Id, i64)> {
        let id = self.conditions[place].0;
        match self.graph.args(id) {
            [x, k] if self.graph.op(id) == Some(Op::Lt) => Some((*x, self.graph.constant(*k)?)),
            _ => None,
        }
    }

    /// Notes a condition and the bools it is made of.
    fn ask(&mut self, condition: Id, must: bool, sides: [Option<Id>; 2]) {
        let mut open = vec![(condition, sides)];
        for _ in 0..PARTS {
            let Some((condition, sides)) = open.pop() else { break };
            if self.graph.constant(condition).is_some() {
                continue;
            }
            if self.graph.op(condition) == Some(Op::Not) {
                let [yes, no] = sides;
                open.push((self.graph.args(condition)[0], [no, yes]));
                continue;
            }
            let asking = self.asking(condition);
            asking.asked += 1;
            asking.must |= must;
            asking.sides.iter_mut().zip(sides).for_each(|(all, new)| all.extend(new));
            asking.choices += u32::from(sides.iter().all(Option::is_some));
            if self.is_compound(condition) {
                // One part alone can decide that a conjunction does not hold, or that a disjunction does.
                let sides = match self.graph.op(condition) {
                    Some(Op::And) => [sides[0], None],
                    Some(Op::Or) => [None, sides[1]],
                    _ => [None, None],
                };
                open.extend(self.graph.args(condition).iter().map(|part| (*part, sides)));
            }
        }
    }

    fn asking(&mut self, condition: Id) -> &mut Asking {
        let place = &mut self.places[condition.index()];
        if *place == u32::MAX {
            *place = self.conditions.len() as u32;
            self.conditions.push((condition, Asking::default()));
        }
        &mut self.conditions[*place as usize].1
    }

    /// Places of the conditions, in the order of nodes.
    pub fn in_order(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.conditions.len()).collect();
        places.sort_unstable_by_key(|at| self.conditions[*at].0);
        places
    }

    /// The part of a condition that most others ask for as well, so that they have it too; the condition itself if it
    /// shares nothing.
    pub fn most_shared(&self, condition: Id) -> Id {
        let asked =
            |id: Id| self.conditions.get(self.places[id.index()] as usize).map_or(0, |(_, asking)| asking.asked);
        let mut best = condition;
        loop {
            let (mut open, from) = (vec![best], best);
            for _ in 0..PARTS {
                let Some(id) = open.pop() else { break };
                if asked(id) > asked(best) {
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

    fn is_compound(&self, id: Id) -> bool {
        matches!(self.graph.op(id), Some(Op::And | Op::Or | Op::Not | Op::Select))
    }

    /// Cycles saved on the dearer side, the branch paid.
    pub fn of(&mut self, at: usize) -> u32 {
        let saved = [true, false].map(|holds| {
            let decided = self.decided(at, holds);
            let asked = || decided.iter().map(|at| &self.conditions[*at].1);
            let gone: Vec<Id> = asked().flat_map(|asking| &asking.sides[usize::from(holds)]).copied().collect();
            let choices: u32 = asked().map(|asking| asking.choices).sum();
            2 * choices + saved(self.graph, &mut self.uses, &gone)
        });
        saved[0].min(saved[1]).saturating_sub(cost::BRANCH)
    }

    /// The comparisons with constants of what this one compares, itself included, in the order of the constants: those that
    /// are wanted, by whether they must be decided and what that saves.
    pub fn compared_alike(&mut self, condition: Id, wanted: impl Fn(bool, u32) -> bool) -> Vec<Id> {
        let place = self.places.get(condition.index()).map_or(usize::MAX, |place| *place as usize);
        let of = if place < self.conditions.len() { self.limit(place) } else { None };
        let all = of.and_then(|(of, _)| self.compared.get(&of)).cloned().unwrap_or_default();
        let mut wanted_at = |at: usize| wanted(self.conditions[at].1.must, self.of(at));
        let places: Vec<usize> = all.into_iter().map(|(_, at)| at).filter(|at| wanted_at(*at)).collect();
        places.into_iter().map(|at| self.conditions[at].0).collect()
    }

    /// The conditions that hold (or do not) where this one does (or does not).
    fn decided(&self, at: usize, holds: bool) -> Vec<usize> {
        let compared = self.limit(at).and_then(|(of, limit)| Some((limit, self.compared.get(&of)?)));
        let Some((limit, places)) = compared else { return vec![at] };
        let first = places.partition_point(|(other, _)| *other < limit);
        let end = places.partition_point(|(other, _)| *other <= limit);
        let places = if holds { &places[first..] } else { &places[..end] };
        places.iter().map(|(_, place)| *place).collect()
    }
}

/// Cycles of what only these uses of nodes need.
fn saved(graph: &Graph, uses: &mut [u32], gone: &[Id]) -> u32 {
    let (mut open, mut log, mut cycles) = (gone.to_vec(), Vec::new(), 0_u32);
    while let Some(id) = open.pop() {
        log.push(id);
        uses[id.index()] = uses[id.index()].saturating_sub(1);
        if uses[id.index()] == 0 {
            cycles = cycles.saturating_add(cost::of_node(graph, id));
            open.extend_from_slice(graph.args(id));
        }
    }
    log.into_iter().for_each(|id| uses[id.index()] += 1);
    cycles
}
