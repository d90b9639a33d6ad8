//! One state through one block, instruction by instruction.

use whippen_isa::timing::{Cost, Outcome, Pipe};
use whippen_isa::{Class, Op};

use super::arena::Arena;
use super::facts::Facts;
use super::graph::{Control, Edge, Graph, Item};
use super::memory::{Accessed, GraphMemory, Waits};
use super::relevant::{Relevance, Relevant, writes};
use super::state::{State, insert};
use super::unknown::UnknownTime;
use super::{Query, Step};

/// What walking through a block needs and leaves behind.
pub struct Walker<'a> {
    pub query: &'a Query<'a>,
    pub graph: &'a Graph,
    pub relevance: &'a Relevance,
    /// The instruction before the one that is counted, in its block.
    pub previous: Option<&'a Item>,
    /// What the graph says of accesses.
    pub memory: GraphMemory,
    pub arena: Arena,
    /// How sure the least sure number is.
    pub class: whippen_isa::timing::Evidence,
    /// Ways that were cut.
    pub infeasible: u32,
    /// Whether states were joined.
    pub merged: bool,
    /// The first access that may meet memory without a known time.
    pub unknown_time: Option<UnknownTime>,
    /// The largest index of each table branch; of those with an unbounded one, the largest word.
    pub indices: std::collections::BTreeMap<u32, u32>,
}

impl<'a> Walker<'a> {
    /// Through a block; what arrives at each of its edges.
    pub fn walk(&mut self, number: usize, state: State) -> Vec<(&'a Edge, State)> {
        let block = &self.graph.blocks[number];
        let behind = &self.relevance.behind[number];
        let Some((last, before)) = block.items.split_last() else {
            return Vec::new();
        };
        let mut states = vec![state];
        self.previous = None;
        for (item, &behind) in before.iter().zip(behind) {
            states = self.pass(item, behind, states);
            self.previous = Some(item);
        }
        let behind = behind.last().copied().unwrap_or(0);
        let mut arrived = Vec::new();
        if last.control == Control::Next {
            let states = self.pass(last, behind, states);
            for edge in &block.edges {
                arrived.extend(states.iter().map(|state| (edge, state.clone())));
            }
            return arrived;
        }
        let table = last.control == Control::Table
            && !self.query.annotations.targets.contains_key(&last.address);
        for state in states {
            if table {
                self.look_at_index(last, &state.facts);
            }
            for edge in &block.edges {
                arrived.extend(
                    self.leave(last, behind, edge, state.clone())
                        .map(|state| (edge, state)),
                );
            }
        }
        arrived
    }

    /// An instruction that does not branch, in every state; one in an IT block is executed and is
    /// skipped.
    fn pass(&mut self, item: &Item, behind: Relevant, states: Vec<State>) -> Vec<State> {
        let cond = item.inst.cond.filter(|_| item.inst.is_conditional());
        let Some((cond, inverse)) = cond.and_then(|cond| Some((cond, cond.invert()?))) else {
            return states
                .into_iter()
                .map(|state| self.execute(item, behind, state, None))
                .collect();
        };
        let mut passed = Vec::with_capacity(2 * states.len());
        for state in states {
            let mut skipped = state.clone();
            let mut met = state;
            if met.facts.assume(cond) {
                let met = self.execute(item, behind, met, None);
                self.gather(&mut passed, met, behind);
            }
            if skipped.facts.assume(inverse) {
                let skipped = self.issue(item, skipped, Outcome::SKIPPED);
                self.gather(&mut passed, skipped, behind);
            }
        }
        passed
    }

    fn gather(&mut self, states: &mut Vec<State>, mut state: State, behind: Relevant) {
        state.facts.keep(behind);
        insert(states, state, &mut self.merged);
    }

    /// The last instruction of a block along one edge; nothing if no input takes it.
    fn leave(
        &mut self,
        item: &Item,
        behind: Relevant,
        edge: &Edge,
        mut state: State,
    ) -> Option<State> {
        if !self.decides(item, edge, &mut state.facts) {
            self.infeasible += 1;
            return None;
        }
        Some(match edge.taken {
            Some(_) => {
                let called = self.execute(item, behind, state, Some(edge));
                self.run_known(edge, called)
            }
            None if edge.leaves => self.issue(item, state, Outcome::NEXT),
            None => self.issue(item, state, Outcome::SKIPPED),
        })
    }

    /// What is bounded elsewhere runs on this edge: it may leave anything in registers, and nothing
    /// in the pipeline.
    fn run_known(&mut self, edge: &Edge, mut state: State) -> State {
        let (Some(known), Some(target)) = (edge.known, edge.taken) else {
            return state;
        };
        state.facts.keep(0);
        let step = Step {
            address: target.address,
            cycles: known.cycles,
            waits: Waits::default(),
            accessed: Accessed::Nothing,
            times: 1,
        };
        let chain = self.arena.step(state.chain, step);
        State {
            pipe: Pipe::default(),
            cycles: state.cycles + known.cycles,
            chain,
            ..state
        }
    }

    /// Narrows what is known to what takes an edge.
    fn decides(&mut self, item: &Item, edge: &Edge, facts: &mut Facts) -> bool {
        let (inst, taken) = (&item.inst, edge.taken.is_some());
        if inst.class() == Class::CompareBranch {
            return facts.assume_zero(inst.n, taken == (inst.op() == Op::CBZ));
        }
        if !edge.indices.is_empty() {
            let index = facts.interval(inst.m);
            return edge
                .indices
                .iter()
                .any(|&entry| index.holds(i64::from(entry)));
        }
        match inst.cond.filter(|_| inst.is_conditional()) {
            Some(cond) if taken => facts.assume(cond),
            Some(cond) => cond.invert().is_some_and(|inverse| facts.assume(inverse)),
            None => true,
        }
    }

    fn execute(
        &mut self,
        item: &Item,
        behind: Relevant,
        state: State,
        edge: Option<&Edge>,
    ) -> State {
        let mut outcome = Outcome {
            target: edge.and_then(|edge| edge.taken),
            ..Outcome::NEXT
        };
        if item.inst.class() == Class::Divide {
            outcome.quotient_bits = quotient_bits_max(item, &state.facts);
        }
        let mut state = self.issue(item, state, outcome);
        if writes(&item.inst) & behind != 0 {
            state
                .facts
                .execute(&item.inst, item.address, self.query.code);
        }
        state
    }

    fn issue(&mut self, item: &Item, state: State, mut outcome: Outcome) -> State {
        let (waits, accessed) = self.wait(item, &state.facts, &outcome);
        outcome.waits = waits.cycles();
        if let Some(interference) = self.query.interference
            && self.query.core.overlap.cycles != 0
        {
            outcome.apart = interference.is_apart(self.previous, item, &state.facts, &self.memory);
        }
        let (pipe, cost) = self
            .query
            .core
            .issue(state.pipe, &item.timed, item.address, &outcome);
        self.judge(item, &cost);
        let cycles = u64::from(cost.cycles());
        let chain = self.arena.step(
            state.chain,
            Step {
                address: item.address,
                cycles,
                waits,
                accessed,
                times: 1,
            },
        );
        State {
            pipe,
            chain,
            cycles: state.cycles + cycles,
            ..state
        }
    }

    /// What an instruction waits at most, and for which data.
    fn wait(&mut self, item: &Item, facts: &Facts, outcome: &Outcome) -> (Waits, Accessed) {
        let Some(interference) = self.query.interference else {
            return (Waits::default(), Accessed::Nothing);
        };
        let (inst, at, graph) = (&item.inst, item.address, &self.memory);
        match interference.waits(inst, at, facts, graph, outcome) {
            Ok(waits) => (waits, interference.accessed(inst, at, facts, graph)),
            Err(unknown) => {
                self.unknown_time.get_or_insert(unknown);
                (Waits::default(), Accessed::Nothing)
            }
        }
    }

    fn judge(&mut self, item: &Item, cost: &Cost) {
        self.class = self.class.max(self.query.core.evidence(&item.timed, cost));
    }

    /// Remembers the largest index of the table branch at the end of a block.
    fn look_at_index(&mut self, item: &Item, facts: &Facts) {
        let index = facts.interval(item.inst.m);
        let largest = if index.low < 0 {
            u32::MAX
        } else {
            index.high as u32
        };
        let known = self.indices.entry(item.address).or_default();
        *known = largest.max(*known);
    }
}

/// The most quotient bits of a division: they decide its length.
fn quotient_bits_max(item: &Item, facts: &Facts) -> i8 {
    let signed = item.inst.op() == Op::SDIV;
    let (dividend, divisor) = (facts.interval(item.inst.n), facts.interval(item.inst.m));
    (dividend.top_bit_max(signed) - divisor.top_bit_min(signed)).clamp(-1, 31) as i8
}
