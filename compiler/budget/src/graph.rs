//! The control-flow graph, from bytes: blocks of instructions and where they lead, calls in the
//! context of their caller.
//!
//! ```text
//!   (context, address) --follow--> nodes, one per instruction --gather--> blocks
//! ```
//!
//! A called function appears once per chain of calls that leads to it, so that its return has one
//! place to go.

mod follow;

use std::collections::BTreeMap;

use whippen_isa::Inst;
use whippen_isa::timing::{Target, Timed};

use super::{Known, NotBounded, Query};
pub use whippen_arm::control::Control;

/// Number of a block.
pub type BlockId = usize;
/// Number of a chain of calls; 0 is the entry's own.
pub type ContextId = usize;

/// The graph. The first block is the entry.
#[derive(Debug)]
pub struct Graph {
    pub blocks: Vec<Block>,
    pub contexts: Vec<Context>,
}

/// A straight run: only its last instruction leads elsewhere than to the next.
#[derive(Debug)]
pub struct Block {
    pub context: ContextId,
    pub items: Vec<Item>,
    pub edges: Vec<Edge>,
}

/// An instruction at its place.
#[derive(Debug, Clone, Copy)]
pub struct Item {
    pub address: u32,
    pub inst: Inst,
    pub timed: Timed,
    pub control: Control,
}

/// A chain of calls: who called last, and where it goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Context {
    pub caller: Option<ContextId>,
    /// The function that was called.
    pub callee: u32,
    pub return_address: u32,
}

/// One edge out of a block.
#[derive(Debug, Clone)]
pub struct Edge {
    /// The branch is taken, to this target; else the next instruction follows.
    pub taken: Option<Target>,
    /// Of a table branch, the indices that lead here.
    pub indices: Vec<u32>,
    /// A function that is bounded elsewhere runs before; its first instruction is the target.
    pub known: Option<Known>,
    /// An exception's handler returns.
    pub leaves: bool,
    pub to: Destination,
}

/// Where an edge leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Destination {
    Block(BlockId),
    /// The end of the question.
    Stop,
}

/// How many entries of each table branch can be reached, as far as is known: by its address.
#[derive(Debug, Default)]
pub struct Tables {
    entries: BTreeMap<u32, u32>,
}

impl Tables {
    /// How many entries a table has.
    fn entries_of(&self, at: u32) -> u32 {
        self.entries.get(&at).copied().unwrap_or(0)
    }

    /// Takes over the largest index that was found for each table; says whether one is larger than
    /// known so far.
    pub fn learn(&mut self, indices: &BTreeMap<u32, u32>) -> bool {
        let mut learned = false;
        for (&at, &largest) in indices {
            let entries = self.entries.entry(at).or_default();
            if largest < TABLE_MAX && *entries <= largest {
                *entries = largest + 1;
                learned = true;
            }
        }
        learned
    }
}

/// Entries of a table at most: an index that is not bounded below this is not bounded.
pub const TABLE_MAX: u32 = 1024;

impl Graph {
    /// Follows every path from the entry.
    pub fn build(query: &Query, tables: &Tables) -> Result<Self, NotBounded> {
        follow::Followed::from(query, tables).map(follow::Followed::gather)
    }

    /// The blocks that a block leads to.
    pub fn successors(&self, block: BlockId) -> impl Iterator<Item = BlockId> + '_ {
        self.blocks[block]
            .edges
            .iter()
            .filter_map(|edge| match edge.to {
                Destination::Block(to) => Some(to),
                Destination::Stop => None,
            })
    }
}

impl Block {
    /// The address of its first instruction.
    pub fn address(&self) -> u32 {
        self.items.first().map_or(0, |item| item.address)
    }

    /// Its last instruction.
    pub fn last(&self) -> Option<&Item> {
        self.items.last()
    }
}
