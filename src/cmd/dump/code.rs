//! `whippen dump` of machine code: what the object of a core's keys is made of, pass by pass.

use whippen_compiler::c99::Names;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::modes::{INSTRUCTIONS, ModeId, Modes};
use whippen_compiler::pipeline::{specialize, unobserved};
use whippen_compiler::thumb::{self, Function, Pass, code_after};

use super::{Args, Opened, load, setup};
use crate::exit::{Failure, Outcome};
use crate::say;

/// Prints the code of all modes after a pass, or of one; after the last that of all functions.
pub fn dump_code(args: &Args, pass: Pass) -> Outcome {
    let opened = Opened::words(&args.words)?;
    let (map, program) = load::checked(&opened.sources, &Options::default(), Severity::Warning)?;
    let model = load::instrument(&program, opened.name)?;
    let keyboard = program.keyboards.first();
    let board = setup::find_board(args.board.as_deref(), keyboard)?;
    let device = load::device(None, &map, &program, model)?;
    // Machine code has no probes, and reports no transitions.
    let compiled = load::compiled(&map, model.clone(), &device, false)?;
    let modes = specialize(&compiled, INSTRUCTIONS, &mut unobserved)
        .map_err(|error| load::report_compile_error(&map, error))?;
    let options = thumb::Options {
        name: Names::new(&modes.kernel).kernel,
        keys: keyboard.map_or(setup::KEYS, |keyboard| keyboard.layout.keys),
        gain: false,
        probes: false,
        arch: board.arch,
    };
    say::whole(&code_text(&modes, pass, &options, args.mode.map(ModeId))?);
    Ok(())
}

fn code_text(
    modes: &Modes,
    pass: Pass,
    options: &thumb::Options,
    only: Option<ModeId>,
) -> Result<String, Failure> {
    if let Some(mode) = only.filter(|mode| modes.modes.get(*mode).is_none()) {
        return Err(Failure::Usage(format!(
            "there is no mode {mode}: `{}` has {}, from 0 on",
            modes.kernel.name,
            modes.modes.len()
        )));
    }
    let functions = code_after(pass, modes, options).map_err(setup::code_failure)?;
    let chosen = functions
        .iter()
        .filter(|function| only.is_none() || function.mode == only);
    let texts: Vec<String> = chosen.map(|function| titled(modes, function)).collect();
    Ok(texts.join("\n"))
}

/// A function's code below its name, that of its mode, and what its longest path takes.
fn titled(modes: &Modes, function: &Function) -> String {
    let mode = function.mode.map(|mode| modes.modes[mode].name.clone());
    let cycles = function
        .cycles
        .map(|cycles| format!("longest path about {cycles} cycles"));
    let facts = mode.into_iter().chain(cycles);
    let facts: Vec<String> = facts.filter(|fact| !fact.is_empty()).collect();
    let comment = if facts.is_empty() { "" } else { " ; " };
    let (name, text) = (&function.name, &function.text);
    format!("{name}:{comment}{}\n{text}", facts.join("; "))
}
