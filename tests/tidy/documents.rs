//! Documents: links lead somewhere, files that are spoken of exist, every diagnostic is tested, one
//! sentence stands on a line.

use super::{Text, none, paths, root, texts};

/// Files that documents may name before they are written.
const ANNOUNCED: &[&str] = &["docs/bars.md"];

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
