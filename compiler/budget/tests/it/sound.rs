//! What is heard of an instrument in parts, which core 1 does while core 0 runs the tail.

use whippen_board::AccessTime;
use whippen_budget::{Bounded, Extent, NotBounded};
use whippen_parts::Beside;

use super::image::{Played, members};

/// Of what is heard so many quotients.
fn played(quotients: usize) -> Played {
    let beside = Beside {
        sound: true,
        ..Beside::default()
    };
    let played = Played::in_parts(&members(false, quotients), beside);
    assert!(played.image.cut().expect("it is in parts").has_sound());
    played
}

/// Core 1 is done with it when core 0 is done with all the rest, or later.
#[test]
fn what_is_heard_has_a_bound_that_a_checker_comes_to() {
    for (quotients, outlasts) in [(1, false), (12, true)] {
        let played = played(quotients);
        let frame = &played.bounds[0][0].contended;
        let mut parts = frame.parts.iter();
        let told = parts.any(|(name, _)| name == "core 1, with what is heard");
        assert_eq!(told, outlasts, "{:?}", frame.parts);
        played.is_audited(0);
    }
}

/// Words that core 0 writes to the memory of core 1.
#[test]
fn visits_of_core_1_take_what_an_access_takes() {
    let visits = |bounds: &Bounded| -> u64 {
        let cut = bounds.contended.cut.as_ref().expect("it is in parts");
        let helped = cut.helped.as_ref().expect("core 1 has some");
        helped.core1.iter().map(|leg| leg.visits_cycles).sum()
    };
    let mut played = played(2);
    let fast = visits(&played.bounds[0][0]);
    assert!(fast > 0);
    for memory in &mut played.board.memory[1..] {
        memory.access = AccessTime::Cycles(3);
    }
    let slow = played.bounded().expect("a bound");
    assert_eq!(visits(&slow[0]), 3 * fast);
}

#[test]
fn core_1_has_a_stack_of_its_own() {
    let mut played = played(2);
    let end = played.board.stacks[1];
    played.program.sections.push(Extent {
        name: ".bss.below".into(),
        base: end - 4,
        size: 4,
    });
    let refused = played.bounded().map(|_| ());
    let Err(NotBounded::StackRoom {
        room: 0, end: of, ..
    }) = refused
    else {
        panic!("{refused:?}");
    };
    assert_eq!(of, end);
}
