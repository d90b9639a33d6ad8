//! Accesses of an instruction: how many words it fetches and accesses, and where.

use whippen_isa::{Class, Inst, reg};

use crate::facts::{Facts, Interval};

pub(super) fn is_by_register(inst: &Inst) -> bool {
    inst.op().identifier().ends_with("_register")
}

pub(super) fn is_literal(inst: &Inst) -> bool {
    inst.op().identifier().ends_with("_literal")
}

pub(super) fn is_store(inst: &Inst) -> bool {
    use Class::*;
    matches!(
        inst.class(),
        Store | StoreDual | StoreMultiple | StoreOrdered | FloatStore | FloatStoreMultiple
    )
}

/// The words that are fetched for an instruction, and for the one that a branch leads to. A 16-bit
/// instruction at the upper half of a word came with the one before it, unless a branch led there.
pub(super) fn fetched(inst: &Inst, at: u32, taken: Option<u32>) -> impl Iterator<Item = u32> {
    let starts = (at & 2 == 0).then_some(at);
    let ends = (at & 2 != 0 && inst.size() == 4).then_some(at.wrapping_add(2));
    let target = taken.filter(|target| target & 2 != 0);
    [starts, ends, target].into_iter().flatten()
}

/// How many words an instruction reads or writes.
pub(super) fn accesses(inst: &Inst) -> u16 {
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

/// Addresses that are looked at one by one, at most.
const RANGE_BYTES_MAX: i64 = 4096;

/// The first address that an instruction accesses, where it is known or one of a few.
pub(super) fn addresses(inst: &Inst, at: u32, facts: &Facts) -> Option<Interval> {
    let simple = matches!(
        inst.class(),
        Class::Load | Class::Store | Class::LoadDual | Class::StoreDual
    ) && !is_by_register(inst);
    let literal = simple && is_literal(inst);
    let base = match literal {
        true => Interval::point((at.wrapping_add(4) & !3) as i32),
        false if inst.n == reg::PC => return None,
        false => facts.interval(inst.n),
    };
    let offset = if inst.add {
        i64::from(inst.imm)
    } else {
        -i64::from(inst.imm)
    };
    let moved = if inst.index {
        Interval::of(base.low + offset, base.high + offset)
    } else {
        base
    };
    (simple && moved.high - moved.low < RANGE_BYTES_MAX).then_some(moved)
}

/// Where an access begins whose address is not known but whose base is: by a register in addition,
/// or of several words.
pub(super) fn roughly(inst: &Inst, facts: &Facts) -> Option<Interval> {
    if inst.n == reg::PC {
        return None;
    }
    let base = facts.interval(inst.n);
    (base.high - base.low < RANGE_BYTES_MAX).then_some(base)
}
