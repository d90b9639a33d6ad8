//! What accesses and fetches wait for, by hand: each number is summed from the rules of
//! `docs/budget.md`.

mod placed;

use whippen_isa::{Arch, parse};

use super::{Access, Around, SOMEWHERE};
use crate::access::RANGE;
use crate::certificate::{Bus, Certificate, Dma, Frame, Memory, Neighbour};
use crate::elf::Elf;
use crate::facts::{Facts, Interval};
use crate::made::{DATA, DEVICES, HANDLER, STACK, VECTORS, board};

#[test]
fn the_banks_of_a_range_are_those_of_its_words() {
    for (size, striped, banks) in [
        (0x8_0000, true, vec![0, 1, 2, 3, 4, 5, 6, 7]),
        (0x4_0000, true, vec![3, 1, 2, 0]),
        (0x1000, false, vec![9]),
        (0x2000, false, vec![4, 5]),
        (0x1800, false, vec![4, 5, 6]),
    ] {
        let memory = Memory {
            base: 0x2000_0000,
            size,
            access: 1,
            fetch: 1,
            striped,
            banks,
        };
        for from in [0, 2, 4, 0x0ffe, 0x1000, 0x17fc] {
            for bytes in [0, 1, 2, 3, 4, 7, 8, 20, 64, 0x400, 0x900, 0x2000] {
                let from = memory.base + from;
                let bytes = bytes.min((memory.base + size).saturating_sub(from));
                let all = (from..from + bytes.max(1)).filter_map(|at| memory.bank(at));
                let wanted = all.fold(0, |set, bank| set | 1 << bank);
                if from < memory.base + size {
                    assert_eq!(memory.banks_of(from, bytes), wanted, "{from:#x}, {bytes}");
                }
            }
        }
    }
}

/// A range goes as far as its memory, whose words alone it meets; a bank without a bit is none.
#[test]
fn a_range_ends_with_its_memory() {
    let striped = |size, banks: &[u8]| Memory {
        base: 0x2000_0000,
        size,
        access: 1,
        fetch: 1,
        striped: true,
        banks: banks.to_vec(),
    };
    let four = striped(0x20, &[0, 1, 2, 3]);
    assert_eq!(four.banks_of(0x2000_001c, 0x40), 0b1000);
    assert_eq!(four.banks_of(0x2000_0018, u32::MAX), 0b1100);
    assert_eq!(striped(0x20, &[31, 32]).banks_of(0x2000_0000, 8), 1 << 31);
    assert_eq!(striped(0x20, &[]).banks_of(0x2000_0000, 8), 0);
}

/// Two cores: core 0 has code and data in the striped group and its stack behind it, core 1 its
/// code and data in bank 5, in which an access takes three cycles, and its stack in bank 6.
fn two_cores() -> (Certificate, Elf) {
    let mut board = board();
    let slow = |base, access, bank| Memory {
        base,
        size: 0x1000,
        access,
        fetch: 1,
        striped: false,
        banks: vec![bank],
    };
    board
        .memories
        .extend([slow(SLOW, 3, 5), slow(OTHER_STACK, 1, 6)]);
    board.cores = 2;
    let frame = |core, vectors| Frame {
        core,
        vectors,
        ..Frame::default()
    };
    board.frames = vec![frame(0, VECTORS), frame(1, VECTORS + 0x100)];
    let word = |word: u32| word.to_le_bytes();
    let elf = Elf::of(&[
        (".text.handler", HANDLER, &[0; 64]),
        (".vectors", VECTORS, &word(STACK)),
        (
            ".core1.vectors",
            VECTORS + 0x100,
            &word(OTHER_STACK + 0x1000),
        ),
        (".data", DATA, &[0; 64]),
        (".text.core1", SLOW, &[0; 64]),
        (".data.core1", SLOW + 0x800, &[0; 16]),
    ]);
    (board, elf)
}

/// The same with a section more.
fn add(elf: &mut Elf, section: (&str, u32, &[u8])) {
    elf.sections.extend(Elf::of(&[section]).sections);
    elf.sections.sort_by_key(|section| section.base);
}

const SLOW: u32 = 0x2002_0000;
const OTHER_STACK: u32 = 0x2002_1000;
/// An instruction that is fetched with the one before it, and one that is not.
const LOWER: u32 = HANDLER + 2;

/// Cycles that an instruction waits, with R1 between two words.
fn waits(around: &Around, text: &str, r1: Interval) -> Result<u16, String> {
    waits_with(around, text, r1, |_| ())
}

fn waits_with(
    around: &Around,
    text: &str,
    r1: Interval,
    with: impl Fn(&mut Access),
) -> Result<u16, String> {
    let inst = parse(text, Arch::V8M, None).expect("an instruction");
    let mut facts = Facts::default();
    facts.set(1, r1);
    let mut access = Access {
        inst: &inst,
        at: LOWER,
        facts: &facts,
        section: None,
        fetched: 0,
        hands_stack: false,
        target: None,
        skipped: false,
    };
    with(&mut access);
    around.waits(&access).map_err(|why| why.to_string())
}

fn at(address: u32) -> Interval {
    [i64::from(address as i32); 2]
}

fn around<'a>(certificate: &'a Certificate, elf: &'a Elf, core: u32) -> Around<'a> {
    Around::new(certificate, elf, core).expect("all lies where time is known")
}

/// In bank 5 a word takes two cycles beyond one, and core 1 fetches and loads there: two accesses
/// of three cycles that go first.
#[test]
fn an_access_waits_for_its_memory_and_for_each_port_of_the_other_core() {
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    for (text, r1, cycles) in [
        ("ldr r0, [r1]", at(DATA), 0),
        ("ldr r0, [r1]", at(STACK - 4), 0),
        ("ldr r0, [r1]", at(SLOW), 2 + 2 * 3),
        ("str r0, [r1]", at(SLOW + 0xfff), 8),
        ("ldrd r2, r3, [r1]", at(SLOW), 2 * 8),
        // Of two words the second alone: core 1's stack behind its memory.
        ("ldrd r2, r3, [r1, #4]", at(SLOW + 0xff8), 8 + 1),
        ("ldrd r2, r3, [r1]", at(OTHER_STACK), 1 + 1),
        // Of a list those that lie there, wherever it begins.
        ("ldm r1, {r2, r3, r4}", at(SLOW + 0xff8), 8 + 8 + 1),
        ("ldmdb r1, {r2, r3}", at(SLOW + 0x1004), 8 + 1),
        ("vldr s0, [r1, #16]", at(SLOW + 0xff0), 1),
        ("vldmia r1, {s0-s1}", at(SLOW + 0xffc), 8 + 1),
        // Of a few addresses the worst.
        ("ldr r0, [r1]", [i64::from(SLOW) - 4, i64::from(SLOW)], 8),
        (
            "ldr r0, [r1]",
            [i64::from(SLOW) + 0xffe, i64::from(SLOW) + 0x1001],
            8,
        ),
        ("adds r0, r1, #1", at(SLOW), 0),
    ] {
        let found = waits(&own, text, r1);
        let why = "accesses 0x2001fffc, where no time is known";
        match r1[0] == i64::from(SLOW) - 4 {
            true => assert_eq!(found, Err(format!("{LOWER:#010x} {why}"))),
            false => assert_eq!(found, Ok(cycles), "`{text}` {r1:x?}"),
        }
    }
    // Whoever uses the bank alone waits for the memory alone; core 0's stack is nobody else's.
    let other = around(&board, &elf, 1);
    assert_eq!(waits(&other, "ldr r0, [r1]", at(SLOW)), Ok(2));
    assert_eq!(waits(&other, "ldr r0, [r1]", at(STACK - 4)), Ok(1));
    // Core 0 fetches and loads in its group.
    assert_eq!(waits(&other, "ldr r0, [r1]", at(DATA)), Ok(2));
}

/// A word in a bank that is fetched from waits for a fetch, where the core does so.
#[test]
fn an_access_waits_for_an_own_fetch_in_its_bank() {
    let (mut board, elf) = two_cores();
    for fetches in [false, true] {
        board.fetches = fetches;
        let own = around(&board, &elf, 0);
        let with =
            |text: &str, r1, banks| waits_with(&own, text, r1, |access| access.fetched = banks);
        let one = u16::from(fetches);
        assert_eq!(with("ldr r0, [r1]", at(DATA + 4), 0b0010), Ok(one));
        assert_eq!(with("ldr r0, [r1]", at(DATA + 4), 0b1101), Ok(0));
        assert_eq!(with("ldrd r2, r3, [r1]", at(DATA + 4), 0b0110), Ok(2 * one));
        // Of two words the worse one.
        let two = [i64::from(DATA), i64::from(DATA) + 4];
        assert_eq!(with("ldr r0, [r1]", two, 0b0010), Ok(one));
        assert_eq!(with("ldr r0, [r1]", two, 0b1100), Ok(0));
        assert_eq!(with("ldr r0, [r1]", at(SLOW), 1 << 5), Ok(8 + one));
    }
}

/// An address that is not known lies in the core's data; on its stack where that is handed out,
/// or by the stack pointer; in a section where the base points there.
#[test]
fn an_unknown_address_lies_where_the_core_has_data() {
    let (mut board, elf) = two_cores();
    board.fetches = true;
    let own = around(&board, &elf, 0);
    let any = [0, i64::from(i32::MAX)];
    // Banks 0 to 3 hold the data, bank 4 the stack, bank 5 what takes three cycles.
    let with = |text: &str, banks, section, hands_stack| {
        let access = |access: &mut Access| {
            access.fetched = banks;
            access.section = section;
            access.hands_stack = hands_stack;
        };
        waits_with(&own, text, any, access).expect("it is known")
    };
    for (text, section, hands_stack, banks) in [
        ("ldr r0, [r1]", None, false, 0b0_1111),
        ("ldr r0, [r1]", None, true, 0b1_1111),
        ("ldr r0, [sp, #4]", None, false, 0b1_0000),
        ("ldr.w r0, [sp, r1]", None, false, 0b1_1111),
        ("ldr r0, [r1, r2]", Some(DATA), false, 0b0_1111),
        ("ldr r0, [r1]", Some(DATA), true, 0b0_1111),
        ("tbb [pc, r1]", None, false, 0b0_1111),
    ] {
        for bank in 0..5 {
            let meets = u16::from(banks >> bank & 1 != 0);
            let found = with(text, 1 << bank, section, hands_stack);
            assert_eq!(found, meets, "`{text}` {section:x?} {hands_stack} {bank}");
        }
    }
    // Data beside the stack.
    let mut beside = elf.clone();
    add(&mut beside, (".data.near", STACK - 0x400, &[0; 4]));
    let near = around(&board, &beside, 0);
    let both = waits_with(&near, "ldr r0, [r1]", any, |access| {
        (access.fetched, access.hands_stack) = (0b1_0000, true);
    });
    assert_eq!(both, Ok(1));
    assert_eq!(with("ldr r0, [r1]", 0, Some(SLOW + 0x800), false), 8);
    assert_eq!(with("ldm r1, {r2, r3, r4}", 1, None, false), 3);
    assert_eq!(with("vldr s0, [r1]", 1, None, false), 1);
    // A section of nobody.
    let lost = waits_with(&own, "ldr r0, [r1]", any, |access| {
        access.section = Some(0x1234);
    });
    assert_eq!(lost, Err("0x00001234 lies in no section".to_string()));
}

/// Where the base alone is known, an index goes on from there: at least as long as the base's own
/// word.
#[test]
fn a_known_base_tells_of_a_device() {
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    let devices = at(DEVICES);
    for (text, r1, cycles) in [
        ("ldr r0, [r1]", devices, 3),
        ("str r0, [r1]", devices, 2),
        ("ldr r0, [r1, r2]", devices, 3),
        ("str r0, [r1, r2]", devices, 2),
        ("ldm r1, {r2, r3}", devices, 2 * 3),
        ("stm r1!, {r2, r3}", devices, 2 * 2),
        ("ldm r1, {r2, r3}", at(SLOW), 2 * 8),
        // What is no address as it is may be an index.
        ("ldr r0, [r1, r2]", at(4), 0),
    ] {
        assert_eq!(waits(&own, text, r1), Ok(cycles), "`{text}`");
    }
    // So many words are looked at, and no more: then it lies in the data.
    let mut wide = board.clone();
    wide.buses[0].size = 0x4000;
    let large = around(&wide, &elf, 0);
    let far = |bytes| [i64::from(DEVICES), i64::from(DEVICES) + bytes];
    assert_eq!(waits(&large, "ldr r0, [r1, r2]", far(RANGE - 1)), Ok(3));
    assert_eq!(waits(&large, "ldr r0, [r1, r2]", far(RANGE)), Ok(0));
    assert_eq!(
        waits(&own, "ldr r0, [r1]", at(DEVICES + 0x1000)),
        Err(format!(
            "{LOWER:#010x} accesses 0x40001000, where no time is known"
        ))
    );
}

/// A memory of which nobody can say how long it takes, as flash behind a cache.
#[test]
fn nobody_can_say_how_long_some_memories_take() {
    let (mut board, elf) = two_cores();
    board.memories.push(Memory {
        base: 0x1000_0000,
        access: 0,
        ..board.memories[1].clone()
    });
    let own = around(&board, &elf, 0);
    let why = format!("{LOWER:#010x} accesses 0x10000000, where no time is known");
    assert_eq!(waits(&own, "ldr r0, [r1]", at(0x1000_0000)), Err(why));
}

#[test]
fn a_skipped_instruction_accesses_nothing() {
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    let skipped = |access: &mut Access| access.skipped = true;
    assert_eq!(waits_with(&own, "ldr r0, [r1]", at(SLOW), skipped), Ok(0));
}

/// A DMA and the other core make who goes to their bridge wait, and nobody else.
#[test]
fn who_shares_a_bridge_waits_there() {
    let (mut board, elf) = two_cores();
    board.buses.push(Bus {
        base: DEVICES + 0x1_0000,
        size: 0x100,
        read: 1,
        write: 1,
    });
    let of = |board: &Certificate, core, address| {
        waits(&around(board, &elf, core), "ldr r0, [r1]", at(address))
    };
    assert_eq!(of(&board, 0, DEVICES + 0x1_0000), Ok(0));
    let base = board.clone();
    board.dma = Some(Dma {
        bus: DEVICES,
        wait: 20,
        accesses: 7,
    });
    assert_eq!(of(&board, 0, DEVICES), Ok(3 + 20));
    assert_eq!(of(&board, 0, DEVICES + 0x1_0000), Ok(0));
    board.neighbour = Some(Neighbour {
        bus: DEVICES,
        waits: vec![100, 200],
    });
    assert_eq!(of(&board, 0, DEVICES), Ok(123));
    assert_eq!(of(&board, 1, DEVICES), Ok(223));
    assert_eq!(of(&board, 1, DEVICES + 0x1_0000), Ok(0));
    // An access of a visitor takes as long as the slowest memory; a DMA's may hold up a load and a
    // fetch at once.
    assert_eq!(around(&board, &elf, 0).visit(), 3);
    assert_eq!(around(&board, &elf, 0).dma_cycles(), 2 * 7 * 3);
    assert_eq!(around(&base, &elf, 0).dma_cycles(), 0);
}

/// Between ticks an address may be anywhere: the slowest of all, unless it is known to be in a
/// section or on the stack.
#[test]
fn between_ticks_any_address_may_be_the_slowest() {
    let (mut board, elf) = two_cores();
    let wait = |board: &Certificate, text: &str, section| {
        let own = around(board, &elf, 0);
        let inst = parse(text, Arch::V8M, None).expect("an instruction");
        let access = Access {
            inst: &inst,
            at: LOWER,
            facts: &Facts::default(),
            section,
            fetched: 1 << 5,
            hands_stack: false,
            target: None,
            skipped: false,
        };
        own.waits_anywhere(&access).expect("it is known")
    };
    assert_eq!(wait(&board, "ldr r0, [r1]", None), 8);
    assert_eq!(wait(&board, "ldr r0, [r1]", Some(DATA)), 0);
    assert_eq!(wait(&board, "ldr r0, [sp]", None), 0);
    assert_eq!(wait(&board, "adds r0, #1", None), 0);
    assert_eq!(wait(&board, "ldm r1, {r2, r3}", None), 16);
    board.buses[0].read = 12;
    assert_eq!(wait(&board, "ldr r0, [r1]", None), 11);
    board.buses[0].write = 14;
    assert_eq!(wait(&board, "ldr r0, [r1]", None), 13);
    board.fetches = true;
    board.buses.clear();
    assert_eq!(wait(&board, "ldr r0, [r1]", None), 9);
}

/// Where core 1 has data in core 0's group, each word of instructions there waits for one access.
#[test]
fn a_fetch_waits_for_the_other_core() {
    let (board, elf) = two_cores();
    let mut shared = elf.clone();
    add(&mut shared, (".data.core1", DATA + 0x100, &[0; 4]));
    let fetch = |elf: &Elf, address| {
        let own = around(&board, elf, 0);
        let found = own.target_wait(address);
        found.map_err(|why| why.to_string())
    };
    // The word at a multiple of 16 and 0x100 is in bank 0, as core 1's word is.
    assert_eq!(fetch(&elf, HANDLER + 2), Ok(0));
    assert_eq!(fetch(&shared, HANDLER + 2), Ok(1));
    assert_eq!(fetch(&shared, HANDLER + 6), Ok(0));
    // A target in a lower half comes with its word.
    assert_eq!(fetch(&shared, HANDLER), Ok(0));
    // Wherever a return leads, it may be there.
    assert_eq!(fetch(&shared, SOMEWHERE), Ok(1));
    assert_eq!(fetch(&elf, SOMEWHERE), Ok(0));
    let why = format!("{:#010x} is fetched in more than a cycle", DEVICES + 2);
    assert_eq!(fetch(&elf, DEVICES + 2), Err(why));
    let mut slow = board.clone();
    slow.memories[0].fetch = 2;
    let own = around(&slow, &elf, 0);
    assert!(own.target_wait(HANDLER + 2).is_err());
    // An instruction that begins a word is fetched with it.
    let own = around(&board, &shared, 0);
    let first = |access: &mut Access| access.at = HANDLER;
    assert_eq!(waits_with(&own, "adds r0, #1", at(0), first), Ok(1));
    let target = |access: &mut Access| access.target = Some(HANDLER + 0x12);
    assert_eq!(waits_with(&own, "b .+8", at(0), target), Ok(1));
}

#[test]
fn what_is_fetched_is_64_bytes_ahead_as_far_as_memory_goes() {
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    let bank = |bank: u8| 1_u32 << bank;
    assert_eq!(own.fetched_at(HANDLER + 4), 0b1111);
    assert_eq!(own.fetched_at(SLOW), bank(5));
    // Behind it another memory begins, which is not its bank.
    assert_eq!(own.fetched_at(SLOW + 0xffe), bank(5));
    assert_eq!(own.fetched_at(DEVICES), 0);
    assert_eq!(own.fetched_at(SOMEWHERE), own.code);
    // The last word of the group.
    assert_eq!(own.fetched_at(HANDLER + 0x7ffc), bank(3));
    let mut halves = board.clone();
    halves.memories[3].banks = vec![7, 8];
    let own = around(&halves, &elf, 0);
    assert_eq!(own.fetched_at(SLOW + 0x1000 + 0x7be), bank(7));
    assert_eq!(own.fetched_at(SLOW + 0x1000 + 0x7c0), bank(7));
    assert_eq!(own.fetched_at(SLOW + 0x1000 + 0x7c1), bank(7) | bank(8));
}

/// The frame of an exception waits as data do, while all code of the core may be fetched.
#[test]
fn a_word_of_an_exception_meets_any_code() {
    let (mut board, elf) = two_cores();
    board.fetches = true;
    let own = around(&board, &elf, 0);
    assert_eq!(own.exception_word(1), 1);
    assert_eq!(own.exception_word(own.stack_banks(0).expect("a stack")), 0);
    assert_eq!(
        own.exception_word(own.section_banks(VECTORS).expect("a table")),
        1
    );
    assert_eq!(own.exception_word(1 << 5 | 1), 8);
    assert_eq!(own.exception_word(0), 0);
}
