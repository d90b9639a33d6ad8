//! Recorded keyswitches, where they are: the table of `docs/import.md`, which `WHIPPEN_BLESS=1`
//! rewrites.

use std::path::Path;

use serde_json::Value;

use super::{Told, swept, there_and_back};
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

/// Cycles that a key is proven to take at most on a board, waiting for memory included, and how
/// many keys are proven to fit.
fn proven(shell: &Shell, board: &str) -> String {
    let args = ["budget", "switch.whip", "--most-keys", "--json", "--board"];
    let (out, _) = shell.ends(0, &[&args[..], &[board]].concat());
    let found: Value = serde_json::from_str(&out).expect("JSON");
    let number = |value: &Value| value.as_u64().expect("a number");
    let of_key = |name: &str| number(&found["key"][name]);
    let cycles_max = of_key("cycles_max") + of_key("contention_cycles_max");
    format!("{cycles_max} | {}", number(&found["keys"]))
}

fn row(name: &str, told: &Told) -> String {
    let shell = Shell::new().with("switch.whip", &told.program);
    let proven = BOARDS.map(|board| proven(&shell, board));
    let (cells, bytes) = sizes(&told.program);
    let json = &told.json;
    format!(
        "| {name} | {} + {} | {} | {:.2} | {} | {cells} | {bytes} | {} |\n",
        json["knots"][0],
        json["knots"][1],
        json["give_mm"],
        told.rms_gf,
        json["glitches"].as_array().map_or(0, Vec::len),
        proven.join(" | "),
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
    let boards = BOARDS.map(|board| format!("{board}: cycles of a key | keys"));
    format!(
        "| {} | {} |\n| {} |\n{rows}",
        heads.join(" | "),
        boards.join(" | "),
        ["---"; 13].join(" | ")
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

/// Places of the grid (mm), and what a word of the sensor may add to the way between two.
const STEP_MM: f64 = 2e-3;
const WORD_MM: f64 = 0.2e-3;

/// A stroke that turns round on its way stays between the curves, and from place to place its force
/// changes by no more than they do and the gap between them over `give`.
fn partial_strokes_do_not_jump(name: &str, told: &Told) {
    let [low, high] = [0, 1].map(|end| told.json["travel_mm"][end].as_f64().expect("a number"));
    let give_mm = told.json["give_mm"].as_f64().expect("a number");
    let last = ((high - low) / STEP_MM) as usize;
    let forces = |way: &[usize]| {
        let places: Vec<f64> = way.iter().map(|n| low + *n as f64 * STEP_MM).collect();
        swept("switch.whip", &told.program, &places)
    };
    let there_and_back: Vec<usize> = (0..=last).chain((0..last).rev()).collect();
    let whole = forces(&there_and_back);
    let curves = |n: usize| (whole[n], whole[2 * last - n]);
    let turns =
        [0.0, 0.6, 0.55, 0.7, 0.3, 0.32, 0.5, 0.2].map(|part| (part * last as f64) as usize);
    let mut way = vec![turns[0]];
    for two in turns.windows(2) {
        match two[0] < two[1] {
            true => way.extend(two[0] + 1..=two[1]),
            false => way.extend((two[1]..two[0]).rev()),
        }
    }
    let partial = forces(&way);
    for (step, two) in partial.windows(2).enumerate() {
        let [(press, back), (next_press, next_back)] = [way[step], way[step + 1]].map(curves);
        let gap = (press - back).abs().max((next_press - next_back).abs());
        let curve = (next_press - press).abs().max((next_back - back).abs());
        let most = curve + gap * (STEP_MM + WORD_MM) / give_mm + 0.05;
        assert!(
            (two[1] - two[0]).abs() < most,
            "{name}, step {step}: {two:?}, {most}"
        );
        let (least, most) = (next_press.min(next_back), next_press.max(next_back));
        let between = least - 0.05..=most + 0.05;
        assert!(
            between.contains(&two[1]),
            "{name}, step {step}: {two:?}, {between:?}"
        );
    }
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
        partial_strokes_do_not_jump(&name, &told);
        if told.rms_gf > RMS_GF {
            far.push((name.clone(), told.rms_gf));
        }
        let is_spring = !told.json["spring_n_per_m"].is_null();
        assert_eq!(is_spring, name.starts_with("Springs"), "{name}");
    }
    assert!(far.is_empty(), "{far:?}");
    stands(&table(&rows));
}
