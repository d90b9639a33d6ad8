//! What is charged for addresses of a few, for buses, and for memory without a known time.

mod charged;

use super::*;
use crate::chip::board;
use crate::graph::Graph;
use std::collections::BTreeMap;
use whippen_isa::{Arch, ItState, decode};

/// Of an instruction at an address whose R0 lies between two addresses, on core 0, while core 1
/// uses its own banks.
fn waits_at(word: u16, at: u32, r0: [u32; 2]) -> Result<u16, UnknownTime> {
    let inst = decode(word, 0, Arch::V8M, ItState::OUTSIDE).expect("an instruction");
    let board = board();
    let data = reach(0b1111);
    let others = Others {
        fetches: true,
        contenders: vec![0b10_1111_0000],
        remote_accesses: 0,
        dma: None,
        neighbour: None,
    };
    let lies = Lies {
        code: 0b1111,
        data,
        stack: reach(1 << 8),
    };
    let around = Interference::new(&board, &[], lies, others);
    let facts = Facts::of_registers(&BTreeMap::from([(0, r0)]));
    let graph = GraphMemory {
        fetched: board.memory_at(at).map_or(0, Memory::bank_set),
        ..GraphMemory::default()
    };
    let waits = around.waits(&inst, at, &facts, &graph, &Outcome::NEXT);
    waits.map(Waits::cycles)
}

fn reach(banks: BankSet) -> Reach {
    Reach {
        banks,
        unknown: None,
    }
}

const LDR_R1_R0: u16 = 0x6801;
const STR_R1_R0: u16 = 0x6001;
const LDR_R1_R0_R2: u16 = 0x5881;

/// Of a load from 0x20000000 by R0.
fn waits(from: u32, to: u32) -> Result<u16, UnknownTime> {
    waits_at(LDR_R1_R0, 0x2000_0000, [from, to])
}

#[test]
fn an_address_of_a_few_waits_as_the_worst_of_them() {
    assert_eq!(
        waits(0x2008_0000, 0x2008_0800),
        Ok(0),
        "near core 0, where nobody fetches"
    );
    assert_eq!(
        waits(0x2008_0ff0, 0x2008_1000),
        Ok(1),
        "the last is near core 1"
    );
    assert_eq!(
        waits(0x2000_0000, 0x2000_0000),
        Ok(1),
        "the bank of the instruction: nobody says how far ahead is fetched"
    );
    assert_eq!(
        waits(0x2000_0000, 0x2000_0010),
        Ok(1),
        "any bank of the code"
    );
    assert_eq!(
        waits(0x2000_0100, 0x2004_0100),
        Ok(1),
        "too many to be looked at"
    );
}

#[test]
fn a_bus_takes_its_own_time_for_reads_and_writes() {
    assert_eq!(waits(0x4000_0000, 0x4000_0000), Ok(2));
    assert_eq!(waits(0x4000_0000, 0x4000_0010), Ok(2), "one of some");
    let store = waits_at(STR_R1_R0, 0x2000_0000, [0x4000_0000; 2]);
    assert_eq!(store, Ok(3));
}

#[test]
fn memory_without_a_known_time_is_an_error_wherever_it_may_be_met() {
    let flash = Unknown::Memory {
        memory: "flash".into(),
        section: None,
    };
    let known = waits(0x1000_0100, 0x1000_0100).expect_err("in flash");
    assert_eq!((known.fetch, &known.what), (false, &flash));
    let some = waits(0x1000_fff0, 0x1001_0000).expect_err("one of them in flash");
    assert_eq!(some.what, flash);
    let table = waits_at(LDR_R1_R0_R2, 0x2000_0000, [0x1000_0100; 2]);
    assert_eq!(table.expect_err("a table in flash").what, flash);
    let fetched = waits_at(LDR_R1_R0, 0x1000_0000, [0x2000_0000; 2]);
    assert!(fetched.expect_err("code in flash").fetch);
    let nothing = waits(0x2008_1ff0, 0x2008_2010).expect_err("behind the memory");
    assert_eq!(
        nothing.what,
        Unknown::Nothing {
            target: 0x2008_2000
        }
    );
}

/// The banks that the code of a few instructions is fetched from, and whether it hands out
/// addresses of the stack.
fn of_code(at: u32, words: &[u16]) -> (BankSet, bool) {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut code = crate::Code::default();
    code.add(at, bytes);
    let board = board();
    let lies = Lies {
        code: 0b1111,
        ..Lies::default()
    };
    let around = Interference::new(&board, &[], lies, Others::default());
    let query = crate::Query {
        core: &whippen_isa::timing::Core::cortex_m33(),
        code: &code,
        entry: at,
        annotations: &crate::Annotations::default(),
        interference: Some(&around),
    };
    let graph = Graph::build(&query, &crate::graph::Tables::default()).expect("a graph");
    let memory = GraphMemory::of(&BTreeMap::new(), &graph, Some(&around));
    (memory.fetched, memory.hands_stack)
}

const NOP: u16 = 0xbf00;
const BX_LR: u16 = 0x4770;
const PUSH_LR: u16 = 0xb500;
const POP_PC: u16 = 0xbd00;
const MOV_R0_SP: u16 = 0x4668;
const ADD_R0_SP: u16 = 0xa801;

/// What a branch leads to is fetched, too: the caller's code, which may be any of the core's.
#[test]
fn fetches_are_those_of_the_code_and_of_where_it_returns() {
    let (near, _) = of_code(0x2008_0000, &[NOP, PUSH_LR, POP_PC]);
    assert_eq!(near, 1 << 8 | 0b1111);
    let (end, _) = of_code(0x2008_0ffc, &[NOP, BX_LR]);
    assert_eq!(end, 1 << 8 | 0b1111, "nothing behind the end of the memory");
}

#[test]
fn an_address_of_the_stack_is_noticed_wherever_it_goes() {
    let takes = |words: &[u16]| of_code(0x2000_0000, words).1;
    assert!(!takes(&[PUSH_LR, POP_PC]));
    assert!(takes(&[MOV_R0_SP, BX_LR]));
    assert!(takes(&[ADD_R0_SP, BX_LR]));
}

/// Whether it is known where this access goes in the place of the halfword of that number, in code
/// where R6 points into known memory.
fn points(words: &[u16], access: u16, at_word: usize) -> bool {
    points_with(&crate::Annotations::default(), words, access, at_word)
}

fn points_with(
    annotations: &crate::Annotations,
    words: &[u16],
    access: u16,
    at_word: usize,
) -> bool {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let (mut code, at) = (crate::Code::default(), 0x2000_0000);
    code.add(at, bytes);
    let query = crate::Query {
        core: &whippen_isa::timing::Core::cortex_m33(),
        code: &code,
        entry: at,
        annotations,
        interference: None,
    };
    let graph = Graph::build(&query, &crate::graph::Tables::default()).expect("a graph");
    let bases = Bases::of(&BTreeMap::from([(6, reach(1))]), &graph);
    let inst = decode(access, 0, Arch::V8M, ItState::OUTSIDE).expect("an instruction");
    bases.reach(&inst, at + 2 * at_word as u32).is_some()
}

/// A call of the function behind the next two halfwords.
const BL: [u16; 2] = [0xf000, 0xf802];
const PUSH_R6_LR: u16 = 0xb540;
const LDR_R0_R6: u16 = 0x6830;

/// What is known of where R6 points, in code that begins with a call of a function right behind it.
fn r6_points(function: &[u16], access: usize) -> bool {
    let caller = [PUSH_LR, BL[0], BL[1], LDR_R0_R6, POP_PC];
    let words: Vec<u16> = caller.iter().chain(function).copied().collect();
    points(&words, LDR_R0_R6, access)
}

/// What a function saves first and takes back at its end points where it did, outside of it.
#[test]
fn a_register_that_a_function_gives_back_points_where_it_did() {
    const PUSH_R5_R6_LR: u16 = 0xb560;
    const POP_R6_PC: u16 = 0xbd40;
    const MOV_R6_R1: u16 = 0x460e;
    const ADD_SP_4: u16 = 0xb001;
    let [outside, inside] = [3, 6];
    let kept = [PUSH_R6_LR, MOV_R6_R1, POP_R6_PC];
    assert!(r6_points(&kept, outside));
    assert!(!r6_points(&kept, inside));
    assert!(!r6_points(&[PUSH_LR, MOV_R6_R1, POP_PC], outside));
    assert!(!r6_points(&[MOV_R6_R1, BX_LR], outside));
    let above = [PUSH_R5_R6_LR, MOV_R6_R1, ADD_SP_4, POP_R6_PC];
    assert!(r6_points(&above, outside));
    let other = [PUSH_R6_LR, MOV_R6_R1, ADD_SP_4, POP_PC];
    assert!(!r6_points(&other, outside));
    assert!(r6_points(&[NOP, BX_LR], outside) && r6_points(&[NOP, BX_LR], 5));
    const LDR_R0_R6_R1: u16 = 0x5870;
    const LDR_R0_PC: u16 = 0x4801;
    let of = |access| points(&[access, BX_LR], access, 0);
    assert!(of(LDR_R0_R6) && !of(LDR_R0_R6_R1), "it may be an index");
    assert!(!of(LDR_R0_PC) && !of(LDR_R1_R0));
}

/// A step by a constant leaves a pointer where it points, everything else that is written does not.
#[test]
fn what_is_no_step_by_a_constant_is_no_pointer() {
    for (text, points_there) in [
        ("ldr r0, [r6], #4", true),
        ("ldr r0, [r6, #-4]!", true),
        ("ldrd r0, r1, [r6], #8", true),
        ("ldm r6!, {r0, r1}", true),
        ("str r0, [r6], #4", true),
        ("strd r0, r1, [r6], #8", true),
        ("stm r6!, {r0, r1}", true),
        ("adds r6, #4", true),
        ("subs r6, #4", true),
        ("str r6, [r1]", true),
        ("movs r5, r6", true),
        ("ldr r6, [r1]", false),
        ("ldr r6, [r6]", false),
        ("ldr r6, [r1], #4", false),
        ("ldrd r6, r0, [r1]", false),
        ("ldrd r0, r6, [r1], #8", false),
        ("ldrd r6, r0, [r6]", false),
        ("ldrd r0, r6, [r6]", false),
        ("ldm r6, {r6, r7}", false),
        ("ldm r1!, {r6, r7}", false),
        ("adds r6, r1, #4", false),
        ("subs r6, r1, #4", false),
        ("adds r6, r6, r1", false),
        ("mov r6, r1", false),
        ("and r6, r6, #7", false),
    ] {
        let inst = whippen_isa::parse(text, Arch::V8M, None);
        let inst = inst.unwrap_or_else(|why| panic!("`{text}`: {why:?}"));
        let (first, second) = inst.encode(Arch::V8M).expect("it has bits").halfwords();
        let mut words = vec![first];
        words.extend(second);
        let at = words.len();
        words.extend([LDR_R0_R6, BX_LR]);
        assert_eq!(points(&words, LDR_R0_R6, at), points_there, "{text}");
    }
}

/// What an index is added to points where it did, until it is written, and behind a function that
/// gives it back.
#[test]
fn a_pointer_with_an_index_points_where_it_did() {
    const ADD_R4_R6_R0_LSL_2: [u16; 2] = [0xeb06, 0x0480];
    const ADD_R4_R6_R0: [u16; 2] = [0xeb06, 0x0400];
    const PUSH_R4_LR: u16 = 0xb510;
    const POP_R4_PC: u16 = 0xbd10;
    const MOV_R4_R1: u16 = 0x460c;
    const LDR_R0_R4: u16 = 0x6820;
    let known = |add: [u16; 2], function: &[u16]| {
        let caller = [PUSH_LR, add[0], add[1], BL[0], BL[1], LDR_R0_R4, POP_PC];
        let words: Vec<u16> = caller.iter().chain(function).copied().collect();
        let accesses = words
            .iter()
            .zip(0..)
            .filter(|(word, _)| **word == LDR_R0_R4);
        let known = accesses.map(|(_, at)| points(&words, LDR_R0_R4, at));
        known.collect::<Vec<bool>>()
    };
    let add = ADD_R4_R6_R0_LSL_2;
    assert_eq!(known(add, &[LDR_R0_R4, BX_LR]), [true, true]);
    let kept = [PUSH_R4_LR, LDR_R0_R4, MOV_R4_R1, LDR_R0_R4, POP_R4_PC];
    assert_eq!(known(add, &kept), [true, true, false]);
    assert_eq!(known(add, &[MOV_R4_R1, BX_LR]), [false], "written");
    assert_eq!(known(ADD_R4_R6_R0, &[BX_LR]), [false], "no index");
    let moved = [PUSH_R6_LR, MOV_R4_R1, 0xbd40];
    assert_eq!(
        known(add, &moved),
        [false],
        "another register is given back"
    );
}

/// A copy points there too, unless it is made in some cases alone; what is made of it does not.
#[test]
fn a_copy_of_a_pointer_with_an_index_points_where_it_did() {
    const LDR_R0_R5: u16 = 0x6828;
    let after = |texts: &[&str]| {
        let (mut words, mut it) = (vec![0xeb06, 0x0480], ItState::OUTSIDE);
        for text in texts {
            let inst = whippen_isa::parse(text, Arch::V8M, it.cond());
            let inst = inst.unwrap_or_else(|why| panic!("`{text}`: {why:?}"));
            it = inst.it_behind(it).expect("an IT instruction");
            let (first, second) = inst.encode(Arch::V8M).expect("it has bits").halfwords();
            words.push(first);
            words.extend(second);
        }
        let at = words.len();
        words.extend([LDR_R0_R5, BX_LR]);
        points(&words, LDR_R0_R5, at)
    };
    assert!(after(&["mov r5, r4"]) && after(&["mov r5, r4", "adds r5, #4"]));
    for other in [
        &["it eq", "moveq r5, r4"][..],
        &["mov r5, r4", "it eq", "moveq r5, r1"],
        &["mov r5, r1"],
        &["lsls r5, r4, #2"],
        &["adds r5, r0, r4"],
        &["adds r5, r4, #4"],
        &["mvns r5, r4"],
    ] {
        assert!(!after(other), "{other:?}");
    }
}

/// Each call has its own caller, who had its own pointers; what is bounded elsewhere leaves none.
#[test]
fn calls_of_one_function_are_apart() {
    const LDR_R0_R4: u16 = 0x6820;
    const MOV_R4_R1: u16 = 0x460c;
    const KEEPS: [u16; 3] = [0xb510, MOV_R4_R1, 0xbd10];
    // BL of what stands behind twelve halfwords, from the fourth and from the seventh.
    let [first, second] = [[0xf000, 0xf807], [0xf000, 0xf803]];
    let code = |one: [u16; 2], other: [u16; 2]| {
        let caller = [
            PUSH_LR, one[0], one[1], first[0], first[1], other[0], other[1],
        ];
        let rest = [second[0], second[1], LDR_R0_R4, POP_PC, NOP];
        [&caller[..], &rest, &KEEPS].concat()
    };
    let (made, lost) = ([0xeb06, 0x0480], [MOV_R4_R1, NOP]);
    assert!(points(&code(lost, made), LDR_R0_R4, 9));
    assert!(!points(&code(made, lost), LDR_R0_R4, 9));
    assert!(points(&code(made, [NOP, NOP]), LDR_R0_R4, 9));
    let elsewhere = crate::Annotations {
        known: [((None, 0x2000_0000 + 2 * 12), crate::Known::default())].into(),
        ..crate::Annotations::default()
    };
    assert!(!points_with(
        &elsewhere,
        &code(made, [NOP, NOP]),
        LDR_R0_R4,
        9
    ));
}

/// On two ways that meet, both must have made it of the same.
#[test]
fn a_pointer_with_an_index_is_known_where_all_ways_say_so() {
    const CBZ_R1: u16 = 0xb109;
    const LDR_R0_R4: u16 = 0x6820;
    let code = |first: [u16; 2]| [first[0], first[1], CBZ_R1, 0xeb06, 0x0480, LDR_R0_R4, BX_LR];
    assert!(points(&code([0xeb06, 0x0480]), LDR_R0_R4, 5));
    assert!(!points(&code([0xeb07, 0x0480]), LDR_R0_R4, 5));
}

/// A loop in which it is written leaves it unknown, also where the loop is left before.
#[test]
fn a_pointer_with_an_index_is_known_behind_a_loop_that_keeps_it() {
    const LDR_R0_R4: u16 = 0x6820;
    const MOV_R4_R1: u16 = 0x460c;
    // add r4, r6, r0, lsl #2; 1: cbz r1, 2f; the loop; b 1b; 2: the access
    let code = |inside| [0xeb06, 0x0480, 0xb109, inside, 0xe7fc, LDR_R0_R4, BX_LR];
    assert!(points(&code(NOP), LDR_R0_R4, 5));
    assert!(!points(&code(MOV_R4_R1), LDR_R0_R4, 5));
}
