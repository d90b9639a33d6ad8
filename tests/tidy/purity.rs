//! What code may not do: be unsafe, use floating point behind lowering, read or write, print past
//! `say`, stay unfinished.

use std::collections::BTreeSet;

use super::{Text, has_word, none, only_listed, rust};

/// The only files that may be `unsafe`: where compiled code is called.
const UNSAFE: &[&str] = &["compiler/jit/src/lib.rs", "emulator/src/translate/host.rs"];

/// Rust that is written for others to link, and an example that links it; neither is part of what
/// is built here.
const WRITTEN: &[&str] = &[
    "examples/embassy/src/main.rs",
    "tests/build/bindings/probe_module.rs",
];

/// Crates that work on integers.
const INTEGERS: &[&str] = &[
    "arm", "board", "budget", "c99", "firmware", "jit", "kernel", "modes", "wasm",
];

/// Floating point in them: file and word, why.
const FLOATS: &[(&str, &str)] = &[
    (
        "compiler/jit/src/translate/arithmetic.rs: F64",
        "the exact integer square root begins with a rounded one, corrected afterwards",
    ),
    (
        "compiler/budget/src/report.rs: f64",
        "shares of a tick, for readers; cycles are integers",
    ),
    (
        "compiler/arm/src/image/map.rs: f64",
        "a clock in MHz, in the map",
    ),
    (
        "compiler/arm/src/asm/instruction.rs: f32",
        "whether the operand of a floating-point instruction is a number",
    ),
];

/// Words that mean input, output, a clock or an environment.
const OUTSIDE: &[&str] = &["fs", "io", "env", "time", "net", "process", "thread"];

/// What is allowed all the same: file, word.
const INSIDE: &[(&str, &str)] = &[
    // Threads share work, and nothing that comes out depends on it.
    ("compiler/deterministic/src/parallel.rs", "thread"),
];

/// What no program should hold outside of its tests.
const UNFINISHED: &[&str] = &["dbg!", "todo!", "unimplemented!", ".unwrap()"];

#[test]
fn unsafe_code_stands_where_compiled_code_is_called() {
    let uses = |t: &Text| {
        let mut lines = t.rust_lines().into_iter();
        lines.any(|(_, line)| has_word(&line.code, "unsafe"))
    };
    let texts = rust();
    let found: Vec<&str> = texts
        .iter()
        .filter(|t| !WRITTEN.contains(&t.path.as_str()) && uses(t))
        .map(|t| t.path.as_str())
        .collect();
    assert_eq!(found, UNSAFE);
}

#[test]
fn what_follows_lowering_works_on_integers() {
    let mut found = BTreeSet::new();
    let folders: Vec<String> = INTEGERS
        .iter()
        .map(|c| format!("compiler/{c}/src/"))
        .collect();
    let texts = rust();
    for folder in &folders {
        let mut inside = texts
            .iter()
            .filter(|t| t.path.starts_with(folder))
            .peekable();
        assert!(inside.peek().is_some(), "{folder} is empty");
        for text in inside {
            for word in ["f32", "f64", "F32", "F64"] {
                if text.code().iter().any(|(_, code)| has_word(code, word)) {
                    found.insert(format!("{}: {word}", text.path));
                }
            }
        }
    }
    only_listed(
        &found,
        FLOATS.iter().map(|e| e.0),
        "no floating point after lowering",
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
                .find(|m| has_word(&code, &format!("std::{m}")));
            let prints = ["print!", "println!", "eprint!", "eprintln!"]
                .iter()
                .find(|m| has_word(&code, m));
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
                .iter()
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
