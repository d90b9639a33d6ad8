//! The self-test: on the emulated boards nothing differs, and what differs is told.

use whippen_compiler::modes::specialize;
use whippen_emulator::BoardKind;
use whippen_isa::Class;
use whippen_isa::timing::{Core, Line, programs, rules};
use whippen_runtime::board;
use whippen_runtime::image::ImageInstrument;
use whippen_runtime::self_test::{SelfTestOutcome, run_self_test, self_test_image, timing_of};

use crate::rig::{kernel, midi};

/// The self-test of a board with a key of the organ, as that table expects it.
fn outcome(kind: BoardKind, timing: &Core) -> SelfTestOutcome {
    let board = board::bundled(kind.name()).expect("bundled");
    let kernel = kernel("hammond.whip");
    let instrument = ImageInstrument {
        midi: midi(&kernel),
        modes: specialize(&kernel, 64),
        places: Vec::new(),
        parts: None,
    };
    let image = self_test_image(&board, timing, "hammond", &instrument);
    let image = image.unwrap_or_else(|why| panic!("{}: {why}", kind.name()));
    run_self_test(&image, kind).unwrap_or_else(|why| panic!("{}: {why}", kind.name()))
}

/// The table of a board's core.
fn table(kind: BoardKind) -> Core {
    timing_of(&board::bundled(kind.name()).expect("bundled"))
}

#[test]
fn nothing_differs_on_emulated_boards() {
    for kind in BoardKind::ALL {
        let outcome = outcome(kind, &table(kind));
        assert_eq!(outcome.differ, 0, "{}", outcome.text);
        let programs = programs(rules(kind.board().core.arch()), &table(kind)).expect("rules");
        let asked = (programs.iter()).filter(|program| program.apart.is_none());
        let titles = asked.clone().filter(|p| outcome.text.contains(&p.title));
        assert_eq!(titles.count(), asked.count(), "{}", outcome.text);
        let end = "0 of 1024 ticks of hammond differ";
        assert!(outcome.text.contains(end), "{}", outcome.text);
        let [least, most] = [outcome.ticks.iter().min(), outcome.ticks.iter().max()];
        assert!(least < most, "ticks of several ways");
    }
}

/// What differs is told by name, with how much and with the rule it was made of.
#[test]
fn a_wrong_entry_of_the_table_is_told() {
    let line_of = |text: &str, title: &str| {
        let line = text.lines().find(|line| line.contains(title));
        line.unwrap_or_else(|| panic!("{title}: {text}"))
            .trim()
            .to_string()
    };
    let mut wrong = Core::cortex_m33();
    wrong.divide.start.cycles += 3;
    let text = outcome(BoardKind::Rp2350, &wrong).text;
    assert_eq!(
        line_of(&text, "a division with five bits of quotient"),
        "8      5 rule     a division with five bits of quotient DIFFERS: less by      3  (3.7.4.9.4: 4 + 1)"
    );
    assert!(
        text.contains("\r\n      5 of 139 programs differ"),
        "{text}"
    );
    let mut wrong = Core::cortex_m4();
    wrong.branches.taken.cycles -= 1;
    let text = outcome(BoardKind::Stm32f4, &wrong).text;
    assert_eq!(
        line_of(&text, "a call"),
        "2      3 rule     a call DIFFERS: more by      1  (3.3.1: 2 + 1)"
    );
    let lines: Vec<Line> = (Core::cortex_m0plus().lines.iter())
        .map(|line| match line.classes.contains(&Class::LoadMultiple) {
            true => Line { each: 2, ..*line },
            false => *line,
        })
        .collect();
    let wrong = Core {
        lines: Box::leak(lines.into()),
        ..Core::cortex_m0plus()
    };
    let text = outcome(BoardKind::Rp2040, &wrong).text;
    assert!(
        line_of(&text, " lists").contains("DIFFERS: less by      "),
        "{text}"
    );
}
