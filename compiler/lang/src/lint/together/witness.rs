//! Looking for values at which facts hold, and saying them.

use super::Facts;
use crate::model::{Interval, MachineId, Model, Node, NodeId};
use crate::range::transfer;
use crate::units::{Dim, shown};
use whippen_deterministic::Rng;
use whippen_ids::IdMap;

/// So many combinations of values are tried.
pub(super) const TRIES: usize = 100;

/// So many values are named in a message.
const NAMED_MAX: usize = 3;

/// Values from these intervals at which all facts hold, in words.
pub(super) fn find(
    model: &Model,
    nodes: &[NodeId],
    facts: &Facts,
    within: &IdMap<NodeId, Interval>,
) -> Option<String> {
    let mut rng = Rng::new(1);
    (0..TRIES).find_map(|attempt| {
        let values = Attempt {
            model,
            facts,
            within,
            first: attempt == 0,
            rng: &mut rng,
        }
        .values(nodes)?;
        let holds = |f: &NodeId| values[f].low == 1.0;
        let fails = |f: &NodeId| values[f].high == 0.0;
        (facts.holds.iter().all(holds) && facts.fails.iter().all(fails))
            .then(|| words(model, nodes, &values))
    })
}

/// One choice of values.
struct Attempt<'a> {
    model: &'a Model,
    facts: &'a Facts,
    within: &'a IdMap<NodeId, Interval>,
    /// The first takes the middle of everything.
    first: bool,
    rng: &'a mut Rng,
}

impl Attempt<'_> {
    /// The value of every node; `None` where one has none.
    fn values(&mut self, nodes: &[NodeId]) -> Option<IdMap<NodeId, Interval>> {
        let states = self.states();
        let mut values = IdMap::filled(Interval::point(0.0), self.within.len());
        for &id in nodes {
            let node = self.model.dag.get(id);
            let own = self.within[id];
            values[id] = match node {
                Node::Is(machine, state) => Interval::point(f64::from(states[machine] == *state)),
                Node::Const(_) | Node::Bool(_) => own,
                Node::LiveBool(_) => Interval::point(if self.first || self.rng.chance(1, 2) {
                    own.high
                } else {
                    own.low
                }),
                _ if node.operands().is_empty() => Interval::point(self.pick(own)),
                _ => transfer(self.model, node, |o| values[o]).ok()?,
            };
        }
        Some(values)
    }

    /// The state of every machine: the one asked for, else any.
    fn states(&mut self) -> IdMap<MachineId, u32> {
        let asked = |id: MachineId| {
            let states = &self.facts.states;
            states.iter().find(|(machine, _)| *machine == id)
        };
        let first = self.first;
        let rng = &mut *self.rng;
        let any = |count: usize, rng: &mut Rng| {
            if first {
                0
            } else {
                rng.below(count.max(1) as u64) as u32
            }
        };
        let machines = self.model.machines.enumerated();
        machines
            .map(|(id, machine)| match asked(id) {
                Some((_, state)) => *state,
                None => any(machine.states.len(), rng),
            })
            .collect()
    }

    /// The middle, or an end, or anything between.
    fn pick(&mut self, own: Interval) -> f64 {
        let part = match if self.first { 0 } else { self.rng.below(4) } {
            0 => 0.5,
            1 => 0.0,
            2 => 1.0,
            _ => self.rng.below(1001) as f64 / 1000.0,
        };
        (own.low + part * (own.high - own.low)).clamp(own.low, own.high)
    }
}

/// `` `x` is 7 mm, `phi'` is 1 rad/s ``
fn words(model: &Model, nodes: &[NodeId], values: &IdMap<NodeId, Interval>) -> String {
    let named = |&id: &NodeId| {
        let (name, dim) = leaf(model, model.dag.get(id))?;
        Some(format!("`{name}` is {}", shown(values[id].low, dim)))
    };
    let mut named: Vec<String> = nodes.iter().filter_map(named).collect();
    let more = if named.len() > NAMED_MAX { ", .." } else { "" };
    named.truncate(NAMED_MAX);
    format!("{}{more}", named.join(", "))
}

/// Name and dimension of what changes while playing.
fn leaf(model: &Model, node: &Node) -> Option<(String, Dim)> {
    let sense = |s: u32| &model.senses[s as usize];
    let per_time = |dim: Dim| dim.div(Dim::TIME);
    Some(match *node {
        Node::Sense(s) => (sense(s).name.clone(), sense(s).dim),
        Node::Slope(s) => (format!("{}'", sense(s).name), per_time(sense(s).dim)),
        Node::Curvature(s) => (
            format!("{}''", sense(s).name),
            per_time(per_time(sense(s).dim)),
        ),
        Node::Live(l) => (
            model.lives[l as usize].name.clone(),
            model.lives[l as usize].dim?,
        ),
        Node::Keyed(k) => (
            model.keyed[k as usize].name.clone(),
            model.keyed[k as usize].dim,
        ),
        Node::Cell(c) => (model.cells[c].name.clone(), model.cells[c].dim),
        _ => return None,
    })
}
