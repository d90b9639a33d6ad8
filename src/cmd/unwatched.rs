//! `--watch` in a module of the command (`docs/studio.md`): nobody else saves files there.

use std::path::PathBuf;

use crate::exit::{Failure, Outcome};

/// Refuses.
pub fn watch(_files: &[PathBuf], _job: impl FnMut() -> Outcome) -> Outcome {
    let why = "--watch needs files that somebody else saves, which a module has not";
    Err(Failure::Usage(why.to_string()))
}
