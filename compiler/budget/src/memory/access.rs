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
        // By PC there are literals alone.
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use whippen_isa::{Arch, parse};

    fn inst(text: &str) -> Inst {
        parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
    }

    #[test]
    fn words_are_those_of_all_registers() {
        for (text, words, stores) in [
            ("ldr r0, [r1]", 1, false),
            ("ldrb r0, [r1, r2]", 1, false),
            ("lda r0, [r1]", 1, false),
            ("tbb [pc, r0]", 1, false),
            ("ldrd r0, r1, [r2]", 2, false),
            ("ldm r0!, {r1, r2, r3}", 3, false),
            ("pop {r4, pc}", 2, false),
            ("vldr s0, [r1]", 1, false),
            ("vldr d0, [r1]", 2, false),
            ("vpop {s0-s2}", 3, false),
            ("str r0, [r1]", 1, true),
            ("stl r0, [r1]", 1, true),
            ("strd r0, r1, [r2]", 2, true),
            ("push {r4, r5, lr}", 3, true),
            ("vstr d0, [r1]", 2, true),
            ("vpush {d0-d1}", 4, true),
            ("adds r0, r1", 0, false),
        ] {
            let inst = inst(text);
            assert_eq!(
                (accesses(&inst), is_store(&inst)),
                (words, stores),
                "{text}"
            );
        }
    }

    /// Words are fetched one after the other; behind a branch into an upper half that one again.
    #[test]
    fn every_word_is_fetched_once_and_that_of_a_target_in_its_upper_half() {
        let (narrow, wide) = (inst("movs r0, #1"), inst("mov.w r0, #1"));
        for (inst, at, target, words) in [
            (narrow, 0x100, None, vec![0x100]),
            (narrow, 0x102, None, vec![]),
            (wide, 0x100, None, vec![0x100]),
            (wide, 0x102, None, vec![0x104]),
            (narrow, 0x102, Some(0x200), vec![]),
            (narrow, 0x102, Some(0x202), vec![0x202]),
        ] {
            let found: Vec<u32> = fetched(&inst, at, target).collect();
            assert_eq!(found, words, "`{inst}` at {at:#x} to {target:x?}");
        }
    }

    /// The address, and the base, with R1 from one word to another.
    fn of(text: &str, at: u32, ends: [u32; 2]) -> [Option<[i64; 2]>; 2] {
        let facts = Facts::of_registers(&BTreeMap::from([(1, ends)]));
        let found = [
            addresses(&inst(text), at, &facts),
            roughly(&inst(text), &facts),
        ];
        found.map(|found| found.map(|found| [found.low, found.high]))
    }

    #[test]
    fn addresses_are_base_and_offset() {
        let base = Some([0x200, 0x210]);
        for (text, address) in [
            ("ldr r0, [r1, #4]", Some([0x204, 0x214])),
            ("str r0, [r1, #-4]", Some([0x1fc, 0x20c])),
            ("ldr r0, [r1], #4", base),
            ("strd r0, r2, [r1, #8]", Some([0x208, 0x218])),
            ("ldr r0, [r1, r2]", None),
            ("ldm r1!, {r2, r3}", None),
            ("vldr s0, [r1]", None),
            ("stl r0, [r1]", None),
        ] {
            assert_eq!(of(text, 0x100, [0x200, 0x210]), [address, base], "{text}");
        }
    }

    #[test]
    fn literals_are_known() {
        let of = |text, at| of(text, at, [0, 0]);
        assert_eq!(of("ldr r0, [pc, #8]", 0x100), [Some([0x10c; 2]), None]);
        assert_eq!(of("ldr r0, [pc, #8]", 0x102), [Some([0x10c; 2]), None]);
        assert_eq!(of("ldr.w r0, [pc, #-8]", 0x100), [Some([0xfc; 2]), None]);
        assert_eq!(of("tbb [pc, r1]", 0x100), [None, None]);
    }

    #[test]
    fn so_many_addresses_are_looked_at_one_by_one_and_no_more() {
        let most = 0x200 + RANGE_BYTES_MAX as u32;
        let of = |high| of("ldr r0, [r1]", 0x100, [0x200, high]).map(|found| found.is_some());
        assert_eq!(
            [of(most - 1), of(most), of(most + 1)],
            [[true; 2], [false; 2], [false; 2]]
        );
    }
}
