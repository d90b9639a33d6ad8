//! `whippen page`: a page that plays.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;
use whippen_runtime::device::Device;
use whippen_runtime::playable::{self, PlayablePage};

use super::file_plan::FilePlan;
use super::opened::Opened;
use super::settings::SettingArgs;
use super::{command, load, option};
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// Keys of a page, where neither a keyboard nor an option says how many: two octaves from C4.
const KEYS: (u32, u8) = (25, 60);

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen page instruments/grand-piano.whip -o touch.html\n\
                  Example: whippen page instruments/bowed-violin.whip -o violin.html"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// The page
    #[arg(short, long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    output: PathBuf,
    /// How many keys, from C4 on, or from the keyboard's lowest; the keyboard's otherwise, or 25
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = option::keys)]
    keys: Option<u32>,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    tick_rate: Option<Rate>,
}

pub fn run(args: &Args) -> Outcome {
    let opened = Opened::words(&args.words)?;
    let others: Vec<PathBuf> = args.settings.files().collect();
    FilePlan::default()
        .reads(opened.paths())
        .reads(&others)
        .writes("--output", &Some(args.output.clone()), &["html"])
        .check()?;
    let options = Options {
        sets: args.settings.all(&opened)?,
        rate_hz: args.tick_rate,
        ..Options::default()
    };
    let choice = PageChoice {
        name: opened.name,
        keys: args.keys,
        device: args.device.as_deref(),
        command: &command::typed(),
    };
    let page = made(&opened.sources, &options, &choice)?;
    page.save(&args.output)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    say!(
        "{}: {} bytes, {} of them the instrument; open it in a browser",
        args.output.display(),
        page.html.len(),
        page.module_bytes
    );
    Ok(())
}

/// Which page of a program.
struct PageChoice<'a> {
    /// The instrument, if there are several.
    name: Option<&'a str>,
    /// How many keys, if not as many as usual.
    keys: Option<u32>,
    device: Option<&'a OsStr>,
    /// What makes it, as one types it.
    command: &'a str,
}

/// Makes the page of a program.
fn made(
    sources: &[(String, String)],
    options: &Options,
    choice: &PageChoice,
) -> Result<PlayablePage, Failure> {
    let (compiled, device, keys) = prepared(sources, options, choice)?;
    playable::page(&compiled, &device, keys, choice.command)
        .map_err(|error| Failure::Usage(error.to_string()))
}

/// What a condition of a study plays, and its page.
#[cfg(not(target_family = "wasm"))]
pub fn of_condition(
    sources: &[(String, String)],
    options: &Options,
    command: &str,
) -> Result<(Compiled, Device, PlayablePage), Failure> {
    let choice = PageChoice {
        name: None,
        keys: Some(1),
        device: None,
        command,
    };
    let (compiled, device, keys) = prepared(sources, options, &choice)?;
    let page = playable::page(&compiled, &device, keys, command)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    Ok((compiled, device, page))
}

/// The instrument of a program, its device, how many keys there are and the lowest one.
fn prepared(
    sources: &[(String, String)],
    options: &Options,
    choice: &PageChoice,
) -> Result<(Compiled, Device, (usize, u8)), Failure> {
    let (map, program) = load::checked(sources, options, Severity::Warning)?;
    let model = load::instrument(&program, choice.name)?;
    let device = load::device(choice.device, &map, &program, model)?;
    let compiled = load::compiled(&map, model.clone(), &device, false)?;
    let keyboard = program.keyboards.first();
    let of_keyboard = keyboard.map(|own| (own.layout.keys, own.layout.first_note));
    let (usual, first_note) = of_keyboard.unwrap_or(KEYS);
    let keys = match compiled.model.is_of_key() {
        true => choice.keys.unwrap_or(usual),
        false => 1,
    };
    Ok((compiled, device, (keys as usize, first_note)))
}

/// The page that `whippen page FILE -o OUTPUT` makes of a text in a file of this name.
///
/// # Errors
/// The text is no program of one instrument.
#[cfg(not(target_family = "wasm"))]
pub fn of_text(file: &str, text: &str, output: &str) -> Result<PlayablePage, Failure> {
    let sources = [(file.to_string(), text.to_string())];
    let choice = PageChoice {
        name: None,
        keys: None,
        device: None,
        command: &format!("whippen page {file} -o {output}"),
    };
    made(&sources, &Options::default(), &choice)
}
