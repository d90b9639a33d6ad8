//! Tests of the checker.

mod bundled;
mod cases;
mod messages;
mod model;
mod mutations;

use super::{Options, Program};
use crate::diag::Diagnostic;
use crate::front::compile_front;
use crate::source::SourceMap;

/// Checks one file.
fn check_text(text: &str, options: &Options) -> (SourceMap, Option<Program>, Vec<Diagnostic>) {
    let mut map = SourceMap::default();
    map.add("test.whip", text);
    let (program, diagnostics) = compile_front(&mut map, options);
    (map, program, diagnostics)
}
