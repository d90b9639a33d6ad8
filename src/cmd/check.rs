//! `whippen check`

use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::check::{Keyboard, Options};
use whippen_compiler::diag::Severity;
use whippen_compiler::keyboard::InstrumentId;
use whippen_runtime::device::Device;
use whippen_runtime::ringing;

use super::load::{self, Form};
use super::{json, numbers, watch};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen check instruments/grand-piano.whip --numbers")]
pub struct Args {
    /// The files of one program
    #[arg(required = true, value_name = "FILE", value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,
    /// Print range, format and error bound of every named value
    #[arg(long)]
    numbers: bool,
    /// Also judge the loop of key, hand and program, and warn of what rings (tenths of a second for
    /// a large program)
    #[arg(long)]
    stability: bool,
    /// Print one JSON object per line instead: diagnostics, and with --numbers the tables
    #[arg(long)]
    json: bool,
    /// Give a parameter another value, such as weight=0.4N
    #[arg(long = "set", value_name = "NAME=VALUE")]
    sets: Vec<String>,
    /// Check again whenever one of the files is saved, until Ctrl-C
    #[arg(long)]
    watch: bool,
}

pub fn run(args: &Args) -> Outcome {
    if args.watch {
        watch::watch(&args.files, || once(args))
    } else {
        once(args)
    }
}

fn once(args: &Args) -> Outcome {
    let options = Options {
        sets: load::sets(&args.sets)?,
        ..Options::default()
    };
    let form = if args.json { Form::Json } else { Form::Text };
    let (map, program) =
        load::checked_as(form, &load::read(&args.files)?, &options, Severity::Note)?;
    if program.instruments.is_empty() && !args.json {
        say!("no instrument, but nothing wrong either");
    }
    let mut outcome = Ok(());
    for (number, model) in (0..).map(InstrumentId).zip(program.instruments) {
        let plays = |k: &&Keyboard| k.layout.instruments().contains(&number);
        let keyboard = program.keyboards.iter().find(plays);
        let named = keyboard
            .or(program.keyboards.first())
            .map(|k| k.device.as_str());
        let (name, device) = (model.name.clone(), Device::of(&model));
        let judged = args
            .stability
            .then(|| ringing::warnings(&model, &Device::known(named, &model)));
        let compiled = match load::compiled_as(form, &map, model, &device) {
            Ok(compiled) => compiled,
            // What is wrong with one instrument hides nothing of the next.
            Err(Failure::Program) => {
                outcome = Err(Failure::Program);
                continue;
            }
            Err(other) => return Err(other),
        };
        if let Some(warnings) = judged {
            load::report(form, &map, &warnings, Severity::Note);
        }
        if args.json {
            args.numbers.then(|| say!("{}", json::numbers(&compiled)));
        } else if args.numbers {
            say::whole(&numbers::report(&compiled, &device).to_string());
        } else {
            say!("{name}: ok");
        }
    }
    for keyboard in program
        .keyboards
        .iter()
        .filter(|_| outcome.is_ok() && !args.json)
    {
        say!(
            "{}: ok ({} keys at {} Hz)",
            keyboard.name,
            keyboard.layout.keys,
            keyboard.rate_hz
        );
    }
    outcome
}
