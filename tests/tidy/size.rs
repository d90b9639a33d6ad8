//! How long files, functions and lines may be, and what a file begins with.

use std::collections::BTreeSet;

use super::lex::Line;
use super::{Text, none, only_listed, rust, texts};

/// Lines of a file.
const FILE_MAX: usize = 500;

/// Files that are longer, and why.
const LONG_FILES: &[(&str, &str)] = &[
    (
        "isa/src/table.rs",
        "one line per instruction, and what each means",
    ),
    ("compiler/lang/src/check/tests/cases.rs", "a table of cases"),
    ("tests/build/command.rs", "tables of cases"),
    ("tests/it/cli.rs", "tables of cases"),
    ("tests/it/lsp.rs", "tables of cases"),
    ("tests/it/midi.rs", "tables of cases"),
    ("runtime/src/emulated.rs", "to be divided"),
    ("compiler/arm/src/image/link.rs", "to be divided"),
    ("compiler/modes/src/place.rs", "to be divided"),
    ("compiler/arm/src/thumb/entry.rs", "to be divided"),
];

/// Lines of a function of the product, from `fn` to its closing brace.
const FUNCTION_MAX: usize = 60;

/// Functions that are longer, and why.
const LONG_FUNCTIONS: &[(&str, &str)] = &[];

/// Columns of a line of Rust without strings.
const COLUMNS_MAX: usize = 100;

/// Files with wider lines of code, and why.
const WIDE: &[(&str, &str)] = &[];

/// Columns of a line of Markdown outside of tables and code.
const MARKDOWN_MAX: usize = 300;

/// Documents with longer sentences, and why.
const LONG_SENTENCES: &[(&str, &str)] = &[];

#[test]
fn files_are_short() {
    let found = rust()
        .into_iter()
        .filter(|text| text.text.lines().count() > FILE_MAX)
        .map(|text| text.path)
        .collect();
    let rule = format!("one idea a file, at most {FILE_MAX} lines");
    only_listed(&found, LONG_FILES.iter().map(|e| e.0), &rule);
}

#[test]
fn files_say_what_they_are_for() {
    let found: Vec<String> = rust()
        .into_iter()
        .filter(|text| !text.text.starts_with("//!"))
        .map(|text| text.path)
        .collect();
    none(&found, "a file begins with its purpose");
}

/// The name of the function that a line begins, and by how much it is indented.
fn function(code: &str) -> Option<(&str, usize)> {
    let head = code.trim_start();
    let indent = code.len() - head.len();
    let words = ["pub", "const", "async", "extern", "\"", "in", "unsafe"];
    let mut rest = head;
    loop {
        if let Some(name) = rest.strip_prefix("fn ") {
            let end = name.find(|c: char| !c.is_alphanumeric() && c != '_')?;
            return Some((&name[..end], indent));
        }
        let (word, behind) = rest.split_once(' ')?;
        let plain = word.split('(').next().unwrap_or_default();
        if !words.contains(&plain) {
            return None;
        }
        rest = behind;
    }
}

/// Names and lengths of the functions of a text as rustfmt lays them out: each ends with a brace
/// under its beginning.
fn functions(code: &[(usize, String)]) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    for (at, (first, line)) in code.iter().enumerate() {
        let Some((name, indent)) = function(line) else {
            continue;
        };
        let under = |line: &str| line.len() - line.trim_start().len() == indent;
        let ends = |line: &str| {
            let line = line.trim_end();
            under(line) && (line.trim_start().starts_with('}') || line.ends_with(';'))
        };
        let whole = line.trim_end().ends_with(['}', ';']);
        let last = code[at + 1..].iter().find(|(_, line)| ends(line));
        let lines = match last {
            Some((last, _)) if !whole => last - first + 1,
            _ => 1,
        };
        found.push((name.to_string(), lines));
    }
    found
}

#[test]
fn functions_are_short() {
    let mut found = BTreeSet::new();
    let mut all = 0;
    for text in rust() {
        for (name, lines) in functions(&text.code()) {
            all += 1;
            if lines > FUNCTION_MAX {
                found.insert(format!("{}: {name}", text.path));
            }
        }
    }
    assert!(all > 3000, "only {all} functions were found");
    let rule = format!("a function has at most {FUNCTION_MAX} lines");
    only_listed(&found, LONG_FUNCTIONS.iter().map(|e| e.0), &rule);
}

#[test]
fn the_lines_of_functions_are_counted() {
    let text = "pub(crate) const fn one(\n    a: u8,\n) -> u8 {\n    fn two() {}\n    fn three() {\n        \
                four;\n    }\n    a\n}\ntrait T {\n    fn five(\n        self,\n    );\n}\nlet x: fn (u8) = y;\n";
    let code: Vec<(usize, String)> = (1..).zip(text.lines().map(str::to_string)).collect();
    let expected = [("one", 9), ("two", 1), ("three", 3), ("five", 3)];
    assert_eq!(
        functions(&code),
        expected.map(|(name, lines)| (name.to_string(), lines))
    );
}

/// Whether a comment is a drawing or a row of a table, which may be wider: it has a gap, an arrow,
/// or the border of a cell.
fn is_drawn(comment: &str) -> bool {
    let comment = comment.trim_start_matches(['/', '!']).trim();
    ["  ", "->", "--", "|", "─"]
        .iter()
        .any(|mark| comment.contains(mark))
}

fn is_too_wide(line: &Line) -> bool {
    let may_be_wide = line.has_string || line.comment.is_some_and(is_drawn);
    line.text.chars().count() > COLUMNS_MAX && !may_be_wide
}

#[test]
fn lines_are_narrow() {
    let found = rust()
        .into_iter()
        .filter(|text| text.rust_lines().iter().any(|(_, line)| is_too_wide(line)))
        .map(|text| text.path)
        .collect();
    let rule = format!("a line of Rust without strings has at most {COLUMNS_MAX} columns");
    only_listed(&found, WIDE.iter().map(|e| e.0), &rule);
}

/// The lines of a document that are prose: nothing in fences, no tables, no code by indentation.
pub fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        let code = fenced || fence || line.starts_with("    ");
        !code && !line.trim_start().starts_with('|')
    })
}

fn documents() -> Vec<Text> {
    let mut documents = texts();
    documents.retain(|text| text.path.ends_with(".md"));
    documents
}

#[test]
fn sentences_are_short() {
    let long = |text: &Text| prose(&text.text).any(|(_, l)| l.chars().count() > MARKDOWN_MAX);
    let found = documents()
        .into_iter()
        .filter(long)
        .map(|text| text.path)
        .collect();
    let rule = format!("a line of Markdown has at most {MARKDOWN_MAX} columns");
    only_listed(&found, LONG_SENTENCES.iter().map(|e| e.0), &rule);
}

/// Whether a sentence ends before the end of a line and another begins. Code and what is in
/// parentheses does not count, nor the number of a heading or of a list.
fn holds_two_sentences(line: &str) -> bool {
    let mut plain = String::new();
    let (mut quoted, mut depth) = (false, 0_usize);
    for c in line.chars() {
        match c {
            '`' => quoted = !quoted,
            '(' if !quoted => depth += 1,
            ')' if !quoted => depth = depth.saturating_sub(1),
            _ if !quoted && depth == 0 => plain.push(c),
            _ => {}
        }
        // Something stands there.
        if matches!(c, '`' | ')') && !quoted && depth == 0 {
            plain.push('x');
        }
    }
    let number = |c: char| c.is_ascii_digit() || "#. *".contains(c);
    let plain = plain.trim_start_matches(number);
    plain.match_indices(". ").any(|(at, _)| {
        let ends = plain[..at].ends_with(|c: char| c.is_lowercase() || c.is_ascii_digit());
        ends && plain[at + 2..].starts_with(|c: char| c.is_uppercase() || c == '`')
    })
}

#[test]
fn one_sentence_stands_on_a_line() {
    assert!(holds_two_sentences("One ends (here. No). Two begins."));
    assert!(!holds_two_sentences(
        "3. `a. B` (see there. It says) goes on."
    ));
    let mut found = Vec::new();
    for text in documents() {
        let lines = prose(&text.text).filter(|(_, line)| holds_two_sentences(line));
        found.extend(lines.map(|(number, _)| format!("{}:{number}", text.path)));
    }
    none(&found, "one sentence stands on a line of Markdown");
}
