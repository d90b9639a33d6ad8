//! Names in a program and what they stand for.

use super::*;
use crate::syntax::parse;

/// What the name before `^` in the text stands for: kind and name, and the text of its declaration.
#[track_caller]
fn meant(text: &str) -> Option<(NameKind, String)> {
    let at = text.find('^').expect("a mark");
    let (mut map, text) = (SourceMap::default(), text.replace('^', ""));
    let file = map.add("test.whip", text.as_str());
    let mut files = vec![parse(file, &text, &mut Vec::new())];
    for (name, text) in crate::bundled::STD {
        let file = map.add(*name, *text);
        files.push(parse(file, text, &mut Vec::new()));
    }
    let index = Index::new(&map, &files);
    for occurrence in &index.occurrences {
        assert_eq!(
            map.text(occurrence.span),
            index.definitions[occurrence.definition].name
        );
    }
    index.at(file, at as u32).map(|o| {
        (
            index.definitions[o.definition].kind,
            map.text(index.definitions[o.definition].whole).to_string(),
        )
    })
}

const PROGRAM: &str = "instrument a { sense x: length in 0 m .. 1 m param k = 2 N/m let j = escapement(x, start: 1 mm) \
    state s: force in 0 N .. 1 N pulse p: force in 0 N .. 1 N lasting 1 ms states m { up -> down when on { s := k * (x) } } \
    body b { angle phi in 0 .. 1, rate in 0 Hz .. 1 Hz } hold b when m is down event e when on { fire p at j.resistance } \
    next s = s force k = k * x force l on x = k * x } keyboard q { programs a, z a.k = { A0: 1 N/m } zones z = { A0 .. C8: a } }";

#[test]
fn names_are_found_where_rule_nine_says() {
    let cases = [
        ("k * (x^)", NameKind::Sense, "sense x: length in 0 m .. 1 m"),
        ("s :=^", NameKind::State, ""),
        ("{ s^ :=", NameKind::State, "state s: force in 0 N .. 1 N"),
        ("escapement^(", NameKind::Term, ""),
        ("start^:", NameKind::Parameter, "start: length"),
        ("j.resistance^", NameKind::Result, "resistance: force"),
        (
            "fire p^",
            NameKind::Pulse,
            "pulse p: force in 0 N .. 1 N lasting 1 ms",
        ),
        (
            "m is down^",
            NameKind::MachineState,
            "up -> down when on { s := k * (x) }",
        ),
        ("when m^ is", NameKind::Machine, ""),
        ("hold b^", NameKind::Body, ""),
        ("next s^", NameKind::State, ""),
        ("force k^ =", NameKind::Force, "force k = k * x"),
        ("on x^ =", NameKind::Sense, ""),
        ("= k^ * x }", NameKind::Param, "param k = 2 N/m"),
        ("programs a^", NameKind::Instrument, ""),
        ("a.k^ =", NameKind::Param, ""),
        (
            "programs a, z^",
            NameKind::Zones,
            "zones z = { A0 .. C8: a }",
        ),
        ("zones z^", NameKind::Zones, "zones z = { A0 .. C8: a }"),
        ("C8: a^", NameKind::Instrument, ""),
    ];
    for (place, kind, whole) in cases {
        let plain = place.replace('^', "");
        assert_eq!(PROGRAM.matches(&plain).count(), 1, "{place}");
        let text = PROGRAM.replace(&plain, place);
        match meant(&text) {
            Some((found, text)) => assert!(
                found == kind && text.contains(whole),
                "{place}: {found:?} {text}"
            ),
            None => assert_eq!(place, "s :=^"),
        }
    }
}

#[test]
fn what_is_not_declared_means_nothing() {
    assert_eq!(meant("instrument a { let b = c^ }"), None);
    assert_eq!(meant("instrument a { let b = nothing(d^: 1) }"), None);
    assert_eq!(
        meant("instrument a { let b = if m is s^ then 1 else 2 }"),
        None
    );
    assert_eq!(meant("instrument a { let b = (b).c^ force = }"), None);
}
