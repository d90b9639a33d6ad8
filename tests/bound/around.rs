//! What a tick's entry and end leave in the state: where every word lies is needed, and a ring
//! without room is looked after.

use whippen_compiler::validate::{Places, Question, RingPlace, validate};
use whippen_compiler::validation::{code_of, questions};
use whippen_isa::Op;
use whippen_runtime::image::ImageInstrument;

use crate::faults::{NOP, code_of_key};
use crate::validated::{Built, built_of};

/// Whether entry and end of the first tick are validated with these places.
fn is_validated(built: &Built, change: impl Fn(&mut Places)) -> bool {
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let (code, all) = (code_of(&built.whole), questions(&built.whole, &instruments));
    let question = all[0].question(&built.whole, &code);
    let mut places = question.places.clone();
    change(&mut places);
    let question = Question {
        places: &places,
        ..question
    };
    validate(&question).entry.is_validated()
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
    let changes: [(&str, Change); 17] = [
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
