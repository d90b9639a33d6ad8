//! Where one claim about stack and pointers holds another.

use whippen_isa::{Arch, parse};

use super::{Place, Tag};

#[test]
fn a_place_covers_whoever_claims_more() {
    let mut more = Place::entered();
    more.sp = -8;
    more.registers[4] = Some(Tag::Section(0x100));
    more.slots = vec![(-8, Tag::Section(0x200)), (-4, Tag::Return(0, 0))];
    let covers = |change: &dyn Fn(&mut Place)| {
        let mut own = more.clone();
        change(&mut own);
        own.covers(&more, |register| {
            (register == 5).then_some(Tag::Section(0x300))
        })
    };
    assert!(covers(&|_| ()));
    // Less of a register or a slot, and what else is known.
    assert!(covers(&|own| own.registers[4] = None));
    assert!(covers(&|own| own.slots.retain(|slot| slot.0 != -8)));
    assert!(covers(&|own| own.registers[5] = Some(Tag::Section(0x300))));
    // More than is known, or something else.
    assert!(!covers(&|own| own.registers[6] = Some(Tag::Section(0x300))));
    assert!(!covers(&|own| own.registers[5] = Some(Tag::Section(0x100))));
    assert!(!covers(&|own| own.registers[14] = Some(Tag::Return(1, 0))));
    assert!(!covers(&|own| own.slots[1].1 = Tag::Return(0, 4)));
    assert!(!covers(&|own| own.slots.push((-12, Tag::Section(0x200)))));
    assert!(!covers(&|own| own.sp = -4));
}

/// What an instruction leaves in R0 of a pointer in R4, where R5 holds a number.
fn left(text: &str) -> Option<Tag> {
    let mut place = Place::entered();
    place.sp = -16;
    place.registers[4] = Some(Tag::Section(0x100));
    place.registers[6] = Some(Tag::Return(0, 0));
    let inst = parse(text, Arch::V8M, None).expect("an instruction");
    place.execute(&inst, || None).expect("it is possible");
    place.tag(0)
}

/// A pointer is moved by constants and by a shifted index; of two words nobody knows which one
/// points.
#[test]
fn a_pointer_is_moved_by_constants_and_by_shifted_indices() {
    let section = Some(Tag::Section(0x100));
    for text in [
        "mov r0, r4",
        "add.w r0, r4, r5, lsl #2",
        "add.w r0, r4, r5, lsl #31",
    ] {
        assert_eq!(left(text), section, "{text}");
    }
    for text in [
        "add.w r0, r4, r5",
        "adds r0, r4, r5",
        "add.w r0, r5, r4, lsl #2",
        "add.w r0, r4, r5, lsr #2",
        "add.w r0, r4, r5, asr #2",
        "add.w r0, r4, r5, ror #2",
        "sub.w r0, r4, r5, lsl #2",
        "orr.w r0, r4, r5, lsl #2",
        "add.w r0, r4, #4",
        "orr r0, r4, #4",
        "lsl.w r0, r4, #2",
        "ldr r0, [r4]",
        "add.w r0, r6, #4",
        "add.w r0, r6, r5, lsl #2",
    ] {
        assert_eq!(left(text), None, "{text}");
    }
    assert_eq!(left("mov r0, r6"), Some(Tag::Return(0, 0)));
    let moved = |text: &str, register: u8| {
        let mut place = Place::entered();
        place.sp = -16;
        place.registers[4] = section;
        place.registers[6] = Some(Tag::Return(0, 0));
        let inst = parse(text, Arch::V8M, None).expect("an instruction");
        place.execute(&inst, || None).expect("it is possible");
        place.tag(register)
    };
    for text in [
        "add.w r4, r4, #4",
        "sub.w r4, r4, #4",
        "ldr r0, [r4], #4",
        "ldrd r0, r1, [r4, #8]!",
        "str r0, [r4], #4",
        "strd r0, r1, [r4], #8",
        "ldm r4!, {r0, r1}",
        "stm r4!, {r0, r1}",
    ] {
        assert_eq!(moved(text, 4), section, "{text}");
        let other = text.replace("r4", "r6");
        assert_eq!(moved(&other, 6), None, "{other}");
    }
    for text in [
        "ldm r4, {r3, r4}",
        "ldr r4, [r4]",
        "ldrd r3, r4, [r4]",
        "orr r4, r4, #4",
    ] {
        assert_eq!(moved(text, 4), None, "{text}");
    }
}

/// Where the stack pointer is behind an instruction, from 16 bytes below its caller's on.
#[test]
fn the_stack_pointer_is_where_an_instruction_moves_it() {
    let behind = |text: &str| {
        let mut place = Place::entered();
        place.sp = -16;
        let inst = parse(text, Arch::V8M, None).expect("an instruction");
        place.execute(&inst, || None).map(|()| place.sp)
    };
    for (text, sp) in [
        ("add sp, #8", -8),
        ("add sp, #16", 0),
        ("sub sp, #8", -24),
        ("push {r0, r1}", -24),
        ("pop {r0, r1}", -8),
        ("vpush {s0}", -20),
        ("vpop {s0}", -12),
        ("vpush {d0}", -24),
        ("vpop {d0}", -8),
        ("str r0, [sp, #-8]!", -24),
        ("ldr r0, [sp], #8", -8),
        ("ldr r0, [sp, #4]!", -12),
        ("ldr r0, [sp, #-4]!", -20),
        ("strd r0, r1, [sp, #-8]!", -24),
        ("ldrd r0, r1, [sp], #8", -8),
        ("ldr r0, [sp, #4]", -16),
        ("str r0, [r1], #4", -16),
        ("ldm r0!, {r1, r2}", -16),
    ] {
        assert_eq!(behind(text), Ok(sp), "{text}");
    }
    let unknown = Err("moves the stack pointer nobody knows where");
    for text in [
        "mov sp, r0",
        "add sp, r0",
        "sub.w sp, sp, r0",
        "ldr sp, [r0]",
        "ldr sp, [r0], #4",
        "ldr sp, [sp, #4]",
        "ldr r0, [sp], #2",
    ] {
        assert_eq!(behind(text), unknown, "{text}");
    }
    let out = Err("moves the stack pointer out of its stack");
    assert_eq!(
        [behind("add sp, #20"), behind("ldr r0, [sp], #20")],
        [out; 2]
    );
}

/// The lowest four words of a stack hold a pointer each, the highest of them a return address.
fn four() -> (Place, [Tag; 4]) {
    let tags = [
        Tag::Section(0x100),
        Tag::Section(0x200),
        Tag::Section(0x300),
        Tag::Return(0, 0),
    ];
    let mut place = Place::entered();
    place.sp = -16;
    place.slots = (-4..0).map(|nth| 4 * nth).zip(tags).collect();
    place.registers[4] = Some(Tag::Section(0x400));
    (place, tags)
}

/// What is stored over is gone, in whole words; a pointer that is stored whole is kept.
#[test]
fn a_store_leaves_what_it_does_not_meet() {
    let own = Some(Tag::Section(0x400));
    // Of the word below the stack pointer, and of the four above, which hold what they did (`=`),
    // nothing (`-`), or what R4 holds (`4`).
    for (text, left) in [
        ("str r0, [r1]", "-===="),
        ("str r0, [sp]", "--==="),
        ("str r0, [sp, #4]", "-=-=="),
        ("str r4, [sp, #4]", "-=4=="),
        ("strb r4, [sp, #7]", "-=-=="),
        ("strh r4, [sp, #8]", "-==-="),
        ("str r0, [sp], #-8", "--==="),
        ("str r4, [sp], #-8", "-4==="),
        ("str r4, [sp, #-8]!", "-===="),
        ("strd r4, r0, [sp]", "-4-=="),
        ("strd r0, r4, [sp, #8]", "-==-4"),
        ("push {r4}", "4===="),
        ("push {r0, r4}", "4===="),
        ("push {r4, r5}", "-===="),
        ("stm sp, {r0, r4}", "--4=="),
        ("vstr s0, [sp, #4]", "-=-=="),
        ("vstr d0, [sp, #4]", "-=--="),
        ("vpush {s0}", "-===="),
        ("vstmia sp, {s0-s1}", "---=="),
        ("str r0, [sp, r1]", "-----"),
        ("stl r0, [sp]", "-----"),
        ("ldr r0, [sp, #4]", "-===="),
    ] {
        let (mut place, tags) = four();
        let inst = parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        place.execute(&inst, || None).expect(text);
        let found = (-5..0).map(|nth| match place.at(4 * nth) {
            None => '-',
            tag if tag == own => '4',
            Some(tag) => {
                assert_eq!(tag, tags[(nth + 4) as usize], "{text}");
                '='
            }
        });
        assert_eq!(found.collect::<String>(), left, "{text}");
    }
    for (text, why) in [
        ("str r0, [sp, #16]", "stores into its caller's stack"),
        ("strb r0, [sp, #16]", "stores into its caller's stack"),
        ("vstr d0, [sp, #12]", "stores into its caller's stack"),
        ("strd r0, r1, [sp, #12]", "stores into its caller's stack"),
        ("str r0, [sp, #-4]", "stores below its stack"),
        ("vstr s0, [sp, #-4]", "stores below its stack"),
        ("str r0, [sp], #8", "stores below its stack"),
    ] {
        let inst = parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        assert_eq!(four().0.execute(&inst, || None), Err(why), "{text}");
    }
}

/// A whole word that is loaded from the stack is what was there.
#[test]
fn a_load_finds_what_was_stored() {
    for (text, found) in [
        ("ldr r0, [sp]", Some(0)),
        ("ldr r0, [sp, #12]", Some(3)),
        ("ldr r0, [sp], #8", Some(0)),
        ("ldr r0, [sp, #8]!", Some(2)),
        ("ldr r0, [sp, #-8]!", None),
        ("ldrd r0, r1, [sp, #4]", Some(1)),
        ("ldrd r1, r0, [sp, #4]", Some(2)),
        ("pop {r0}", Some(0)),
        ("ldm sp, {r0, r1}", Some(0)),
        ("ldrh r0, [sp]", None),
        ("ldrb r0, [sp]", None),
        ("ldr r0, [sp, r1]", None),
        ("ldr r0, [r1]", None),
        ("add r0, sp, #4", None),
    ] {
        let (mut place, tags) = four();
        place.registers[0] = Some(Tag::Return(9, 0));
        let inst = parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        place.execute(&inst, || None).expect(text);
        assert_eq!(place.tag(0), found.map(|nth: usize| tags[nth]), "{text}");
    }
    let (mut place, tags) = four();
    let inst = parse("pop {r0, r1, r2}", Arch::V8M, None).expect("an instruction");
    place.execute(&inst, || None).expect("it is possible");
    assert_eq!(
        [0, 1, 2].map(|register| place.tag(register)),
        [0, 1, 2].map(|nth| Some(tags[nth]))
    );
    assert_eq!(place.slots, [(-4, tags[3])]);
    let inst = parse("pop {r4, pc}", Arch::V8M, None).expect("an instruction");
    assert_eq!(four().0.loaded_pc(&inst), Some(tags[1]));
}
