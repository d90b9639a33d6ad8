//! Cycles against counts derived on paper, program by program.

mod mutation;
mod program;

use program::{Program, parse};
use whippen_isa::timing::Core;

/// The programs of a file, and how they come out on `core`.
fn check(core: &Core, text: &str) {
    let programs = parse(text, core);
    let wrong: Vec<String> = programs.iter().filter_map(|p| difference(core, p)).collect();
    assert!(!programs.is_empty() && wrong.is_empty(), "{}", wrong.join("\n"));
}

fn difference(core: &Core, program: &Program) -> Option<String> {
    let run = program.run(core);
    (run.cycles != program.want)
        .then(|| format!("{}: {} cycles, on paper {}\n{}", program.title, run.cycles, program.want, run.listing))
}

const PUBLISHED_M33: &str = include_str!("published-m33.txt");
const RULES_M33: &str = include_str!("rules-m33.txt");

#[test]
fn published_cortex_m33() {
    check(&Core::cortex_m33(), PUBLISHED_M33);
}

#[test]
fn rules_cortex_m33() {
    check(&Core::cortex_m33(), RULES_M33);
}

#[test]
fn every_number_of_cortex_m33_matters() {
    no_survivors(&Core::cortex_m33(), &[PUBLISHED_M33, RULES_M33]);
}

fn no_survivors(core: &Core, texts: &[&str]) {
    let programs: Vec<Program> = texts.iter().flat_map(|text| parse(text, core)).collect();
    let survivors = mutation::survivors(core, &programs);
    assert!(survivors.is_empty(), "changed by one, and nothing comes out otherwise:\n{}", survivors.join("\n"));
}

const RULES_M0PLUS: &str = include_str!("rules-m0plus.txt");
const RULES_M4: &str = include_str!("rules-m4.txt");

#[test]
fn rules_cortex_m0plus() {
    check(&Core::cortex_m0plus(), RULES_M0PLUS);
}

#[test]
fn rules_cortex_m4() {
    check(&Core::cortex_m4(), RULES_M4);
}

#[test]
fn every_number_of_cortex_m0plus_matters() {
    no_survivors(&Core::cortex_m0plus(), &[RULES_M0PLUS]);
}

#[test]
fn every_number_of_cortex_m4_matters() {
    no_survivors(&Core::cortex_m4(), &[RULES_M4]);
}
