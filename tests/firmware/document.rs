//! The tables of docs/firmware.md beside those of the code.

use whippen_compiler::firmware::{FAULTS, core_block, key_guard, sources, support};
use whippen_runtime::board;

const DOCUMENT: &str = include_str!("../../docs/firmware.md");

/// The rows of the table with this head: their cells.
fn rows(head: &str) -> Vec<Vec<&'static str>> {
    let (_, below) = DOCUMENT.split_once(head).expect("the table is there");
    let lines = below
        .lines()
        .skip(1)
        .skip_while(|line| line.starts_with("| ---"));
    lines
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

/// Offsets and names in the first two columns.
fn offsets(head: &str) -> Vec<(String, u32)> {
    let offset = |row: Vec<&str>| {
        let at = row[0].parse().expect("an offset");
        (row[1].trim_matches('`').to_string(), at)
    };
    rows(head).into_iter().map(offset).collect()
}

fn named(all: &[(&str, u32)]) -> Vec<(String, u32)> {
    all.iter()
        .map(|&(name, at)| (name.to_string(), at))
        .collect()
}

#[test]
fn the_words_of_blocks_and_guards_are_those_of_the_code() {
    assert_eq!(offsets("| offset | name | word |"), named(core_block::ALL));
    assert_eq!(offsets("| offset | name | what |"), named(key_guard::ALL));
}

#[test]
fn every_fault_has_its_row() {
    let told: Vec<u32> = rows("| what happens | what follows | fault |")
        .iter()
        .filter_map(|row| row[2].parse().ok())
        .collect();
    let bits: Vec<u32> = FAULTS.iter().map(|fault| fault.bit).collect();
    assert_eq!(told, bits);
}

#[test]
fn every_board_has_the_functions_of_the_table() {
    let told = rows("| function | called | does |");
    let names: Vec<&str> = told
        .iter()
        .flat_map(|row| row[0].split(", "))
        .map(|name| name.trim_matches('`'))
        .collect();
    assert!(names.len() >= 9, "{names:?}");
    for board in [
        "rp2350",
        "rp2040",
        "stm32f4",
        "pico2_knob",
        "pico2_strings",
        "pico2_two_knobs",
        "pico2_four_knobs",
        "rp2350b_bench",
    ] {
        let board = board::bundled(board).expect("it is bundled");
        let support = support(&board).unwrap_or_else(|e| panic!("{e}"));
        let texts: Vec<_> = sources(&support, &crate::rig::setup())
            .into_iter()
            .flatten()
            .collect();
        for name in &names {
            let label = format!("\n{name}:");
            let has = texts.iter().filter(|source| source.text.contains(&label));
            assert_eq!(has.count(), 1, "{}: {name}", board.name);
        }
    }
}
