//! How long files, functions and lines may be, and what a file begins with.

use std::collections::BTreeSet;

use super::lex::Line;
use super::{none, only_listed, rust};

/// Lines of a file.
const FILE_MAX: usize = 500;

/// Files that are longer, and why.
const LONG_FILES: &[(&str, &str)] = &[
    ("compiler/lang/src/check/tests/cases.rs", "a table of cases"),
    (
        "isa/src/table.rs",
        "one line per instruction, and what each means",
    ),
    ("tests/build/command.rs", "tables of cases"),
    ("tests/it/cli.rs", "tables of cases"),
    ("tests/it/lsp.rs", "tables of cases"),
    ("tests/it/midi.rs", "tables of cases"),
];

/// Lines of a function of the product, from `fn` to its closing brace.
const FUNCTION_MAX: usize = 60;

/// Functions that are longer, and why.
const LONG_FUNCTIONS: &[(&str, &str)] = &[
    (
        "compiler/arm/src/thumb/select/operator.rs: select_operator",
        "an arm for each operator",
    ),
    (
        "compiler/budget/src/error.rs: fmt",
        "a message for each error",
    ),
    (
        "compiler/budget/src/facts/effect.rs: result",
        "an arm for each instruction",
    ),
    (
        "compiler/c99/src/declare.rs: state",
        "a text, field by field",
    ),
    (
        "compiler/firmware/src/constants.rs: constants",
        "a table of names and values",
    ),
    (
        "compiler/jit/src/lanes/operator.rs: operator",
        "an arm for each operator",
    ),
    (
        "compiler/kernel/src/op/apply.rs: declared_by",
        "an arm for each operator",
    ),
    (
        "compiler/kernel/src/op/error.rs: fmt",
        "a message for each error",
    ),
    (
        "compiler/kernel/src/print.rs: declarations",
        "a paragraph for each kind of declaration",
    ),
    (
        "compiler/wasm/src/arithmetic.rs: operator",
        "an arm for each operator",
    ),
    (
        "compiler/lang/src/model/print.rs: text",
        "an arm for each part of a model",
    ),
    (
        "compiler/lang/src/syntax/pretty.rs: decl",
        "an arm for each declaration",
    ),
    (
        "compiler/lower/src/values.rs: real_node",
        "an arm for each node",
    ),
    (
        "compiler/modes/src/facts.rs: operands",
        "an arm for each operator",
    ),
    ("src/lsp/server.rs: answer", "an arm for each request"),
];

/// Columns of a line of Rust without strings.
const COLUMNS_MAX: usize = 100;

/// Files with wider lines of code, and why.
const WIDE: &[(&str, &str)] = &[
    ("compiler/kernel/src/op.rs", "one row per operator"),
    (
        "compiler/lang/src/syntax/tests/mistakes.rs",
        "a macro, which rustfmt leaves",
    ),
    (
        "compiler/lang/src/syntax/tests/spans.rs",
        "a macro and its rows",
    ),
    ("isa/src/table.rs", "one row per instruction"),
    (
        "tests/build/bindings/probe_module.rs",
        "what `build` writes for others",
    ),
];

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

/// Whether a comment is a row of a table, which may be wider: it has a gap or the border of a cell.
fn is_drawn(comment: &str) -> bool {
    let comment = comment.trim_start_matches(['/', '!']).trim();
    ["  ", "|"].iter().any(|mark| comment.contains(mark))
}

/// The lines that are too wide; what is fenced in comments is drawings and code.
fn too_wide(lines: &[(usize, Line)]) -> Vec<usize> {
    let mut fenced = false;
    let mut found = Vec::new();
    for (number, line) in lines {
        let fence = line.comment.is_some_and(|text| text.contains("```"));
        fenced = line.comment.is_some() && (fenced ^ fence);
        let may_be_wide = fenced || line.has_string || line.comment.is_some_and(is_drawn);
        if line.text.chars().count() > COLUMNS_MAX && !may_be_wide {
            found.push(*number);
        }
    }
    found
}

#[test]
fn lines_are_narrow() {
    let mut found = BTreeSet::new();
    for text in rust() {
        let wide = too_wide(&text.rust_lines());
        if !wide.is_empty() {
            println!("{}: lines {wide:?}", text.path);
            found.insert(text.path);
        }
    }
    let rule = format!("a line of Rust without strings has at most {COLUMNS_MAX} columns");
    only_listed(&found, WIDE.iter().map(|e| e.0), &rule);
}
