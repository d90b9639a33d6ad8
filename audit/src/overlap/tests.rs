//! Which accesses are known to be in the memory of the one before.

use whippen_isa::{Arch, Inst, parse};

use super::Last;
use crate::certificate::Certificate;
use crate::elf::Elf;
use crate::facts::{Facts, Interval};
use crate::made::{DATA, HANDLER, Image, STACK};
use crate::memory::Around;
use crate::place::Tag;

fn inst(text: &str) -> Inst {
    parse(text, Arch::V8M, None).expect("an instruction")
}

fn image() -> (Certificate, Elf) {
    let image = Image::new(&["bx lr"], &[], Vec::new());
    (image.certificate, image.elf)
}

/// Whether the second of two accesses may be in another memory than the first; of R1 and R2 each
/// is known to lie in an interval, or to point into the data.
fn is_apart(texts: [&str; 2], known: [Interval; 2], tag: Option<Tag>) -> bool {
    let (certificate, elf) = image();
    let around = Around::new(&certificate, &elf, 0).expect("it is known");
    let mut facts = Facts::default();
    facts.set(1, known[0]);
    facts.set(2, known[1]);
    let last = |text: &str| {
        let inst = inst(text);
        let tag = tag.filter(|_| [1, 2].contains(&inst.n));
        Last::of(&inst, HANDLER, &facts, tag, &around)
    };
    let (first, second) = (last(texts[0]), last(texts[1]));
    first.is_apart(second, &inst(texts[1]))
}

const ANY: Interval = [0, i32::MAX as i64];

fn at(address: u32) -> Interval {
    [i64::from(address); 2]
}

/// By one register that still points there, but for constants and shifted indices.
#[test]
fn two_accesses_by_one_register_are_in_one_memory() {
    for (texts, apart) in [
        (["ldr r0, [r1]", "ldr r3, [r1, #4]"], false),
        (["ldr r0, [r1]", "ldr r3, [r2]"], true),
        (["ldr r0, [r1], #4", "ldr r3, [r1]"], false),
        (["ldr r1, [r1]", "ldr r3, [r1]"], true),
        (["ldrd r0, r1, [r1]", "ldr r3, [r1]"], true),
        (["ldm r1!, {r0, r3}", "ldr r3, [r1]"], false),
        (["ldr r0, [r1, r2]", "ldr r3, [r1]"], true),
        (["ldr r0, [r1]", "ldr r3, [r1, r2]"], true),
        (["ldr.w r0, [r1, r2, lsl #2]", "ldr r3, [r1]"], false),
        (["ldr r0, [r1]", "ldr.w r3, [r1, r2, lsl #2]"], false),
        (["adds r0, r1, #1", "ldr r3, [r1]"], true),
        (["ldr r0, [r1]", "adds r0, r1, #1"], true),
        (["tbb [pc, r0]", "tbb [pc, r0]"], true),
        // No base: it is not R0.
        (["ldr r3, [pc, #4]", "ldr r1, [r0]"], true),
        (["ldr r1, [r0]", "ldr r3, [pc, #4]"], true),
    ] {
        assert_eq!(is_apart(texts, [ANY, ANY], None), apart, "{texts:?}");
    }
}

/// Where both are known to be in the same memory: by their addresses, by the stack pointer, beside
/// the code, in a section.
#[test]
fn two_accesses_are_in_one_memory_where_that_is_known() {
    let two = ["ldr r0, [r1]", "ldr r3, [r2]"];
    let stack = STACK - 4;
    for (texts, known, tag, apart) in [
        (two, [at(DATA), at(DATA + 64)], None, false),
        (two, [at(DATA), at(stack)], None, true),
        (two, [at(DATA), ANY], None, true),
        (two, [ANY, at(DATA)], None, true),
        (two, [at(0x1000), at(0x1000)], None, true),
        // The last word is in the other memory.
        (
            ["ldm r1, {r0, r4}", "ldr r3, [r2]"],
            [at(HANDLER + 0x7ffc), at(HANDLER)],
            None,
            true,
        ),
        (
            ["ldm r1, {r0, r4}", "ldr r3, [r2]"],
            [at(HANDLER + 0x7ff8), at(HANDLER)],
            None,
            false,
        ),
        // Some of these addresses are in another memory.
        (
            two,
            [
                at(DATA),
                [i64::from(HANDLER) + 0x7ffc, i64::from(HANDLER) + 0x8000],
            ],
            None,
            true,
        ),
        (two, [ANY, ANY], Some(Tag::Section(DATA)), false),
        (two, [ANY, ANY], Some(Tag::Return(0, 0)), true),
        (
            ["ldr r0, [sp]", "ldr r3, [sp, #8]"],
            [ANY, ANY],
            None,
            false,
        ),
        (
            ["ldr r0, [sp]", "ldr r3, [r2]"],
            [ANY, at(stack)],
            None,
            false,
        ),
        (
            ["ldr r0, [sp]", "ldr r3, [r2]"],
            [ANY, at(DATA)],
            None,
            true,
        ),
        (
            ["ldr r0, [pc, #4]", "ldr r3, [r2]"],
            [ANY, at(DATA)],
            None,
            false,
        ),
        (
            ["ldr r0, [pc, #4]", "ldr r3, [r2]"],
            [ANY, at(stack)],
            None,
            true,
        ),
        (
            ["ldr r0, [r1, r0]", "ldr r3, [r2]"],
            [ANY, at(DATA)],
            Some(Tag::Section(DATA)),
            true,
        ),
        (
            ["ldr.w r0, [sp, r0]", "ldr r3, [r2]"],
            [ANY, at(stack)],
            None,
            true,
        ),
    ] {
        assert_eq!(
            is_apart(texts, known, tag),
            apart,
            "{texts:?} {known:x?} {tag:x?}"
        );
    }
}
