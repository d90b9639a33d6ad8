//! What each access is charged for whom, of one word and of several.

use super::{board, reach};
use crate::facts::Facts;
use crate::memory::*;
use crate::unknown::Unknown;
use std::collections::BTreeMap;
use whippen_board::Board;
use whippen_isa::{Arch, parse};

/// Near core 0, whose code lies in the first group; core 1 uses the second one and what is near it.
const NEAR: u32 = 0x2008_0000;
const OTHER: u32 = 0x2008_1000;
const CODE: u32 = 0x2000_0000;
const DEVICE: u32 = 0x4000_0000;

fn others() -> Others {
    Others {
        fetches: true,
        contenders: vec![0b10_1111_0000],
        remote_accesses: 3,
        dma: Some(Dma {
            device: DEVICE,
            wait_cycles: 7,
            in_memory: 5,
        }),
        neighbour: Some(Neighbour {
            device: DEVICE,
            wait_cycles: 12,
        }),
    }
}

fn around(board: &Board) -> Interference<'_> {
    let lies = Lies {
        code: 0b1111,
        data: reach(1 << 8),
        stack: reach(1 << 9),
    };
    Interference::new(board, &[], lies, others())
}

fn inst(text: &str) -> Inst {
    parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
}

/// The instruction stands in the upper half of a word, so that nothing is fetched for it.
const AT: u32 = CODE + 2;

/// Of an instruction of the code in the first group, with R0 from one word to another.
fn of(text: &str, r0: [u32; 2]) -> Result<Waits, UnknownTime> {
    let (board, graph) = (board(), of_code(false));
    let facts = Facts::of_registers(&BTreeMap::from([(0, r0)]));
    around(&board).waits(&inst(text), AT, &facts, &graph, &Outcome::NEXT)
}

fn of_code(hands_stack: bool) -> GraphMemory {
    GraphMemory {
        fetched: 0b1111,
        hands_stack,
        ..GraphMemory::default()
    }
}

const ANY: [u32; 2] = [0x8000_0000, 0x7fff_ffff];

fn waits(fetches: u16, others: u16) -> Waits {
    Waits {
        fetches,
        others,
        ..Waits::default()
    }
}

/// A word of a device: two cycles to read it, three to write it, the other core and a DMA.
fn of_device(access: u16) -> Waits {
    Waits {
        access,
        others: 12,
        dma: 7,
        fetches: 0,
    }
}

#[test]
fn every_word_waits_where_it_lies() {
    let [near, own, other] = [[NEAR; 2], [CODE; 2], [OTHER; 2]];
    for (text, r0, charged) in [
        ("ldr r1, [r0]", near, waits(0, 0)),
        ("ldr r1, [r0]", own, waits(1, 0)),
        ("ldr r1, [r0]", other, waits(0, 1)),
        ("ldr r1, [r0]", [DEVICE; 2], of_device(2)),
        ("str r1, [r0]", [DEVICE; 2], of_device(3)),
        // The second word is core 1's.
        ("ldrd r1, r2, [r0]", [OTHER - 4; 2], waits(0, 1)),
        ("strd r1, r2, [r0]", [OTHER - 8; 2], waits(0, 0)),
        ("ldrd r1, r2, [r0]", other, waits(0, 2)),
        ("ldm r0!, {r1, r2, r3}", other, waits(0, 3)),
        // Of a list those that lie there, wherever it begins.
        ("ldm r0!, {r1, r2, r3}", [OTHER - 4; 2], waits(0, 2)),
        ("ldmdb r0!, {r1, r2}", [OTHER + 4; 2], waits(0, 1)),
        ("vldr d0, [r0, #16]", [OTHER - 12; 2], waits(0, 2)),
        ("vldmia r0, {s0-s2}", [OTHER - 4; 2], waits(0, 2)),
        ("ldm r0!, {r1, r2}", [DEVICE; 2], of_device(2).times(2)),
        ("ldr r1, [r0, r2]", other, waits(0, 1)),
        ("vldr d0, [r0]", own, waits(2, 0)),
        // A byte at the end of a word that is core 1's.
        ("ldrb r1, [r0]", [OTHER - 4, OTHER + 3], waits(0, 1)),
        ("ldrb r1, [r0]", [OTHER - 4, OTHER - 1], waits(0, 0)),
        ("ldr r1, [r0]", ANY, waits(0, 0)),
        ("adds r1, r0", other, waits(0, 0)),
    ] {
        assert_eq!(of(text, r0), Ok(charged), "{text} {r0:x?}");
    }
}

/// What is added to an index is an address: the index by itself may lie nowhere, but not in memory
/// without a known time.
#[test]
fn a_base_may_be_an_index() {
    assert_eq!(of("ldr r1, [r0, r2]", [16; 2]), Ok(waits(0, 0)));
    assert!(of("ldr r1, [r0, r2]", [0x1000_0000; 2]).is_err());
}

/// Nothing is accessed by what is skipped; it is fetched all the same.
#[test]
fn what_is_skipped_is_fetched() {
    let board = board();
    let around = around(&board);
    let of = |at, outcome: &Outcome| {
        let facts = Facts::of_registers(&BTreeMap::from([(0, [OTHER; 2])]));
        around.waits(&inst("ldr r1, [r0]"), at, &facts, &of_code(false), outcome)
    };
    let other_code = 0x2004_0000;
    assert_eq!(of(other_code, &Outcome::SKIPPED), Ok(waits(0, 1)));
    assert_eq!(of(other_code, &Outcome::NEXT), Ok(waits(0, 2)));
    assert_eq!(of(CODE, &Outcome::SKIPPED), Ok(waits(0, 0)));
    let to = |address| Outcome {
        target: Some(whippen_isa::timing::Target {
            address,
            wide: false,
        }),
        ..Outcome::SKIPPED
    };
    assert_eq!(of(AT, &to(other_code + 2)), Ok(waits(0, 1)));
    assert_eq!(of(AT, &to(other_code)), Ok(waits(0, 0)));
    assert_eq!(of(AT, &to(SOMEWHERE)), Ok(waits(0, 0)), "its own code");
    let lies = Lies {
        code: 0b1_1111,
        ..around.lies()
    };
    assert_eq!(lies.data, reach(1 << 8));
    let around = Interference::new(&board, &[], lies, others());
    let facts = Facts::nothing();
    let branch = inst("bx lr");
    let found = around.waits(&branch, AT, &facts, &of_code(false), &to(SOMEWHERE));
    assert_eq!(found, Ok(waits(0, 1)), "of which core 1 uses a bank");
}

/// Data of code that hands out addresses of the stack may lie there; a table lies in the code.
#[test]
fn what_has_no_known_address_lies_in_data_stack_or_code() {
    let board = board();
    let around = around(&board);
    let of = |text, takes| {
        let graph = of_code(takes);
        let waits = around.waits(&inst(text), AT, &Facts::nothing(), &graph, &Outcome::NEXT);
        waits.expect("its time is known")
    };
    assert_eq!(of("ldr r1, [r3]", false), waits(0, 0));
    assert_eq!(of("ldr r1, [r3]", true), waits(0, 1));
    assert_eq!(of("push {r1, r2}", false), waits(0, 2));
    assert_eq!(of("tbb [pc, r0]", false), waits(1, 0));
}

/// Where nothing is known at all, it may be a device, or core 1's.
#[test]
fn between_ticks_an_address_may_be_any() {
    let board = board();
    let around = around(&board);
    let graph = of_code(false);
    let most = |text| around.waits_max(&inst(text), AT, &graph);
    assert_eq!(most("ldr r1, [r3]"), Ok(of_device(3)));
    assert_eq!(most("strd r1, r2, [r3]"), Ok(of_device(3).times(2)));
    assert_eq!(most("adds r1, r0"), Ok(waits(0, 0)));
    let nobody = Interference::new(&board, &[], around.lies(), Others::default());
    let device = Waits {
        access: 3,
        ..Waits::default()
    };
    assert_eq!(
        nobody.waits_max(&inst("ldr r1, [r3]"), AT, &graph),
        Ok(device)
    );
    let mut slow = board.clone();
    slow.memory[3].access = AccessTime::Cycles(9);
    let slow = Interference::new(&slow, &[], around.lies(), Others::default());
    let own = Waits {
        access: 8,
        ..Waits::default()
    };
    // What is known to be its own data anyway, and what may be anything.
    assert_eq!(
        slow.waits_max(&inst("ldr r1, [r3]"), AT, &graph),
        Ok(own.times(2))
    );
}

#[test]
fn exceptions_visits_and_a_dma_wait_for_whole_accesses() {
    let board = board();
    let of = around(&board);
    let word = |banks| of.exception_word(AT, &reach(banks));
    assert_eq!(word(1 << 8), Ok(waits(0, 0)));
    assert_eq!(word(1 << 9), Ok(waits(0, 1)));
    assert_eq!(
        word(1 << 3),
        Ok(waits(1, 0)),
        "the end of what is interrupted"
    );
    assert_eq!(word(1 << 8 | 1 << 9), Ok(waits(0, 1)));
    let unknown = Unknown::Nothing { target: 0 };
    let nowhere = Reach {
        banks: 0,
        unknown: Some(unknown.clone()),
    };
    let found = of.exception_word(AT, &nowhere).expect_err("no time");
    assert_eq!((found.address, found.what), (AT, unknown));
    assert_eq!((of.remote_access_cycles(), of.dma_cycles()), (1, 2 * 5));
    let mut slow = board.clone();
    slow.memory[3].access = AccessTime::Cycles(4);
    let of = around(&slow);
    assert_eq!((of.remote_access_cycles(), of.dma_cycles()), (4, 2 * 5 * 4));
    assert_eq!(
        of.exception_word(AT, &reach(1 << 8)).map(Waits::cycles),
        Ok(3)
    );
    // Another manager's access takes as long.
    slow.memory[4].access = AccessTime::Cycles(4);
    let of = around(&slow);
    let word = of.exception_word(AT, &reach(1 << 9));
    assert_eq!(word.map(|word| (word.access, word.others)), Ok((3, 4)));
}

#[test]
fn what_is_accessed_is_told() {
    let board = board();
    let around = around(&board);
    let facts = Facts::of_registers(&BTreeMap::from([(0, [NEAR, NEAR + 4])]));
    let told = |text| around.accessed(&inst(text), AT, &facts, &of_code(false));
    assert_eq!(told("adds r1, r0"), Accessed::Nothing);
    assert_eq!(told("ldr r1, [pc, #8]"), Accessed::Constant);
    assert_eq!(told("tbb [pc, r0]"), Accessed::Constant);
    assert_eq!(told("ldr r1, [r0, #4]"), Accessed::At(NEAR + 4));
    assert_eq!(told("ldr r1, [r3]"), Accessed::Unknown);
}

/// A better memory is one where it has a bound, for code and for data.
#[test]
fn a_memory_with_a_known_time_is_named() {
    let mut board = board();
    board.memory[1].access = AccessTime::NotBounded;
    board.memory[2].fetch = AccessTime::NotBounded;
    let sections = [Extent {
        name: ".rodata".into(),
        base: 0x1000_0000,
        size: 0x10,
    }];
    let of = Interference::new(&board, &sections, Lies::default(), Others::default());
    let facts = Facts::of_registers(&BTreeMap::from([(0, [0x1000_000f; 2])]));
    let at = |text, at| {
        of.waits(&inst(text), at, &facts, &of_code(false), &Outcome::NEXT)
            .expect_err("no time")
    };
    let data = at("ldrb r1, [r0]", AT);
    let section = Some(".rodata".to_string());
    let memory = "flash".to_string();
    assert_eq!(data.better.as_deref(), Some("sram4"));
    assert_eq!(data.what, Unknown::Memory { memory, section });
    let code = at("ldrb r1, [r0]", 0x1000_0010);
    assert_eq!(code.better.as_deref(), Some("sram8"));
    let section = None;
    let memory = "flash".to_string();
    assert_eq!(code.what, Unknown::Memory { memory, section });
}

#[test]
fn sections_reach_their_banks() {
    let board = board();
    let section = |base, size| Extent {
        name: ".data".into(),
        base,
        size,
    };
    let own = section(CODE, 8);
    let contains = [CODE - 1, CODE, CODE + 7, CODE + 8].map(|at| own.contains(at));
    assert_eq!(contains, [false, true, true, false]);
    assert_eq!(own.banks(&board), 0b11);
    assert_eq!(own.reach(&board), reach(0b11));
    let flash = section(0x1000_0000, 8).reach(&board);
    assert!(matches!(flash.unknown, Some(Unknown::Memory { .. })));
    let nowhere = section(0x3000_0000, 8).reach(&board);
    assert_eq!(
        nowhere.unknown,
        Some(Unknown::Nothing {
            target: 0x3000_0000
        })
    );
    let both = reach(0b110).and(reach(0b1010));
    assert_eq!(both, reach(0b1110));
    let unknown = flash.clone().and(reach(1));
    assert_eq!((unknown.banks, unknown.unknown), (1, flash.unknown.clone()));
    assert_eq!(reach(1).and(flash.clone()).unknown, flash.unknown);
}

#[test]
fn the_larger_of_two_waits_and_of_equal_ones_the_first() {
    let (one, other) = (waits(1, 1), waits(0, 2));
    assert_eq!([one.max(other), other.max(one)], [one, other]);
    assert_eq!(
        [one.max(waits(0, 3)), waits(0, 3).max(one)],
        [waits(0, 3); 2]
    );
    assert_eq!(of_device(3).cycles(), 3 + 12 + 7);
    let mut sum = of_device(3);
    sum += waits(5, 2);
    assert_eq!(
        [sum.access, sum.fetches, sum.others, sum.dma],
        [3, 5, 14, 7]
    );
    let thrice = sum.times(3);
    assert_eq!(
        [thrice.access, thrice.fetches, thrice.others, thrice.dma],
        [9, 15, 42, 21]
    );
}
