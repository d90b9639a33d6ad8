//! Bare `whippen`: the bundled grand piano on the bundled gesture, to see at once what this is.

use std::path::{Path, PathBuf};

use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::files::write_whole;

use super::load;
use super::motion::{MotionArgs, Positions};
use super::run::{self, Outputs};
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// Where it writes.
const FOLDER: &str = "whippen-tour";

/// The bundled grand piano.
const GRAND: &str = include_str!("../../instruments/grand-piano.whip");

pub fn run() -> Outcome {
    let files = [("<instruments/grand-piano.whip>".to_string(), GRAND.to_string())];
    let (map, program) = load::checked(&files, &Options::default(), Severity::Warning)?;
    let device = Device::mikey();
    let model = load::instrument(&program, None)?.clone();
    let positions: Positions = MotionArgs::bundled(&model);
    let compiled = load::compiled(&map, model, &device, true)?;
    let played = run::play(&compiled, &device, EngineKind::Jit, &positions)?;
    run::summary(&compiled, &played, EngineKind::Jit, &positions);

    std::fs::create_dir_all(FOLDER).map_err(|e| Failure::Usage(format!("cannot make the folder `{FOLDER}`: {e}")))?;
    let file = |name: &str| -> PathBuf { Path::new(FOLDER).join(name) };
    let outputs = Outputs {
        out: Some(file("grand-piano.csv")),
        every: 44,
        events: Some(file("grand-piano-events.csv")),
        plot: vec![file("grand-piano.png"), file("grand-piano.svg")],
        report: None,
    };
    run::write(&outputs, &compiled, &played)?;
    let profile = file("grand-piano.whip");
    keep(&profile)?;
    say!("profile: {}", profile.display());
    say!("next: open {FOLDER}/grand-piano.png, change the profile, and `whippen run {}`", profile.display());
    Ok(())
}

/// Writes the profile to play with, unless there is one already: it may have been changed.
fn keep(profile: &Path) -> Outcome {
    if profile.exists() {
        return Ok(());
    }
    write_whole(profile, |file| file.write_all(GRAND.as_bytes())).map_err(|e| Failure::Usage(e.to_string()))
}
