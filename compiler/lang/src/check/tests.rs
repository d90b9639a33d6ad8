//! Tests of the checker.

mod bank;
mod bundled;
mod cases;
mod messages;
mod model;
mod mutations;
mod tables;

use super::{Options, Program};
use crate::diag::{Code, Diagnostic};
use crate::front::compile_front;
use crate::lint::lint;
use crate::range::analyze;
use whippen_source::SourceMap;

/// Checks one file, and says what is surely not meant.
fn check_text(text: &str, options: &Options) -> (SourceMap, Option<Program>, Vec<Diagnostic>) {
    let mut map = SourceMap::default();
    map.add("test.whip", text);
    let (program, mut diagnostics) = compile_front(&mut map, options);
    for model in program.iter().flat_map(|p| &p.instruments) {
        diagnostics.extend(analyze(model).iter().flat_map(|ranges| lint(model, ranges)));
        // Most cases are about something else than what the player feels.
        diagnostics.retain(|d| d.code != Code::NoForce);
    }
    (map, program, diagnostics)
}
