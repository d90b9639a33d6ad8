//! `whippen check`

use std::ffi::OsString;
use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::check::{Keyboard, Options, Program};
use whippen_compiler::diag::Severity;
use whippen_compiler::keyboard::InstrumentId;
use whippen_compiler::model::Model;
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::judged::{JudgedPort, judge};
use whippen_runtime::ringing;

use super::load::{self, Form};
use super::opened::Opened;
use super::settings::SettingArgs;
use super::{json, numbers, option, strings, watch};
use crate::device::{self, NoDevice};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say, tell};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen check instruments/grand-piano.whip --numbers")]
pub struct Args {
    /// The files of one program
    #[arg(required = true, value_name = "FILE", value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,
    /// Print range, format and error bound of every named value
    #[arg(long)]
    numbers: bool,
    /// Print one JSON object per line instead: diagnostics, and with --numbers the tables
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[arg(long = "tick-rate", visible_alias = "rate", value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    rate: Option<Rate>,
    /// Check again whenever one of the files is saved, until Ctrl-C
    #[arg(long)]
    watch: bool,
}

pub fn run(args: &Args) -> Outcome {
    if !args.watch {
        return once(args);
    }
    let opened = Opened::files(&args.files)?;
    let files = opened.paths().cloned();
    let files = files.chain(device::file(args.device.as_deref()));
    let files: Vec<PathBuf> = files.chain(args.settings.files()).collect();
    watch::watch(&files, || once(args))
}

fn once(args: &Args) -> Outcome {
    let opened = Opened::files(&args.files)?;
    let options = Options {
        sets: args.settings.all(&opened)?,
        rate_hz: args.rate,
        ..Options::default()
    };
    let form = if args.json { Form::Json } else { Form::Text };
    let (map, program) = load::checked_as(form, &opened.sources, &options, Severity::Note)?;
    let devices = CheckedDevices::find(args, form, &map, &program)?;
    if program.instruments.is_empty() && !args.json {
        say!("no instrument, but nothing wrong either");
    }
    let mut outcome = Ok(());
    for (number, model) in (0..).map(InstrumentId).zip(program.instruments) {
        let (name, device) = (
            model.name.clone(),
            devices.of(number, &program.keyboards, &model)?,
        );
        for note in device::unmeasured(&device, &model)
            .iter()
            .filter(|_| !args.json)
        {
            tell!("note: {note}");
        }
        let compiled = match load::compiled_as(form, &map, model.clone(), &device) {
            Ok(compiled) => compiled,
            // What is wrong with one instrument hides nothing of the next.
            Err(Failure::Program) => {
                outcome = Err(Failure::Program);
                continue;
            }
            Err(other) => return Err(other),
        };
        let ports = judge(&model, &device, None);
        let rings: Vec<_> = ports.iter().flat_map(ringing::warnings_of).collect();
        load::report(form, &map, &rings, Severity::Note);
        if args.json {
            args.numbers
                .then(|| say!("{}", json::numbers(&compiled, &device)));
        } else if args.numbers {
            say::whole(&numbers::report(&compiled, &device).to_string());
        } else {
            say!("{name}: ok{}", unjudged(&model, &ports));
            for line in strings::report(&compiled, &device) {
                say!("{line}");
            }
        }
    }
    if outcome.is_ok() && !args.json {
        program.keyboards.iter().for_each(found_right);
    }
    outcome
}

fn found_right(keyboard: &Keyboard) {
    let keys = match keyboard.layout.keys {
        1 => "1 key".to_string(),
        keys => format!("{keys} keys"),
    };
    say!("{}: ok ({keys} at {} Hz)", keyboard.name, keyboard.rate_hz);
}

/// That nothing is said of loops of an instrument with several ports, if that is so.
fn unjudged(model: &Model, ports: &[JudgedPort]) -> String {
    let unknown = ports.iter().filter(|port| port.found.is_err());
    let names: Vec<&str> = unknown.map(|port| port.port.as_str()).collect();
    if model.is_of_key() || names.is_empty() {
        return String::new();
    }
    let names = names.join("`, `");
    format!(" (the stability of `{names}` is not judged: `whippen budget` says why)")
}

/// The devices that instruments are checked for.
struct CheckedDevices {
    /// The one of the command line.
    wanted: Option<Device>,
    /// Of each keyboard.
    of_keyboards: Vec<Option<Device>>,
}

impl CheckedDevices {
    fn find(args: &Args, form: Form, map: &SourceMap, program: &Program) -> Result<Self, Failure> {
        let wanted = args.device.as_deref().map(device::named).transpose();
        let of_keyboard = |keyboard| {
            device::of_keyboard(keyboard, map, device::folder_of)
                .map_err(|wrong| load::no_device(form, map, NoDevice::Program(wrong)))
        };
        Ok(CheckedDevices {
            wanted: wanted.map_err(Failure::Usage)?,
            of_keyboards: program
                .keyboards
                .iter()
                .map(of_keyboard)
                .collect::<Result<_, _>>()?,
        })
    }

    /// The device of the command line, of the keyboard that plays the instrument, of any keyboard
    /// on which it can be played, or the usual one.
    fn of(&self, number: InstrumentId, all: &[Keyboard], model: &Model) -> Result<Device, Failure> {
        if let Some(wanted) = &self.wanted {
            device::fits(wanted, model).map_err(Failure::Usage)?;
            return Ok(wanted.clone());
        }
        let plays = |k: &Keyboard| k.layout.instruments().contains(&number);
        let found = self
            .of_keyboards
            .get(all.iter().position(plays).unwrap_or(0));
        Ok(Device::fitting(found.and_then(Option::as_ref), model))
    }
}
