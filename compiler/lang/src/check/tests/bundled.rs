//! The programs of the manual: they check, and this is what they become.

use super::super::{Options, Program};
use super::check_text;
use crate::bundled::{INSTRUMENTS, KEYBOARDS};
use crate::front::compile_front;
use crate::model::Model;
use whippen_source::SourceMap;

/// All of them as one program. Notes are allowed, but only about jumps between modes.
fn program() -> Program {
    let mut map = SourceMap::default();
    for (name, text) in INSTRUMENTS.iter().chain(&KEYBOARDS[..1]) {
        map.add(*name, *text);
    }
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    assert!(
        diagnostics.iter().all(|d| d.code.number() == "WH0404"),
        "{diagnostics:?}"
    );
    program.expect("no errors")
}

fn model(name: &str) -> Model {
    program()
        .instruments
        .into_iter()
        .find(|m| m.name == name)
        .expect("is bundled")
}

#[test]
fn grand_piano() {
    insta::assert_snapshot!(model("grand_piano"));
}

#[test]
fn harpsichord() {
    insta::assert_snapshot!(model("harpsichord"));
}

#[test]
fn hammond() {
    insta::assert_snapshot!(model("hammond"));
}

#[test]
fn mikey() {
    let program = program();
    let board = &program.keyboards[0];
    assert_eq!(
        (board.board.as_deref(), &board.device, board.rate_hz),
        (
            Some("rp2350"),
            &crate::check::DeviceName::Bundled("mikey".to_string()),
            44_100.into()
        )
    );
    let layout = &board.layout;
    assert_eq!(
        (layout.first_note, layout.last_note(), layout.keys),
        (36, 84, 49)
    );
    let names: Vec<&str> = layout.programs.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["grand_piano", "harpsichord", "hammond"]);
}

#[test]
fn every_value_of_the_bundled_programs_is_bounded() {
    for model in program().instruments {
        let ranges = crate::range::analyze(&model);
        assert!(ranges.is_ok(), "{}: {:?}", model.name, ranges.err());
    }
}

#[test]
fn the_library_alone_is_no_program_and_no_error() {
    let (_, program, diagnostics) = check_text("", &Options::default());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert!(program.is_some_and(|p| p.instruments.is_empty() && p.keyboards.is_empty()));
}

/// The programs in the manual's text are one program, and it has no mistakes.
#[test]
fn every_program_of_the_manual_checks() {
    let manual = include_str!("../../../../../docs/language.md");
    let blocks = manual
        .split("```whip\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next());
    let texts: Vec<&str> = blocks
        .filter(|b| {
            ["instrument", "term", "keyboard"]
                .iter()
                .any(|k| b.contains(k))
        })
        .collect();
    assert!(texts.len() >= 9, "{texts:?}");
    let (_, program, diagnostics) = check_text(&texts.concat(), &Options::default());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert!(program.is_some_and(|p| p.instruments.len() >= 9 && p.keyboards.len() == 2));
}
