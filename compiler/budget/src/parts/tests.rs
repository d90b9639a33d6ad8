//! When cores meet, with cycles made up and summed on paper.

use super::*;
use crate::memory::Others;
use crate::tick_handler::tests::asked;
use whippen_isa::timing::Evidence;

/// A bound of so many cycles.
pub(crate) fn of_cycles(cycles: u64) -> Bound {
    Bound {
        cycles_max: cycles,
        path: Vec::new(),
        class: Evidence::Exact,
        settled: true,
        delays_nobody: true,
        stack_bytes_max: 0,
        stack_left: 0,
        infeasible: 0,
        merged: false,
        code_bytes: 0,
    }
}

/// With the number there, with waiting, and what visits take besides.
fn leg([at_once, late, visits_cycles]: [u64; 3]) -> Leg {
    Leg {
        at_once: of_cycles(at_once),
        late: of_cycles(late),
        visits_cycles,
    }
}

/// Core 0 starts core 1 after ten cycles.
fn helped(core0: &[[u64; 3]], core1: &[[u64; 3]]) -> Helped {
    Helped {
        start: of_cycles(10),
        core0: core0.iter().copied().map(leg).collect(),
        core1: core1.iter().copied().map(leg).collect(),
        before: None,
    }
}

/// Core 1 is late: core 0 looks from 8 on, and goes on when core 1 has written at 35. Or core 0 is:
/// it looks at 60 and finds what core 1 has written.
#[test]
fn members_end_with_the_core_that_is_late() {
    let late = helped(&[[5, 8, 0], [7, 9, 0]], &[[20, 23, 2]]);
    assert_eq!(late.members_cycles_max(), [8, 10 + 23 + 2]);
    assert_eq!(late.cycles_max(), 35 + 9);
    assert_eq!(late.early_cycles_max(), None);
    assert_eq!(late.sound_cycles_max(), None);
    let soon = helped(&[[60, 58, 0], [7, 9, 0]], &[[20, 23, 2]]);
    assert_eq!(soon.members_cycles_max(), [60, 35]);
    assert_eq!(soon.cycles_max(), 60 + 7);
}

/// They meet twice, and core 1 goes on with what is heard: from its own members' end or from core
/// 0's, whichever is later, but for what it takes to have waited.
#[test]
fn legs_begin_where_both_have_met() {
    let core0 = [[5, 8, 0], [40, 42, 0], [7, 9, 0]];
    let core1 = [[20, 23, 2], [30, 33, 3], [100, 104, 6]];
    let mut both = helped(&core0, &core1);
    assert_eq!(both.early_cycles_max(), Some([8, 35]));
    // Core 0 looks at 8, core 1 wrote at 35; core 1 looks at 35, core 0 wrote at 8.
    let ends = [35 + 42, 35 + 30 + 3];
    assert_eq!(both.members_cycles_max(), ends);
    assert_eq!(both.cycles_max(), ends[0] + 9 - 2);
    assert_eq!(both.sound_cycles_max(), Some(ends[0] + 104 + 6));
    assert_eq!(both.handler_cycles_max(), Some(ends[0] + 104 + 6));
    both.before = Some([of_cycles(1000), of_cycles(200)]);
    assert_eq!(both.handler_cycles_max(), Some(1200 + ends[0] + 104 + 6));
    // Its own members end last.
    both.core1[1] = leg([90, 93, 3]);
    assert_eq!(both.members_cycles_max(), [77, 35 + 90 + 3]);
    assert_eq!(both.sound_cycles_max(), Some(128 + 100 + 6));
}

/// What a frame takes longer for core 1, of which 50 cycles are around and 300 go by anyhow.
#[test]
fn a_frame_lasts_as_long_as_the_core_that_is_done_last() {
    let core0 = [[5, 8, 0], [7, 9, 0]];
    let outlasts = |sound: u64, rest: u64| {
        let cut = CutBound {
            parts: Vec::new(),
            helped: Some(helped(&core0, &[[20, 23, 2], [sound, sound, 0]])),
        };
        cut.outlasts(50, rest).map(|(_, cycles)| cycles)
    };
    // Core 1 is done with its members at 35.
    assert_eq!(outlasts(400, 300), Some(50 + 35 + 400 - 300));
    assert_eq!(outlasts(216, 300), Some(1));
    assert_eq!([outlasts(215, 300), outlasts(100, 300)], [None; 2]);
    let alone = CutBound {
        parts: Vec::new(),
        helped: None,
    };
    assert_eq!(alone.outlasts(50, 0), None);
}

/// What lies on the stack of core 0 where the cores meet lies there until the end.
#[test]
fn legs_are_on_the_stack_of_those_before() {
    let mut both = helped(&[[5, 8, 0], [40, 42, 0], [7, 9, 0]], &[[20, 23, 2]]);
    let stacks = [(24, -16), (20, -16), (8, 0)];
    for (leg, (bytes, left)) in both.core0.iter_mut().zip(stacks) {
        leg.late.stack_bytes_max = bytes;
        leg.late.stack_left = left;
    }
    assert_eq!(both.stack_bytes_max(), 16 + 20);
    both.core0[0].late.stack_bytes_max = 40;
    assert_eq!(both.stack_bytes_max(), 40);
}

/// As sure as the least sure of all.
#[test]
fn parts_are_as_sure_as_the_least_sure() {
    let sure = || helped(&[[5, 8, 0], [7, 9, 0]], &[[20, 23, 2]]);
    let class = |helped| {
        let parts = Vec::new();
        CutBound { parts, helped }.class()
    };
    assert_eq!([class(None), class(Some(sure()))], [Evidence::Exact; 2]);
    let changes: [fn(&mut Helped); 5] = [
        |own| own.start.class = Evidence::Rule,
        |own| own.core0[1].at_once.class = Evidence::Rule,
        |own| own.core0[0].late.class = Evidence::Rule,
        |own| own.core1[0].at_once.class = Evidence::Rule,
        |own| {
            own.before = Some([of_cycles(0), of_cycles(0)]);
            own.before
                .iter_mut()
                .for_each(|own| own[1].class = Evidence::Rule);
        },
    ];
    for change in changes {
        let mut helped = sure();
        change(&mut helped);
        assert_eq!(class(Some(helped)), Evidence::Rule);
    }
}

/// A part of core 1 runs with that one's words, whoever asks.
#[test]
fn a_part_runs_with_what_its_core_has() {
    for core in [0, 1] {
        let of = |asked: &OnCore| (asked.on(core).number, asked.on(core).running.words);
        assert_eq!(asked(Others::default(), of), (core, RUNNING[core].words));
    }
}
