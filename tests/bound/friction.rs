//! What a friction takes of a Cortex-M33, by the bound of a program with it and without.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Cycles of a key at most.
fn cycles_of(folder: &Path, text: &str) -> u64 {
    std::fs::write(folder.join("program.whip"), text).expect("writable");
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    let output = command
        .current_dir(folder)
        .args(["budget", "program.whip", "--keys", "2", "--json"])
        .output()
        .expect("the command runs");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    found["key"]["cycles_max"].as_u64().expect("a number")
}

/// A program without the lines that have one of these.
fn without(text: &str, these: &[&str]) -> String {
    let has = |line: &str| these.iter().any(|what| line.contains(what));
    text.lines()
        .filter(|line| !has(line))
        .map(|line| format!("{line}\n"))
        .collect()
}

/// The goal is 250 for both.
#[test]
fn a_friction_takes_no_more_than_it_did() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cycles = |text: &str| cycles_of(folder.path(), text);
    let string = include_str!("../programs/bowed_string.whip");
    let string = string.replace("ends     pinned", "ends     pinned\n        points 61");
    let free = without(&string, &["friction bow", "let rubs", "let slips"]);
    let of_string = cycles(&string) - cycles(&free);
    let body = include_str!("../programs/rubbed_mass.whip");
    let free = without(body, &["friction stick", "let slip", "event let_go"]);
    let free = free.replace("1e-5 * stick", "0 N");
    let of_body = cycles(body) - cycles(&free);
    println!("of a string {of_string}, of a body {of_body}");
    assert!(of_body > 100 && of_body <= 250, "{of_body}");
    assert!(of_string > 100 && of_string <= 250, "{of_string}");
}
