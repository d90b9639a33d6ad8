//! The longest path: states forward through blocks and loops.
//!
//! At the head of each block stand the states in which it can be entered. Of two with the same
//! pipeline, the one that is not cheaper and knows no more makes the other superfluous: whatever
//! follows the other may follow it too, at no less. Where too many gather, those with the same
//! pipeline are joined: the larger count of cycles, what both know.
//!
//! A loop is walked once for each pipeline state at its head, from zero cycles and with nothing
//! known of what it changes; that gives the cycles from every such state to every one, and to its
//! exits. Its rounds are then sums of those.

use std::collections::BTreeMap;

use whippen_isa::timing::{Evidence, Pipe};

use super::arena::{Arena, Chain, START};
use super::block::Walker;
use super::facts::Facts;
use super::graph::{BlockId, Destination, Graph, TABLE_MAX};
use super::memory::{Accessed, GraphMemory, Waits};
use super::order::{Element, Loop, Order};
use super::relevant::{Relevance, writes};
use super::stack::Stack;
use super::state::{State, insert};
use super::unknown::UnknownTime;
use super::{Bound, NotBounded, Query, Step};

/// Rounds that are summed one by one; the rest is charged as the most expensive of all.
const ROUNDS_MAX: u32 = 4096;

/// What was found.
pub struct Longest {
    /// The worst-case end: cycles and its path.
    end: Option<(u64, Chain)>,
    arena: Arena,
    class: Evidence,
    infeasible: u32,
    merged: bool,
    ends: Ends,
    entry: u32,
    /// An access that may meet memory without a known time.
    unknown_time: Option<UnknownTime>,
    /// The largest index of each table branch.
    pub indices: BTreeMap<u32, u32>,
}

/// What is in the pipeline at ends: whether it remembers something, and delays what follows.
#[derive(Debug, Clone, Copy, Default)]
struct Ends {
    remember: bool,
    delay: bool,
}

struct Search<'a> {
    walker: Walker<'a>,
    arriving: Vec<Vec<State>>,
    /// The loops that are being walked, innermost last.
    open_loops: Vec<OpenLoop<'a>>,
    end: Option<(u64, Chain)>,
    ends: Ends,
}

/// A loop that is being walked from one state of its head.
struct OpenLoop<'a> {
    around: &'a Loop,
    /// What comes back to the head.
    back: Vec<State>,
    /// What leaves.
    exits: Vec<(Destination, State)>,
}

/// What a loop does from one pipeline state at its head.
struct Round {
    back: Vec<State>,
    exits: Vec<(Destination, State)>,
}

impl Longest {
    /// Walks through a graph.
    pub fn find(query: &Query, graph: &Graph, order: &Order) -> Self {
        let relevance = Relevance::of(graph, query.interference.is_some());
        let walker = Walker {
            query,
            graph,
            relevance: &relevance,
            previous: None,
            memory: GraphMemory::of(&query.annotations.bases, graph, query.interference),
            arena: Arena::default(),
            class: Evidence::Exact,
            infeasible: 0,
            merged: false,
            unknown_time: None,
            indices: BTreeMap::new(),
        };
        let arriving = vec![Vec::new(); graph.blocks.len()];
        let mut search = Search {
            walker,
            arriving,
            open_loops: Vec::new(),
            end: None,
            ends: Ends::default(),
        };
        let facts = Facts::of_registers(&query.annotations.entered);
        let start = State {
            pipe: Pipe::default(),
            facts,
            cycles: 0,
            chain: START,
        };
        search.arrive(Destination::Block(0), start);
        search.elements(&order.elements);
        let Search {
            walker:
                Walker {
                    arena,
                    class,
                    infeasible,
                    indices,
                    merged,
                    unknown_time,
                    ..
                },
            end,
            ends,
            ..
        } = search;
        Self {
            end,
            arena,
            class,
            infeasible,
            merged,
            ends,
            entry: query.entry,
            unknown_time,
            indices,
        }
    }

    /// As an answer.
    pub fn answer(self, stack: Stack, graph: &Graph) -> Result<Bound, NotBounded> {
        if let Some(unknown) = self.unknown_time {
            return Err(unknown.into());
        }
        if let Some((&address, _)) = self
            .indices
            .iter()
            .find(|(_, largest)| **largest >= TABLE_MAX)
        {
            let items = graph.blocks.iter().flat_map(|block| &block.items);
            let text = items
                .filter(|item| item.address == address)
                .map(|item| item.inst.to_string())
                .next();
            return Err(NotBounded::NoTable {
                address,
                text: text.unwrap_or_default(),
            });
        }
        let (cycles_max, chain) = self.end.ok_or(NotBounded::Endless { entry: self.entry })?;
        let sizes: BTreeMap<u32, u32> = graph
            .blocks
            .iter()
            .flat_map(|block| &block.items)
            .map(|item| (item.address, item.inst.size()))
            .collect();
        Ok(Bound {
            cycles_max,
            path: self.arena.steps(chain),
            class: self.class,
            settled: !self.ends.remember,
            delays_nobody: !self.ends.delay,
            stack_bytes_max: stack.deepest,
            stack_left: stack.left,
            infeasible: self.infeasible,
            merged: self.merged,
            code_bytes: sizes.values().sum(),
        })
    }
}

impl<'a> Search<'a> {
    fn elements(&mut self, elements: &'a [Element]) {
        for element in elements {
            match element {
                Element::Block(block) => self.block(*block),
                Element::Loop(around) => self.rounds(around),
            }
        }
    }

    fn block(&mut self, block: BlockId) {
        for state in std::mem::take(&mut self.arriving[block]) {
            self.walk(block, state);
        }
    }

    fn walk(&mut self, block: BlockId, state: State) {
        for (edge, state) in self.walker.walk(block, state) {
            self.arrive(edge.to, state);
        }
    }

    /// A state comes to a place: of the loop that is being walked, outside of it, or to the end.
    fn arrive(&mut self, to: Destination, mut state: State) {
        let relevant = match to {
            Destination::Block(block) => self.walker.relevance.before[block],
            Destination::Stop => 0,
        };
        state.facts.keep(relevant);
        let merged = &mut self.walker.merged;
        match (self.open_loops.last_mut(), to) {
            (Some(frame), Destination::Block(block)) if block == frame.around.head => {
                insert(&mut frame.back, state, merged)
            }
            (Some(frame), to) if !frame.holds(to) => frame.exits.push((to, state)),
            (_, Destination::Block(block)) => insert(&mut self.arriving[block], state, merged),
            (_, Destination::Stop) => {
                self.ends.remember |= state.pipe != Pipe::default();
                self.ends.delay |= !state.pipe.delays_nobody();
                if self.end.is_none_or(|(cycles, _)| cycles < state.cycles) {
                    self.end = Some((state.cycles, state.chain));
                }
            }
        }
    }

    /// All rounds of a loop.
    fn rounds(&mut self, around: &'a Loop) {
        let entries = std::mem::take(&mut self.arriving[around.head]);
        let Some(facts) = self.invariant(around, &entries) else {
            return;
        };
        let mut pipes: Vec<Pipe> = Vec::new();
        let mut reached: Vec<Option<(u64, Chain)>> = Vec::new();
        for state in entries {
            let pipe = number(&mut pipes, state.pipe);
            reached.resize(pipes.len(), None);
            keep_longer(&mut reached[pipe], (state.cycles, state.chain));
        }
        let mut rounds: Vec<Round> = Vec::new();
        while rounds.len() < pipes.len() {
            let round = self.round(around, pipes[rounds.len()], &facts);
            round.back.iter().for_each(|state| {
                number(&mut pipes, state.pipe);
            });
            rounds.push(round);
        }
        reached.resize(pipes.len(), None);
        let heads = self.sum(&pipes, &rounds, reached, around.rounds_max);
        for (round, head) in rounds.into_iter().zip(heads) {
            let Some((cycles, chain)) = head else {
                continue;
            };
            for (to, state) in round.exits {
                let chain = self.walker.arena.segment(chain, state.chain);
                self.arrive(
                    to,
                    State {
                        cycles: cycles + state.cycles,
                        chain,
                        ..state
                    },
                );
            }
        }
    }

    /// What is known at the head in every round: what was known at every entry, but for what the
    /// loop changes.
    fn invariant(&mut self, around: &Loop, entries: &[State]) -> Option<Facts> {
        let (first, others) = entries.split_first()?;
        let mut facts = others
            .iter()
            .fold(first.facts.clone(), |facts, state| facts.join(&state.facts));
        let blocks = around
            .members
            .iter()
            .map(|&block| &self.walker.graph.blocks[block]);
        if blocks
            .clone()
            .flat_map(|block| &block.edges)
            .any(|edge| edge.known.is_some())
        {
            facts.keep(0);
        }
        let changed = blocks
            .flat_map(|block| &block.items)
            .fold(0, |set, item| set | writes(&item.inst));
        facts.keep(!changed & self.walker.relevance.before[around.head]);
        Some(facts)
    }

    /// One round, from one state of the pipeline.
    fn round(&mut self, around: &'a Loop, pipe: Pipe, facts: &Facts) -> Round {
        self.open_loops.push(OpenLoop {
            around,
            back: Vec::new(),
            exits: Vec::new(),
        });
        self.walk(
            around.head,
            State {
                pipe,
                facts: facts.clone(),
                cycles: 0,
                chain: START,
            },
        );
        let body = around
            .body
            .iter()
            .filter(|element| !matches!(element, Element::Block(block) if *block == around.head));
        for element in body {
            self.elements(std::slice::from_ref(element));
        }
        let Some(OpenLoop { back, exits, .. }) = self.open_loops.pop() else {
            return Round {
                back: Vec::new(),
                exits: Vec::new(),
            };
        };
        Round { back, exits }
    }

    /// The worst-case path to the head in any round, for each state of the pipeline there.
    fn sum(
        &mut self,
        pipes: &[Pipe],
        rounds: &[Round],
        first: Vec<Option<(u64, Chain)>>,
        rounds_max: u32,
    ) -> Vec<Option<(u64, Chain)>> {
        let mut best = first.clone();
        let mut reached = first;
        for done in 1..rounds_max {
            let mut next: Vec<Option<(u64, Chain)>> = vec![None; pipes.len()];
            let mut from: Vec<Option<(Chain, Chain)>> = vec![None; pipes.len()];
            for (round, head) in rounds.iter().zip(&reached) {
                let Some((cycles, chain)) = head else {
                    continue;
                };
                for state in &round.back {
                    let Some(to) = pipes.iter().position(|pipe| *pipe == state.pipe) else {
                        continue;
                    };
                    if keep_longer(&mut next[to], (cycles + state.cycles, *chain)) {
                        from[to] = Some((*chain, state.chain));
                    }
                }
            }
            for (next, from) in next.iter_mut().zip(from) {
                if let (Some(next), Some((chain, segment))) = (next, from) {
                    next.1 = self.walker.arena.segment(chain, segment);
                }
            }
            best.iter_mut().zip(&next).for_each(|(best, next)| {
                next.iter().for_each(|&next| {
                    keep_longer(best, next);
                });
            });
            reached = next;
            if done >= ROUNDS_MAX {
                self.charge_rest(rounds, &mut best, rounds_max - 1 - done);
                break;
            }
        }
        best
    }

    /// The rounds that are not summed one by one, each as the most expensive.
    fn charge_rest(&mut self, rounds: &[Round], best: &mut [Option<(u64, Chain)>], left: u32) {
        let costs = rounds
            .iter()
            .flat_map(|round| &round.back)
            .map(|state| state.cycles);
        let each = costs.max().unwrap_or(0);
        let Some(&(cycles, chain)) = best.iter().flatten().max_by_key(|(cycles, _)| *cycles) else {
            return;
        };
        let rest = each * u64::from(left);
        let step = Step {
            address: 0,
            cycles: rest,
            waits: Waits::default(),
            accessed: Accessed::Nothing,
            times: left,
        };
        let chain = self.walker.arena.step(chain, step);
        self.walker.merged = true;
        best.fill(Some((cycles + rest, chain)));
    }
}

impl OpenLoop<'_> {
    fn holds(&self, to: Destination) -> bool {
        matches!(to, Destination::Block(block) if self.around.members.binary_search(&block).is_ok())
    }
}

/// The number of a pipeline state.
fn number(pipes: &mut Vec<Pipe>, pipe: Pipe) -> usize {
    pipes
        .iter()
        .position(|known| *known == pipe)
        .unwrap_or_else(|| {
            pipes.push(pipe);
            pipes.len() - 1
        })
}

fn keep_longer(known: &mut Option<(u64, Chain)>, new: (u64, Chain)) -> bool {
    let is = known.is_none_or(|(cycles, _)| cycles < new.0);
    if is {
        *known = Some(new);
    }
    is
}
