//! Pipelined loads: whether an access is in the same memory as the one before it.
//!
//! On a Cortex-M4 an access starts under the load before it only where both go to the same memory
//! (jnk0le, pipeline cycle test, commit 3dfc2ab). What cannot be shown to stay in one is charged as
//! if it did not.

use whippen_board::Memory;
use whippen_isa::{Inst, reg};

use super::access::{addresses, roughly};
use super::{GraphMemory, Interference, steps};
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
    let kept = first.defs().core_bits() >> first.n & 1 == 0 || steps(first, first.n);
    first.n == second.n && is_pointer(first) && is_pointer(second) && kept
}

/// Whether an index is added to the address, which therefore is in `n`: only an index is shifted.
fn has_index(inst: &Inst) -> bool {
    inst.is_by_register() && inst.amount > 0
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use whippen_board::{AccessTime, Board, Memory, MemoryKind, Start};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;

    use crate::{Annotations, Code, Interference, Lies, Others, Query, Reach, bound};

    fn memory(name: &str, base: u32, bank: u8) -> Memory {
        Memory {
            name: name.into(),
            base,
            size: 0x1_0000,
            kind: MemoryKind::Ram,
            access: AccessTime::Cycles(1),
            fetch: AccessTime::Cycles(1),
            striped: false,
            banks: vec![bank],
        }
    }

    /// Code at 0, two memories for data.
    fn board() -> Board {
        Board {
            name: "own".into(),
            arch: Arch::V7EM,
            cores: 1,
            clock_hz: 168_000_000,
            start: Start::Vectors,
            uf2_family: None,
            fetches_apart: true,
            banks: ["SRAM1", "CCM", "SRAM2"].map(String::from).to_vec(),
            memory: vec![
                memory("sram1", 0, 0),
                memory("ccm", 0x1000_0000, 1),
                memory("sram2", 0x2001_0000, 2),
            ],
            buses: Vec::new(),
            devices: Vec::new(),
            converter_interrupt: 56,
            stacks: vec![0x2002_0000],
            places: Vec::new(),
            knob: None,
            bench: None,
            columns: None,
            i2s: None,
        }
    }

    /// The bound of two instructions and BX LR, with these words in registers.
    fn cycles(code: [u16; 2], entered: &[(u8, u32)]) -> u64 {
        let bytes = code.into_iter().chain([0x4770]);
        let code = Code::new(0, bytes.flat_map(u16::to_le_bytes).collect());
        let annotations = Annotations {
            entered: BTreeMap::from_iter(entered.iter().map(|(n, word)| (*n, [*word, *word]))),
            ..Annotations::default()
        };
        let board = board();
        let data = Reach {
            banks: 0b110,
            unknown: None,
        };
        let lies = Lies {
            code: 1,
            data,
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

    /// `ldr r0, [r1]` and `ldr r2, [r3]`.
    const TWO_POINTERS: [u16; 2] = [0x6808, 0x681a];
    /// `ldr r3, [pc]`, whose encoding has no base, and `ldr r1, [r0]`.
    const LITERAL_FIRST: [u16; 2] = [0x4b00, 0x6801];
    /// `ldr r0, [r1]` and `ldr r2, [r1, #4]`.
    const ONE_POINTER: [u16; 2] = [0x6808, 0x684a];

    /// To a 32-bit instruction across two words, as nothing is known of the caller.
    const BX_LR_CYCLES: u64 = 4;

    #[test]
    fn loads_of_one_memory_pipeline() {
        let one = cycles(TWO_POINTERS, &[(1, 0x1000_0000), (3, 0x1000_0100)]);
        let two = cycles(TWO_POINTERS, &[(1, 0x1000_0000), (3, 0x2001_0100)]);
        assert_eq!((one, two), (2 + 1 + BX_LR_CYCLES, 2 + 2 + BX_LR_CYCLES));
    }

    #[test]
    fn what_is_not_known_is_not_taken_for_one_memory() {
        assert_eq!(cycles(TWO_POINTERS, &[]), 2 + 2 + BX_LR_CYCLES);
        assert_eq!(cycles(ONE_POINTER, &[]), 2 + 1 + BX_LR_CYCLES);
    }
    #[test]
    fn a_literal_is_beside_the_code() {
        let [beside, away] =
            [0x100, 0x1000_0100].map(|to| cycles(LITERAL_FIRST, &[(0, to)]) - BX_LR_CYCLES);
        assert_eq!((beside, away), (2 + 1, 2 + 2));
        assert_eq!(cycles(LITERAL_FIRST, &[]), 2 + 2 + BX_LR_CYCLES);
    }
}
