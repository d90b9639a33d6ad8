//! Recorded keyswitches, where they are: the table of `docs/import.md`, which `WHIPPEN_BLESS=1`
//! rewrites.

use std::path::Path;

use serde_json::Value;

use super::{Told, there_and_back};
use crate::cli::Shell;
use crate::common;

/// How far a recording may come back (gf rms), glitches aside.
const RMS_GF: f64 = 1.0;
/// The boards, in the order of the columns.
const BOARDS: [&str; 3] = ["rp2350", "stm32f4", "rp2040"];
/// Around the table in the document.
const MARKS: [&str; 2] = ["<!-- keyswitches -->\n", "<!-- end of keyswitches -->\n"];

/// Cells of both tables in integers, and their bytes: words of 32 bits.
fn sizes(program: &str) -> (usize, usize) {
    let compiled = common::compiled("switch.whip", program, &[]).remove(0);
    let tables = &compiled.lowered.kernel.tables;
    let cells = tables.iter().map(|table| table.rows()).sum();
    let words: usize = tables.iter().map(|table| table.values.len()).sum();
    (cells, 4 * words)
}

/// Cycles that a key is proven to take at most on a board, waiting for memory included.
fn cycles_max(shell: &Shell, board: &str) -> u64 {
    let args = ["budget", "switch.whip", "--keys", "2", "--json", "--board"];
    let (out, _) = shell.ends(0, &[&args[..], &[board]].concat());
    let found: Value = serde_json::from_str(&out).expect("JSON");
    let of_key = |name: &str| found["key"][name].as_u64().expect("cycles");
    of_key("cycles_max") + of_key("contention_cycles_max")
}

fn row(name: &str, told: &Told) -> String {
    let shell = Shell::new().with("switch.whip", &told.program);
    let cycles = BOARDS.map(|board| cycles_max(&shell, board).to_string());
    let (cells, bytes) = sizes(&told.program);
    let json = &told.json;
    format!(
        "| {name} | {} + {} | {} | {:.2} | {} | {cells} | {bytes} | {} |\n",
        json["knots"][0],
        json["knots"][1],
        json["give_mm"],
        told.rms_gf,
        json["glitches"].as_array().map_or(0, Vec::len),
        cycles.join(" | "),
    )
}

fn table(rows: &str) -> String {
    let heads = [
        "recording",
        "knots",
        "give (mm)",
        "rms (gf)",
        "glitches",
        "cells",
        "bytes",
    ];
    let boards = BOARDS.map(|board| format!("{board}: cycles of a key"));
    format!(
        "| {} | {} |\n| {} |\n{rows}",
        heads.join(" | "),
        boards.join(" | "),
        ["---"; 10].join(" | ")
    )
}

/// What stands between the marks of the document is this.
fn stands(table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/import.md");
    let document = std::fs::read_to_string(&path).expect("the document");
    let (before, rest) = document.split_once(MARKS[0]).expect("the table begins");
    let (now, after) = rest.split_once(MARKS[1]).expect("the table ends");
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        let [begin, end] = MARKS;
        let new = format!("{before}{begin}{table}{end}{after}");
        std::fs::write(&path, new).expect("the document can be written");
        return;
    }
    let bless = "WHIPPEN_BLESS=1 cargo test --test it recorded_keyswitches";
    assert!(now == table, "bless with {bless}:\n{table}");
}

#[test]
fn recorded_keyswitches_come_back() {
    let Some(folder) = whippen_need::recordings("keyswitches") else {
        return;
    };
    let entries = std::fs::read_dir(folder.join("curves")).expect("a folder");
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    assert_eq!(paths.len(), 33);
    let (mut rows, mut far) = (String::new(), Vec::new());
    for path in &paths {
        let text = std::fs::read_to_string(path).expect("readable");
        let told = there_and_back(&text);
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        rows += &row(&name, &told);
        if told.rms_gf > RMS_GF {
            far.push((name.clone(), told.rms_gf));
        }
        let is_spring = !told.json["spring_n_per_m"].is_null();
        assert_eq!(is_spring, name.starts_with("Springs"), "{name}");
    }
    assert!(far.is_empty(), "{far:?}");
    stands(&table(&rows));
}
