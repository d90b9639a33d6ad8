//! `whippen dump`

use clap::ValueHint;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::kernel::{Kernel, without_probes};
use whippen_compiler::modes::{self, INSTRUCTIONS, Modes, verify};
use whippen_compiler::pipeline::PASSES;
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::{parse, pretty};
use whippen_runtime::device::Device;

use super::load;
use crate::exit::{Failure, Outcome};
use crate::say;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen dump instruments/grand-piano.whip --after lower")]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    /// The last pass to run: parse, check, simplify, lower or modes
    #[arg(long, value_name = "PASS", default_value = "lower")]
    after: String,
    /// Leave out what only traces need: probes, and events for transitions
    #[arg(long)]
    bare: bool,
}

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
    let compiled = load::compiled(&map, model.clone(), &Device::of(model), !args.bare)?;
    match pass {
        2 => say::whole(&compiled.step.model.to_string()),
        3 => say::whole(&compiled.lowered.kernel.to_string()),
        _ => say::whole(&specialised(&compiled.lowered.kernel)?.to_string()),
    }
    Ok(())
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
