//! Potentials: loops, pieces, and what a certificate may not claim, in small images.

#[path = "../../tests/made/changed.rs"]
mod changed;
mod ended;
mod left;

use whippen_isa::timing::{Evidence, Pipe};

use super::{Check, node_of};
use crate::Refusal;
use crate::certificate::{Certificate, Dma, Kind, Neighbour, Piece};
use crate::facts::ALL;
use crate::made::{DATA, DEVICES, HANDLER, Image, STACK, assemble, call, function};
use crate::overlap::Last;
use crate::place::{Place, Tag};
use crate::step::{Seen, State, Stepper};
use changed::changed;

/// The least cycles that may be claimed of the states of a piece.
///
/// # Errors
/// What is refused whatever is claimed.
pub(crate) fn solve(stepper: &Stepper, piece: Piece) -> Result<Piece, Refusal> {
    let mut piece = piece;
    for _ in 0..100 {
        let claimed = piece.clone();
        let mut seen = Seen {
            class: Evidence::Exact,
            stack: 0,
            hands_stack: false,
        };
        let mut check = Check::new(stepper, &claimed, &mut seen)?;
        check.prepare()?;
        for (point, new) in claimed.points.iter().zip(&mut piece.points) {
            check.is_in(node_of(point), &point.loops)?;
            for ((pipe, facts, _), (_, _, remains)) in point.states.iter().zip(&mut new.states) {
                let state = State {
                    pipe: claimed.pipe(*pipe).expect("a pipe"),
                    facts: claimed.facts[*facts as usize].clone(),
                    place: check.place(point.place)?.clone(),
                    last: Last::default(),
                };
                *remains = check.follow(node_of(point), state, &point.loops)? as i64;
            }
        }
        let (first, longest) = (&claimed.points[0], check.longest);
        let begins = Pipe::from_bits(claimed.begins);
        let entered = State {
            pipe: begins,
            facts: claimed.facts[first.states[0].1 as usize].clone(),
            place: check.place(claimed.place)?.clone(),
            last: Last::default(),
        };
        piece.cycles = match stepper.function.kind {
            Kind::Idle => longest + u64::from(stepper.core.late.cycles),
            _ => check.go_on(node_of(first), &[], &entered)? as u64,
        };
        if piece == claimed {
            return Ok(piece);
        }
    }
    Err(Refusal::new("no cycles are enough".to_string()))
}

/// A handler with loops: heads by distance from its beginning, with their rounds, and the cycles
/// of a round; each is within the one before it.
fn looping(texts: &[&str], loops: &[(u32, u32, u64)]) -> Image {
    let mut handling = function("handler", Kind::Handler, HANDLER);
    for (head, rounds, cycles) in loops {
        let head = HANDLER + head;
        handling.loops.push((head, *rounds));
        handling.pieces[0].rounds.push((0, head, *cycles));
    }
    Image::with(handling, texts, &[], Vec::new())
}

fn cycles(image: Image) -> Result<u64, String> {
    let image = image.prove().map_err(|why| why.why)?;
    match image.judge() {
        Ok(_) => Ok(image.cycles(0, 0)),
        Err(why) => Err(why.why),
    }
}

/// Counts down: a round takes a cycle and a branch that is taken, two; one that is not taken is
/// folded.
const COUNTS: [&str; 4] = ["movs r0, #9", "subs r0, #1", "bne .-2", "bx lr"];

/// Entered, two rounds of nine rounds each.
const NESTED: [&str; 7] = [
    "movs r0, #9",
    "movs r1, #9",
    "subs r1, #1",
    "bne .-2",
    "subs r0, #1",
    "bne .-8",
    "bx lr",
];

#[test]
fn a_loop_takes_its_rounds() {
    let of = |rounds, round| cycles(looping(&COUNTS, &[(2, rounds, round)]));
    assert_eq!(of(9, 3), Ok(1 + 9 * 3 - 2 + 1));
    assert_eq!(of(1, 3), Ok(1 + 3 - 2 + 1));
    assert_eq!(of(9, 2), Err("no cycles are enough".to_string()));
    let of = |outer, inner| cycles(looping(&NESTED, &[(2, 9, outer), (4, 9, inner)]));
    let round = 1 + (9 * 3 - 2) + 3;
    assert_eq!(of(round, 3), Ok(1 + 9 * round - 2 + 1));
    assert!(of(round - 1, 3).is_err() && of(round, 2).is_err());
    // No bound, and a loop that is none.
    let mut none = looping(&COUNTS, &[(2, 9, 3)]);
    none.function(0).loops.clear();
    assert_eq!(
        cycles(none),
        Err("heads a loop without a bound".to_string())
    );
    // What is known to end is followed to its end.
    assert_eq!(cycles(looping(&COUNTS, &[])), Ok(1 + 9 * 3 - 2 + 1));
}

#[test]
fn a_loop_without_an_end_is_refused() {
    let endless = "is walked through endlessly between two points";
    let unknown = ["movs r1, #9", "subs r0, #1", "bne .-2", "bx lr"];
    assert_eq!(cycles(looping(&unknown, &[])), Err(endless.to_string()));
    let none = cycles(looping(&["b .+0"], &[]));
    assert_eq!(none, Err("no cycles are enough".to_string()));
}

/// A loop that is entered behind its head, or whose points belong to other loops than they are in.
#[test]
fn a_loop_is_entered_at_its_head() {
    let texts = [
        "movs r0, #9",
        "b .+4",
        "nop",
        "subs r0, #1",
        "bne .-4",
        "bx lr",
    ];
    let both = "is both in a loop and outside of it";
    assert_eq!(cycles(looping(&texts, &[(4, 9, 4)])), Err(both.to_string()));
    let proven = looping(&NESTED, &[(2, 9, 29), (4, 9, 3)]).prove();
    let proven = proven.expect("it is proven");
    let with = |point: usize, loops: &[u32]| {
        let mut other = proven.clone();
        other.function(0).pieces[0].points[point].loops = loops.to_vec();
        other.why()
    };
    let (outer, inner) = (1, 2);
    assert_eq!(with(inner, &[0, 1]), "");
    let behind = "is in a loop that is not entered at its head";
    assert!(with(inner, &[1, 0]).ends_with(behind));
    for loops in [&[0][..], &[1], &[], &[0, 1, 1], &[0, 0, 1]] {
        assert!(!with(inner, loops).is_empty(), "{loops:?}");
    }
    for loops in [&[1][..], &[], &[0, 1], &[1, 0], &[0, 0]] {
        assert!(!with(outer, loops).is_empty(), "{loops:?}");
    }
}

/// Code that ticks keys: it is entered, goes from key to key by R5, and ends.
const ENTRY: u32 = HANDLER + 0x100;
const KEYS: [&str; 10] = [
    "push {r4, r5, lr}",
    "bx r5",
    "movs r0, #1",
    "bx r5",
    "ldr r0, [r6]",
    "movs r0, #2",
    "udiv r0, r1, r2",
    "bx r5",
    "pop {r4, r5, pc}",
    "nop",
];
const MODES: [u32; 2] = [ENTRY + 4, ENTRY + 8];
const END: u32 = ENTRY + 0x12;

fn ticking(keys: u32) -> Image {
    let mut handling = function("handler", Kind::Handler, HANDLER);
    handling.calls = vec![call(HANDLER + 2, ENTRY, 0, keys)];
    let mut ticks = function("keys", Kind::Keys, ENTRY);
    let piece = |entry| Piece {
        entry,
        ..Piece::default()
    };
    ticks.pieces.extend([MODES[0], MODES[1], END].map(piece));
    ticks.bases = vec![(6, DATA)];
    ticks.entered = vec![(0, [0, 7])];
    let texts = ["push {r4, lr}", "bl .+0xfe", "pop {r4, pc}"];
    let mut image = Image::with(handling, &texts, &[(ENTRY, &KEYS)], vec![ticks]);
    let to = [MODES[0], MODES[1], END].to_vec();
    let targets = [ENTRY + 2, ENTRY + 6, ENTRY + 0x10];
    image.certificate.targets = targets.map(|at| (at, to.clone())).to_vec();
    image
}

/// Keys take their entry and their end once, and the longest mode as often as there are keys.
#[test]
fn keys_take_as_many_modes_as_there_are_keys() {
    let of = |keys| {
        let image = ticking(keys).prove().expect("it is proven");
        let checked = image.judge().expect("it is accepted");
        let longest = image.cycles(2, 2).max(image.cycles(2, 1));
        assert_eq!((checked[0].key, checked[0].keys), (longest, keys));
        (longest, image.cycles(0, 0))
    };
    let (longest, three) = of(3);
    assert!(longest > 11, "it divides");
    assert_eq!(of(4).1, three + longest);
    assert_eq!(of(30).1, three + 27 * longest);
}

/// The last piece ends the keys: none follows it.
#[test]
fn nothing_follows_the_last_piece_of_keys() {
    let mut image = ticking(3);
    let mut code = KEYS;
    (code[8], code[9]) = ("bx r5", "pop {r4, r5, pc}");
    image.replace(".text.more", ENTRY, &assemble(&code));
    let to = image.certificate.targets[0].1.clone();
    image.certificate.targets.push((END, to));
    let why = image.prove().map(|_| ()).expect_err("it goes on");
    assert_eq!(why.why, "is led to by the last piece, which runs once");
}

/// A register that is assumed to point into a section is waited for there.
#[test]
fn an_access_by_a_base_waits_where_that_points() {
    let near = STACK - 0x1000;
    let mode = |section| {
        let mut image = ticking(3);
        image.certificate.fetches = true;
        image.replace(".data.near", near, &[0; 16]);
        image.function(2).bases = vec![(6, section)];
        let image = image.prove().expect("it is proven");
        assert_eq!(image.why(), "");
        image.cycles(2, 1)
    };
    // The code is fetched from the banks of the data, not from the one of the stack.
    assert_eq!(mode(DATA), mode(near) + 1);
}

/// Where numbers of 32 and 64 bits, with and without sign, begin and end.
const ENDS: [i128; 5] = [
    0,
    i32::MIN as i128,
    u32::MAX as i128,
    i64::MAX as i128,
    u64::MAX as i128,
];

/// How many lies were tried, and which are accepted: the place of the number that was changed, 0
/// where the line is left out or doubled, and the line.
fn accepted(image: &Image) -> (usize, Vec<(usize, String)>) {
    let text = image.certificate.to_string();
    let lines: Vec<&str> = text.lines().collect();
    let (mut tried, mut accepted) = (0, Vec::new());
    for (at, line) in lines.iter().enumerate() {
        let mut others = vec![(0, String::new()), (0, format!("{line}\n{line}"))];
        for word in 1..line.split(' ').count() {
            let by = [1, -1].iter();
            let by = by.filter_map(|by| changed(line, word, |old| old + by));
            // More banks that are fetched from are true as well.
            let holds =
                |old: i128, end| line.starts_with("function") && word == 3 && old & end == old;
            let ends = ENDS.iter();
            let ends = ends.filter_map(|end| {
                changed(line, word, |old| if holds(old, *end) { old } else { *end })
            });
            others.extend(by.chain(ends).map(|other| (word, other)));
        }
        for (word, other) in others {
            let mut all: Vec<&str> = lines.clone();
            all[at] = &other;
            all.retain(|line| !line.is_empty());
            tried += 1;
            let Ok(certificate) = Certificate::read(&all.join("\n")) else {
                continue;
            };
            let lies = Image {
                certificate,
                ..image.clone()
            };
            if lies.judge().is_ok() {
                accepted.push((word, line.to_string()));
            }
        }
    }
    (tried, accepted)
}

/// A handler that goes to a device which a DMA and another core go to as well.
fn sharing() -> Image {
    let texts = [
        "movw r1, #0",
        "movt r1, #16384",
        "ldr r0, [r1]",
        "str r0, [r1, #4]",
        "bx lr",
    ];
    let mut image = Image::new(&texts, &[], Vec::new());
    image.certificate.dma = Some(Dma {
        bus: DEVICES,
        wait: 20,
        accesses: 7,
    });
    image.certificate.neighbour = Some(Neighbour {
        bus: DEVICES,
        waits: vec![9],
    });
    image
}

/// What no byte says and nothing meets, by the first word of its line and the number's place, 0
/// for the line as a whole; every other change is refused.
const UNMET: [(&str, &[usize]); 3] = [
    ("deadline", &[1]),
    ("memory", &[1, 2, 3, 4, 5, 6, 7, 8, 9]),
    ("bus", &[0, 1, 2, 3, 4]),
];

#[test]
fn what_is_claimed_is_claimed_of_nothing_else() {
    let counts = looping(&COUNTS, &[(2, 9, 3)]);
    let nested = looping(&NESTED, &[(2, 9, 29), (4, 9, 3)]);
    for (image, tries) in [
        (counts, 200),
        (nested, 220),
        (ticking(3), 350),
        (sharing(), 180),
    ] {
        let image = image.prove().expect("it is proven");
        assert_eq!(image.why(), "");
        let (tried, accepted) = accepted(&image);
        let told = |(word, line): &(usize, String)| {
            let what = line.split(' ').next().unwrap_or_default();
            UNMET
                .iter()
                .any(|(own, words)| *own == what && words.contains(word))
        };
        let lies: Vec<_> = accepted.iter().filter(|own| !told(own)).collect();
        assert!(lies.is_empty(), "{lies:#?}");
        assert!(tried > tries, "{tried}");
    }
    let image = sharing().prove().expect("it is proven");
    let (_, accepted) = accepted(&image);
    // Here a device is met: how long it takes is asked.
    let met =
        |(word, line): &&(usize, String)| line.starts_with("bus") && [0, 1, 3, 4].contains(word);
    assert_eq!(accepted.iter().find(met), None);
}

/// A stack or words that cannot be are refused before anything is computed of them.
#[test]
fn what_cannot_be_is_not_claimed() {
    let proven = looping(&COUNTS, &[(2, 9, 3)])
        .prove()
        .expect("it is proven");
    let cannot = "claims a stack or words that cannot be";
    let with = |change: &dyn Fn(&mut Piece)| {
        let mut other = proven.clone();
        change(&mut other.function(0).pieces[0]);
        other.why().ends_with(cannot)
    };
    let deepest = -(1 << 24);
    for (sp, refused) in [
        (0, false),
        (4, true),
        (deepest, false),
        (deepest - 1, true),
        (i32::MIN, true),
    ] {
        let mut place = Place {
            sp,
            ..Place::default()
        };
        let more = |own: &mut Piece| own.places.push(place.clone());
        assert_eq!(with(&more), refused, "{sp}");
        (place.sp, place.slots) = (0, vec![(sp, Tag::Return(0, 0))]);
        let more = |own: &mut Piece| own.places.push(place.clone());
        assert_eq!(with(&more), refused, "{sp}");
    }
    for (words, refused) in [
        ([0, 0], false),
        ([1, 0], true),
        (ALL, false),
        ([ALL[0] - 1, 0], true),
        ([0, i64::MAX], true),
    ] {
        let changed = with(&|own| {
            own.facts
                .iter_mut()
                .for_each(|own| own.values = vec![words])
        });
        assert_eq!(changed, refused, "{words:?}");
    }
}

/// Each entry of a table is another one, and is named by a number that it has.
#[test]
fn an_entry_is_there_once() {
    let proven = looping(&NESTED, &[(2, 9, 29), (4, 9, 3)]).prove();
    let proven = proven.expect("it is proven");
    let with = |change: &dyn Fn(&mut Piece)| {
        let mut other = proven.clone();
        change(&mut other.function(0).pieces[0]);
        other.why()
    };
    assert_eq!(with(&|_| ()), "");
    let twice = "has an entry that nothing needs";
    let changes: [fn(&mut Piece); 3] = [
        |own| {
            own.places
                .push(own.places[own.points[1].place as usize].clone());
            own.points[1].place = own.places.len() as u32 - 1;
        },
        |own| {
            let number = own.points[1].states[0].0 as usize;
            own.pipes.push(own.pipes[number]);
            own.points[1].states[0].0 = own.pipes.len() as u32 - 1;
        },
        |own| {
            let number = own.points[1].states[0].1 as usize;
            own.facts.push(own.facts[number].clone());
            own.points[1].states[0].1 = own.facts.len() as u32 - 1;
        },
    ];
    for (nth, change) in changes.iter().enumerate() {
        let mut own = proven.clone();
        let before = own.function(0).pieces[0].clone();
        change(&mut own.function(0).pieces[0]);
        let used = |piece: &Piece| {
            let states = piece.points.iter().flat_map(|point| &point.states);
            let places = piece.points.iter().map(|point| point.place);
            let [mut pipes, mut facts] = [0, 1].map(|_| std::collections::BTreeSet::new());
            for (pipe, fact, _) in states {
                pipes.insert(*pipe);
                facts.insert(*fact);
            }
            [
                places.collect::<std::collections::BTreeSet<_>>(),
                pipes,
                facts,
            ]
            .map(|all| all.len())
        };
        // Only then the copy is what nothing needs.
        assert_eq!(
            used(&own.function(0).pieces[0])[nth],
            used(&before)[nth] + 1
        );
        assert!(own.why().ends_with(twice), "{nth}: {}", own.why());
    }
    let names = "names an entry that is not there";
    let changes: [fn(&mut Piece); 5] = [
        |own| own.place = own.places.len() as u32,
        |own| own.points[1].place = own.places.len() as u32,
        |own| own.points[1].loops[0] = own.rounds.len() as u32,
        |own| own.points[1].states[0].0 = own.pipes.len() as u32,
        |own| own.points[1].states[0].1 = own.facts.len() as u32,
    ];
    for (nth, change) in changes.iter().enumerate() {
        let why = with(change);
        let entered = nth == 0 && why.ends_with("is entered with another stack than is claimed");
        assert!(why.ends_with(names) || entered, "{nth}: {why}");
    }
}

/// What is known on a way of more instructions than there are numbers for names is known at its
/// end.
#[test]
fn a_long_way_is_followed_to_its_end() {
    let texts = ["movw r0, #34000", "subs r0, #1", "bne .-2", "bx lr"];
    assert_eq!(looping(&texts, &[]).explore(1, 0), Ok(()));
}
