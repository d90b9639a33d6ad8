//! What an instruction does at memory, by itself: how many words, at which addresses, and what is
//! fetched for it.

#[cfg(test)]
mod tests;

use whippen_isa::{Class, Inst, RegSet, reg};

use crate::facts::{ALL, Facts, Interval, holds};

/// Addresses that are looked at one by one, at most.
pub(crate) const RANGE: i64 = 4096;

/// How many words an instruction reads or writes.
pub(crate) fn words(inst: &Inst) -> u16 {
    use Class::*;
    match inst.class() {
        Load | Store | LoadOrdered | StoreOrdered | TableBranch => 1,
        LoadDual | StoreDual => 2,
        LoadMultiple | StoreMultiple => (inst.imm as u16).count_ones() as u16,
        FloatLoad | FloatStore | FloatLoadMultiple | FloatStoreMultiple => {
            inst.uses().union(inst.defs()).single_bits().count_ones() as u16
        }
        _ => 0,
    }
}

/// Whether an instruction writes.
pub(crate) fn is_store(inst: &Inst) -> bool {
    use Class::*;
    matches!(
        inst.class(),
        Store | StoreDual | StoreMultiple | StoreOrdered | FloatStore | FloatStoreMultiple
    )
}

/// Whether an instruction may put an address of the stack into another register than SP.
pub fn hands_stack(inst: &Inst) -> bool {
    let sp = RegSet::core(reg::SP);
    let (uses, accesses) = (inst.uses().contains(sp), words(inst) > 0);
    let stored = inst.t == reg::SP || inst.t2 == reg::SP;
    let moved = inst.defs().core_bits() == sp.core_bits();
    uses && !(accesses && inst.n == reg::SP && !stored || moved && !accesses)
}

/// What is fetched for an instruction and for where it branches.
pub(crate) fn fetches(inst: &Inst, at: u32, target: Option<u32>) -> impl Iterator<Item = u32> {
    let starts = (at & 2 == 0).then_some(at);
    let ends = (at & 2 != 0 && inst.size() == 4).then_some(at.wrapping_add(2));
    [starts, ends, target.filter(|to| to & 2 != 0)]
        .into_iter()
        .flatten()
}

/// The first address that an instruction accesses, where it is one of a few.
pub(crate) fn addresses(inst: &Inst, at: u32, facts: &Facts) -> Option<Interval> {
    let (class, name) = (inst.class(), inst.op().identifier());
    let simple = matches!(
        class,
        Class::Load | Class::Store | Class::LoadDual | Class::StoreDual
    );
    if !simple || name.ends_with("_register") {
        return None;
    }
    let base = match name.ends_with("_literal") {
        true => [i64::from((at.wrapping_add(4) & !3) as i32); 2],
        // By PC there are literals alone.
        false => facts.of(inst.n),
    };
    let offset = if inst.add {
        i64::from(inst.imm)
    } else {
        -i64::from(inst.imm)
    };
    let moved = if inst.index {
        base.map(|end| end + offset)
    } else {
        base
    };
    (holds(ALL, moved) && moved[1] - moved[0] < RANGE).then_some(moved)
}
