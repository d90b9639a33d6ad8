//! `whippen dump`

mod code;

use std::ffi::OsString;
use std::fmt::Display;

use clap::ValueHint;
use whippen_compiler::check::{Options, Program};
use whippen_compiler::diag::Severity;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::model::Model;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, Observer, PASSES, Pass};
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::{parse, pretty};
use whippen_compiler::thumb;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup_to_bound};

use super::opened::Opened;
use super::{load, option, setup};
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
    words: Vec<OsString>,
    /// The last pass to run: parse, check, simplify, lower, modes; select, promote, schedule,
    /// allocate, reorder, emit for machine code; image or budget, of 88 keys on the keyboard's
    /// board, or rp2350
    #[arg(long, value_name = "PASS", default_value = "lower")]
    after: String,
    /// Leave out what only traces need: probes, and events for transitions
    #[arg(long)]
    bare: bool,
    /// Of machine code: this mode alone
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = option::mode)]
    mode: Option<u32>,
    /// Of machine code: for the core of this board; the keyboard's, or rp2350 otherwise
    #[arg(long, value_name = "NAME|FILE.toml")]
    board: Option<OsString>,
}

pub fn run(args: &Args) -> Outcome {
    if let Some(pass) = thumb::Pass::named(&args.after) {
        return code::dump_code(args, pass);
    }
    let Some(&pass) = PASSES.iter().find(|pass| pass.name() == args.after) else {
        return Err(no_pass(&args.after));
    };
    if args.mode.is_some() || args.board.is_some() {
        return Err(Failure::Usage(format!(
            "--mode and --board are for machine code: for `select` to `emit`, not for `{}`",
            args.after
        )));
    }
    let opened = Opened::words(&args.words)?;
    if pass == Pass::Parse {
        return print_trees(&opened.sources);
    }
    let (map, program) = load::checked(&opened.sources, &Options::default(), Severity::Warning)?;
    let model = load::instrument(&program, opened.name)?;
    let mut text = String::new();
    let mut observer = |made: Pass, form: &dyn Display| {
        if made == pass {
            text += &form.to_string();
        }
    };
    let dumped = match pass {
        Pass::Image | Pass::Budget => dump_image(&map, &program, model, &mut observer),
        _ => dump_kernel(&map, model, pass, !args.bare, &mut observer),
    };
    dumped?;
    say::whole(&text);
    Ok(())
}

/// All passes, those of machine code behind the modes that it is made of.
fn no_pass(name: &str) -> Failure {
    let mut known = Vec::new();
    for pass in PASSES {
        known.push((pass.name(), pass.makes()));
        if *pass == Pass::Modes {
            known.extend(thumb::Pass::ALL.map(|(_, name, makes)| (name, makes)));
        }
    }
    let line = |(name, makes): &(&str, &str)| format!("  {name:<10}{makes}");
    let known: Vec<String> = known.iter().map(line).collect();
    Failure::Usage(format!(
        "`{name}` is no pass; passes are\n{}",
        known.join("\n")
    ))
}

/// Runs the passes up to a Kernel or its modes.
fn dump_kernel(
    map: &SourceMap,
    model: &Model,
    last: Pass,
    probes: bool,
    observer: Observer,
) -> Outcome {
    if last == Pass::Check {
        observer(last, model);
        return Ok(());
    }
    let compiled =
        load::compiled_observed(map, model.clone(), &Device::of(model), probes, observer)?;
    if last == Pass::Modes {
        pipeline::specialize(&compiled, INSTRUCTIONS, observer)
            .map_err(|error| load::report_compile_error(map, error))?;
    }
    Ok(())
}
/// Runs the passes up to the image of a keyboard, or to its budget.
fn dump_image(map: &SourceMap, program: &Program, model: &Model, observer: Observer) -> Outcome {
    let device = load::device(None, map, program, model)?;
    let board = setup::find_board(None, program.keyboards.first())?;
    let layout =
        Layout::of_one_instrument(&model.name, setup::usual_keys(model), setup::FIRST_NOTE);
    let compiled = load::compiled_observed(map, model.clone(), &device, false, observer)?;
    let instrument = ImageInstrument::new(&compiled, INSTRUCTIONS, Some(map), observer)
        .map_err(|error| load::report_compile_error(map, error))?;
    let (keys, first_note) = (layout.keys, layout.first_note);
    let setup = setup_to_bound(&compiled, &device, keys, board.cores, first_note)
        .map_err(Failure::Usage)?;
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
    let image = pipeline::build(&layout, &instruments, &setup, &board, observer)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    pipeline::prove(&image, &board, model.rate_hz, observer)
        .map_err(|error| Failure::Defect(format!("no bound: {error}")))?;
    Ok(())
}

/// The trees as source text; mistakes are reported, and what could be read is printed all the same.
fn print_trees(texts: &[(String, String)]) -> Outcome {
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
