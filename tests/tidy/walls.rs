//! Who may depend on whom, read from the manifests.

use std::collections::{BTreeMap, BTreeSet};

use super::{Text, none, only_listed, rust, texts};

/// Crates, and what they may not reach, directly or through others, and why.
const APART: &[(&str, &[&str], &str)] = &[
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
        "whippen-audit",
        &[
            "whippen-arm",
            "whippen-board",
            "whippen-firmware",
            "whippen-budget",
        ],
        "the checker believes nothing of the compiler",
    ),
    (
        "whippen-validate",
        &["whippen-arm", "whippen-firmware", "whippen-budget"],
        "whoever judges the code generator believes nothing of it",
    ),
    (
        "whippen-budget",
        &["whippen-lower", "whippen-jit"],
        "the bound sees final bytes",
    ),
    (
        "whippen-kernel",
        &["whippen-lang", "whippen-isa", "whippen-target-info"],
        "a Kernel is for any machine, from any language",
    ),
    (
        "whippen-lang",
        &["whippen-kernel", "whippen-isa"],
        "the language knows nothing of code",
    ),
];

/// Dependencies that few crates have.
const ALONE: &[(&str, &[&str])] = &[
    ("cranelift-", &["whippen-jit", "whippen-emulator"]),
    ("regalloc2", &["whippen-arm"]),
    ("lalrpop", &["whippen-lang"]),
];

/// Crates that the bound does not depend on by itself: it sees final bytes.
const NOT_BYTES: &[&str] = &[
    "whippen-kernel",
    "whippen-lang",
    "whippen-lower",
    "whippen-modes",
];

/// Files of the code generator that name an architecture, and why; all others ask the table for one
/// ability of the core.
const ARCHITECTURES: &[(&str, &str)] = &[
    (
        "compiler/arm/src/features.rs",
        "the table of what cores can do",
    ),
    (
        "compiler/arm/src/image/elf/attributes.rs",
        "an object says its architecture",
    ),
    (
        "compiler/arm/src/image/listing.rs",
        "a listing says its architecture",
    ),
];

/// What each crate of the workspace needs to be built, by name; not what its tests need.
fn manifests() -> BTreeMap<String, BTreeSet<String>> {
    let needs = |text: &Text| Some((name(text)?, dependencies(&text.text)));
    texts().iter().filter_map(needs).collect()
}

/// The name of the crate whose manifest a text is.
fn name(text: &Text) -> Option<String> {
    let is_manifest = text.path == "Cargo.toml" || text.path.ends_with("/Cargo.toml");
    let mut lines = text.text.lines().filter(|_| is_manifest);
    let name = lines.find_map(|line| line.strip_prefix("name = "))?;
    Some(name.trim_matches('"').to_string())
}

/// Names under `[dependencies]` and `[build-dependencies]`, those for some computers too.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut inside = false;
    for line in manifest.lines() {
        if line.starts_with('[') {
            let here = ["[dependencies]", "[build-dependencies]"].contains(&line);
            inside = here || line.starts_with("[target.") && line.ends_with(".dependencies]");
        } else if let (true, Some((name, _))) = (inside, line.split_once('=')) {
            found.insert(name.trim().trim_end_matches(".workspace").to_string());
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
fn compiler_and_emulator_do_not_know_each_other() {
    let all = manifests();
    let parts: Vec<String> = texts()
        .iter()
        .filter(|text| text.path.starts_with("compiler/"))
        .filter_map(name)
        .collect();
    assert!(parts.len() > 10, "{parts:?}");
    let ours = reached("whippen-emulator", &all);
    for part in &parts {
        assert!(!ours.contains(part), "the emulator reaches {part}");
        let reached = reached(part, &all);
        assert!(
            !reached.contains("whippen-emulator"),
            "{part} reaches the emulator"
        );
    }
}

#[test]
fn walls_between_crates_stand() {
    let all = manifests();
    let mut found = Vec::new();
    for (from, apart, why) in APART {
        assert!(all.contains_key(*from), "there is no crate {from}");
        let reached = reached(from, &all);
        let broken = apart.iter().filter(|to| reached.contains(**to));
        found.extend(broken.map(|to| format!("{from} reaches {to}, but {why}")));
    }
    none(&found, "walls between crates stand");
}

#[test]
fn the_bound_sees_final_bytes() {
    let named = &manifests()["whippen-budget"];
    let found: Vec<String> = NOT_BYTES
        .iter()
        .filter(|name| named.contains(**name))
        .map(ToString::to_string)
        .collect();
    none(&found, "the bound sees final bytes");
}

#[test]
fn the_instruction_set_depends_on_nothing() {
    assert_eq!(manifests().get("whippen-isa"), Some(&BTreeSet::new()));
}

#[test]
fn what_is_slow_to_build_is_needed_in_few_places() {
    let all = manifests();
    let mut found = Vec::new();
    for (what, owners) in ALONE {
        let owns = |needs: &BTreeSet<String>| needs.iter().any(|name| name.starts_with(what));
        for owner in *owners {
            assert!(owns(&all[*owner]), "{owner} does not need {what}");
        }
        let others = all
            .iter()
            .filter(|(name, needs)| !owners.contains(&name.as_str()) && owns(needs));
        found.extend(others.map(|(name, _)| format!("{name}: {what}")));
    }
    none(&found, "nobody else needs it");
}

#[test]
fn what_a_core_can_do_is_asked_by_name() {
    let names = |text: &Text| {
        let mut lines = text.code().into_iter().map(|(_, line)| line);
        lines.any(|line| line.contains("Arch::V") || line.contains("arch =="))
    };
    let found = rust()
        .into_iter()
        .filter(|text| text.path.starts_with("compiler/arm/") && names(text))
        .map(|text| text.path)
        .collect();
    let rule = "the code generator asks for what a core can do, not for its architecture";
    only_listed(&found, ARCHITECTURES.iter().map(|e| e.0), rule);
}
