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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Tables;
    use crate::{Annotations, Code, Query};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    /// In front of all of these texts, and behind each, what is relevant of R0 to R7 and the flags.
    fn relevant(texts: &[&str], addresses: bool) -> Vec<String> {
        let query = Query {
            core: &Core::cortex_m33(),
            code: &Code::new(0x100, assembled(texts, Arch::V8M)),
            entry: 0x100,
            annotations: &Annotations::default(),
            interference: None,
        };
        let graph = Graph::build(&query, &Tables::default()).expect("a graph");
        let Relevance { before, behind } = Relevance::of(&graph, addresses);
        let names = |set: Relevant| {
            let registers = (0..8).filter(|register| set >> register & 1 != 0);
            let mut names: String = registers.map(|register| register.to_string()).collect();
            names.extend((set & FLAGS != 0).then_some('f'));
            assert_eq!(set >> 17, 0);
            names
        };
        let blocks = graph.blocks.iter().zip(&behind);
        let mut behind: Vec<(u32, String)> = blocks
            .flat_map(|(block, behind)| block.items.iter().zip(behind))
            .map(|(item, behind)| (item.address, names(*behind)))
            .collect();
        behind.sort();
        let behind = behind.into_iter().map(|(_, names)| names);
        [names(before[0])].into_iter().chain(behind).collect()
    }

    #[test]
    fn what_leads_to_branches_conditions_and_quotients_is_relevant() {
        let texts = [
            ("", "347", "12347"),
            ("movs r5, #1", "347", "12347"),
            ("ldr r6, [r1]", "347", "2347"),
            ("str r5, [r2]", "347", "347"),
            ("udiv r6, r7, r4", "367", "367"),
            ("cmp r6, #3", "37f", "37f"),
            ("it eq", "37f", "37f"),
            ("addeq r3, r7", "3", "3"),
            ("cbz r3, .+4", "", ""),
            ("nop", "", ""),
            ("bx lr", "", ""),
        ];
        let code: Vec<&str> = texts[1..].iter().map(|(text, ..)| *text).collect();
        assert_eq!(relevant(&code, false), texts.map(|(_, flow, _)| flow));
        assert_eq!(relevant(&code, true), texts.map(|(.., too)| too));
    }

    /// What the flags are made of, a round before; what is needed behind the loop, too.
    #[test]
    fn what_a_later_round_needs_is_relevant() {
        let texts = [
            ("", "12f"),
            ("adcs r1, r2", "12f"),
            ("mov r3, r4", "12f"),
            ("bne .-4", "12f"),
            ("cbz r1, .+4", ""),
            ("nop", ""),
            ("bx lr", ""),
        ];
        let code: Vec<&str> = texts[1..].iter().map(|(text, _)| *text).collect();
        assert_eq!(relevant(&code, false), texts.map(|(_, flow)| flow));
    }
}
