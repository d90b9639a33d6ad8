//! How instructions use the stack, as their text says it.

use whippen_isa::{Arch, Inst, ItState, Stored, decode, parse};

fn inst(text: &str) -> Inst {
    parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
}

/// The stack pointer is at -32.
#[test]
fn stores_go_where_their_addresses_say() {
    use Stored::*;
    for (text, bytes) in [
        ("push {r4, lr}", Bytes(-40, -32)),
        ("stm sp, {r0, r1}", Bytes(-32, -24)),
        ("str r0, [sp, #8]", Bytes(-24, -20)),
        ("str r0, [sp, #-8]!", Bytes(-40, -36)),
        ("str r0, [sp], #8", Bytes(-32, -28)),
        ("strb r0, [sp, #1]", Bytes(-31, -30)),
        ("strh r0, [sp, #2]", Bytes(-30, -28)),
        ("strd r0, r1, [sp, #8]", Bytes(-24, -16)),
        ("vpush {s0-s2}", Bytes(-44, -32)),
        ("vstmia sp, {d0-d1}", Bytes(-32, -16)),
        // It leaves a word behind what it stores.
        ("fstmdbx sp!, {d0-d1}", Bytes(-52, -36)),
        ("vstr d0, [sp, #8]", Bytes(-24, -16)),
        ("str.w r0, [sp, r1]", Somewhere),
        ("strb.w r0, [sp, r1]", Somewhere),
        ("stl r0, [sp]", Somewhere),
        ("str r0, [r1]", Nothing),
        ("pop {r4}", Nothing),
    ] {
        assert_eq!(inst(text).stored(-32), bytes, "{text}");
    }
}

#[test]
fn slots_are_those_of_registers() {
    let r4 = |text| {
        let inst = inst(text);
        [inst.stored_slot(-32, 4), inst.loaded_slot(-32, 4)]
    };
    for (text, slots) in [
        ("push {r3, r4, lr}", [Some(-40), None]),
        ("push {r2, r3, r4}", [Some(-36), None]),
        ("stm sp, {r3, r4}", [Some(-28), None]),
        ("stm sp, {r3, r5}", [None, None]),
        ("str.w r4, [sp, #8]", [Some(-24), None]),
        ("str.w r3, [sp, #8]", [None, None]),
        ("strd r3, r4, [sp, #8]", [Some(-20), None]),
        ("strd r3, r5, [sp, #8]", [None, None]),
        ("pop {r3, r4}", [None, Some(-28)]),
        ("ldmdb sp, {r3, r4, r5}", [None, Some(-40)]),
        ("ldr r4, [sp], #8", [None, Some(-32)]),
        ("ldrd r4, r5, [sp, #8]", [None, Some(-24)]),
        ("ldrb.w r4, [sp, #8]", [None, None]),
        ("ldr.w r4, [sp, r1]", [None, None]),
        ("ldr r4, [r1]", [None, None]),
    ] {
        assert_eq!(r4(text), slots, "{text}");
    }
}

#[test]
fn an_address_of_the_stack_is_handed_out_by_what_reads_it_elsewhere() {
    for (text, hands) in [
        ("mov r0, sp", true),
        ("add r0, sp, #4", true),
        ("str.w sp, [r0]", true),
        ("str.w sp, [sp, #4]", true),
        ("ldr r0, [sp, #4]", false),
        ("ldr r0, [sp], #8", false),
        ("str r0, [sp, #4]", false),
        ("push {r4, lr}", false),
        ("pop {r4, pc}", false),
        ("vstr s0, [sp]", false),
        ("add sp, #8", false),
        ("sub sp, #8", false),
        ("mov sp, r0", false),
        ("adds r0, r1", false),
        ("ldr r0, [r1]", false),
    ] {
        assert_eq!(inst(text).hands_stack(), hands, "{text}");
    }
}

#[test]
fn the_stack_pointer_moves_by_constants_and_by_what_is_put_there_and_taken() {
    for (text, bytes) in [
        ("add sp, #8", Some(8)),
        ("sub sp, #8", Some(-8)),
        ("push {r3, r4, lr}", Some(-12)),
        ("pop {r4, pc}", Some(8)),
        ("vpush {d0-d1}", Some(-16)),
        ("vpop {s0-s2}", Some(12)),
        ("str r0, [sp, #-8]!", Some(-8)),
        ("ldr r0, [sp], #8", Some(8)),
        ("strd r0, r1, [sp], #-8", Some(-8)),
        ("ldrd r0, r1, [sp, #8]!", Some(8)),
        ("mov sp, r0", None),
        ("ldr sp, [r0]", None),
        ("ldr r0, [r1], #8", None),
        ("ldm r1!, {r0}", None),
        ("stmdb r1!, {r0, r2}", None),
    ] {
        assert_eq!(inst(text).sp_change_bytes(), bytes, "{text}");
    }
    // These are PUSH and POP.
    for text in ["stmdb sp!, {r0, r1}", "ldm sp!, {r0, r1}"] {
        assert!(parse(text, Arch::V8M, None).is_err(), "{text}");
    }
}

#[test]
fn a_register_steps_by_constants_alone() {
    for (text, register, steps) in [
        ("add.w r4, r4, #4", 4, true),
        ("sub.w r4, r4, #4", 4, true),
        ("add sp, #8", 13, true),
        ("sub sp, #8", 13, true),
        ("ldr r0, [r4], #4", 4, true),
        ("ldrd r0, r1, [r4, #8]!", 4, true),
        ("ldm r4!, {r0, r1}", 4, true),
        ("str r0, [r4], #4", 4, true),
        ("strd r0, r1, [r4], #8", 4, true),
        ("stm r4!, {r0, r1}", 4, true),
        ("add.w r4, r5, #4", 4, false),
        ("add r4, sp, #8", 4, false),
        ("orr r4, r4, #4", 4, false),
        ("add.w r4, r4, r5", 4, false),
        ("ldr r4, [r4]", 4, false),
        ("ldrd r3, r4, [r4]", 4, false),
        ("ldr r0, [r4], #4", 0, false),
        ("ldm r4, {r3, r4}", 4, false),
        ("ldm r4!, {r0, r1}", 0, false),
    ] {
        assert_eq!(inst(text).steps(register), steps, "{text}");
    }
}

/// No core has an instruction that loads the base that it moves.
#[test]
fn a_base_that_is_written_back_is_not_loaded() {
    for text in [
        "ldr r0, [r0], #4",
        "ldr r0, [r0, #4]!",
        "ldrb r0, [r0], #1",
        "ldrd r0, r1, [r0], #8",
        "ldrd r1, r0, [r0], #8",
        "ldrd r1, r0, [r0, #8]!",
        "ldr sp, [sp], #4",
        "str sp, [sp, #-4]!",
        "ldrd sp, r1, [sp], #8",
        "strd r1, sp, [sp, #-8]!",
        "strh sp, [sp, #-4]!",
    ] {
        assert!(encodes(text).is_none(), "{text}");
    }
    assert!(encodes("ldr r1, [r0], #4").is_some());
    assert!(encodes("ldrd r1, r2, [r0], #8").is_some());
}

/// An instruction as its bits are read again.
fn encodes(text: &str) -> Option<Inst> {
    let inst = parse(text, Arch::V8M, None).ok()?;
    let (first, second) = inst.encode(Arch::V8M).ok()?.halfwords();
    decode(first, second.unwrap_or(0), Arch::V8M, ItState::OUTSIDE).ok()
}
