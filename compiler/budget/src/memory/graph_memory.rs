//! What a graph's code says of accesses: where registers point, which banks it is fetched from, and
//! whether it hands out addresses of the stack.

use std::collections::BTreeMap;

use whippen_board::{BankSet, Board};
use whippen_isa::{Class, Inst, RegSet, reg};

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
    pub(super) takes_stack_address: bool,
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
            takes_stack_address: items
                .into_iter()
                .any(|item| takes_stack_address(&item.inst)),
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

/// Whether an instruction may put an address of the stack elsewhere than into SP: it reads SP, and
/// not only as the base of what it accesses or to move it.
fn takes_stack_address(inst: &Inst) -> bool {
    use Class::*;
    let sp = RegSet::core(reg::SP);
    if !inst.uses().contains(sp) {
        return false;
    }
    let accesses = matches!(
        inst.class(),
        Load | Store
            | LoadDual
            | StoreDual
            | LoadMultiple
            | StoreMultiple
            | FloatLoad
            | FloatStore
            | FloatLoadMultiple
            | FloatStoreMultiple
    );
    let stored = inst.t == reg::SP || inst.t2 == reg::SP;
    let moved = inst.defs().core_bits() == sp.core_bits();
    !(accesses && inst.n == reg::SP && !stored || moved && !accesses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::{Arch, parse};

    #[test]
    fn an_address_of_the_stack_is_taken_by_what_reads_it_elsewhere() {
        for (text, takes) in [
            ("mov r0, sp", true),
            ("add r0, sp, #4", true),
            ("str.w sp, [r0]", true),
            ("str.w sp, [sp, #4]", true),
            ("ldr r0, [sp, #4]", false),
            ("ldr r0, [sp], #8", false),
            ("str r0, [sp, #4]", false),
            ("push {r4, lr}", false),
            ("pop {r4, pc}", false),
            ("vstr s0, [sp]", false),
            ("add sp, #8", false),
            ("sub sp, #8", false),
            ("mov sp, r0", false),
            ("adds r0, r1", false),
            ("ldr r0, [r1]", false),
        ] {
            let inst =
                parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"));
            assert_eq!(takes_stack_address(&inst), takes, "{text}");
        }
    }
}
