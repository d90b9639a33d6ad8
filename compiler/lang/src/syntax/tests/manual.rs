//! The manual agrees with the compiler: its programs are read, its tables are those of the
//! compiler, and whatever its grammar generates is accepted.

use std::collections::BTreeSet;

use super::random::Dice;
use super::*;
use crate::syntax::layout;
use crate::syntax::token::{HARD_KEYWORDS, SIGNS, SOFT_KEYWORDS};
use crate::units::{dimension_names, unit_names};

const MANUAL: &str = include_str!("../../../../../docs/language.md");

/// The blocks of the manual in this language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    MANUAL
        .split(&fence)
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap())
        .collect()
}

/// What stands between the headings of a section.
fn section(title: &str) -> &'static str {
    let start = MANUAL
        .find(&format!("\n## {title}\n"))
        .unwrap_or_else(|| panic!("no section {title}"));
    MANUAL[start + 4..].split("\n## ").next().unwrap()
}

/// The words in backquotes.
fn quoted(text: &str) -> BTreeSet<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

#[test]
fn programs_of_the_manual_have_the_canonical_layout() {
    for program in blocks("whip") {
        assert_eq!(layout(0, program).as_deref(), Ok(program));
    }
}

#[test]
fn tables_of_the_manual_are_complete() {
    let rows = |title: &'static str| {
        section(title)
            .lines()
            .filter(|l| l.starts_with('|'))
            .flat_map(quoted)
    };
    let units: BTreeSet<&str> = rows("Numbers and units").collect();
    assert_eq!(units, unit_names().collect());
    let dimensions: BTreeSet<&str> = rows("Dimensions").collect();
    assert_eq!(dimensions, dimension_names().collect());
    let grammar = section("Grammar");
    let keywords = |title: &str| {
        quoted(
            grammar
                .split(title)
                .nth(1)
                .unwrap()
                .split("\n\n")
                .next()
                .unwrap(),
        )
    };
    assert_eq!(
        keywords("Keywords everywhere"),
        HARD_KEYWORDS.iter().copied().collect()
    );
    assert_eq!(
        keywords("Keywords where the grammar expects them"),
        SOFT_KEYWORDS.iter().copied().collect()
    );
    assert_eq!(
        section("The rules")
            .lines()
            .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
            .count(),
        39
    );
}

/// A rule's right side.
enum Ebnf {
    Text(&'static str),
    Rule(&'static str),
    Row(Vec<Ebnf>),
    Choice(Vec<Ebnf>),
    Repeated(Box<Ebnf>),
    Optional(Box<Ebnf>),
}

/// Reads the right side of a rule up to a closing bracket or the final dot.
fn right_side(words: &mut dyn Iterator<Item = &'static str>) -> Ebnf {
    let mut choice = vec![Vec::new()];
    while let Some(word) = words.next() {
        let part = match word {
            "|" => {
                choice.push(Vec::new());
                continue;
            }
            ")" | "]" | "}" | "." => break,
            "(" => right_side(words),
            "[" => Ebnf::Optional(Box::new(right_side(words))),
            "{" => Ebnf::Repeated(Box::new(right_side(words))),
            _ => match word.strip_prefix('"') {
                Some(text) => Ebnf::Text(text.strip_suffix('"').unwrap()),
                None => Ebnf::Rule(word),
            },
        };
        choice.last_mut().unwrap().push(part);
    }
    Ebnf::Choice(choice.into_iter().map(Ebnf::Row).collect())
}

/// The rules of the manual's grammar.
fn rules() -> Vec<(&'static str, Ebnf)> {
    let mut words = blocks("ebnf")[0].split_whitespace();
    let mut rules = Vec::new();
    while let Some(name) = words.next() {
        assert_eq!(words.next(), Some("="), "{name}");
        rules.push((name, right_side(&mut words)));
    }
    rules
}

/// Adds a sentence of the grammar to the text. Beyond a depth, the shortest way out is taken.
fn generate(rules: &[(&str, Ebnf)], ebnf: &Ebnf, depth: usize, dice: &mut Dice, text: &mut String) {
    match ebnf {
        Ebnf::Text(terminal) => *text += &format!("{terminal} "),
        Ebnf::Row(parts) => parts
            .iter()
            .for_each(|p| generate(rules, p, depth, dice, text)),
        Ebnf::Choice(parts) => {
            let part = if depth > 14 {
                parts.len().min(2) - 1
            } else {
                dice.below(parts.len())
            };
            generate(rules, &parts[part], depth, dice, text);
        }
        Ebnf::Repeated(part) => {
            for _ in 0..if depth > 14 { 0 } else { dice.below(3) } {
                generate(rules, part, depth, dice, text);
            }
        }
        Ebnf::Optional(part) => {
            if depth <= 14 && dice.below(2) == 0 {
                generate(rules, part, depth, dice, text);
            }
        }
        Ebnf::Rule("number") => *text += dice.pick(&["1 ", "0.5 mm ", "8e3 N*s/m ", "2 kg*m^2 "]),
        Ebnf::Rule("name") => {
            *text += dice.pick(&["x ", "let_off ", "B_k ", "rate ", "over ", "torque ", "A0 "])
        }
        Ebnf::Rule("sharp") => *text += "C#4 ",
        Ebnf::Rule("text") => *text += "\"own.toml\" ",
        Ebnf::Rule(name) => {
            let (_, side) = rules
                .iter()
                .find(|r| r.0 == *name)
                .unwrap_or_else(|| panic!("no rule {name}"));
            generate(rules, side, depth + 1, dice, text);
        }
    }
}

#[test]
fn the_grammar_of_the_manual_names_every_terminal() {
    let text = blocks("ebnf")[0];
    let named: BTreeSet<&str> = text.split('"').skip(1).step_by(2).collect();
    let all = HARD_KEYWORDS
        .iter()
        .chain(SOFT_KEYWORDS)
        .chain(SIGNS)
        .copied()
        .chain(["{", "}"]);
    assert_eq!(named, all.collect());
}

#[test]
fn what_the_grammar_of_the_manual_generates_is_accepted() {
    let rules = rules();
    let mut dice = Dice(0x9e3779b9);
    let mut longest = 0;
    for _ in 0..5000 {
        let mut text = String::new();
        generate(&rules, &Ebnf::Rule("item"), 0, &mut dice, &mut text);
        longest = longest.max(text.len());
        tree(&text);
    }
    assert!(longest > 500);
}
