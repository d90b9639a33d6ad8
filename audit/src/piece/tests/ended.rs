//! Pieces that end elsewhere than with a return: at a place, or where the next leg begins.

use super::looping;
use crate::certificate::{Function, Kind, Piece};
use crate::facts::Facts;
use crate::made::{HANDLER, Image, function};

/// Where the function stands.
const OWN: u32 = HANDLER + 0x100;

/// An image with that function beside a handler that does not call it.
fn beside(own: Function, texts: &[&str]) -> Image {
    Image::new(&["bx lr"], &[(OWN, texts)], vec![own])
}

/// The cycles of the function's pieces.
fn cycles(own: Function, texts: &[&str]) -> Result<Vec<u64>, String> {
    let image = beside(own, texts).prove().map_err(|why| why.why)?;
    match image.judge() {
        Err(why) => Err(why.why),
        Ok(_) => {
            let pieces = &image.certificate.frames[0].functions[0].pieces;
            Ok(pieces.iter().map(|piece| piece.cycles).collect())
        }
    }
}

/// A function as far as a place behind its beginning.
fn until(place: u32) -> Function {
    Function {
        until: Some((OWN + place, 0)),
        ..function("until", Kind::Until, OWN)
    }
}

/// One way comes to the place at 4; the other returns, and takes longer.
const WAYS: [&str; 6] = [
    "cbz r0, .+8",
    "movs r1, #1",
    "nop",
    "bx lr",
    "udiv r0, r1, r2",
    "bx lr",
];

#[test]
fn what_never_comes_to_its_place_does_not_count() {
    assert_eq!(cycles(until(4), &WAYS), Ok(vec![2]));
    assert_eq!(cycles(until(2), &WAYS), Ok(vec![1]));
    // The branch is taken, then it divides.
    assert_eq!(cycles(until(12), &WAYS), Ok(vec![2 + 11]));
    // None comes there.
    let never = cycles(until(0x40), &WAYS);
    assert_eq!(
        never,
        Err("a function says something twice, or what cannot be".to_string())
    );
}

/// Rounds count as far as the last one comes to the place; a way out of them that never comes there
/// does not.
#[test]
fn a_place_is_behind_all_rounds() {
    let rounds = |texts: &[&str], place: u32, round: u64| {
        let mut own = until(place);
        own.loops = vec![(OWN + 2, 9)];
        own.pieces[0].rounds = vec![(0, OWN + 2, round)];
        cycles(own, texts)
    };
    // A branch that is not taken is folded; one that is taken takes two.
    let counts = [
        "movs r0, #9",
        "subs r0, #1",
        "beq .+4",
        "b .-4",
        "nop",
        "bx lr",
    ];
    assert_eq!(rounds(&counts, 8, 3), Ok(vec![1 + 9 * 3]));
    let leaves = [
        "movs r0, #9",
        "cbz r1, .+10",
        "subs r0, #1",
        "beq .+4",
        "b .-6",
        "nop",
        "bx lr",
    ];
    assert_eq!(rounds(&leaves, 10, 4), Ok(vec![1 + 9 * 4]));
}

/// The place may be in what is called.
#[test]
fn a_place_may_be_in_a_call() {
    let texts = [
        "push {r4, lr}",
        "bl .+6",
        "pop {r4, pc}",
        "movs r0, #1",
        "nop",
        "bx lr",
    ];
    let mut own = until(10);
    own.contexts.push([0, OWN + 6, OWN + 8]);
    let place = cycles(own.clone(), &texts).expect("it is bounded");
    own.until = Some((OWN + 8, 0));
    let callee = cycles(own.clone(), &texts).expect("it is bounded");
    assert_eq!(place[0], callee[0] + 1);
    // Behind the return of the callee.
    own.until = Some((OWN + 6, 0));
    let behind = cycles(own, &texts).expect("it is bounded");
    assert!(behind[0] > place[0] + 1);
}

/// The pipeline at the place is the one that is claimed.
#[test]
fn a_place_is_come_to_with_its_pipeline() {
    let image = beside(until(4), &WAYS).prove().expect("it is proven");
    let (at, bits) = image.certificate.frames[0].functions[0]
        .until
        .expect("a place");
    assert_eq!((at, image.why().as_str()), (OWN + 4, ""));
    assert_ne!(bits, 0);
    let mut other = image.clone();
    other.certificate.frames[0].functions[0].until = Some((at, 0));
    assert!(
        other
            .why()
            .ends_with("ends with another pipeline than is claimed")
    );
}

/// Three legs, the last of which leads back to the first.
fn legs(entries: [u32; 3]) -> Function {
    let mut own = function("legs", Kind::Legs, OWN);
    own.pieces = entries
        .map(|entry| Piece {
            entry: OWN + entry,
            ..Piece::default()
        })
        .to_vec();
    own
}

#[test]
fn a_leg_leads_to_the_next_one() {
    let texts = [
        "movs r0, #1",
        "b .+2",
        "movs r0, #1",
        "movs r1, #1",
        "b .+2",
        "movs r0, #1",
        "movs r0, #1",
        "movs r0, #1",
        "b .-16",
    ];
    // A branch that is taken takes two, less one where it is folded.
    let taken = 1;
    let three = [1 + taken, 2 + taken, 3 + taken].map(|cycles| cycles as u64);
    assert_eq!(cycles(legs([0, 4, 10]), &texts), Ok(three.to_vec()));
    // A leg that leads past the next one comes there some time, or never.
    let past = ["b .+8", "nop", "nop", "b .+4", "nop", "b .-10"];
    let never = Err("is never come to".to_string());
    assert_eq!(cycles(legs([0, 2, 8]), &past), never);
    // In another order each leads around to the next one.
    let around = cycles(legs([0, 10, 4]), &texts);
    let [one, two, _] = three;
    assert_eq!(around, Ok(vec![one + two, three[2] + one, two + three[2]]));
}

/// The next leg begins with the pipeline and the stack that the one before it leaves.
#[test]
fn a_leg_begins_as_the_one_before_it_ends() {
    let texts = ["movs r0, #1", "movs r0, #1", "movs r0, #1", "b .-6"];
    let own = legs([0, 2, 4]);
    let image = beside(own, &texts).prove().expect("it is proven");
    assert_eq!(image.why(), "");
    let with = |change: &dyn Fn(&mut Piece)| {
        let mut other = image.clone();
        change(&mut other.certificate.frames[0].functions[0].pieces[1]);
        other.why()
    };
    assert!(with(&|own| own.begins = 0).ends_with("ends with another pipeline than is claimed"));
    let stack = "begins with another stack than is claimed";
    assert!(with(&|own| own.places[0].sp = -4).ends_with(stack));
    let tag = Some(crate::place::Tag::Section(HANDLER));
    assert!(with(&|own| own.places[0].registers[4] = tag).ends_with(stack));
}

/// Two ways come to the division, one of which knows that it is passed by.
const KNOWN: [&str; 6] = [
    "cbz r1, .+6",
    "movs r0, #0",
    "b .+2",
    "cbz r0, .+6",
    "udiv r2, r0, r1",
    "bx lr",
];

/// The claims at the place where both ways meet, `true` for what one of them knows.
fn met(claims: &[bool]) -> String {
    met_with(claims, [0, 0], !0)
}

/// The same with other words and flags that are known.
fn met_with(claims: &[bool], words: [i64; 2], flags: u16) -> String {
    let mut image = Image::new(&KNOWN, &[], Vec::new());
    image = image.prove().expect("it is proven");
    let piece = &mut image.function(0).pieces[0];
    let mut known = Facts::default();
    known.set(0, words);
    known.flags = flags;
    piece.facts = vec![Facts::default(), known];
    let mut point = piece.points[0].clone();
    point.at = HANDLER + 6;
    let states = claims
        .iter()
        .map(|known| (0, u32::from(*known), -1_000_000));
    point.states = states.collect();
    piece.points.push(point);
    let last = image.certificate.frames[0].functions.len() - 1;
    let proven = image.solve(last).and_then(|()| image.sum());
    match proven {
        Err(why) => why.why,
        Ok(()) => image.why(),
    }
}

/// What arrives is held by the claim of which the least remains, and by one that covers it.
#[test]
fn the_least_claim_that_covers_a_state_holds_it() {
    assert_eq!([met(&[false, true]), met(&[true, false])], ["", ""]);
    assert_eq!(met(&[true]), "is met in a state that is not claimed");
    // What is known is what arrives, no more; of flags N and Z here.
    let both = |words, flags| met_with(&[false, true], words, flags);
    assert_eq!([both([0, 0], !0), both([0, 0], 0xf0)], ["", ""]);
    for (words, flags) in [
        ([0, 1], !0),
        ([-1, 0], !0),
        ([1, 1], !0),
        ([0, 0], 0xf1),
        ([0, 0], 0x10),
    ] {
        let why = both(words, flags);
        assert!(why.ends_with("has a state that nothing needs"), "{why}");
    }
    // Enough for both ways, but then nobody needs to know.
    assert!(met(&[false]).ends_with("has an entry that nothing needs"));
}

/// One loop is left where the next one is entered.
#[test]
fn a_loop_may_lead_into_the_next_one() {
    let texts = [
        "movs r0, #9",
        "movs r1, #9",
        "subs r0, #1",
        "bne .-2",
        "subs r1, #1",
        "bne .-2",
        "bx lr",
    ];
    let mut image = looping(&texts, &[(4, 9, 3), (8, 9, 3)]);
    for number in 0..2 {
        assert_eq!(image.explore(number, 0), Ok(()));
        for point in &mut image.function(1 - number).pieces[0].points {
            if point.at == HANDLER + 8 {
                point.loops = vec![1];
            }
        }
        assert_eq!(image.solve(number), Ok(()));
    }
    assert_eq!(image.sum(), Ok(()));
    assert_eq!(image.why(), "");
    let rounds = 9 * 3 - 2;
    assert_eq!(image.cycles(0, 0), 2 + rounds + rounds + 1);
}
