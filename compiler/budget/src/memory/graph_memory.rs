//! What a graph's code says of accesses: where registers point, which banks it is fetched from, and
//! whether it hands out addresses of the stack.

use std::collections::BTreeMap;

use whippen_board::{BankSet, Board};

use super::{Bases, Interference, Reach, SOMEWHERE};
use crate::graph::Graph;

/// How far behind an instruction words may be fetched while it executes: more than any prefetch
/// runs ahead, since how far this one does is not documented.
const AHEAD_BYTES: u32 = 64;

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct GraphMemory {
    /// Where accesses through registers go.
    pub(super) bases: Bases,
    /// Banks that may be fetched from while any of its instructions executes.
    pub(super) fetched: BankSet,
    /// Whether an address of the stack may be in another register than SP.
    pub(super) hands_stack: bool,
}

impl GraphMemory {
    /// Of a graph, with the registers that are said to point into known memory.
    pub fn of(
        said: &BTreeMap<u8, Reach>,
        graph: &Graph,
        interference: Option<&Interference>,
    ) -> Self {
        let items = graph.blocks.iter().flat_map(|block| &block.items);
        Self {
            bases: Bases::of(said, graph),
            fetched: interference.map_or(0, |around| around.banks_fetched(graph)),
            hands_stack: items.into_iter().any(|item| item.inst.hands_stack()),
        }
    }
}

impl Interference<'_> {
    /// The banks of all instructions, of what stands behind each, and of all targets: where a
    /// branch goes is fetched before it is decided.
    fn banks_fetched(&self, graph: &Graph) -> BankSet {
        let mut banks = 0;
        for block in &graph.blocks {
            let items = block.items.iter().map(|item| item.address);
            let targets = block.edges.iter().filter_map(|edge| edge.taken);
            for at in items.chain(targets.map(|target| target.address)) {
                banks |= match at {
                    SOMEWHERE => self.code,
                    _ => banks_from(self.board, at),
                };
            }
        }
        banks
    }
}

/// The banks of an address in memory and of what stands behind it.
fn banks_from(board: &Board, at: u32) -> BankSet {
    board.memory_at(at).map_or(0, |memory| {
        let rest = memory.size - (at - memory.base);
        memory.banks_between(at, AHEAD_BYTES.min(rest))
    })
}
