//! Can several bools hold at once? Intervals are narrowed by what is asked for until nothing is
//! left, which proves that they cannot; or values are found for which they do, which proves that
//! they can.
//!
//! Narrowing runs against the graph (from a comparison to its sides, from a sum to its terms) and
//! with it, in turn, on the nodes below the facts only. Values are tried from the narrowed
//! intervals: middles, ends, then at random from a fixed seed; every try is worked out in interval
//! arithmetic, so that rounding cannot fool it.

pub mod narrow;
mod witness;

use crate::model::{Interval, MachineId, Model, Node, NodeId};
use crate::range::Ranges;

/// Bools that shall hold, and states that machines shall be in.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    /// Bools.
    pub holds: Vec<NodeId>,
    /// Bools that shall not hold.
    pub fails: Vec<NodeId>,
    /// Machines and their states.
    pub states: Vec<(MachineId, u32)>,
}

impl Facts {
    /// Both.
    pub fn and(mut self, mut other: Facts) -> Facts {
        self.holds.append(&mut other.holds);
        self.fails.append(&mut other.fails);
        self.states.append(&mut other.states);
        self
    }
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Together {
    /// They exclude each other.
    Never,
    /// They hold at such values (`x = 7 mm`).
    At(String),
    /// Neither was found.
    Unknown,
}

/// So many nodes are looked at in one instrument, or a little more; beyond, everything is unknown.
const WORK_MAX: usize = 3_000_000;

/// Answers questions about one Model.
pub struct Solver<'m> {
    model: &'m Model,
    ranges: &'m Ranges,
    work: usize,
}

impl<'m> Solver<'m> {
    /// Nothing asked yet.
    pub fn new(model: &'m Model, ranges: &'m Ranges) -> Solver<'m> {
        Solver {
            model,
            ranges,
            work: 0,
        }
    }

    /// Whether all facts can hold in one tick.
    pub fn ask(&mut self, facts: &Facts) -> Together {
        if facts
            .states
            .iter()
            .any(|a| facts.states.iter().any(|b| a.0 == b.0 && a.1 != b.1))
        {
            return Together::Never;
        }
        if self.work > WORK_MAX {
            return Together::Unknown;
        }
        let nodes = self.below(facts);
        self.work += self.model.dag.len() + nodes.len() * (narrow::ROUNDS_MAX + witness::TRIES);
        let start = self.ranges.all().clone();
        let Some(narrowed) = narrow::narrow(self.model, &nodes, facts, start) else {
            return Together::Never;
        };
        match witness::find(self.model, &nodes, facts, &narrowed) {
            Some(values) => Together::At(values),
            None => Together::Unknown,
        }
    }

    /// The nodes that the facts depend on, operands first.
    fn below(&self, facts: &Facts) -> Vec<NodeId> {
        let mut nodes: Vec<NodeId> = facts
            .holds
            .iter()
            .chain(&facts.fails)
            .flat_map(|f| self.model.dag.below(*f))
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// What a question about the state of a machine must answer, if the facts say it.
fn asked_state(facts: &Facts, node: &Node) -> Option<Interval> {
    let Node::Is(machine, state) = *node else {
        return None;
    };
    let known = facts.states.iter().find(|(m, _)| *m == machine)?;
    Some(Interval::point(f64::from(known.1 == state)))
}
