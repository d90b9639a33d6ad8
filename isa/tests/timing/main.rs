//! Cycles against counts derived on paper, program by program.

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

#[test]
fn published_cortex_m33() {
    check(&Core::cortex_m33(), include_str!("published-m33.txt"));
}
