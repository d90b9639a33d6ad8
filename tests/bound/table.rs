//! Tables of `docs/bars.md`: how many keys of each instrument are proven to fit, and what the terms
//! of the library take. `WHIPPEN_BLESS=1` rewrites them.

use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use serde_json::Value;
use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::lower::ExportKind;

/// Tests on several threads rewrite one document.
static DOCUMENT: Mutex<()> = Mutex::new(());

/// The boards, in the order of the columns.
const BOARDS: [&str; 3] = ["rp2350", "stm32f4", "rp2040"];

/// `whippen budget FILE --board BOARD --most-keys --json`; none where there is no image.
fn budget(file: &str, name: &str, board: &str) -> Option<Value> {
    let path = format!("instruments/{file}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["budget", &path, name, "--board", board]);
    let output = command
        .args(["--most-keys", "--json"])
        .output()
        .expect("the command runs");
    // 1: not even the fewest keys fit.
    matches!(output.status.code(), Some(0 | 1))
        .then(|| serde_json::from_slice(&output.stdout).expect("JSON"))
}

/// Cycles of a key, what it waits, and how many fit.
fn columns(found: &Value) -> String {
    let key = &found["key"];
    let keys = if found["fits"] == Value::Bool(true) {
        found["keys"].to_string()
    } else {
        "none".to_string()
    };
    format!(
        "{} + {} | {keys}",
        key["cycles_max"], key["contention_cycles_max"]
    )
}

fn table() -> String {
    let heads = BOARDS.map(|board| format!("{board}: cycles of a key | keys at 44.1 kHz"));
    let mut text = format!(
        "| instrument | {} |\n| --- | {} |\n",
        heads.join(" | "),
        ["---"; 6].join(" | ")
    );
    for compiled in crate::image::instruments() {
        let name = compiled.model.name.clone();
        let holds = |text: &str| text.contains(&format!("instrument {name} "));
        let file = INSTRUMENTS
            .iter()
            .find(|(_, text)| holds(text))
            .map(|(file, _)| *file)
            .expect("it is bundled");
        let found: Option<Vec<Value>> = BOARDS
            .into_iter()
            .map(|board| budget(file, &name, board))
            .collect();
        let Some(found) = found else { continue };
        let row: Vec<String> = found.iter().map(columns).collect();
        text += &format!(
            "| [{name}](../instruments/{file}) | {} |\n",
            row.join(" | ")
        );
    }
    text
}

/// The key of a program: its cycles, and what it may wait.
fn key_of(folder: &Path, file: &str, board: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    let output = command
        .current_dir(folder)
        .args(["budget", file, "--keys", "2", "--board", board, "--json"])
        .output()
        .expect("the command runs");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let key = &found["key"];
    format!("{} + {}", key["cycles_max"], key["contention_cycles_max"])
}

/// What the programs of the library's pages take, each with a term.
fn terms() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = std::fs::read_to_string(root.join("docs/std.md")).expect("the library's pages");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let boards = ["rp2350", "stm32f4"];
    let mut text = format!(
        "| program | {} | error of one tick |\n| --- | --- | --- | --- |\n",
        boards.join(" | ")
    );
    for program in pages.split("```whip\n").skip(1) {
        let program = program.split("```").next().expect("its end");
        let compiled = crate::common::compiled("std.whip", program, &[]).remove(0);
        let file = format!("{}.whip", compiled.model.name);
        std::fs::write(folder.path().join(&file), program).expect("writable");
        let key = boards.map(|board| key_of(folder.path(), &file, board));
        let exports = compiled.lowered.exports.iter();
        let out = exports.filter(|e| match e.kind {
            ExportKind::Total(_) => !compiled.model.forces.is_empty(),
            ExportKind::Channel(_) => true,
            _ => false,
        });
        let errors: Vec<String> = out
            .map(|e| {
                format!(
                    "{:.1e} {}",
                    e.error,
                    if e.name == "force" { "N" } else { "" }
                )
            })
            .collect();
        let errors = errors
            .iter()
            .map(|e| e.trim())
            .collect::<Vec<_>>()
            .join(", ");
        text += &format!(
            "| {} | {} | {errors} |\n",
            compiled.model.name,
            key.join(" | ")
        );
    }
    text
}

/// What stands between two marks of the document is this.
fn stands(mark: &str, bless: &str, table: &str) {
    let (begin, end) = (
        format!("<!-- {mark} -->\n"),
        format!("<!-- end of {mark} -->\n"),
    );
    let _guard = DOCUMENT.lock().unwrap_or_else(PoisonError::into_inner);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/bars.md");
    let document = std::fs::read_to_string(&path).expect("the document");
    let (before, rest) = document.split_once(&begin).expect("the table begins");
    let (_, after) = rest.split_once(&end).expect("the table ends");
    let new = format!("{before}{begin}{table}{end}{after}");
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&path, &new).expect("the document can be written");
    }
    let now = std::fs::read_to_string(&path).expect("the document");
    assert!(
        now == new,
        "bless with WHIPPEN_BLESS=1 cargo test --test bound {bless}:\n{table}"
    );
}

#[test]
fn the_table_of_most_keys_is_what_the_command_prints() {
    stands("most keys", "most_keys", &table());
}

#[test]
fn the_table_of_library_terms_is_what_the_command_prints() {
    stands("terms", "library_terms", &terms());
}
