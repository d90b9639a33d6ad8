//! Registers that hold a pointer and an index added to it: they point where the pointer does.
//!
//! ```text
//!   add  r4, r7, r9, lsl #2      r7 points into known memory; only an index is shifted
//!   bl   string                  saves R4 first and gives it back
//!   ldr  r0, [r4, #112]          goes where accesses through R7 go
//! ```
//!
//! A forward analysis over the blocks of a graph: of each register the pointer that it was made of,
//! if that is the same on all ways.

use std::collections::BTreeMap;

use whippen_isa::{Inst, Op, ShiftType};

use super::bases::keeps;
use crate::graph::{Block, Control, Edge, Graph, Item};

/// Of each register, the pointer that it was made of.
type Made = [Option<u8>; 16];

/// Of each access through such a register, by its address, the pointer.
pub(super) type Indexed = BTreeMap<u32, Option<u8>>;

/// Finds them. `is_pointer`: a register points into known memory at an instruction.
pub(super) fn of(graph: &Graph, is_pointer: impl Fn(u8, u32) -> bool) -> Indexed {
    let adds = |item: &Item| adds_index(&item.inst) && is_pointer(item.inst.n, item.address);
    let mut items = graph.blocks.iter().flat_map(|block| &block.items);
    if !items.any(adds) {
        return Indexed::new();
    }
    let analysis = Analysis { graph, adds };
    let entered = analysis.entered();
    let mut all = Indexed::new();
    for (block, made) in graph.blocks.iter().zip(entered) {
        let Some(mut made) = made else {
            continue;
        };
        for item in &block.items {
            if item.inst.words() > 0 {
                let own = made[usize::from(item.inst.n & 15)];
                let known = all.entry(item.address).or_insert(own);
                *known = known.filter(|known| Some(*known) == own);
            }
            analysis.pass(item, &mut made);
        }
    }
    all
}

/// Whether an instruction adds a shifted index to a register.
fn adds_index(inst: &Inst) -> bool {
    inst.op() == Op::ADD_register
        && inst.shift == ShiftType::LSL
        && inst.amount > 0
        && !inst.is_conditional()
}

struct Analysis<'a, F> {
    graph: &'a Graph,
    /// Whether an instruction adds an index to a pointer.
    adds: F,
}

impl<F: Fn(&Item) -> bool> Analysis<'_, F> {
    /// What is known where each block begins; nothing of what no way leads to.
    fn entered(&self) -> Vec<Option<Made>> {
        let mut entered = vec![None; self.graph.blocks.len()];
        entered[0] = Some(Made::default());
        let mut is_settled = false;
        while !is_settled {
            is_settled = true;
            for number in 0..self.graph.blocks.len() {
                let Some(made) = entered[number] else {
                    continue;
                };
                let block = &self.graph.blocks[number];
                let made = self.left(block, made, &entered);
                for edge in &block.edges {
                    let made = if is_known(edge) {
                        made
                    } else {
                        Made::default()
                    };
                    let crate::graph::Destination::Block(to) = edge.to else {
                        continue;
                    };
                    let both = entered[to].map_or(made, |known| both(known, made));
                    is_settled &= entered[to] == Some(both);
                    entered[to] = Some(both);
                }
            }
        }
        entered
    }

    /// What is known behind a block.
    fn left(&self, block: &Block, mut made: Made, entered: &[Option<Made>]) -> Made {
        block
            .items
            .iter()
            .for_each(|item| self.pass(item, &mut made));
        let returns = block.last().map(|item| item.control) == Some(Control::Return);
        let Some(before) = returns.then(|| self.called(block, entered)).flatten() else {
            return made;
        };
        for (register, before) in (0..).zip(before) {
            if before.is_some() && keeps(self.graph, block.context, register) {
                made[usize::from(register)] = before;
            }
        }
        made
    }

    /// What was known where the function of a block began.
    fn called(&self, block: &Block, entered: &[Option<Made>]) -> Option<Made> {
        let callee = self.graph.contexts[block.context].callee & !1;
        let mut numbered = self.graph.blocks.iter().zip(entered);
        let first =
            numbered.find(|(own, _)| own.context == block.context && own.address() == callee);
        *first?.1
    }

    /// Past an instruction.
    fn pass(&self, item: &Item, made: &mut Made) {
        let inst = &item.inst;
        let moved = inst.op() == Op::MOV_register && !inst.is_conditional();
        let written = match (self.adds)(item) {
            true => Some(inst.n),
            false if moved => made[usize::from(inst.m & 15)],
            false => None,
        };
        for register in (0..16).filter(|register| inst.defs().core_bits() >> register & 1 != 0) {
            if !inst.steps(register) {
                made[usize::from(register)] = written;
            }
        }
    }
}

/// Whether what is known of registers holds along an edge: not behind a function that is bounded
/// elsewhere, nor behind an exception.
fn is_known(edge: &Edge) -> bool {
    edge.known.is_none() && !edge.leaves
}

/// What is the same in both.
fn both(a: Made, b: Made) -> Made {
    std::array::from_fn(|register| a[register].filter(|own| b[register] == Some(*own)))
}
