//! The repository as a whole: licences, no path of one machine, plain ends of lines.

use std::fs;

use super::{Text, none, paths, root, texts};

/// Links of the file system, and why.
const LINKS: &[(&str, &str)] = &[(
    "runtime/src/studio/whip.tmLanguage.json",
    "the extension of VS Code and the package of the runtime hold one grammar",
)];

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
        let known = LINKS.iter().any(|(known, _)| *known == path);
        assert_eq!(link, known, "{path} is a link, or is none any more");
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
