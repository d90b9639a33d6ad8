//! Texts spoilt by chance. The generator is seeded: a failing case comes back.

use super::random::Dice;
use super::spans::{Places, without};
use super::*;
use crate::bundled::programs;
use crate::diag::render;
use crate::syntax::pretty::print;
use crate::syntax::token::{HARD_KEYWORDS, SIGNS, SOFT_KEYWORDS};
use whippen_source::{SourceMap, Span};

/// A piece of a bundled program with some mistakes made in it.
fn spoilt(dice: &mut Dice) -> String {
    let all: Vec<_> = programs().collect();
    let program = dice.pick(&all).1;
    let from = dice.below(program.len());
    let to = (from + dice.below(700)).min(program.len());
    let mut bytes = if dice.below(8) == 0 {
        program.as_bytes().to_vec()
    } else {
        program.as_bytes()[from..to].to_vec()
    };
    if dice.below(2) == 0 {
        bytes.splice(0..0, b"instrument i {".iter().copied());
    }
    for _ in 0..dice.below(6) {
        let at = dice.below(bytes.len() + 1);
        let end = (at + dice.below(12)).min(bytes.len());
        let inserted: Vec<u8> = match dice.below(7) {
            0 | 1 => Vec::new(),
            2 => dice.pick(HARD_KEYWORDS).into(),
            3 => dice.pick(SIGNS).into(),
            4 => dice
                .pick(&[
                    "{", "}", "}}", "((", " 2 ", " 2 mm", "x", "\n", "µ²", "漢", "==", "1.2.3",
                    "'", "/*", "é",
                ])
                .into(),
            5 => dice.pick(SOFT_KEYWORDS).into(),
            _ => vec![dice.below(128) as u8; 1 + dice.below(80)],
        };
        let end = if dice.below(2) == 0 { at } else { end };
        bytes.splice(at..end, inserted);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn no_text_is_too_bad() {
    let mut dice = Dice(0xbad);
    let (mut faulty, mut faultless) = (0, 0);
    for case in 0..20_000 {
        let text = spoilt(&mut dice);
        let (mut file, diagnostics) = read(&text);
        let mut inside = |span: &mut Span| {
            let range = span.start as usize..span.end as usize;
            assert!(
                span.file == 0 && text.get(range).is_some(),
                "case {case}: {span:?}\n{text}"
            );
        };
        file.each(&mut inside);
        for diagnostic in &diagnostics {
            inside(&mut diagnostic.span.clone());
            diagnostic
                .others
                .iter()
                .for_each(|label| inside(&mut label.span.clone()));
        }
        if diagnostics.is_empty() {
            faultless += 1;
            assert_eq!(
                without(tree(&print(&file))),
                without(file),
                "case {case}\n{text}"
            );
            continue;
        }
        faulty += 1;
        if case % 16 == 0 {
            let mut map = SourceMap::default();
            map.add("spoilt", text);
            assert!(
                diagnostics
                    .iter()
                    .all(|d| render(&map, d, case % 32 == 0).contains(d.code.number()))
            );
        }
    }
    assert!(
        faulty > 10_000 && faultless > 100,
        "{faulty} faulty and {faultless} faultless texts"
    );
}
