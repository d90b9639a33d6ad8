//! What a frame is summed from, and of which functions.

use crate::certificate::{CYCLES, Dma, Kind, Piece};
use crate::made::{HANDLER, IDLE, Image, STACK, VECTORS, assemble, call, function};
use crate::memory::Around;
use crate::{core_of, costs};

fn nothing() -> Image {
    Image::new(&["push {r4}", "pop {r4}", "bx lr"], &[], Vec::new())
}

/// The cycles of a frame's parts, as accepted.
fn parts(image: Image) -> Vec<u64> {
    let image = image.prove().expect("it is proven");
    let checked = image.judge().expect("it is accepted");
    assert_eq!(checked.len(), 1);
    let parts = &checked[0].parts;
    let sum: u64 = parts.iter().map(|(_, cycles)| cycles).sum();
    assert_eq!(checked[0].cycles, sum);
    parts.iter().map(|(_, cycles)| *cycles).collect()
}

/// Entry and return of an exception save and restore eight words, and read a vector.
#[test]
fn a_frame_is_the_sum_of_its_parts() {
    let core = core_of("cortex-m33").expect("a core");
    let (entry, exit) = (core.exceptions.entry.cycles, core.exceptions.exit.cycles);
    let [entry, exit] = [entry, exit].map(u64::from);
    let least = parts(nothing());
    let (between, handler) = (least[0], least[2]);
    assert_eq!(least, [between, entry, handler, exit, 0, 0]);
    // The longest instruction between two ticks, and what may be late behind it.
    let late = u64::from(core.late.cycles);
    assert_eq!(between, 2 + late);
    // Of the stack each word takes two cycles more; two words of the handler's are there too.
    let mut slow = nothing();
    slow.certificate.memories[1].access = 3;
    let found = parts(slow);
    assert_eq!(found, [between, entry + 16, handler + 4, exit + 16, 0, 0]);
    // A vector that is in a bank that is fetched from.
    let mut fetching = nothing();
    fetching.certificate.fetches = true;
    assert_eq!(parts(fetching), [between, entry + 1, handler, exit, 0, 0]);
    let mut visited = nothing();
    visited.certificate.frames[0].visits = 5;
    visited.certificate.dma = Some(Dma {
        bus: visited.certificate.buses[0].base,
        wait: 0,
        accesses: 7,
    });
    assert_eq!(parts(visited), [between, entry, handler, exit, 5, 14]);
}

/// Between ticks nothing is used of which an interrupt would have to save more; it may sleep.
#[test]
fn between_ticks_no_number_is_floating() {
    let with = |text: &str| {
        let mut image = nothing();
        image.replace(".text.idle", IDLE, &assemble(&[text, "b .-2"]));
        image.prove().err().map(|why| why.why)
    };
    assert_eq!(
        [with("wfi"), with("wfe"), with("ldr r0, [r1]")],
        [None, None, None]
    );
    // Whatever a register holds, the slowest device.
    let mut slow = nothing();
    slow.replace(".text.idle", IDLE, &assemble(&["ldr r0, [r1]", "b .-2"]));
    let mut slower = slow.clone();
    slower.certificate.buses[0].read += 40;
    let [slow, slower] = [slow, slower].map(|image| parts(image)[0]);
    assert_eq!(slower, slow + 40);
    let float = with("vadd.f32 s0, s1, s2").expect("it is refused");
    assert!(float.ends_with("makes an interrupt save more"), "{float}");
    let handler = Image::new(&["vadd.f32 s0, s1, s2", "bx lr"], &[], Vec::new());
    assert!(handler.prove().is_ok());
}

/// The stack of what is interrupted, of the exception with what aligns it, and of the handler.
#[test]
fn stacks_of_a_frame_lie_one_above_the_other() {
    let mut image = nothing().prove().expect("it is proven");
    assert_eq!(image.certificate.frames[0].stack, 36 + 4);
    let checked = image.judge().expect("it is accepted");
    // A state of what runs between ticks, and one of the handler.
    assert_eq!((checked[0].stack, checked[0].states), (40, 2));
    image.certificate.memories[1].base = STACK - 40;
    image.certificate.memories[1].size = 40;
    assert_eq!(image.why(), "");
    image.certificate.memories[1].base = STACK - 36;
    image.certificate.memories[1].size = 36;
    assert!(image.why().ends_with("has no room for 40 bytes of stack"));
}

#[test]
fn a_frame_meets_its_deadline() {
    let mut image = nothing().prove().expect("it is proven");
    let cycles = image.certificate.frames[0].cycles;
    image.certificate.deadline = cycles;
    assert_eq!(image.why(), "");
    image.certificate.deadline = cycles - 1;
    let why = format!("core 0: {cycles} cycles of {}", cycles - 1);
    assert_eq!(image.why(), why);
}

/// The image with another word in its table of vectors.
fn with_vector(nth: u32, word: u32) -> Image {
    let mut image = nothing().prove().expect("it is proven");
    let mut words = [STACK, 1, 0, image.certificate.dead | 1, HANDLER | 1];
    words[nth as usize] = word;
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    image.replace(".vectors", VECTORS, &bytes);
    image
}

/// Every vector behind the first two leads to the handler, to the end, or nowhere.
#[test]
fn no_interrupt_but_the_ticks_is_taken() {
    assert_eq!(with_vector(1, IDLE | 1).why(), "");
    // Another interrupt that leads to the handler is one that nobody counts.
    let twice = format!(
        "{:#010x} is the vector of an interrupt that nobody bounds",
        VECTORS + 16
    );
    assert_eq!(with_vector(2, HANDLER | 1).why(), twice);
    assert_eq!(with_vector(3, 0).why(), "");
    for nth in [2, 3] {
        let at = VECTORS + 4 * nth;
        let why = format!("{at:#010x} is the vector of an interrupt that nobody bounds");
        assert_eq!(with_vector(nth, IDLE | 1).why(), why);
    }
    let mut part = nothing().prove().expect("it is proven");
    let words = [STACK, 1, 0, HANDLER | 1];
    let words = words.iter().flat_map(|word| word.to_le_bytes());
    let bytes: Vec<u8> = words.chain([1]).collect();
    part.replace(".vectors", VECTORS, &bytes);
    let why = format!("{:#010x} is a part of a vector", VECTORS + 16);
    assert_eq!(part.why(), why);
    // It is a section of its own, and the stack ends at a word.
    let mut within = nothing().prove().expect("it is proven");
    within.certificate.frames[0].vectors = VECTORS + 4;
    assert_eq!(within.why(), "core 0 has no table of vectors");
    let end = |end| with_vector(0, end).why();
    assert_eq!(end(STACK), "");
    for wrong in [0, 1, STACK + 1, STACK + 2] {
        assert_eq!(end(wrong), "core 0 has no table of vectors");
    }
    let bytes: Vec<u8> = [STACK, STACK, 1, 0, 0, HANDLER | 1]
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect();
    within.replace(".vectors", VECTORS, &bytes);
    let why = format!("{:#010x} is no table of vectors", VECTORS + 4);
    assert_eq!(within.why(), why);
    let none = format!("{VECTORS:#010x} has no vector of the handler");
    assert_eq!(with_vector(4, 0).why(), none);
}

/// A frame ends with what runs between ticks and its handler, one piece each.
#[test]
fn a_frame_ends_with_idle_and_handler() {
    let proven = nothing().prove().expect("it is proven");
    let ends = "a frame ends with what runs between ticks and its handler";
    let mut swapped = proven.clone();
    swapped.certificate.frames[0].functions.swap(0, 1);
    assert_eq!(swapped.why(), ends);
    let mut alone = proven.clone();
    alone.certificate.frames[0].functions.remove(0);
    assert_eq!(alone.why(), ends);
    let mut plain = proven.clone();
    plain.function(0).kind = Kind::Plain;
    assert!(!plain.why().is_empty());
    let mut twice = proven.clone();
    let idle = twice.certificate.frames[0].functions[0].clone();
    twice.certificate.frames[0].functions.push(idle);
    assert_eq!(twice.why(), ends);
}

/// Pieces of a function: as many as its kind has, the first entered as a function is.
#[test]
fn a_function_has_the_pieces_of_its_kind() {
    let with = |kind, pieces: usize| {
        let mut own = function("more", kind, HANDLER + 0x100);
        let more = (1..pieces).map(|nth| Piece {
            entry: HANDLER + 0x100 + 4 * nth as u32,
            ..Piece::default()
        });
        own.pieces.extend(more);
        let code: &[&str] = &["bx lr"];
        let mut image = Image::new(&["bx lr"], &[(HANDLER + 0x100, code)], Vec::new());
        image = image.prove().expect("it is proven");
        image.certificate.frames[0].functions.insert(0, own);
        image.why()
    };
    let number = "has another number of pieces than its kind";
    for (kind, pieces) in [
        (Kind::Plain, 2),
        (Kind::Keys, 1),
        (Kind::Keys, 2),
        (Kind::Legs, 1),
        (Kind::Idle, 2),
    ] {
        assert!(with(kind, pieces).ends_with(number), "{kind:?} {pieces}");
    }
    for (kind, pieces) in [(Kind::Plain, 1), (Kind::Keys, 3), (Kind::Legs, 2)] {
        let why = with(kind, pieces);
        assert!(!why.is_empty() && !why.ends_with(number), "{kind:?} {why}");
    }
    let proven = nothing().prove().expect("it is proven");
    let mut none = proven.clone();
    none.function(0).pieces.clear();
    assert!(!none.why().is_empty());
    let mut other = proven.clone();
    other.function(0).contexts[0] = [0, 0, HANDLER + 2];
    assert!(other.why().ends_with("is not the first context's"));
    let mut begun = proven.clone();
    begun.function(0).pieces[0].begins = 1;
    assert!(!begun.why().is_empty());
    let mut lower = proven.clone();
    lower.function(0).pieces[0].places[0].sp = -4;
    let why = "is entered with another stack than is claimed";
    assert!(lower.why().ends_with(why));
}

/// What takes longer than any sum has room for is called nowhere.
#[test]
fn a_call_costs_no_more_than_sums_have_room_for() {
    let with = |[first, mode, last]: [u64; 3], keys: u32| {
        let mut own = function("keys", Kind::Keys, HANDLER + 0x100);
        own.pieces = [first, mode, last]
            .map(|cycles| Piece {
                cycles,
                ..own.pieces[0].clone()
            })
            .to_vec();
        let image = Image::new(&["bx lr"], &[], vec![own]);
        let around = Around::new(&image.certificate, &image.elf, 0).expect("it is known");
        let calls = [call(HANDLER, HANDLER + 0x100, 0, keys)];
        let found = costs(&around, &image.certificate.frames[0], 1, &calls);
        found
            .map(|all| all[0].clone().expect("it is called").cycles)
            .map_err(|why| why.why)
    };
    let none = Err("costs what no function before it does".to_string());
    assert_eq!(with([1, 2, 3], 4), Ok(12));
    assert_eq!(with([CYCLES - 3, 1, 0], 3), Ok(CYCLES));
    assert_eq!(with([CYCLES - 2, 1, 0], 3), none);
    assert_eq!(with([0, CYCLES, 0], u32::MAX), none);
    assert_eq!(with([u64::MAX, 0, 1], 0), none);
    assert_eq!(with([1, 0, u64::MAX - 1], 2), none);
}
