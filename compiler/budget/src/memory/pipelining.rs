//! Pipelined loads: whether an access is in the same memory as the one before it.
//!
//! On a Cortex-M4 an access starts under the load before it only where both go to the same memory
//! (jnk0le, pipeline cycle test, commit 3dfc2ab). What cannot be shown to stay in one is charged as
//! if it did not.

use whippen_board::Memory;
use whippen_isa::{Inst, reg};

use super::access::{addresses, roughly};
use super::{GraphMemory, Interference};
use crate::facts::Facts;
use crate::graph::Item;

impl Interference<'_> {
    /// Whether an access may be in another memory than that of the instruction before it in its
    /// block, if there is one.
    pub fn is_apart(
        &self,
        previous: Option<&Item>,
        item: &Item,
        facts: &Facts,
        graph: &GraphMemory,
    ) -> bool {
        let Some(previous) = previous.filter(|previous| previous.inst.words() > 0) else {
            return true;
        };
        if have_one_pointer(&previous.inst, &item.inst) {
            return false;
        }
        // What is known now of its registers was known in front of it, too, unless it wrote them.
        let kept = previous.inst.defs().core_bits() >> previous.inst.n & 1 == 0;
        let facts_before = if kept { facts } else { &Facts::nothing() };
        let before = self.memory_of(&previous.inst, previous.address, facts_before, graph);
        let now = self.memory_of(&item.inst, item.address, facts, graph);
        match (before, now) {
            (Some(before), Some(now)) => before.base != now.base,
            _ => true,
        }
    }

    /// The memory that an instruction accesses, where it is known to be one.
    fn memory_of(
        &self,
        inst: &Inst,
        at: u32,
        facts: &Facts,
        graph: &GraphMemory,
    ) -> Option<&Memory> {
        let behind = 4 * u32::from(inst.words().checked_sub(1)?);
        if let Some(reach) = graph.bases.reach(inst, at) {
            let holds = |memory: &&Memory| reach.banks & !memory.bank_set() == 0;
            let known = reach.unknown.is_none() && reach.banks != 0;
            return self.board.memory.iter().filter(|_| known).find(holds);
        }
        let pointed = addresses(inst, at, facts);
        let pointed =
            pointed.or_else(|| has_index(inst).then(|| roughly(inst, facts)).flatten())?;
        let first = self.board.memory_at(pointed.low as u32)?;
        let last = (pointed.high as u32).wrapping_add(behind);
        first.contains(last).then_some(first)
    }
}

/// Whether both access by a pointer in one register, which the first leaves there but for a step:
/// a pointer and what is added to it stay in one memory.
fn have_one_pointer(first: &Inst, second: &Inst) -> bool {
    let is_pointer =
        |inst: &Inst| inst.base() != reg::PC && (!inst.is_by_register() || has_index(inst));
    let kept = first.defs().core_bits() >> first.n & 1 == 0 || first.steps(first.n);
    first.n == second.n && is_pointer(first) && is_pointer(second) && kept
}

/// Whether an index is added to the address, which therefore is in `n`: only an index is shifted.
fn has_index(inst: &Inst) -> bool {
    inst.is_by_register() && inst.amount > 0
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use whippen_board::{BankSet, Board};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    use crate::chip::{self, ram};
    use crate::{Annotations, Code, Interference, Lies, Others, Query, Reach, bound};

    /// Code at 0, two memories for data.
    fn board() -> Board {
        let memory = |name, base, bank| ram(name, base, 0x1_0000, &[bank]);
        Board {
            arch: Arch::V7EM,
            cores: 1,
            memory: vec![
                memory("sram1", 0, 0),
                memory("ccm", 0x1000_0000, 1),
                memory("sram2", 0x2001_0000, 2),
            ],
            buses: Vec::new(),
            stacks: vec![0x2002_0000],
            ..chip::board()
        }
    }

    /// The banks of either memory of data.
    const CCM: BankSet = 0b010;
    const SRAM2: BankSet = 0b100;

    /// The bound of some texts and BX LR, with these words in registers, and with registers that
    /// point into these banks.
    fn cycles(texts: &[&str], entered: &[(u8, u32)], bases: &[(u8, Reach)]) -> u64 {
        let mut bytes = assembled(texts, Arch::V7EM);
        bytes.extend(0x4770_u16.to_le_bytes());
        let code = Code::new(0, bytes);
        let annotations = Annotations {
            entered: BTreeMap::from_iter(entered.iter().map(|(n, word)| (*n, [*word, *word]))),
            bases: bases.iter().cloned().collect(),
            ..Annotations::default()
        };
        let board = board();
        let lies = Lies {
            code: 1,
            data: within(CCM | SRAM2),
            ..Lies::default()
        };
        let alone = Interference::new(&board, &[], lies, Others::default());
        let query = Query {
            core: &Core::cortex_m4(),
            code: &code,
            entry: 0,
            annotations: &annotations,
            interference: Some(&alone),
        };
        bound(&query).expect("a bound").cycles_max
    }

    /// Whether the second of two loads is pipelined.
    fn pipelines(texts: [&str; 2], entered: &[(u8, u32)], bases: &[(u8, Reach)]) -> bool {
        let cycles = cycles(&texts, entered, bases);
        // BX LR leads to a 32-bit instruction across two words, as nothing is known of the caller.
        let apart = 2 + 2 + 4;
        assert!(
            cycles == apart || cycles == apart - 1,
            "{texts:?}: {cycles}"
        );
        cycles < apart
    }

    fn within(banks: BankSet) -> Reach {
        Reach {
            banks,
            unknown: None,
        }
    }

    const TWO_POINTERS: [&str; 2] = ["ldr r0, [r1]", "ldr r2, [r3]"];

    #[test]
    fn loads_of_one_memory_pipeline() {
        let words = |second| pipelines(TWO_POINTERS, &[(1, 0x1000_0000), (3, second)], &[]);
        assert!(words(0x1000_0100) && !words(0x2001_0100));
        let bases = |first, second| pipelines(TWO_POINTERS, &[], &[(1, first), (3, second)]);
        assert!(bases(within(CCM), within(CCM)) && bases(within(SRAM2), within(SRAM2)));
        assert!(!bases(within(CCM), within(SRAM2)) && !bases(within(SRAM2), within(CCM)));
    }

    #[test]
    fn what_is_not_known_is_not_taken_for_one_memory() {
        assert!(!pipelines(TWO_POINTERS, &[], &[]));
        let either = within(CCM | SRAM2);
        for reach in [either, within(0)] {
            let both = [(1, reach.clone()), (3, reach)];
            assert!(!pipelines(TWO_POINTERS, &[], &both), "{both:?}");
        }
        // R1 pointed to another memory, and holds a byte then, as if to that of the code.
        let texts = ["ldrb r1, [r1]", "ldr r2, [r3]", "cbz r1, .+4", "nop"];
        let [code, data] = [0x100, 0x2001_0100]
            .map(|second| cycles(&texts, &[(1, 0x1000_0000), (3, second)], &[]));
        assert_eq!(code, data);
    }

    /// A pointer and what is added to it stay in one memory; what is it of two registers nobody
    /// says, but where the other one is shifted.
    #[test]
    fn one_pointer_is_to_one_memory() {
        for (texts, one) in [
            (["ldr r0, [r1]", "ldr r2, [r1, #4]"], true),
            (["ldr r1, [r1]", "ldr r2, [r1]"], false),
            (["ldr r0, [r1, r2]", "ldr r3, [r1, r4]"], false),
            (["ldr r0, [r1, r2]", "ldr r3, [r1]"], false),
            (["ldr r0, [r1]", "ldr r3, [r1, r2]"], false),
            (
                ["ldr.w r0, [r1, r2, lsl #2]", "ldr.w r3, [r1, r4, lsl #2]"],
                true,
            ),
            (["ldr.w r0, [r1, r2, lsl #2]", "ldr r3, [r1]"], true),
            (
                ["ldr.w r0, [r1, r2, lsl #2]", "ldr.w r3, [r4, r2, lsl #2]"],
                false,
            ),
        ] {
            assert_eq!(pipelines(texts, &[], &[]), one, "{texts:?}");
        }
    }

    /// A literal has no base: it is not by R0.
    #[test]
    fn a_literal_is_beside_the_code() {
        let texts = ["ldr r3, [pc, #0]", "ldr r1, [r0]"];
        assert!(pipelines(texts, &[(0, 0x100)], &[]));
        assert!(!pipelines(texts, &[(0, 0x1000_0100)], &[]));
        assert!(!pipelines(texts, &[], &[]));
    }
}
