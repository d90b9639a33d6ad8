//! A piece under exploration: places in the code, and the states that were met there.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use whippen_audit::{Facts, Function, Kind, Node, Place};
use whippen_isa::timing::Pipe;

use crate::Flow;
use crate::graph::Graph;
use crate::order::{Element, Loop};
use crate::relevant::{Relevance, Relevant, writes};

/// A place in the code where states are gathered.
#[derive(Debug, Clone)]
pub struct Spot {
    pub node: Node,
    /// Facts that are worth keeping.
    pub(super) relevant: Relevant,
    /// The loops that it is in, outermost first.
    pub loops: Vec<u32>,
    pub place: Option<Place>,
    pub states: Vec<(Pipe, Facts)>,
    /// What follows each.
    pub follows: Vec<Vec<Follows>>,
}

impl Spot {
    pub(super) fn set_follows(&mut self, nth: usize, follows: Vec<Follows>) {
        let count = self.follows.len().max(nth + 1);
        self.follows.resize(count, Vec::new());
        self.follows[nth] = follows;
    }
}

/// What follows a state.
#[derive(Debug, Clone)]
pub struct Follows {
    pub cycles: i64,
    /// A state at a spot, or the end.
    pub to: Option<(usize, usize)>,
    /// The facts and pipeline with which it comes there.
    pub state: (Pipe, Facts),
}

/// A loop of a piece.
#[derive(Debug, Clone)]
pub struct LoopOfPiece {
    pub context: u32,
    pub head: u32,
    pub rounds_max: u32,
}

/// A piece under exploration.
pub struct Explored {
    pub entry: u32,
    /// The pipeline that it begins with.
    pub begins: Pipe,
    pub spots: Vec<Spot>,
    pub rounds: Vec<LoopOfPiece>,
    pub index: FxHashMap<(u32, u32), usize>,
    /// States whose followers are to be found.
    pub open: BTreeSet<(usize, usize)>,
    /// The cycles of the longest instruction.
    pub longest: u64,
}

impl Explored {
    pub(super) fn new(function: &Function, flow: &Flow, contexts: &[u32]) -> Self {
        let graph = &flow.graph;
        let relevance = Relevance::of(graph, true);
        let mut own = Self {
            entry: graph.blocks[0].address(),
            begins: Pipe::default(),
            spots: Vec::new(),
            rounds: Vec::new(),
            index: FxHashMap::default(),
            open: BTreeSet::new(),
            longest: 0,
        };
        let idle = function.kind == Kind::Idle;
        let mut order = Vec::new();
        let mut nest = Vec::new();
        match idle {
            true => order.extend((0..graph.blocks.len()).map(|block| (block, Vec::new(), !0))),
            false => own.order(&flow.order.elements, graph, contexts, &mut nest, &mut order),
        }
        for (block, loops, kept) in order {
            let items = &graph.blocks[block].items;
            for (nth, item) in items.iter().enumerate() {
                let before = nth.checked_sub(1).map(|before| &items[before].inst);
                let relevant = match (before, idle) {
                    (_, true) if nth == 0 => Some(0),
                    (None, _) => Some(relevance.before[block] & kept),
                    (Some(before), false) if before.is_conditional() => {
                        Some(relevance.behind[block][nth - 1])
                    }
                    _ => None,
                };
                let (context, at) = (contexts[graph.blocks[block].context], item.address);
                let node = Node { context, at, it: 0 };
                if let Some(relevant) = relevant {
                    own.index.insert((context, at), own.spots.len());
                    own.spots.push(Spot {
                        node,
                        relevant,
                        loops: loops.clone(),
                        place: None,
                        states: Vec::new(),
                        follows: Vec::new(),
                    });
                }
            }
        }
        own
    }

    /// Blocks in order, with the loops that they are in and what may be known at heads.
    fn order(
        &mut self,
        elements: &[Element],
        graph: &Graph,
        contexts: &[u32],
        nest: &mut Vec<u32>,
        order: &mut Vec<(usize, Vec<u32>, Relevant)>,
    ) {
        for element in elements {
            match element {
                Element::Block(block) if order.iter().any(|(known, ..)| known == block) => {}
                Element::Block(block) => order.push((*block, nest.clone(), !0)),
                Element::Loop(around) => {
                    let head = &graph.blocks[around.head];
                    nest.push(self.rounds.len() as u32);
                    self.rounds.push(LoopOfPiece {
                        context: contexts[head.context],
                        head: head.address(),
                        rounds_max: around.rounds_max,
                    });
                    order.push((around.head, nest.clone(), !changed(graph, around)));
                    self.order(&around.body, graph, contexts, nest, order);
                    nest.pop();
                }
            }
        }
    }
}

/// What a loop changes.
fn changed(graph: &Graph, around: &Loop) -> Relevant {
    let blocks = around.members.iter().map(|block| &graph.blocks[*block]);
    let calls = blocks
        .clone()
        .flat_map(|block| &block.edges)
        .any(|edge| edge.known.is_some());
    let items = blocks.flat_map(|block| &block.items);
    let changed = items.fold(0, |set, item| set | writes(&item.inst));
    if calls { !0 } else { changed }
}
