//! `whippen dump`

use clap::ValueHint;
use whippen_compiler::c99;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::kernel::{Kernel, without_probes};
use whippen_compiler::modes::{self, INSTRUCTIONS, Modes, verify};
use whippen_compiler::pipeline::PASSES;
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::{parse, pretty};
use whippen_compiler::thumb::{self, Function, Pass};
use whippen_runtime::device::Device;

use super::{load, setup};
use crate::exit::{Failure, Outcome};
use crate::say;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen dump instruments/grand-piano.whip --after lower
         whippen dump instruments/hammond.whip --after schedule --mode 0"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    /// The last pass to run: parse, check, simplify, lower, modes, select, promote, schedule,
    /// allocate, reorder or emit
    #[arg(long, value_name = "PASS", default_value = "lower")]
    after: String,
    /// Leave out what only traces need: probes, and events for transitions
    #[arg(long)]
    bare: bool,
    /// From `select` on: the code of this mode alone
    #[arg(long, value_name = "N")]
    mode: Option<usize>,
    /// From `select` on: for the core of this board; the keyboard's, or rp2350 otherwise
    #[arg(long, value_name = "NAME|FILE.toml")]
    board: Option<String>,
}

/// Keys of the object whose code is shown, where no keyboard says otherwise.
const KEYS: u32 = 88;

pub fn run(args: &Args) -> Outcome {
    let Some(pass) = PASSES.iter().position(|(name, _)| *name == args.after) else {
        let known: Vec<String> = PASSES
            .iter()
            .map(|(name, what)| format!("  {name:<10}{what}"))
            .collect();
        return Err(Failure::Usage(format!(
            "`{}` is no pass; passes are\n{}",
            args.after,
            known.join("\n")
        )));
    };
    let code_pass = Pass::named(&args.after);
    if code_pass.is_none() && (args.mode.is_some() || args.board.is_some()) {
        return Err(Failure::Usage(format!(
            "--mode and --board are for machine code: for passes from `select` on, not for `{}`",
            args.after
        )));
    }
    let (files, name) = load::split(&args.words)?;
    let texts = load::read(&files)?;
    if pass == 0 {
        return parsed(&texts);
    }
    let (map, program) = load::checked(&texts, &Options::default(), Severity::Warning)?;
    let model = load::instrument(&program, name)?;
    if pass == 1 {
        say::whole(&model.to_string());
        return Ok(());
    }
    // Machine code has no probes, and reports no transitions.
    let observe = !args.bare && code_pass.is_none();
    let compiled = load::compiled(&map, model.clone(), &Device::of(model), observe)?;
    match (pass, code_pass) {
        (2, _) => say::whole(&compiled.step.model.to_string()),
        (3, _) => say::whole(&compiled.lowered.kernel.to_string()),
        (_, None) => say::whole(&specialised(&compiled.lowered.kernel)?.to_string()),
        (_, Some(pass)) => {
            let keyboard = program.keyboards.first();
            let board = setup::board(args.board.as_deref(), keyboard)?;
            let modes = specialised(&compiled.lowered.kernel)?;
            let options = thumb::Options {
                name: c99::Names::new(&modes.kernel).kernel,
                keys: keyboard.map_or(KEYS, |keyboard| keyboard.keys() as u32),
                gain: false,
                probes: false,
                arch: board.arch,
            };
            say::whole(&code(&modes, pass, &options, args.mode)?);
        }
    }
    Ok(())
}

/// The code of all modes after a pass of the back end, or of one.
fn code(
    modes: &Modes,
    pass: Pass,
    options: &thumb::Options,
    only: Option<usize>,
) -> Result<String, Failure> {
    if let Some(mode) = only.filter(|mode| *mode >= modes.modes.len()) {
        return Err(Failure::Usage(format!(
            "there is no mode {mode}: `{}` has {}, from 0 on",
            modes.kernel.name,
            modes.modes.len()
        )));
    }
    let functions = thumb::code_after(pass, modes, options).map_err(setup::no_code)?;
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
    let facts: Vec<String> = mode
        .into_iter()
        .chain(cycles)
        .filter(|fact| !fact.is_empty())
        .collect();
    let comment = if facts.is_empty() { "" } else { " ; " };
    format!(
        "{}:{comment}{}\n{}",
        function.name,
        facts.join("; "),
        function.text
    )
}

/// The modes of a kernel, verified.
fn specialised(kernel: &Kernel) -> Result<Modes, Failure> {
    let modes = modes::specialise(&without_probes(kernel), INSTRUCTIONS);
    verify::verify(&modes).map_err(|errors| {
        let all: Vec<String> = errors.iter().map(ToString::to_string).collect();
        Failure::Defect(format!(
            "the modes of `{}`: {}",
            kernel.name,
            all.join("; ")
        ))
    })?;
    Ok(modes)
}

/// The trees as source text; mistakes are told, and what could be read is printed all the same.
fn parsed(texts: &[(String, String)]) -> Outcome {
    let (mut map, mut diagnostics) = (SourceMap::default(), Vec::new());
    for (name, text) in texts {
        let index = map.add(name, text);
        say::whole(&pretty::print(&parse(index, text, &mut diagnostics)).to_string());
    }
    load::print(&map, &diagnostics, Severity::Note);
    if diagnostics.is_empty() {
        Ok(())
    } else {
        Err(Failure::Program)
    }
}
