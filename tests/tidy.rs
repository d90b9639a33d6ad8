//! The rules of the repository, enforced: what the compiler may not do, how long a file may be,
//! what documents may claim.
//!
//! An exception is a line of a table below, with its reason.

#[path = "tidy/words.rs"]
mod words;

use std::fs;
use std::path::{Path, PathBuf};

/// The only file that may be `unsafe`.
const UNSAFE: &str = "compiler/jit/src/lib.rs";

/// Files that write Rust for others to link, and what they wrote; none of it runs here.
const WRITTEN: [&str; 2] = [
    "compiler/src/bindings/rust.rs",
    "tests/build/bindings/probe_module.rs",
];

/// Floating point in what works on integers: file, what is allowed there, why.
const FLOATS: &[(&str, &str)] = &[
    // The exact integer square root begins with a rounded one, corrected afterwards.
    ("compiler/jit/src/translate/arithmetic.rs", "F64"),
];

/// Files of more than [`LINES_MAX`] lines.
const LONG: &[&str] = &[
    // One line per instruction, and what each means.
    "isa/src/table.rs",
    // Tables of cases.
    "compiler/lang/src/check/tests/cases.rs",
    "tests/build/command.rs",
    "tests/it/cli.rs",
    "tests/it/lsp.rs",
    "tests/it/midi.rs",
    // To be divided.
    "runtime/src/emulated.rs",
    "compiler/arm/src/image/link.rs",
    "compiler/modes/src/place.rs",
    "compiler/arm/src/thumb/entry.rs",
];

const LINES_MAX: usize = 500;

/// Files that documents may name before they are written.
const ANNOUNCED: &[&str] = &["docs/bars.md"];

/// Words that mean input, output, a clock or an environment.
const OUTSIDE: &[&str] = &["fs", "io", "env", "time", "net", "process", "thread"];

/// What is allowed all the same: file, word.
const INSIDE: &[(&str, &str)] = &[
    // Threads share work, and nothing that comes out depends on it.
    ("compiler/deterministic/src/parallel.rs", "thread"),
];

/// What no program should hold outside of its tests.
const UNFINISHED: &[&str] = &["dbg!", "todo!", "unimplemented!", ".unwrap()"];

/// A text of the repository.
struct Text {
    /// Path with `/`, relative to the root.
    path: String,
    text: String,
}

impl Text {
    /// Whether all of it is tests.
    fn is_test(&self) -> bool {
        let module = self.path.rsplit('/').next().unwrap_or_default();
        self.path.starts_with("tests/")
            || self.path.contains("/tests/")
            || module == "tests.rs"
            || self.path == "runtime/src/motion/recordings.rs"
    }

    /// The lines that run in the product: no comments, nothing behind `#[cfg(test)] mod tests`.
    /// Counted from 1.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        let end = self
            .text
            .find("#[cfg(test)]\nmod tests {")
            .unwrap_or(self.text.len());
        let text = if self.is_test() {
            ""
        } else {
            &self.text[..end]
        };
        let bare = |line: &'_ str| line.find("//").map_or(line.len(), |at| at);
        text.lines()
            .enumerate()
            .map(move |(i, line)| (i + 1, &line[..bare(line)]))
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below a folder, without what Git or a build put there.
fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .expect("readable")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    entries.sort();
    for path in entries {
        let name = path
            .file_name()
            .and_then(|n| n.to_str())
            .unwrap_or_default()
            .to_string();
        let ours = !["target", ".git", "whippen-out", "whippen-tour"].contains(&name.as_str());
        match path.is_dir() {
            _ if !ours => {}
            true => walk(&path, found),
            false => found.push(path),
        }
    }
}

fn paths() -> Vec<String> {
    let mut found = Vec::new();
    walk(root(), &mut found);
    let relative = |path: PathBuf| {
        path.strip_prefix(root())
            .expect("inside")
            .to_string_lossy()
            .replace('\\', "/")
    };
    found.into_iter().map(relative).collect()
}

/// Every file that is text.
fn texts() -> Vec<Text> {
    let read = |path: String| {
        fs::read_to_string(root().join(&path))
            .ok()
            .map(|text| Text { path, text })
    };
    let texts: Vec<Text> = paths().into_iter().filter_map(read).collect();
    assert!(
        texts.len() > 100,
        "only {} files: is this the repository?",
        texts.len()
    );
    texts
}

fn rust() -> Vec<Text> {
    texts()
        .into_iter()
        .filter(|t| t.path.ends_with(".rs"))
        .collect()
}

/// Whether `word` stands in `line` by itself.
fn has_word(line: &str, word: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        !line[..at].chars().next_back().is_some_and(joins)
            && !line[at + word.len()..].chars().next().is_some_and(joins)
    })
}

#[track_caller]
fn none(found: &[String], rule: &str) {
    assert!(found.is_empty(), "{rule}:\n  {}", found.join("\n  "));
}

#[test]
fn unsafe_code_stands_where_compiled_code_is_called() {
    // 'unsafe-inline' is a word of content security policies.
    let code = |line: &str| {
        line.split("//")
            .next()
            .unwrap_or_default()
            .replace("'unsafe-inline'", "")
    };
    let uses = |t: &Text| t.text.lines().any(|l| has_word(&code(l), "unsafe"));
    // This file speaks of it.
    let spoken = |t: &&Text| t.path == "tests/tidy.rs" || WRITTEN.contains(&t.path.as_str());
    let texts = rust();
    let found: Vec<&str> = texts
        .iter()
        .filter(|t| !spoken(t) && uses(t))
        .map(|t| t.path.as_str())
        .collect();
    assert_eq!(found, [UNSAFE]);
}

#[test]
fn kernels_and_host_code_work_on_integers() {
    let mut found = Vec::new();
    let mut used = vec![false; FLOATS.len()];
    let parts = ["compiler/kernel/src", "compiler/jit/src"];
    for text in rust()
        .iter()
        .filter(|t| parts.iter().any(|p| t.path.starts_with(p)))
    {
        for (line, code) in text.code() {
            for word in ["f32", "f64", "F32", "F64"]
                .into_iter()
                .filter(|word| has_word(code, word))
            {
                match FLOATS
                    .iter()
                    .position(|exception| *exception == (text.path.as_str(), word))
                {
                    Some(at) => used[at] = true,
                    None => found.push(format!("{}:{line}: {word}", text.path)),
                }
            }
        }
    }
    none(&found, "no floating point after lowering");
    assert!(
        used.iter().all(|used| *used),
        "an exception is not needed: {FLOATS:?} {used:?}"
    );
}

#[test]
fn the_compiler_does_no_input_or_output() {
    let mut found = Vec::new();
    for text in rust()
        .iter()
        .filter(|t| t.path.starts_with("compiler/") && !t.is_test())
    {
        for (line, code) in text.code() {
            let allowed = |m: &&&str| !INSIDE.contains(&(text.path.as_str(), **m));
            let module = OUTSIDE
                .iter()
                .filter(allowed)
                .find(|m| has_word(code, &format!("std::{m}")));
            let prints = ["print!", "println!", "eprint!", "eprintln!"]
                .iter()
                .find(|m| has_word(code, m));
            if let Some(what) = module.or(prints) {
                found.push(format!("{}:{line}: {what}", text.path));
            }
        }
    }
    none(&found, "the compiler gets text and gives bytes");
}

#[test]
fn commands_print_through_say() {
    let mut found = Vec::new();
    for text in rust().iter().filter(|t| t.path.starts_with("src/")) {
        let prints = |code: &str| ["print!", "println!"].iter().any(|m| has_word(code, m));
        found.extend(
            text.code()
                .filter(|(_, code)| prints(code))
                .map(|(line, _)| format!("{}:{line}", text.path)),
        );
    }
    none(&found, "`print!` panics when its reader is gone");
}

#[test]
fn nothing_is_left_unfinished_and_nothing_is_unwrapped() {
    let mut found = Vec::new();
    for text in rust() {
        for (line, code) in text.code() {
            found.extend(
                UNFINISHED
                    .iter()
                    .filter(|w| code.contains(**w))
                    .map(|w| format!("{}:{line}: {w}", text.path)),
            );
        }
        let notes = ["TO", "FIX"]
            .map(|start| format!("{start}{}", if start == "TO" { "DO" } else { "ME" }));
        found.extend(
            notes
                .iter()
                .filter(|n| has_word(&text.text, n))
                .map(|n| format!("{}: {n}", text.path)),
        );
    }
    none(&found, "errors are values; what is not done is not there");
}

#[test]
fn files_are_short_and_say_what_they_are_for() {
    let mut found = Vec::new();
    for text in rust() {
        let lines = text.text.lines().count();
        let listed = LONG.contains(&text.path.as_str());
        if (lines > LINES_MAX) != listed {
            found.push(format!(
                "{}: {lines} lines, at most {LINES_MAX} unless listed",
                text.path
            ));
        }
        if !text.text.starts_with("//!") {
            found.push(format!("{}: begins without its purpose", text.path));
        }
    }
    none(&found, "one idea a file");
}

#[test]
fn every_diagnostic_is_tested() {
    let texts = texts();
    let table = texts
        .iter()
        .find(|t| t.path == "compiler/lang/src/diag/codes.rs")
        .expect("the table");
    let codes: Vec<&str> = table
        .text
        .split('"')
        .filter(|s| s.len() == 6 && s.starts_with("WH0"))
        .collect();
    assert!(codes.len() > 60, "{codes:?}");
    let tested = |code: &&&str| {
        let said = |t: &Text| (t.is_test() || t.path.ends_with(".snap")) && t.text.contains(**code);
        !texts.iter().any(said)
    };
    let missing: Vec<String> = codes
        .iter()
        .filter(tested)
        .map(|code| code.to_string())
        .collect();
    none(&missing, "a test shows the message of every code");
    let distinct: std::collections::BTreeSet<_> = codes.iter().collect();
    assert_eq!(distinct.len(), codes.len(), "a code stands twice");
}

/// Targets of `[text](target)`.
fn links(text: &str) -> Vec<&str> {
    let targets = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    targets
        .filter(|t| !t.contains("://") && !t.starts_with('#') && !t.starts_with("mailto:"))
        .collect()
}

#[test]
fn links_lead_somewhere() {
    let mut found = Vec::new();
    for text in texts().iter().filter(|t| t.path.ends_with(".md")) {
        let folder = root().join(&text.path);
        let folder = folder.parent().unwrap_or(root());
        for link in links(&text.text) {
            let file = link.split(['#', ' ']).next().unwrap_or_default();
            if !folder.join(file).exists() {
                found.push(format!("{}: {link}", text.path));
            }
        }
    }
    none(&found, "links lead somewhere");
}

/// What a document puts in backquotes and means as a path of the repository.
fn mentioned(text: &str) -> impl Iterator<Item = &str> {
    let quoted = text
        .split("```")
        .step_by(2)
        .flat_map(|prose| prose.split('`').skip(1).step_by(2));
    let plain = |t: &&str| {
        t.chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c))
    };
    let ending = |t: &str| {
        [".rs", ".md", ".toml", ".whip", ".lalrpop"]
            .iter()
            .any(|e| t.ends_with(e))
    };
    let generated =
        |t: &str| t.starts_with("whippen-") || t.starts_with("../") || t.starts_with('/');
    quoted
        .filter(plain)
        .filter(move |t| (t.contains('/') || ending(t)) && !generated(t))
}

#[test]
fn documents_speak_of_files_that_exist() {
    let paths = paths();
    // A path may be told from any folder on: `kernel/op.rs`, `host/`.
    let exists = |mention: &str| {
        let mention = mention.trim_end_matches('/').trim_start_matches("./");
        paths.iter().any(|path| {
            let path = format!("/{path}");
            path.ends_with(&format!("/{mention}")) || path.contains(&format!("/{mention}/"))
        })
    };
    let documents = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "GLOSSARY.md",
        "docs/codegen.md",
        "docs/modes.md",
        "docs/budget.md",
    ];
    let mut found = Vec::new();
    for text in texts()
        .iter()
        .filter(|t| documents.contains(&t.path.as_str()) || t.path.starts_with("docs/how-to/"))
    {
        let missing = mentioned(&text.text).filter(|m| !exists(m) && !ANNOUNCED.contains(m));
        found.extend(missing.map(|m| format!("{}: {m}", text.path)));
    }
    none(&found, "documents speak of files that exist");
}

#[test]
fn the_licences_are_there() {
    for (file, says) in [
        ("LICENSE-MIT", "Permission is hereby granted"),
        ("LICENSE-APACHE", "Apache License"),
    ] {
        let text = fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(text.contains(says), "{file}");
    }
    let manifests: Vec<Text> = texts()
        .into_iter()
        .filter(|t| t.path.ends_with("Cargo.toml"))
        .collect();
    for manifest in manifests.iter().filter(|m| m.text.contains("[package]")) {
        assert!(
            manifest.text.contains("license"),
            "{} has no licence",
            manifest.path
        );
    }
}

#[test]
fn nothing_speaks_of_one_machine() {
    let folders = ["home", "root", "work", "Users", "mnt"].map(|folder| format!("/{folder}/"));
    let mut found = Vec::new();
    for text in texts() {
        for (number, line) in text.text.lines().enumerate() {
            let absolute = |folder: &String| {
                let before = |at: usize| line[..at].chars().next_back();
                line.match_indices(folder.as_str()).any(|(at, _)| {
                    !before(at).is_some_and(|c| c.is_alphanumeric() || "._-}*".contains(c))
                })
            };
            found.extend(
                folders
                    .iter()
                    .filter(|f| absolute(f))
                    .map(|f| format!("{}:{}: {f}", text.path, number + 1)),
            );
        }
    }
    none(&found, "no path of one machine");
    for path in paths() {
        let link = fs::symlink_metadata(root().join(&path)).is_ok_and(|m| m.is_symlink());
        assert!(!link, "{path} is a link");
    }
}

#[test]
fn texts_end_with_a_newline_and_have_no_trailing_spaces() {
    let mut found = Vec::new();
    // Inputs of tests may be spoiled on purpose.
    let ours = |t: &&Text| {
        [".rs", ".md", ".toml", ".whip"]
            .iter()
            .any(|e| t.path.ends_with(e))
    };
    let spoiled = |t: &&Text| {
        ["tests/filetests/", "fuzz/corpus/"]
            .iter()
            .any(|folder| t.path.starts_with(folder))
    };
    for text in texts().iter().filter(ours).filter(|t| !spoiled(t)) {
        if !text.text.is_empty() && (!text.text.ends_with('\n') || text.text.contains('\r')) {
            found.push(format!("{}: ends", text.path));
        }
        let spaced = |(_, line): &(usize, &str)| line.ends_with([' ', '\t']);
        found.extend(
            text.text
                .lines()
                .enumerate()
                .filter(spaced)
                .map(|(i, _)| format!("{}:{}", text.path, i + 1)),
        );
    }
    none(&found, "plain ends of lines");
}
