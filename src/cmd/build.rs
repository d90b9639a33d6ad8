//! `whippen build`: from a program to files for a microcontroller.

mod files;

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::check::{Keyboard, Options, Program};
use whippen_compiler::diag::{Severity, nearest};
use whippen_compiler::image::Board;
use whippen_compiler::model::Model;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_runtime::board;
use whippen_runtime::device::Device;

use super::load;
use crate::exit::{Failure, Outcome};
use files::Output;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen build instruments/grand-piano.whip --board rp2350 --keys 88 -o piano.uf2\n\
                  Example: whippen build instruments/grand-piano.whip --board rp2350 --keys 44 -o piano.o\n\
                  Example: whippen build instruments/grand-piano.whip -o piano.c")]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    /// What to write: .elf or .uf2, a whole image; .o (with .h and .rs beside it) to link; .c (with .h) for any other compiler
    #[arg(short, long, value_name = "FILE.elf|.uf2|.o|.c", value_hint = ValueHint::FilePath, value_parser = files::output)]
    output: Output,
    /// The board, by name or as a TOML file; the keyboard's, or rp2350 otherwise
    #[arg(long, value_name = "NAME|FILE.toml")]
    board: Option<String>,
    /// How many keys; as many as the keyboard has, or 88 otherwise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    keys: Option<u32>,
    /// Ticks per second where no keyboard says otherwise
    #[arg(long, value_name = "HZ", default_value_t = 44_100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    rate: u32,
    /// So many instructions for all modes of a key, which are faster the more there may be; 0 for one mode that knows nothing
    #[arg(long, value_name = "INSTRUCTIONS", default_value_t = INSTRUCTIONS)]
    modes: usize,
    /// Give a parameter another value, such as weight=0.4N
    #[arg(long = "set", value_name = "NAME=VALUE")]
    sets: Vec<String>,
    /// Device file with the scales of sensor and drive; the keyboard's device or mikey otherwise
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    device: Option<PathBuf>,
    /// Also write where everything lies and how large it is
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    map: Option<PathBuf>,
    /// Also write the source and its instructions side by side, with cycles
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    listing: Option<PathBuf>,
}

/// The MIDI number of the first key where no keyboard says otherwise: A0.
const FIRST_NOTE: u8 = 21;

/// Everything that a file is made of.
struct Setup {
    map: SourceMap,
    /// The programs, at least one; several only in an image.
    programs: Vec<Compiled>,
    device: Device,
    board: Board,
    keys: u32,
    /// MIDI number of the first key.
    first_note: u8,
}

pub fn run(args: &Args) -> Outcome {
    let (files, name) = load::split(&args.words)?;
    let options = Options { sets: load::sets(&args.sets)?, rate_hz: args.rate };
    let (map, program) = load::checked(&load::read(&files)?, &options, Severity::Warning)?;
    let keyboard = program.keyboards.first();
    let models = if args.output.is_image() { instruments(&program, name)? } else { vec![instrument(&program, name)?] };
    let device = load::device(args.device.as_deref(), &program, models[0])?;
    let board = board(args.board.as_deref(), keyboard)?;
    let keys = args.keys.or(keyboard.map(|k| k.keys() as u32)).unwrap_or(88);
    let first_note = keyboard.map_or(FIRST_NOTE, |k| k.first_key);
    let programs = models.into_iter().map(|model| load::compiled(&map, model.clone(), &device, false));
    let programs = programs.collect::<Result<_, _>>()?;
    let setup = Setup { map, programs, device, board, keys, first_note };
    setup.write(args)
}

/// The instrument that was named, or all programs of the keyboard, or the only instrument.
fn instruments<'p>(program: &'p Program, name: Option<&str>) -> Result<Vec<&'p Model>, Failure> {
    match (name, program.keyboards.first().map(|keyboard| &keyboard.programs[..])) {
        (None, Some(programs @ [_, ..])) => Ok(programs.iter().map(|&at| &program.instruments[at]).collect()),
        _ => Ok(vec![load::instrument(program, name)?]),
    }
}

/// The instrument that was named, the only one, or the only one of the keyboard.
pub fn instrument<'p>(program: &'p Program, name: Option<&str>) -> Result<&'p Model, Failure> {
    match (name, program.keyboards.first().map(|keyboard| &keyboard.programs[..])) {
        (None, Some(&[only])) => Ok(&program.instruments[only]),
        _ => load::instrument(program, name),
    }
}

/// The board that was named, the keyboard's, or the usual one.
pub fn board(wanted: Option<&str>, keyboard: Option<&Keyboard>) -> Result<Board, Failure> {
    let name = wanted.or(keyboard.and_then(|k| k.board.as_deref())).unwrap_or("rp2350");
    if name.ends_with(".toml") {
        return board::load(Path::new(name)).map_err(|e| Failure::Usage(e.to_string()));
    }
    board::bundled(name).ok_or_else(|| {
        let near = nearest(name, board::bundled_names()).map(|near| format!("; did you mean `{near}`?"));
        let known: Vec<&str> = board::bundled_names().collect();
        Failure::Usage(format!(
            "there is no board `{name}`{}\nboards are {}; a file of your own ends in .toml",
            near.unwrap_or_default(),
            known.join(", ")
        ))
    })
}
