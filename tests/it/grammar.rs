//! The editor's grammar against the lexer: its regular expressions, run as an editor runs them, see
//! what the compiler sees.

use fancy_regex::Regex;
use serde_json::Value;
use whippen_compiler::bundled;
use whippen_compiler::syntax::token::{HARD_KEYWORDS, SOFT_KEYWORDS, Token, lex};
use whippen_compiler::units::{dimension_names, unit_names};

const GRAMMAR: &str = include_str!("../../editors/vscode/syntaxes/whip.tmLanguage.json");
const MANUAL: &str = include_str!("../../docs/language.md");
const STARTER: &str = include_str!("../../src/cmd/new/starter.whip");

/// A rule: its expression, the scope of all of it, and those of its groups.
struct Rule {
    regex: Regex,
    name: Option<String>,
    groups: Vec<(usize, String)>,
}

/// A piece of a line and its scope.
type Scoped = (usize, usize, String);

fn rules() -> Vec<Rule> {
    let grammar: Value = serde_json::from_str(GRAMMAR).expect("JSON");
    let mut rules = Vec::new();
    collect(&grammar, &grammar["patterns"], &mut rules);
    assert!(rules.len() > 12);
    rules
}

fn collect(grammar: &Value, patterns: &Value, rules: &mut Vec<Rule>) {
    for pattern in patterns.as_array().expect("a list") {
        if let Some(included) = pattern["include"].as_str() {
            let rule = &grammar["repository"][included.trim_start_matches('#')];
            match rule.get("patterns") {
                Some(inner) => collect(grammar, inner, rules),
                None => collect(grammar, &Value::Array(vec![rule.clone()]), rules),
            }
            continue;
        }
        let text = |value: &Value| value.as_str().map(str::to_string);
        let captures = pattern["captures"].as_object().into_iter().flatten();
        rules.push(Rule {
            regex: Regex::new(pattern["match"].as_str().expect("a match")).expect("an expression"),
            name: text(&pattern["name"]),
            groups: captures
                .map(|(n, v)| {
                    (
                        n.parse().expect("a number"),
                        text(&v["name"]).expect("a name"),
                    )
                })
                .collect(),
        });
    }
}

/// The scopes of a line: again and again the rule that matches first, of several the one named
/// first.
fn scopes(rules: &[Rule], line: &str) -> Vec<Scoped> {
    let (mut at, mut found) = (0, Vec::new());
    while at < line.len() {
        let matches = rules.iter().filter_map(|rule| {
            let captures = rule
                .regex
                .captures_from_pos(line, at)
                .expect("no runaway")?;
            Some((captures.get(0)?.start(), rule, captures))
        });
        let Some((_, rule, captures)) = matches.min_by_key(|(start, ..)| *start) else {
            break;
        };
        let whole = captures.get(0).expect("all of it");
        found.extend(
            rule.name
                .iter()
                .map(|name| (whole.start(), whole.end(), name.clone())),
        );
        for (group, name) in &rule.groups {
            found.extend(
                captures
                    .get(*group)
                    .map(|m| (m.start(), m.end(), name.clone())),
            );
        }
        at = whole.end().max(at + 1);
    }
    found
}

/// The scope of the byte at a place of a line.
fn scope(scopes: &[Scoped], at: usize) -> &str {
    scopes
        .iter()
        .rfind(|(start, end, _)| *start <= at && at < *end)
        .map_or("", |(_, _, name)| name)
}

fn texts() -> Vec<&'static str> {
    let blocks = MANUAL
        .split("```whip\n")
        .skip(1)
        .map(|rest| rest.split("```").next().expect("an end"));
    bundled::programs()
        .map(|(_, text)| *text)
        .chain([
            STARTER,
            "keyboard k {\n    device \"https://keys/own.toml\" // mine\n}\n",
        ])
        .chain(blocks)
        .collect()
}

#[test]
fn programs_are_coloured_as_the_lexer_reads_them() {
    let rules = rules();
    let mut seen = 0;
    for text in texts() {
        let lexed = lex(0, text, &mut Vec::new());
        let lines: Vec<(usize, Vec<Scoped>)> = text
            .split_inclusive('\n')
            .scan(0, |at, line| {
                let start = *at;
                *at += line.len();
                Some((start, scopes(&rules, line.trim_end_matches('\n'))))
            })
            .collect();
        let scope_at = |byte: usize| {
            let (start, scopes) = &lines[lines.partition_point(|(start, _)| *start <= byte) - 1];
            scope(scopes, byte - start)
        };
        for comment in &lexed.comments {
            assert!(
                scope_at(comment.span.start as usize).starts_with("comment."),
                "{}",
                comment.node
            );
        }
        for token in &lexed.tokens {
            let (start, end) = (token.span.start as usize, token.span.end as usize);
            let (written, found) = (&text[start..end], scope_at(start));
            let right = match token.node {
                Token::Number(literal) => {
                    let unit = scope_at(end - 1) == "keyword.other.unit.whip";
                    found == "constant.numeric.whip" && unit != literal.unit.is_empty()
                }
                Token::On | Token::Off => found == "constant.language.whip",
                Token::Force => found.starts_with("keyword.") || found == "support.type.whip",
                token if token.is_hard_keyword() => found.starts_with("keyword."),
                // Whether a soft keyword is one here, only the grammar knows.
                _ if SOFT_KEYWORDS.contains(&written) => true,
                Token::Word(_) | Token::Sharp(_) => {
                    !found.starts_with("keyword.") && !found.starts_with("comment.")
                }
                Token::LeftParen | Token::RightParen | Token::Comma | Token::Dot => {
                    found.is_empty()
                }
                Token::Open(_) | Token::Close(_) => found.is_empty(),
                Token::Text(_) => found == "string.quoted.double.whip",
                Token::Colon => found.is_empty() || found == "punctuation.separator.whip",
                _ => found == "keyword.operator.whip",
            };
            assert!(
                right,
                "`{written}` is `{found}` in\n{}",
                &text[start.saturating_sub(60)..end]
            );
            seen += 1;
        }
    }
    assert!(seen > 2000, "{seen} tokens");
}

#[test]
fn the_grammar_knows_the_words_of_the_compiler() {
    let rules = rules();
    for word in HARD_KEYWORDS {
        let found = scopes(&rules, word);
        assert!(
            ["keyword.", "constant.language"]
                .iter()
                .any(|k| scope(&found, 0).starts_with(k)),
            "{word}"
        );
    }
    for unit in unit_names() {
        assert_eq!(
            scope(&scopes(&rules, &format!("12 {unit}")), 3),
            "keyword.other.unit.whip",
            "{unit}"
        );
        let whole = format!("12 N*{unit}^-2");
        assert_eq!(
            scope(&scopes(&rules, &whole), whole.len() - 1),
            "keyword.other.unit.whip",
            "{unit}"
        );
        assert_eq!(
            scope(&scopes(&rules, &format!("12  {unit}")), 4),
            "",
            "{unit} after two spaces"
        );
        assert_eq!(
            scope(&scopes(&rules, &format!("12 {unit}x")), 3),
            "",
            "{unit}x"
        );
    }
    for dimension in dimension_names().chain(["bool"]) {
        assert_eq!(
            scope(&scopes(&rules, &format!("state a: {dimension} in")), 9),
            "support.type.whip",
            "{dimension}"
        );
    }
    let unknown = |pattern: &str, known: &[&str]| -> Vec<String> {
        let words = pattern
            .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .map(str::to_string);
        words
            .filter(|w| {
                w.len() > 1
                    && w.chars().all(|c| c.is_ascii_lowercase())
                    && !known.contains(&w.as_str())
            })
            .collect()
    };
    let grammar: Value = serde_json::from_str(GRAMMAR).expect("JSON");
    let keywords = [HARD_KEYWORDS, SOFT_KEYWORDS].concat();
    for rule in grammar["repository"]["keywords"]["patterns"]
        .as_array()
        .expect("a list")
    {
        let pattern = rule["match"]
            .as_str()
            .expect("a match")
            .replace("\\b", " ")
            .replace("\\s", " ");
        assert_eq!(
            unknown(&pattern, &keywords),
            Vec::<String>::new(),
            "{pattern}"
        );
    }
}

#[test]
fn soft_keywords_are_keywords_in_their_places_alone() {
    let rules = rules();
    let cases = [
        (
            "    sense x: length in 0 mm .. 1 mm over 1 ms",
            "over",
            true,
        ),
        ("    sense x: length in a .. b slew 1 m/s", "slew", true),
        (
            "    pulse p: force in 0 N .. 1 N lasting 8 ms",
            "lasting",
            true,
        ),
        (
            "    live param v = 0.5 in 0 .. 1 glide 20 ms",
            "glide",
            true,
        ),
        ("    noise hiss", "noise", true),
        (
            "    delay past: length in a .. b lasting 5 ms",
            "delay",
            true,
        ),
        ("    feed past = x", "feed", true),
        ("    sound out on left = x", "sound", true),
        ("    let a = noise * feed", "noise", false),
        ("            fire thump at 20 N*s/m * squeeze'", "at", true),
        ("    rate     44100 Hz", "rate", true),
        ("        torque  l3 * push", "torque", true),
        (
            "        angle   phi in 0 rad .. 1 rad, rate in",
            "rate",
            true,
        ),
        ("    programs grand_piano", "programs", true),
        (
            "    zones    split = { A0 .. B3: hammond, C4 .. C8: grand_piano }",
            "zones",
            true,
        ),
        ("    zones = { A0: 1 N }", "zones", false),
        ("    zones.weight = { A0: 1 N }", "zones", false),
        ("    param mass = 2 kg", "mass", false),
        ("    rate = x'", "rate", false),
        ("    let a = over * at + slew", "over", false),
        ("    let a = f(x, rate: 2)", "rate", false),
        ("    force lasting = x", "lasting", false),
    ];
    for (line, word, keyword) in cases {
        let found = scopes(&rules, line);
        let at = line.find(word).expect("there");
        assert_eq!(
            scope(&found, at).starts_with("keyword."),
            keyword,
            "{line}: {found:?}"
        );
    }
}
