//! Registers that point into known memory: where accesses through them go.
//!
//! A register is one as long as nothing moves it but by constants; so is what an index is added to
//! it in (`indexed`). A function that saves it where
//! it begins, and takes it back where it returns, may do with it what it likes: outside it points
//! where it did, inside nothing is known of it.

use std::collections::{BTreeMap, BTreeSet};

use whippen_isa::Inst;

use super::Reach;
use super::indexed::{self, Indexed};
use crate::graph::{ContextId, Control, Graph};

/// Where accesses through registers go.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Bases {
    known: BTreeMap<u8, Base>,
    /// Accesses through a register that was made of one and an index.
    indexed: Indexed,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Base {
    reach: Reach,
    /// The instructions of functions that save and restore it.
    inside: BTreeSet<u32>,
}

impl Bases {
    /// Of the registers that are said to point into known memory, those that nothing in a graph
    /// moves but by constants, or that is undone.
    pub fn of(said: &BTreeMap<u8, Reach>, graph: &Graph) -> Self {
        let base = |(register, reach): (&u8, &Reach)| {
            let base = Base {
                reach: reach.clone(),
                inside: inside(graph, *register)?,
            };
            Some((*register, base))
        };
        let mut bases = Self {
            known: said.iter().filter_map(base).collect(),
            indexed: Indexed::new(),
        };
        bases.indexed = indexed::of(graph, |register, at| bases.base(register, at).is_some());
        bases
    }

    /// Where an access goes by such a register and a constant, or an index that is added before.
    pub fn reach(&self, inst: &Inst, at: u32) -> Option<&Reach> {
        self.pointer(inst, at)
            .and_then(|pointer| self.known.get(&pointer))
            .map(|base| &base.reach)
    }

    /// The register that an access goes by, or that its register was made of.
    pub fn pointer(&self, inst: &Inst, at: u32) -> Option<u8> {
        if inst.is_by_register() || inst.base() != inst.n {
            return None;
        }
        let own = self.base(inst.n, at).map(|_| inst.n);
        own.or_else(|| self.indexed.get(&at).copied().flatten())
    }

    /// A register that points into known memory at an instruction.
    fn base(&self, register: u8, at: u32) -> Option<&Base> {
        let base = self.known.get(&register)?;
        (!base.inside.contains(&at)).then_some(base)
    }
}

/// The instructions of functions that move a register and bring it back; none where something
/// else moves it.
fn inside(graph: &Graph, register: u8) -> Option<BTreeSet<u32>> {
    let moves = |inst: &Inst| inst.defs().core_bits() >> register & 1 != 0 && !inst.steps(register);
    let blocks = graph.blocks.iter();
    let moving = blocks.filter(|block| block.items.iter().any(|item| moves(&item.inst)));
    let moving: BTreeSet<ContextId> = moving.map(|block| block.context).collect();
    let mut keepers = BTreeSet::new();
    for context in moving {
        keepers.insert(keeper(graph, context, register)?);
    }
    let is_inside = |context| callers(graph, context).any(|caller| keepers.contains(&caller));
    let blocks = graph.blocks.iter().filter(|block| is_inside(block.context));
    let items = blocks.flat_map(|block| &block.items);
    Some(items.map(|item| item.address).collect())
}

/// The function that keeps a register for its caller: this one, or one that led to it.
fn keeper(graph: &Graph, context: ContextId, register: u8) -> Option<ContextId> {
    callers(graph, context).find(|caller| keeps(graph, *caller, register))
}

/// A context and those that led to it.
fn callers(graph: &Graph, context: ContextId) -> impl Iterator<Item = ContextId> {
    std::iter::successors(Some(context), |context| graph.contexts[*context].caller)
}

/// Whether a function that is called saves a register with its first instruction, and every return
/// takes it from there. That a return finds the stack pointer of the entry is checked for all
/// (`stack`), and that nobody else writes to the slot is the calling convention.
pub(super) fn keeps(graph: &Graph, context: ContextId, register: u8) -> bool {
    let entered = graph.contexts[context];
    if entered.caller.is_none() {
        return false;
    }
    let own = || graph.blocks.iter().filter(|block| block.context == context);
    let entry = own().find(|block| block.address() == entered.callee & !1);
    let first = entry.and_then(|block| block.items.first());
    let saved = first
        .filter(|item| !item.inst.is_conditional())
        .and_then(|item| item.inst.stored_slot(0, register));
    let back = |inst: &Inst| {
        let by = inst.sp_change_bytes().filter(|_| !inst.is_conditional())?;
        inst.loaded_slot(-by, register)
    };
    let mut returns = own()
        .flat_map(|block| &block.items)
        .filter(|item| item.control == Control::Return)
        .peekable();
    saved.is_some() && returns.peek().is_some() && returns.all(|item| back(&item.inst) == saved)
}
