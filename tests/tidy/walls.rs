//! Who may depend on whom, read from the manifests.

use std::collections::{BTreeMap, BTreeSet};

use super::{none, only_listed, texts};

/// Crates, and what they may not reach, directly or through others, and why.
const APART: &[(&str, &[&str], &str)] = &[
    (
        "whippen-emulator",
        &[
            "whippen-compiler",
            "whippen-arm",
            "whippen-kernel",
            "whippen-lang",
            "whippen-budget",
        ],
        "the emulator is an independent judge of generated code",
    ),
    (
        "whippen-compiler",
        &["whippen-emulator"],
        "and the compiler may not ask its judge",
    ),
    (
        "whippen-arm",
        &[
            "whippen-lang",
            "whippen-jit",
            "cranelift-codegen",
            "lalrpop",
        ],
        "a change of the code generator rebuilds neither parser nor Cranelift",
    ),
    (
        "whippen-budget",
        &["whippen-lower", "whippen-jit"],
        "the bound sees final bytes",
    ),
    (
        "whippen-kernel",
        &["whippen-lang", "whippen-isa"],
        "a Kernel is for any machine, from any language",
    ),
    (
        "whippen-lang",
        &["whippen-kernel", "whippen-isa"],
        "the language knows nothing of code",
    ),
];

/// Dependencies that one crate alone has.
const ALONE: &[(&str, &str)] = &[
    ("cranelift-", "whippen-jit"),
    ("regalloc2", "whippen-arm"),
    ("lalrpop", "whippen-lang"),
];

/// Dependencies that break a wall still: crate and what it uses, why.
const BREACHES: &[(&str, &str)] = &[];

/// What each crate of the workspace needs to be built, by name; not what its tests need.
fn manifests() -> BTreeMap<String, BTreeSet<String>> {
    let is_manifest = |path: &str| path == "Cargo.toml" || path.ends_with("/Cargo.toml");
    texts()
        .iter()
        .filter(|text| is_manifest(&text.path))
        .filter_map(|text| {
            let name = text.text.lines().find_map(|l| l.strip_prefix("name = "))?;
            Some((name.trim_matches('"').to_string(), dependencies(&text.text)))
        })
        .collect()
}

/// Names under `[dependencies]` and `[build-dependencies]`.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut inside = false;
    for line in manifest.lines() {
        if line.starts_with('[') {
            inside = ["[dependencies]", "[build-dependencies]"].contains(&line);
        } else if let (true, Some((name, _))) = (inside, line.split_once('=')) {
            found.insert(name.trim().to_string());
        }
    }
    found
}

/// Everything that a crate reaches.
fn reached(from: &str, all: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut open = vec![from.to_string()];
    while let Some(name) = open.pop() {
        for next in all.get(&name).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    found
}

#[test]
fn walls_between_crates_stand() {
    let all = manifests();
    let mut found = BTreeSet::new();
    for (from, apart, _) in APART {
        assert!(all.contains_key(*from), "there is no crate {from}");
        let reached = reached(from, &all);
        let broken = apart.iter().filter(|to| reached.contains(**to));
        found.extend(broken.map(|to| format!("{from}: {to}")));
    }
    only_listed(
        &found,
        BREACHES.iter().map(|e| e.0),
        "walls between crates stand",
    );
}

#[test]
fn the_instruction_set_depends_on_nothing() {
    assert_eq!(manifests().get("whippen-isa"), Some(&BTreeSet::new()));
}

#[test]
fn what_is_slow_to_build_is_needed_in_one_place() {
    let all = manifests();
    let mut found = Vec::new();
    for (what, owner) in ALONE {
        let owns = |needs: &BTreeSet<String>| needs.iter().any(|name| name.starts_with(what));
        assert!(owns(&all[*owner]), "{owner} does not need {what}");
        let others = all
            .iter()
            .filter(|(name, needs)| name != owner && owns(needs));
        found.extend(others.map(|(name, _)| format!("{name}: {what}")));
    }
    none(&found, "one crate alone needs it");
}
