//! The files of the repository as texts, and how violations are reported.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::lex::{Line, lines};

/// A text of the repository.
pub struct Text {
    /// Path with `/`, relative to the root.
    pub path: String,
    pub text: String,
}

impl Text {
    /// Whether all of it is tests.
    pub fn is_test(&self) -> bool {
        let module = self.path.rsplit('/').next().unwrap_or_default();
        self.path.starts_with("tests/")
            || self.path.contains("/tests/")
            || module == "tests.rs"
            || self.path == "runtime/src/motion/recordings.rs"
    }

    /// Its lines as Rust, with what is code, string and comment told apart. Counted from 1.
    pub fn rust_lines(&self) -> Vec<(usize, Line<'_>)> {
        (1..).zip(lines(&self.text)).collect()
    }

    /// The lines that run in the product, without comments and strings: nothing of tests, nothing
    /// behind `#[cfg(test)] mod tests`. Counted from 1.
    pub fn code(&self) -> Vec<(usize, String)> {
        if self.is_test() {
            return Vec::new();
        }
        let end = self.text.find("#[cfg(test)]\nmod tests {");
        let last = end.map_or(usize::MAX, |end| self.text[..end].lines().count());
        let all = self.rust_lines().into_iter().take(last);
        all.map(|(number, line)| (number, line.code)).collect()
    }
}

/// The root of the repository.
pub fn root() -> &'static Path {
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

/// Every path, relative to the root.
pub fn paths() -> Vec<String> {
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
pub fn texts() -> Vec<Text> {
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

/// The folders with a manifest, with a `/` behind, but for the root.
pub fn crates() -> Vec<String> {
    let manifests = paths()
        .into_iter()
        .filter(|path| path.ends_with("/Cargo.toml"));
    manifests
        .map(|path| path.trim_end_matches("Cargo.toml").to_string())
        .collect()
}

/// The crate of a file: the longest folder above it with a manifest. The root's is empty.
pub fn crate_of<'a>(path: &str, crates: &'a [String]) -> &'a str {
    let above = crates
        .iter()
        .filter(|folder| path.starts_with(folder.as_str()));
    above.max_by_key(|folder| folder.len()).map_or("", |f| f)
}

/// Every Rust file.
pub fn rust() -> Vec<Text> {
    texts()
        .into_iter()
        .filter(|t| t.path.ends_with(".rs"))
        .collect()
}

/// Whether `word` stands in `line` by itself.
pub fn has_word(line: &str, word: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        !line[..at].chars().next_back().is_some_and(joins)
            && !line[at + word.len()..].chars().next().is_some_and(joins)
    })
}

/// Nothing was found that breaks a rule.
#[track_caller]
pub fn none(found: &[String], rule: &str) {
    assert!(found.is_empty(), "{rule}:\n  {}", found.join("\n  "));
}

/// Exactly what is listed is found: what is found and not listed breaks the rule, and what is
/// listed and not found is an exception that is not needed any more.
#[track_caller]
pub fn only_listed<'a>(
    found: &BTreeSet<String>,
    listed: impl IntoIterator<Item = &'a str>,
    rule: &str,
) {
    let listed: BTreeSet<String> = listed.into_iter().map(str::to_string).collect();
    let mut wrong: Vec<String> = found.difference(&listed).cloned().collect();
    let stale = listed.difference(found);
    wrong.extend(stale.map(|name| format!("{name}: is listed and need not be")));
    none(&wrong, rule);
}
