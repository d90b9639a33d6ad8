//! Every message of the checker, as it is shown.

use super::super::Options;
use super::cases::{Case, KEYBOARDS, MOTION, NAMES, RANGES, SLIPS, STRINGS, TYPES};
use super::check_text;
use crate::diag::Code;
use crate::diag::render;

/// The messages about a program, and their codes.
fn messages(text: &str, options: &Options) -> (String, Vec<&'static str>) {
    let (map, program, diagnostics) = check_text(text, options);
    let codes: Vec<&str> = diagnostics.iter().map(|d| d.code.number()).collect();
    let error = diagnostics
        .iter()
        .any(|d| d.severity() == crate::diag::Severity::Error);
    assert_eq!(program.is_none(), error, "{codes:?}");
    assert!(
        diagnostics
            .iter()
            .all(|d| !d.hints.is_empty() && !d.label.is_empty()),
        "{diagnostics:?}"
    );
    (
        diagnostics.iter().map(|d| render(&map, d, false)).collect(),
        codes,
    )
}

fn program(case: &Case) -> String {
    let whole = ["instrument ", "term ", "keyboard "]
        .iter()
        .any(|word| case.text.starts_with(word));
    let body = format!(
        "instrument test {{\n    sense x: length in 0 mm .. 10 mm\n    {}\n}}\n",
        case.text
    );
    if whole { case.text.to_string() } else { body }
}

/// All messages about some programs, each under its name.
fn shown(cases: &[Case]) -> String {
    let mut text = String::new();
    let mut wrong = Vec::new();
    for case in cases {
        let (messages, codes) = messages(&program(case), &Options::default());
        if codes != case.codes {
            wrong.push(format!(
                "{}: {codes:?} for {:?}\n{messages}",
                case.name, case.codes
            ));
        }
        text += &format!("# {}\n\n{messages}\n", case.name);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    text
}

#[test]
fn names() {
    insta::assert_snapshot!(shown(NAMES));
}

#[test]
fn types() {
    insta::assert_snapshot!(shown(TYPES));
}

#[test]
fn motion() {
    insta::assert_snapshot!(shown(MOTION));
}

#[test]
fn ranges() {
    insta::assert_snapshot!(shown(RANGES));
}

#[test]
fn keyboards() {
    insta::assert_snapshot!(shown(KEYBOARDS));
}

#[test]
fn settings() {
    let text =
        "instrument piano { sense x: length in 0 mm .. 10 mm param k = 1 N/m in 0 N/m .. 2 N/m
    live param pedal = off force f = if pedal then k * x else 0 N }";
    let sets = [
        ("k", "3 N/m", "WH0507"),
        ("k", "1", "WH0303"),
        ("k", "1 N", "WH0302"),
        ("k", "on", "WH0302"),
        ("k", "much", "WH0609"),
        ("k", "1 N/mmm", "WH0609"),
        ("pedal", "1", "WH0302"),
        ("kk", "1 N/m", "WH0221"),
        ("organ.k", "1 N/m", "WH0220"),
        ("piano.pedall", "on", "WH0221"),
    ];
    let mut all = String::new();
    for (name, value, code) in sets {
        let options = Options {
            sets: vec![(name.into(), value.into())],
            ..Options::default()
        };
        let (shown, codes) = messages(text, &options);
        assert_eq!(codes, [code], "{name}={value}\n{shown}");
        all += &format!("# --set {name}={value}\n\n{shown}\n");
    }
    insta::assert_snapshot!(all);
}

#[test]
fn too_many_calls_and_too_long_chains() {
    let doubled: Vec<String> = (0..13)
        .map(|n| {
            format!(
                "term t{n}(a: length) -> b: length {{ b = t{0}(a) + t{0}(a) }}\n",
                n + 1
            )
        })
        .collect();
    let text = format!(
        "{}term t13(a: length) -> b: length {{ b = a }}",
        doubled.concat()
    );
    let (_, codes) = messages(&text, &Options::default());
    assert!(codes.contains(&"WH0217"), "{codes:?}");

    let lets: Vec<String> = (0..3000)
        .map(|n| format!("let a{n} = a{} + 1 mm\n", n + 1))
        .collect();
    let text = format!(
        "instrument i {{ sense x: length in 0 mm .. 1 mm {} let a3000 = x }}",
        lets.concat()
    );
    let (_, codes) = messages(&text, &Options::default());
    assert!(
        codes.contains(&"WH0218") && codes.iter().all(|c| *c == "WH0218"),
        "{codes:?}"
    );
}

#[test]
fn every_code_of_the_checker_has_a_case() {
    let cases = [NAMES, TYPES, MOTION, RANGES, KEYBOARDS, SLIPS, STRINGS].concat();
    let all: Vec<&str> = cases.iter().flat_map(|case| case.codes).copied().collect();
    let elsewhere = [
        "WH0217", "WH0218", "WH0609", "WH0310", "WH0413", "WH0414", "WH0415", "WH0511", "WH0611",
    ];
    let numbers = Code::ALL.iter().map(|code| code.number());
    let checker = numbers.filter(|n| {
        ("WH0201".."WH0700").contains(n)
            && ![
                "WH0501", "WH0502", "WH0504", "WH0512", "WH0513", "WH0514", "WH0515", "WH0619",
                "WH0621",
            ]
            .contains(n)
    });
    let missing: Vec<&str> = checker
        .filter(|n| !all.contains(n) && !elsewhere.contains(n))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn what_could_not_be_read_has_no_consequences() {
    let text = "instrument i { sense x: length in 0 mm .. 1 mm let a = 3 mmm * let b = a + c\n force f = 1 N + 2 }";
    let (_, _, diagnostics) = check_text(text, &Options::default());
    let codes: Vec<&str> = diagnostics.iter().map(|d| d.code.number()).collect();
    assert!(
        codes
            .iter()
            .all(|c| c.starts_with("WH01") || *c == "WH0303"),
        "{codes:?}"
    );
    assert!(codes.contains(&"WH0303"), "{codes:?}");
}

#[test]
fn one_mistake_in_a_term_is_told_once() {
    let text = "term t(a: length) -> b: length { b = a + 1 N }
        instrument i { sense x: length in 0 mm .. 1 mm let b = t(x) let c = t(2 * x) force f = (b + c) * 1 N/m }
        instrument j { sense x: length in 0 mm .. 1 mm let b = t(x) force f = b * 1 N/m }";
    let (shown, codes) = messages(text, &Options::default());
    assert_eq!(codes, ["WH0301"]);
    assert!(!shown.contains("in this call"), "{shown}");
}

#[test]
fn slips() {
    insta::assert_snapshot!(shown(SLIPS));
}

#[test]
fn strings() {
    insta::assert_snapshot!(shown(STRINGS));
}
