//! What a tick's entry and end leave in the state: where every word lies is needed, and a ring
//! without room is looked after.

use whippen_compiler::validate::{
    Places, Question, RingPlace, Routine, Verdict, validate, validate_routine,
};
use whippen_compiler::validation::{code_of, questions};
use whippen_isa::Op;
use whippen_runtime::image::ImageInstrument;

use crate::faults::{NOP, code_of_key};
use crate::validated::{Built, built_of, built_of_keys};

/// What is found of the first core's keys with these places.
fn found_with<T>(
    built: &Built,
    change: impl Fn(&mut Places),
    find: impl FnOnce(&Question) -> T,
) -> T {
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let (code, all) = (code_of(&built.whole), questions(&built.whole, &instruments));
    let question = all[0].question(&built.whole, &code);
    let mut places = question.places.clone();
    change(&mut places);
    find(&Question {
        places: &places,
        ..question
    })
}

/// Whether entry and end of the first tick are validated with these places.
fn is_validated(built: &Built, change: impl Fn(&mut Places)) -> bool {
    found_with(built, change, |question| {
        validate(question).entry.is_validated()
    })
}

fn ring(places: &mut Places) -> &mut RingPlace {
    places.events.as_mut().expect("it has events")
}

/// A word that lies elsewhere is not the one that the code stores.
#[test]
fn every_place_is_needed_at_entry_and_end() {
    let built = built_of("clavichord-heard.whip", "rp2350");
    assert!(is_validated(&built, |_| {}));
    type Change = fn(&mut Places);
    let changes: [(&str, Change); 18] = [
        ("keys that have events", |p| p.keys *= 16),
        ("head", |p| ring(p).head = 8),
        ("tail", |p| ring(p).tail = 8),
        ("lost", |p| ring(p).lost = 4),
        ("the ring", |p| ring(p).start += 4),
        ("its size", |p| ring(p).bytes *= 2),
        ("the spare", |p| ring(p).spare += 16),
        ("room for a tick", |p| ring(p).tick_bytes += 16),
        ("an event", |p| p.event_bytes *= 2),
        ("the next event", |p| p.next_event += 4),
        ("the tick", |p| p.tick += 4),
        ("the words", |p| p.words = None),
        ("the histories", |p| p.apart = p.apart.map(|at| at + 4)),
        ("the row", |p| p.row += 4),
        ("slots", |p| p.lines[0].len += 1),
        ("the first slot", |p| p.lines[0].at += 4),
        ("the next slot", |p| p.lines[0].row += 4),
        ("a pointer", |p| {
            let (ticks, at) = p.lines[0].pointers.pop_last().expect("there is one");
            p.lines[0].pointers.insert(ticks + 1, at);
        }),
    ];
    for (what, change) in changes {
        assert!(!is_validated(&built, change), "{what}");
    }
}

/// Which routines of a few keys are validated with these places.
fn routines_validated(built: &Built, change: impl Fn(&mut Places)) -> [bool; 2] {
    found_with(built, change, |question| {
        Routine::ALL.map(|routine| validate_routine(question, routine).is_validated())
    })
}

/// So it is with what keys begin with.
#[test]
fn every_place_is_needed_where_keys_begin() {
    let built = built_of_keys("celesta.whip", "rp2350", 4);
    assert_eq!(routines_validated(&built, |_| {}), [true, true]);
    type Change = fn(&mut Places);
    // Whether `begin` knows it, too.
    let changes: [(&str, bool, Change); 12] = [
        ("a key more", false, |p| p.keys += 1),
        ("a key less", false, |p| p.keys -= 1),
        ("records", true, |p| p.records += 4),
        ("a record", true, |p| p.record_bytes += 4),
        ("a cell", true, |p| p.cells[0] += 4),
        ("the words", false, |p| p.words = None),
        ("words of a key", false, |p| p.stride += 2),
        ("the histories", true, |p| {
            p.apart = p.apart.map(|at| at + 4)
        }),
        ("the row", false, |p| p.row += 4),
        ("slots", true, |p| p.lines[0].len += 1),
        ("the first slot", true, |p| p.lines[0].at += 4),
        ("the next slot", true, |p| p.lines[0].row += 4),
    ];
    for (what, is_known_to_begin, change) in changes {
        let validated = routines_validated(&built, change);
        assert_eq!(validated, [false, !is_known_to_begin], "{what}");
    }
}

/// A line that only ticks push into is not `begin`'s, as the firmware has emptied it; `init` stores
/// its pointers.
#[test]
fn pointers_into_lines_are_needed() {
    let built = built_of_keys("clavichord-heard.whip", "rp2350", 4);
    assert_eq!(routines_validated(&built, |_| {}), [true, true]);
    let without_pointer = |p: &mut Places| {
        let (ticks, at) = p.lines[0].pointers.pop_last().expect("there is one");
        p.lines[0].pointers.insert(ticks + 1, at);
    };
    assert_eq!(routines_validated(&built, without_pointer), [false, true]);
}

/// What memory holds before `init` is looked at: whatever byte of it is otherwise.
#[test]
fn what_memory_holds_at_first_is_needed() {
    let built = built_of_keys("clavichord-heard.whip", "rp2350", 4);
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let (code, all) = (code_of(&built.whole), questions(&built.whole, &instruments));
    let question = all[0].question(&built.whole, &code);
    let (state, places) = (question.symbols.state, question.places);
    let ring = places.events.expect("it has events");
    let record = |key: u32| state + places.records + key * places.record_bytes;
    let from = code.first_word(state + places.apart.expect("they lie apart"));
    let line = &places.lines[1];
    let last_slot = line.at + (line.len - 1) * line.row + u32::from(line.bytes());
    let cases = [
        ("code", record(1)),
        ("the end", record(places.keys)),
        ("a cell", record(1) + places.cells[4]),
        ("the tick", state + places.tick),
        ("the slot of a line", state + line.ring),
        ("head", state + ring.head),
        ("lost", state + ring.lost),
        ("a live value", state + places.lives[0] + 3),
        ("a slot", from.expect("an address") + last_slot),
    ];
    for (what, at) in cases {
        let mut faulty = code.clone();
        let own = faulty.data.iter_mut().find_map(|(from, bytes)| {
            let at = at.checked_sub(*from)? as usize;
            bytes.get_mut(at)
        });
        *own.unwrap_or_else(|| panic!("no byte of {what}")) ^= 0xff;
        let question = Question {
            code: &faulty,
            ..question.clone()
        };
        let told = validate_routine(&question, Routine::Init);
        assert!(matches!(told, Verdict::Refuted { .. }), "{what}: {told}");
    }
}

/// The entry does not ask whether the ring has room: at either of the two places.
#[test]
fn a_full_ring_is_asked_for() {
    for board in ["rp2350", "rp2040"] {
        let built = built_of("harpsichord.whip", board);
        let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
        let code = code_of(&built.whole);
        let all = questions(&built.whole, &instruments);
        let question = all[0].question(&built.whole, &code);
        let arch = built.whole.image.arch;
        let entry = code_of_key(&code, arch, question.symbols.tick, question.symbols.end);
        let asks = entry
            .iter()
            .filter(|(.., inst)| inst.op() == Op::B && inst.to_string().starts_with("bhi"));
        let asks: Vec<u32> = asks.map(|(at, ..)| *at).collect();
        assert_eq!(asks.len(), 2, "{board}");
        for at in asks {
            let mut faulty = code.clone();
            faulty.put(at, NOP);
            let question = Question {
                code: &faulty,
                ..question.clone()
            };
            assert!(
                !validate(&question).entry.is_validated(),
                "{board}, {at:#x}"
            );
        }
    }
}
