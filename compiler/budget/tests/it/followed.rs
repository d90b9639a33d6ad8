//! Where ways lead: to the targets that come with a branch, into functions and out of them.

use std::collections::BTreeMap;

use whippen_budget::{Annotations, Bound, Code, NotBounded};
use whippen_isa::Arch;
use whippen_words::assembled;

use super::{CODE, bound_of, machine, observed, returning};

fn asked(texts: &[&str], annotations: &Annotations) -> Result<Bound, NotBounded> {
    let code = Code::new(CODE, assembled(texts, Arch::V8M));
    bound_of(&code, CODE, annotations)
}

fn cycles(texts: &[&str], annotations: &Annotations) -> u64 {
    asked(texts, annotations).expect("a bound").cycles_max
}

/// The branch at the beginning goes to these, by distance from there and with their lowest bit set.
fn going(to: &[u32]) -> Annotations {
    let to = to.iter().map(|to| (CODE + to) | 1).collect();
    Annotations {
        targets: [(CODE, to)].into(),
        ..returning()
    }
}

/// To a return and to a division, which takes longer; whatever the branch is called.
#[test]
fn a_branch_goes_to_each_of_its_targets() {
    for branch in ["bx r0", "bx lr", "mov pc, r0"] {
        let texts = [branch, "bx lr", "udiv r1, r2, r3", "bx lr"];
        let of = |to: &[u32]| cycles(&texts, &going(to));
        let (short, long) = (of(&[2]), of(&[4]));
        assert!(long > short + 5, "{branch}: {short} and {long}");
        assert_eq!([of(&[2, 4]), of(&[4, 2])], [long; 2], "{branch}");
    }
    let untold = asked(&["bx r0", "bx lr"], &returning());
    assert!(matches!(untold, Err(NotBounded::NoTargets { .. })));
}

/// Targets at which ways end are one only if they cost the same: 32-bit instructions across two
/// words take longer, and what is behind one counts where the way does not end there.
#[test]
fn ends_of_a_branch_are_told_apart() {
    let texts = [
        "bx r0",
        "bx lr",
        "mov.w r1, #1",
        "movs r1, #1",
        "mov.w r1, #1",
        "bx lr",
    ];
    let of = |to: &[u32], stops: &[u32]| {
        let stops = stops.iter().map(|at| CODE + at).collect();
        cycles(&texts, &Annotations { stops, ..going(to) })
    };
    let (word, split, narrow) = (4, 10, 8);
    let all = [word, split, narrow];
    assert!(of(&[split], &all) > of(&[word], &all));
    assert_eq!(of(&[narrow], &all), of(&[word], &all));
    for to in [
        [word, split],
        [split, word],
        [narrow, split],
        [split, narrow],
    ] {
        assert_eq!(of(&to, &all), of(&[split], &all), "{to:?}");
    }
    for to in [[word, narrow], [narrow, word]] {
        for stop in to {
            let longest = to.map(|to| of(&[to], &[stop])).into_iter().max();
            assert_eq!(Some(of(&to, &[stop])), longest, "{to:?}, {stop}");
        }
    }
}

/// A function that is called twice, and another one, by names and by a register.
#[test]
fn a_call_comes_back_behind_itself() {
    let texts = [
        "push {r4, lr}",
        "bl .+16",
        "bl .+12",
        "blx r3",
        "nop.w",
        "pop {r4, pc}",
        // At 18, and at 24.
        "udiv r0, r1, r2",
        "bx lr",
        "adds r0, #1",
        "bx lr",
    ];
    let mut annotations = returning();
    annotations.targets.insert(CODE + 10, vec![(CODE + 24) | 1]);
    let bytes = assembled(&texts, Arch::V8M);
    let mut machine = machine(&bytes);
    let registers = BTreeMap::from([(1, u32::MAX), (2, 1), (3, (CODE + 24) | 1)]);
    let slowest = observed(&mut machine, CODE, &registers);
    let bound = asked(&texts, &annotations).expect("a bound");
    assert_eq!(bound.cycles_max, slowest);
    let times = |at: u32| {
        let at_it = bound.path.iter().filter(|step| step.address == CODE + at);
        at_it.count()
    };
    assert_eq!([18, 24].map(times), [2, 1]);
}

/// As many functions, each of which calls the next one.
#[test]
fn calls_inside_calls_are_followed_so_far() {
    let of = |calls: usize| {
        let mut texts = ["push {r4, lr}", "bl .+6", "pop {r4, pc}"].repeat(calls);
        texts.push("bx lr");
        asked(&texts, &returning())
    };
    let [few, more] = [of(62), of(63)].map(|bound| bound.expect("a bound").cycles_max);
    assert!(more > few);
    assert_eq!(of(64).map(|bound| bound.cycles_max), Ok(2 * more - few));
    let refused = of(65).expect_err("too deep");
    assert!(matches!(refused, NotBounded::Recursive { .. }), "{refused}");
}

/// The entry is the head of a loop that comes back to it from above without a branch.
#[test]
fn an_entry_may_be_come_to_again() {
    let texts = ["adds r1, #1", "subs r0, #1", "bne .-4", "bx lr"];
    let bytes = assembled(&texts, Arch::V8M);
    let entry = CODE + 2;
    let mut machine = machine(&bytes);
    for rounds in [1, 2, 5] {
        let mut annotations = returning();
        annotations.loops.insert(entry, rounds);
        let code = Code::new(CODE, bytes.clone());
        let bound = bound_of(&code, entry, &annotations).expect("a bound");
        let slowest = observed(&mut machine, entry, &BTreeMap::from([(0, rounds)]));
        assert_eq!(bound.cycles_max, slowest);
    }
}

/// What sleeps has a bound only where how long it does is not asked, and other ways to stop never.
#[test]
fn what_waits_is_told() {
    let sleeping = Annotations {
        sleeps: true,
        ..returning()
    };
    for wait in ["wfi", "wfe"] {
        assert!(matches!(
            asked(&[wait, "bx lr"], &returning()),
            Err(NotBounded::Waits { address: CODE, .. })
        ));
        assert_eq!(
            cycles(&[wait, "bx lr"], &sleeping),
            cycles(&["adds r0, #1", "bx lr"], &sleeping)
        );
    }
    for text in ["svc #0", "bkpt #0", "udf #0"] {
        let refused = asked(&[text, "bx lr"], &sleeping);
        assert!(matches!(refused, Err(NotBounded::Waits { .. })), "{text}");
    }
}

/// Only what a branch, a condition or a division asks for is kept, however far before it: through
/// copies and sums, and flags that are read by what is under a condition.
#[test]
fn what_decides_is_kept_as_far_back_as_it_is_made() {
    let goes_on = |before: &[&str], decides: &[&str]| {
        let [first, then] = [before, decides].map(|texts| assembled(texts, Arch::V8M).len());
        let texts = [before, decides, &["mov.w r7, #1"; 4], &["bx lr"]].concat();
        let bound = asked(&texts, &returning()).expect("a bound");
        let behind = (first + then) as u32;
        let mut path = bound.path.iter();
        path.any(|step| step.address == CODE + behind)
    };
    // R0 is 1, by one instruction or several.
    let made: [&[&str]; 6] = [
        &["movs r0, #1"],
        &["movs r1, #1", "mov r0, r1"],
        &["movs r1, #3", "movs r2, #2", "subs r0, r1, r2"],
        &["movs r1, #1", "b .+2", "mov r0, r1"],
        &["movs r0, #1", "cmp r3, #0", "it ne", "movne r7, #1"],
        &["movs r0, #1", "cmp r3, #0", "it ne", "movne r0, #1"],
    ];
    for before in made {
        assert!(!goes_on(before, &["cmp r0, #1", "beq .+18"]), "{before:?}");
        assert!(goes_on(before, &["cmp r0, #2", "beq .+18"]), "{before:?}");
        assert!(!goes_on(before, &["cbnz r0, .+18"]), "{before:?}");
        assert!(goes_on(before, &["cbz r0, .+18"]), "{before:?}");
    }
    let may: [&[&str]; 2] = [
        &["movs r0, #1", "cmp r3, #0", "it ne", "movne r0, #2"],
        &["movs r0, #1", "cmp r3, #0", "it ne", "ldrne r0, [r1]"],
    ];
    for before in may {
        assert!(goes_on(before, &["cmp r0, #1", "beq .+18"]), "{before:?}");
    }
}
