//! When two cores that wait for each other are done, with cycles of legs made up and counted on
//! paper.

use super::{HELPER, Legs, Meetings, ROUNDS};
use crate::certificate::{Frame, Function, Helper, Kind, Piece};
use crate::costs;
use crate::made::{HANDLER, Image, call, function};
use crate::memory::Around;

const HEAD: u32 = HANDLER + 0x1000;

/// Legs that take so many cycles, each with a loop that waits.
fn legs(cycles: &[u64], rounds: u32, base: u32) -> Function {
    let piece = |(nth, cycles): (usize, &u64)| Piece {
        entry: base + 0x10 * nth as u32,
        cycles: *cycles,
        rounds: vec![(0, HEAD, 1)],
        ..Piece::default()
    };
    Function {
        kind: Kind::Legs,
        loops: vec![(HEAD, rounds)],
        pieces: cycles.iter().enumerate().map(piece).collect(),
        stack: rounds,
        returns: Some((HANDLER + rounds, true)),
        fetched: 0b110 | 8 << rounds,
        ..function("legs", Kind::Legs, base)
    }
}

fn until(entry: u32, cycles: u64, place: Option<(u32, u128)>) -> Function {
    let mut own = function("until", Kind::Until, entry);
    own.pieces[0].cycles = cycles;
    own.until = place;
    own
}

const FIRST: u32 = HANDLER + 0x100;
const OTHER: u32 = HANDLER + 0x800;
const TICK: u32 = HANDLER;

/// Core 0 has legs of 10, 20 and 30 cycles, 5 more each where it waits; core 1 of 100 and 200,
/// 7 more each, and goes back in 40 and 7.
fn frame(back: &[u64]) -> Frame {
    let more = |cycles: &[u64], more| cycles.iter().map(|own| own + more).collect::<Vec<u64>>();
    let other = [&[100, 200], back].concat();
    Frame {
        functions: vec![
            until(FIRST, 3, Some((FIRST + 0x20, 9))),
            until(TICK, 50, Some((FIRST, 0))),
            legs(&[10, 20, 30], 1, FIRST),
            legs(&more(&[10, 20, 30], 5), ROUNDS, FIRST),
        ],
        helper: Some(Helper {
            visits: vec![2; back.len() + 1],
            functions: vec![
                legs(&other, 1, OTHER),
                legs(&more(&other, 7), ROUNDS, OTHER),
            ],
            ..Helper::default()
        }),
        ..Frame::default()
    }
}

/// What core 0 takes, and when core 1 is done with what it does not wait for; or why not.
fn met(frame: &Frame) -> Result<(u64, Option<u64>), String> {
    let mut image = Image::new(&["bx lr"], &[], Vec::new());
    image.certificate.frames.push(Frame {
        core: HELPER,
        ..image.certificate.frames[0].clone()
    });
    let around = Around::new(&image.certificate, &image.elf, 0).expect("it is known");
    let met = Meetings::of(&around, frame).map_err(|why| why.to_string())?;
    let outlasts = met.outlasts(TICK, 1000).map_err(|why| why.to_string())?;
    Ok((met.cost().cycles, outlasts))
}

/// A leg ends at the later of: from where it looked, with the number there; from where the number
/// was written, with waiting. Core 0 starts core 1 at 3; each visit takes core 1 a cycle.
#[test]
fn a_leg_ends_when_both_may_have_come() {
    // Leg 0: core 0 looks at 0 and was written to at 0: 10 or 15, 15. Core 1 looks at 3 + 47, and
    // was written to at 3: 150 or 110, and two visits: 152.
    // Leg 1: core 0 from 15 and 152: 35 or 177, 177. Core 1 from 152 and 15: 352 or 222, and two
    // visits: 354.
    // Leg 2: core 0 from 177 and 354: 207 or 389.
    assert_eq!(met(&frame(&[40])), Ok((389, None)));
    // With a leg more core 1 goes on behind core 0's last: in leg 2 from 354 and 177, and two
    // visits, behind 50 of the tick, with 1000 around it.
    let (cycles, heard) = met(&frame(&[300, 40])).expect("they meet");
    assert_eq!((cycles, heard), (389, Some(1000 + 50 + 354 + 300 + 2)));
    // The number comes late where core 0 is slow.
    let mut slow = frame(&[40]);
    for own in &mut slow.functions[2..] {
        own.pieces[0].cycles += 1000;
    }
    // Core 0 at 1015, core 1 at 152; then core 0 at 1035, core 1 at 1015 + 207 + 2, and core 0 35
    // behind it.
    assert_eq!(met(&slow), Ok((1015 + 207 + 2 + 35, None)));
}

/// An image whose frame the helper has, too.
fn of_two_cores() -> Image {
    let mut image = Image::new(&["bx lr"], &[], Vec::new());
    let mut other = image.certificate.frames[0].clone();
    other.core = HELPER;
    image.certificate.frames.push(other);
    image
}

#[test]
fn what_legs_cost_is_what_either_does() {
    let image = of_two_cores();
    let around = Around::new(&image.certificate, &image.elf, 0).expect("it is known");
    let own = frame(&[40]);
    let cost = Meetings::of(&around, &own).expect("they meet").cost();
    assert_eq!(cost.stack, ROUNDS);
    assert_eq!(cost.returns, Some((HANDLER + ROUNDS, true)));
    assert_eq!(cost.fetched, 0b110);
    let legs = Legs::of(&own, 0).expect("it has legs");
    assert_eq!(legs.end(0, 100, 0), 110);
    assert_eq!(legs.end(0, 0, 100), 115);
    assert_eq!(legs.end(9, 0, 100), 100);
}

/// A call of legs costs what both cores take; the first of both stands for both, without keys.
#[test]
fn a_call_of_legs_costs_until_the_cores_have_met() {
    let image = of_two_cores();
    let around = Around::new(&image.certificate, &image.elf, 0).expect("it is known");
    let own = frame(&[40]);
    let of = |number, keys, behind| {
        let calls = [call(HANDLER, FIRST, number, keys)];
        let costs = costs(&around, &own, behind, &calls);
        costs
            .ok()
            .map(|costs| costs[0].as_ref().map(|cost| cost.cycles))
    };
    assert_eq!(of(2, 0, 4), Some(Some(389)));
    assert_eq!(
        [of(2, 1, 4), of(3, 0, 4), of(2, 0, 2), of(0, 0, 4)],
        [None; 4]
    );
}

/// Cores meet as often as both have legs, wait at each meeting, and begin where that is bounded.
#[test]
fn legs_that_do_not_belong_together_are_refused() {
    let why = |change: &dyn Fn(&mut Frame)| {
        let mut own = frame(&[40]);
        change(&mut own);
        met(&own).err().unwrap_or_default()
    };
    let helper = |own: &mut Frame| own.helper.take().expect("a helper");
    assert_eq!(why(&|_| ()), "");
    let nobody = why(&|own| drop(helper(own)));
    assert_eq!(nobody, "legs lead to no other core");
    let twice = "a core has its legs twice";
    assert_eq!(why(&|own| drop(own.functions.pop())), twice);
    let third = |own: &mut Frame| own.functions.push(own.functions[3].clone());
    assert_eq!(why(&third), twice);
    let meet = "the cores do not meet as often";
    let visits = |own: &mut Frame, count| {
        own.helper.as_mut().expect("a helper").visits = vec![2; count];
    };
    assert_eq!(why(&|own| visits(own, 1)), meet);
    assert_eq!(why(&|own| visits(own, 3)), meet);
    let shorter = |own: &mut Frame| {
        for legs in &mut own.functions[2..] {
            legs.pieces.truncate(1);
        }
    };
    assert_eq!(why(&shorter), meet);
    // Two legs are the fewest: what starts core 1, and what hears of it.
    let few = |count: usize| {
        why(&move |own: &mut Frame| {
            for legs in &mut own.functions[2..] {
                legs.pieces.truncate(count);
            }
            let helper = own.helper.as_mut().expect("a helper");
            for legs in &mut helper.functions {
                legs.pieces.truncate(count + 1);
            }
            helper.visits.truncate(count);
        })
    };
    assert_eq!([few(2), few(1)], ["", meet]);
    let longer = |own: &mut Frame| {
        let mut more = frame(&[1, 2, 40]);
        own.helper = Some(helper(&mut more));
    };
    assert_eq!(why(&longer), meet);
    let fewer = |own: &mut Frame| {
        let functions = &mut own.helper.as_mut().expect("a helper").functions;
        functions
            .iter_mut()
            .for_each(|legs| drop(legs.pieces.pop()));
        visits(own, 1);
    };
    assert_eq!(why(&fewer), meet);
    // Core 0's first leg waits for nothing, nor does core 1's way back; all others do.
    let idle = |core: u32, leg: usize| {
        why(&move |own: &mut Frame| {
            for legs in own.functions_on(core).iter_mut() {
                if legs.kind == Kind::Legs {
                    legs.pieces[leg].rounds.clear();
                }
            }
        })
    };
    let waits = "`legs` does not wait";
    assert_eq!([idle(0, 0), idle(HELPER, 2)], ["", ""]);
    for (core, leg) in [(0, 1), (0, 2), (HELPER, 0), (HELPER, 1)] {
        assert_eq!(idle(core, leg), waits, "{core} {leg}");
    }
    for (nth, rounds) in [(2, 2), (3, 2), (3, 1), (2, ROUNDS)] {
        let other = move |own: &mut Frame| own.functions[nth].loops[0].1 = rounds;
        assert_eq!(why(&other), waits);
    }
    let entries = |own: &mut Frame| own.functions[3].pieces[1].entry += 2;
    assert_eq!(why(&entries), waits);
    let nowhere = |at: u32| format!("{at:#010x} is not bounded until the cores meet");
    assert_eq!(
        why(&|own| own.functions[0].kind = Kind::Plain),
        nowhere(FIRST)
    );
    assert_eq!(
        why(&|own| own.functions[0].pieces[0].entry += 2),
        nowhere(FIRST)
    );
    // Core 1 outlasts the tick that begins where the legs do, and not elsewhere.
    let other = |place| {
        let mut own = frame(&[300, 40]);
        own.functions[1].until = place;
        met(&own).err().unwrap_or_default()
    };
    assert_eq!(other(Some((FIRST, 0))), "");
    assert_eq!(other(Some((FIRST, 1))), nowhere(TICK));
    assert_eq!(other(Some((FIRST + 2, 0))), nowhere(TICK));
}
