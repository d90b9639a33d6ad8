//! What lies where: code, data and stacks of cores.

use super::super::{Around, owner};
use super::{SLOW, add, around, at, two_cores, waits};
use crate::certificate::Certificate;
use crate::elf::Elf;
use crate::made::{DATA, DEVICES, HANDLER, STACK, VECTORS};

#[test]
fn code_is_run_by_its_own_core_alone() {
    let (mut board, mut elf) = two_cores();
    elf.sections[0].writable = true;
    let runs =
        |board: &Certificate, elf: &Elf, core, at| around(board, elf, core).is_own_code(at).is_ok();
    assert!(!runs(&board, &elf, 0, HANDLER), "it could be changed");
    elf.sections[0].writable = false;
    assert!(runs(&board, &elf, 0, HANDLER) && !runs(&board, &elf, 1, HANDLER));
    assert!(runs(&board, &elf, 1, SLOW) && !runs(&board, &elf, 0, SLOW));
    assert!(!runs(&board, &elf, 0, DATA), "data are no code");
    assert!(!runs(&board, &elf, 0, VECTORS) && !runs(&board, &elf, 0, DEVICES));
    // A single core runs what is named after another one, and fetches it.
    board.cores = 1;
    assert!(runs(&board, &elf, 0, SLOW));
    let own = around(&board, &elf, 0);
    assert_eq!(own.code, 0b10_1111);
    assert_eq!(own.data, 0b10_1111);
    // Nobody else is there to wait for.
    assert_eq!(waits(&own, "ldr r0, [r1]", at(SLOW)), Ok(2));
}

/// Sections of a core are named after it; what runs before the first tick is nobody's.
#[test]
fn a_section_says_by_its_name_whose_it_is() {
    for (name, core) in [
        (".text", Some(0)),
        (".data.keys", Some(0)),
        (".text.core1", Some(1)),
        (".bss.core1_keys", Some(1)),
        (".bss.core10", Some(0)),
        (".text.start", None),
        (".text.start.core1", None),
        (".text.restart", Some(0)),
        (".vectors", None),
        (".core1_vectors", None),
        (".exceptions", None),
        (".boot2", None),
        (".image_def", None),
        (".copy_table", None),
        (".zero_table", None),
        ("text", None),
    ] {
        assert_eq!(owner(name), core, "{name}");
    }
}

/// Room for a stack ends at the section or the other core's stack right below it.
#[test]
fn a_stack_has_the_room_above_what_lies_below_it() {
    let (mut board, mut elf) = two_cores();
    let room = |board: &Certificate, elf: &Elf, bytes| {
        around(board, elf, 0).has_stack_room(0, bytes).is_ok()
    };
    // Down to where its memory begins.
    assert!(room(&board, &elf, 0x1000) && !room(&board, &elf, 0x1001));
    add(&mut elf, (".data.near", STACK - 0x400, &[0; 0x40]));
    assert!(room(&board, &elf, 0x3c0) && !room(&board, &elf, 0x3c1));
    // What lies above it leaves it its room.
    add(&mut elf, (".boot2", STACK, &[0; 0x40]));
    assert!(room(&board, &elf, 0x3c0));
    // Core 1's stack ends between; one above does not matter.
    let vectors = VECTORS + 0x200;
    add(
        &mut elf,
        (".vectors", vectors, &(STACK - 0x100).to_le_bytes()),
    );
    board.frames[1].vectors = vectors;
    assert!(room(&board, &elf, 0x100) && !room(&board, &elf, 0x101));
    let other = around(&board, &elf, 1);
    assert!(other.has_stack_room(1, 0x2c0).is_ok() && other.has_stack_room(1, 0x2c1).is_err());
    assert_eq!(other.stack_memory(), Some(STACK - 0x1000));
    // Two stacks of one end have no room.
    let mut same = board.clone();
    same.frames[1].vectors = VECTORS;
    assert!(room(&same, &elf, 0) && !room(&same, &elf, 1));
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    assert_eq!(own.stack_memory(), Some(STACK - 0x1000));
}

/// Stacks and data lie where time is known, and a core has a table of vectors.
#[test]
fn nothing_lies_where_no_time_is_known() {
    let (board, elf) = two_cores();
    let why = |board: &Certificate, elf: &Elf| match Around::new(board, elf, 0) {
        Ok(_) => String::new(),
        Err(why) => why.to_string(),
    };
    assert_eq!(why(&board, &elf), "");
    let mut lost = board.clone();
    lost.memories[1].access = 0;
    assert_eq!(
        why(&lost, &elf),
        "0x20011000 has a stack where no time is known"
    );
    let mut lost = board.clone();
    lost.memories[2].access = 0;
    let told = "0x20020000 `.text.core1` lies where no time is known";
    assert_eq!(why(&lost, &elf), told);
    let mut lost = board.clone();
    lost.frames[0].vectors = DATA;
    assert_eq!(why(&lost, &elf), "core 0 has no table of vectors");
    let low = Elf::of(&[(".vectors", VECTORS, &3_u32.to_le_bytes())]);
    assert_eq!(why(&board, &low), "core 0 has no table of vectors");
    let least = Elf::of(&[(".vectors", VECTORS, &4_u32.to_le_bytes())]);
    assert_eq!(
        why(&board, &least),
        "0x00000004 has a stack where no time is known"
    );
    // A section without bytes lies nowhere.
    let mut empty = elf.clone();
    add(&mut empty, (".data", 0x1000, &[]));
    assert_eq!(why(&board, &empty), "");
}

/// The section of an interval: all of it, its last word included, and nothing of the next one.
#[test]
fn an_interval_points_into_a_section_as_a_whole() {
    let (board, elf) = two_cores();
    let own = around(&board, &elf, 0);
    let data = i64::from(DATA);
    assert_eq!(own.section_of([data, data + 63]), Some(DATA));
    assert_eq!(own.section_of([data + 8, data + 63]), Some(DATA));
    assert_eq!(own.section_of([data + 8, data + 64]), None);
    assert_eq!(own.section_of([data - 4, data]), None);
    assert_eq!(own.section_of([data, 1 << 31]), None);
    // What is no word is no address.
    let more = data + (1 << 32);
    assert_eq!(own.section_of([more, more]), None);
    assert_eq!(own.memory_base(DATA), Some(HANDLER));
    assert_eq!(own.memory_base(0), None);
}
