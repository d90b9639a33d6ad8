//! Packages: none includes a file from outside of it, and what all are made of on this system may
//! be passed on under the project's licences.

use std::path::{Component, Path, PathBuf};
use std::process::Command;

use super::{Text, crate_of, crates, none, root, rust};

/// The licences that `deny.toml` allows.
fn licences() -> Vec<String> {
    let table = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml");
    let list = table.split("allow = [").nth(1).expect("a list of licences");
    let list = list.split(']').next().unwrap_or_default();
    let quoted = list.split('"').skip(1).step_by(2);
    quoted.map(str::to_string).collect()
}

/// A package that has a licence of its own, where its feature is asked for (`exceptions` there).
const EXCEPTIONS: &[(&str, &str)] = &[("serialport", "MPL-2.0")];

/// Where a path leads from the folder of a file, without `..`.
fn resolved(file: &str, path: &str) -> String {
    let mut found = PathBuf::new();
    let from = Path::new(file).parent().expect("a file is in a folder");
    for part in from.join(path).components() {
        match part {
            Component::ParentDir => drop(found.pop()),
            part => found.push(part),
        }
    }
    found.to_str().expect("a plain path").to_string()
}

#[test]
fn what_a_package_includes_is_in_it() {
    let (texts, crates) = (rust(), crates());
    assert!(crates.contains(&"instruments/".to_string()), "{crates:?}");
    let (mut found, mut looked_at) = (Vec::new(), 0);
    // Tests, benchmarks and examples of the repository are in no package.
    let is_packed = |text: &&Text| {
        let folder = text.path.split('/').next().unwrap_or_default();
        !text.is_test() && !["benches", "examples"].contains(&folder)
    };
    for text in texts.iter().filter(is_packed) {
        for macro_name in ["include_str!(\"", "include_bytes!(\""] {
            for (at, _) in text.text.match_indices(macro_name) {
                let path = &text.text[at + macro_name.len()..];
                let path = path.split('"').next().unwrap_or_default();
                let leads_to = resolved(&text.path, path);
                looked_at += 1;
                let (of, to) = (crate_of(&text.path, &crates), crate_of(&leads_to, &crates));
                let inside = of == to && (!of.is_empty() || leads_to.starts_with("src/"));
                if !inside {
                    found.push(format!("{} includes {leads_to}", text.path));
                }
            }
        }
    }
    assert!(looked_at > 20, "{looked_at} inclusions");
    none(&found, "what a package includes is in it");
}

/// Whether one of the choices that a licence leaves is one of these.
fn is_listed(licence: &str, licences: &[String]) -> bool {
    let plain = licence.replace('/', " OR ").replace(['(', ')'], "");
    let is_known = |one: &str| licences.iter().any(|known| known == one.trim());
    let has_choice = |part: &str| part.split(" OR ").any(is_known);
    plain.split(" AND ").all(has_choice)
}

#[test]
fn what_all_are_made_of_may_be_passed_on() {
    let licences = licences();
    let is_listed = |licence: &str| is_listed(licence, &licences);
    assert!(!is_listed("GPL-3.0-only") && !is_listed("MIT AND GPL-2.0"));
    assert!(is_listed("(MIT OR Apache-2.0) AND Unicode-3.0") && is_listed("Unlicense/MIT"));
    let table = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml");
    for (name, licence) in EXCEPTIONS {
        assert!(table.contains(&format!(
            "{{ allow = [\"{licence}\"], crate = \"{name}\" }}"
        )));
    }
    let all: &[&str] = match cfg!(feature = "probe") {
        true => &["--all-features"],
        false => &[],
    };
    let told = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(all)
        .args(["--filter-platform", "host-tuple"])
        .output()
        .expect("cargo starts");
    assert!(
        told.status.success(),
        "{}",
        String::from_utf8_lossy(&told.stderr)
    );
    let told: serde_json::Value = serde_json::from_slice(&told.stdout).expect("JSON");
    let nodes = told["resolve"]["nodes"].as_array().expect("a graph");
    let packages = told["packages"].as_array().expect("packages");
    let used = |id: &serde_json::Value| nodes.iter().any(|node| node["id"] == *id);
    let mut found = Vec::new();
    for package in packages.iter().filter(|package| used(&package["id"])) {
        let licence = package["license"].as_str().unwrap_or("no licence");
        let name = package["name"].as_str().unwrap_or_default();
        let is_excepted = !all.is_empty() && EXCEPTIONS.contains(&(name, licence));
        if !is_listed(licence) && !is_excepted {
            found.push(format!("{}: {licence}", package["name"]));
        }
    }
    assert!(nodes.len() > 100, "{} packages", nodes.len());
    none(&found, "what all are made of may be passed on");
}
