//! What instructions access in memory, as their text says it.

use whippen_isa::{Arch, Class, Inst, parse, reg};

fn inst(text: &str) -> Inst {
    parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
}

/// How many, where the first is, and whether it is a store.
#[test]
fn words_are_those_of_all_registers() {
    for (text, words, first, stores) in [
        ("ldr r0, [r1]", 1, Some(0), false),
        ("ldr r0, [r1, #4]", 1, Some(4), false),
        ("ldr r0, [r1, #-4]!", 1, Some(-4), false),
        ("ldr r0, [r1], #4", 1, Some(0), false),
        ("ldr r0, [pc, #8]", 1, Some(8), false),
        ("ldrb r0, [r1, r2]", 1, None, false),
        ("lda r0, [r1]", 1, Some(0), false),
        ("ldrex r0, [r1, #8]", 1, Some(8), false),
        ("tbb [pc, r0]", 1, None, false),
        ("ldrd r0, r1, [r2, #-8]", 2, Some(-8), false),
        ("ldm r0!, {r1, r2, r3}", 3, Some(0), false),
        ("ldmdb r0, {r1, r2, r3}", 3, Some(-12), false),
        ("pop {r4, pc}", 2, Some(0), false),
        ("vldr s0, [r1, #-8]", 1, Some(-8), false),
        ("vldr d0, [pc, #16]", 2, Some(16), false),
        ("vpop {s0-s2}", 3, Some(0), false),
        ("vldmia r0, {d0-d3}", 8, Some(0), false),
        ("vldmdb r0!, {s1-s5}", 5, Some(-20), false),
        ("fldmdbx r0!, {d0-d1}", 4, Some(-20), false),
        ("fldmiax r0, {d0-d1}", 4, Some(0), false),
        ("str r0, [r1], #-4", 1, Some(0), true),
        ("strh r0, [r1, r2]", 1, None, true),
        ("stl r0, [r1]", 1, Some(0), true),
        ("strd r0, r1, [r2, #8]", 2, Some(8), true),
        ("stm r2!, {r0, r1}", 2, Some(0), true),
        ("push {r4, r5, lr}", 3, Some(-12), true),
        ("vstr d0, [r1, #4]", 2, Some(4), true),
        ("vpush {d0-d1}", 4, Some(-16), true),
        ("vstmia r1, {s0-s2}", 3, Some(0), true),
        ("adds r0, r1", 0, None, false),
        ("adds r0, #4", 0, None, false),
    ] {
        let inst = inst(text);
        assert_eq!(
            (inst.words(), inst.first_offset()),
            (words, first),
            "{text}"
        );
        assert_eq!(inst.class().is_store(), stores, "{text}");
        let branches = inst.class() == Class::TableBranch;
        let loads = words > 0 && !stores && !branches;
        assert_eq!(inst.class().is_load(), loads, "{text}");
        assert_eq!(inst.base() == reg::PC, text.contains("[pc"), "{text}");
        assert_eq!(
            inst.is_by_register(),
            words > 0 && first.is_none(),
            "{text}"
        );
    }
}

#[test]
fn loads_and_stores_of_coprocessors_are_no_words() {
    for (text, memory) in [
        ("ldc p1, c2, [r3]", true),
        ("ldc2l p1, c2, [r3]", true),
        ("stc p1, c2, [r3]", true),
        ("mrc p1, #0, r2, c3, c4, #0", false),
        ("ldr r0, [r1]", false),
    ] {
        assert_eq!(inst(text).is_of_coprocessor_memory(), memory, "{text}");
    }
}

/// Words are fetched one after the other: one for each that an instruction begins with, or ends
/// in; behind a branch that leads into an upper half that one again, for the half alone.
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
        (narrow, 0x100, Some(0x206), vec![0x100, 0x206]),
    ] {
        let fetched: Vec<u32> = inst.fetched_words(at, target).collect();
        assert_eq!(fetched, words, "`{inst}` at {at:#x} to {target:x?}");
    }
}
