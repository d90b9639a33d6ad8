//! Pipelined loads: whether an access is in the same memory as the one before it.
//!
//! On a Cortex-M4 an access starts under the load before it only where both go to the same memory
//! (jnk0le, pipeline cycle test, commit 3dfc2ab). What cannot be shown to stay in one is charged as
//! if it did not.

use whippen_board::Memory;
use whippen_isa::{Inst, reg};

use super::access::{accesses, addresses, is_by_register, is_literal, roughly};
use super::{Bases, Interference, steps};
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
        bases: &Bases,
    ) -> bool {
        let Some(previous) = previous.filter(|previous| accesses(&previous.inst) > 0) else {
            return true;
        };
        if have_one_pointer(&previous.inst, &item.inst) {
            return false;
        }
        // What is known now of its registers was known in front of it, too, unless it wrote them.
        let kept = previous.inst.defs().core_bits() >> previous.inst.n & 1 == 0;
        let facts_before = if kept { facts } else { &Facts::nothing() };
        let before = self.memory_of(&previous.inst, previous.address, facts_before, bases);
        let now = self.memory_of(&item.inst, item.address, facts, bases);
        match (before, now) {
            (Some(before), Some(now)) => before.base != now.base,
            _ => true,
        }
    }

    /// The memory that an instruction accesses, where it is known to be one.
    fn memory_of(&self, inst: &Inst, at: u32, facts: &Facts, bases: &Bases) -> Option<&Memory> {
        if is_literal(inst) {
            return self.board.memory_at(at);
        }
        if let Some(reach) = bases.reach(inst) {
            let holds = |memory: &&Memory| reach.banks & !memory.bank_set() == 0;
            let known = reach.unknown.is_none() && reach.banks != 0;
            return self.board.memory.iter().filter(|_| known).find(holds);
        }
        let pointed = addresses(inst, at, facts);
        let pointed =
            pointed.or_else(|| has_index(inst).then(|| roughly(inst, facts)).flatten())?;
        let first = self.board.memory_at(pointed.low as u32)?;
        first.contains(pointed.high as u32).then_some(first)
    }
}

/// Whether both access by a pointer in one register, which the first leaves there but for a step:
/// a pointer and what is added to it stay in one memory.
fn have_one_pointer(first: &Inst, second: &Inst) -> bool {
    let is_pointer = |inst: &Inst| inst.n != reg::PC && (!is_by_register(inst) || has_index(inst));
    let kept = first.defs().core_bits() >> first.n & 1 == 0 || steps(first, first.n);
    first.n == second.n && is_pointer(first) && is_pointer(second) && kept
}

/// Whether an index is added to the address, which therefore is in `n`: only an index is shifted.
fn has_index(inst: &Inst) -> bool {
    is_by_register(inst) && inst.amount > 0
}
