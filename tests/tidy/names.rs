//! One name, one thing: no two types of a crate share a name.

use std::collections::{BTreeMap, BTreeSet};

use super::{crate_of, crates, only_listed, rust};

/// Names that stand twice in a crate: crate and name, why.
const TWICE: &[(&str, &str)] = &[
    ("Args", "arguments of each command"),
    ("compiler/lang/Action", "in the text and in the model"),
    (
        "compiler/lang/Cell",
        "of the model, and of a row in the layout",
    ),
    ("compiler/lang/Item", "in the text and in the model"),
    ("compiler/lang/Keyboard", "in the text and in the model"),
    ("emulator/Exit", "with translation, and without"),
    ("emulator/Host", "with translation, and without"),
    ("emulator/Native", "with translation, and without"),
    ("emulator/Node", "with translation, and without"),
    ("emulator/RunMode", "with translation, and without"),
    ("emulator/Time", "with translation, and without"),
    ("emulator/Translated", "with translation, and without"),
];

/// The name of the type that a line of code defines.
fn defined(code: &str) -> Option<&str> {
    let mut words = code.split_whitespace();
    let mut word = words.next()?;
    while word.starts_with("pub") || word == "in" || word.ends_with(')') {
        word = words.next()?;
    }
    if !["struct", "enum", "union"].contains(&word) {
        return None;
    }
    let name = words.next()?;
    let end = name.find(|c: char| !c.is_alphanumeric() && c != '_');
    let name = &name[..end.unwrap_or(name.len())];
    name.starts_with(char::is_uppercase).then_some(name)
}

#[test]
fn a_crate_has_one_type_of_a_name() {
    assert_eq!(defined("pub(in crate::a) struct Name<'a> {"), Some("Name"));
    let crates = crates();
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for text in rust().iter().filter(|text| text.path.contains("src/")) {
        for (number, code) in text.code() {
            if let Some(name) = defined(&code) {
                let name = format!("{}{name}", crate_of(&text.path, &crates));
                let place = format!("{}:{number}", text.path);
                places.entry(name).or_default().push(place);
            }
        }
    }
    assert!(places.len() > 500, "only {} types were found", places.len());
    places.retain(|_, places| places.len() > 1);
    places
        .iter()
        .for_each(|(name, at)| println!("{name}: {at:?}"));
    let found: BTreeSet<String> = places.into_keys().collect();
    only_listed(&found, TWICE.iter().map(|e| e.0), "one name, one thing");
}
