//! Which registers and flags may still decide a branch: facts about others are not worth keeping.
//!
//! Liveness, with branches (and what else the cycles depend on) as the only readers: an instruction
//! whose results are relevant makes its operands relevant.

use whippen_isa::{Class, Flags, Inst};

use super::graph::{Graph, Item};

/// A set of core registers, bit n for Rn, and the flags, bit 16.
pub type Relevant = u32;

/// The flags.
pub const FLAGS: Relevant = 1 << 16;

/// What is relevant at every place of a graph.
#[derive(Debug)]
pub struct Relevance {
    /// In front of each block.
    pub before: Vec<Relevant>,
    /// Behind each instruction of each block.
    pub behind: Vec<Vec<Relevant>>,
}

impl Relevance {
    /// Backwards through the graph until nothing changes; `addresses` decide too if waiting for
    /// memory is charged.
    pub fn of(graph: &Graph, addresses: bool) -> Self {
        let effects: Vec<Vec<Effect>> = graph
            .blocks
            .iter()
            .map(|block| {
                block
                    .items
                    .iter()
                    .map(|item| Effect::of(item, addresses))
                    .collect()
            })
            .collect();
        let mut before = vec![0; graph.blocks.len()];
        let mut changed = true;
        while changed {
            changed = false;
            for block in (0..graph.blocks.len()).rev() {
                let behind = behind(graph, &before, block);
                let here = effects[block]
                    .iter()
                    .rev()
                    .fold(behind, |behind, effect| effect.before(behind));
                changed |= before[block] != here;
                before[block] = here;
            }
        }
        let behind = |block: usize| {
            let mut relevant = behind(graph, &before, block);
            let mut all: Vec<Relevant> = Vec::new();
            for effect in effects[block].iter().rev() {
                all.push(relevant);
                relevant = effect.before(relevant);
            }
            all.reverse();
            all
        };
        let behind = (0..graph.blocks.len()).map(behind).collect();
        Self { before, behind }
    }
}

/// What an instruction may write.
pub fn writes(inst: &Inst) -> Relevant {
    let flags = if inst.flags().writes.intersects(Flags::NZCV) {
        FLAGS
    } else {
        0
    };
    Relevant::from(inst.defs().core_bits()) | flags
}

fn behind(graph: &Graph, before: &[Relevant], block: usize) -> Relevant {
    graph.successors(block).fold(0, |set, to| set | before[to])
}

/// What one instruction reads and writes.
struct Effect {
    /// Read by the branch, the condition or the division itself.
    decides: Relevant,
    reads: Relevant,
    writes: Relevant,
    /// Written for certain.
    kills: Relevant,
}

impl Effect {
    fn of(item: &Item, addresses: bool) -> Self {
        let inst = &item.inst;
        let flags = inst.flags();
        let registers = Relevant::from(inst.uses().core_bits());
        let writes = writes(inst);
        let conditional = inst.is_conditional();
        let by_operands = matches!(
            inst.class(),
            Class::CompareBranch | Class::TableBranch | Class::Divide
        );
        let base = if addresses && registers >> inst.n & 1 != 0 {
            1 << inst.n
        } else {
            0
        };
        let decides =
            if by_operands { registers } else { base } | if conditional { FLAGS } else { 0 };
        let kills = if conditional { 0 } else { writes };
        Self {
            decides,
            reads: registers
                | if flags.reads.intersects(Flags::NZCV) {
                    FLAGS
                } else {
                    0
                },
            writes,
            kills,
        }
    }

    fn before(&self, behind: Relevant) -> Relevant {
        let reads = if self.writes & behind != 0 {
            self.reads
        } else {
            0
        };
        behind & !self.kills | reads | self.decides
    }
}
