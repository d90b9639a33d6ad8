//! What `build` and `budget` start from: an instrument, compiled, and the keyboard and board it is for.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::c;
use whippen_compiler::check::{Keyboard, Options, Playable, Program};
use whippen_compiler::diag::{Severity, nearest};
use whippen_compiler::firmware::{self, FirmwareError, Midi, Whole, WholeError};
use whippen_compiler::image::{Board, LinkError, Place, places};
use whippen_compiler::model::Model;
use whippen_compiler::modes::{INSTRUCTIONS, Modes, specialise};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_compiler::thumb::ThumbError;
use whippen_runtime::device::Device;
use whippen_runtime::{board, image};

use super::load;
use crate::exit::Failure;

#[derive(Debug, clap::Args)]
pub struct SetupArgs {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    /// The board, by name or as a TOML file; the keyboard's, or rp2350 otherwise
    #[arg(long, value_name = "NAME|FILE.toml")]
    board: Option<String>,
    /// How many keys on all cores; as many as the keyboard has, or 88 otherwise
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
}

/// The MIDI number of the first key where no keyboard says otherwise: A0.
const FIRST_NOTE: u8 = 21;

/// Everything that code is made of.
pub struct Setup {
    pub map: SourceMap,
    /// At least one program; several only for an image.
    pub programs: Vec<Compiled>,
    pub device: Device,
    pub board: Board,
    pub keys: u32,
    /// MIDI number of the first key.
    pub first_note: u8,
    /// Instructions for all modes of a key.
    instructions: usize,
}

impl SetupArgs {
    /// The instrument that was named, the only one, or the only one of the keyboard.
    pub fn one(&self) -> Result<Setup, Failure> {
        let (map, program, name) = self.checked()?;
        let model = match (name, listed(&program)) {
            (None, Some(&[ref only])) => &program.instruments[only.parts[0].instrument],
            _ => load::instrument(&program, name)?,
        };
        self.setup(map, &program, &[model])
    }

    /// The instrument that was named, or all programs of the keyboard, or the only instrument.
    pub fn all(&self) -> Result<Setup, Failure> {
        let (map, program, name) = self.checked()?;
        let models: Vec<&Model> = match (name, listed(&program)) {
            (None, Some(programs @ [_, ..])) => {
                programs.iter().map(|p| &program.instruments[p.parts[0].instrument]).collect()
            }
            _ => vec![load::instrument(&program, name)?],
        };
        self.setup(map, &program, &models)
    }

    fn checked(&self) -> Result<(SourceMap, Program, Option<&str>), Failure> {
        let (files, name) = load::split(&self.words)?;
        let options = Options { sets: load::sets(&self.sets)?, rate_hz: self.rate };
        let (map, program) = load::checked(&load::read(&files)?, &options, Severity::Warning)?;
        Ok((map, program, name))
    }

    fn setup(&self, map: SourceMap, program: &Program, models: &[&Model]) -> Result<Setup, Failure> {
        let keyboard = program.keyboards.first();
        let device = load::device(self.device.as_deref(), program, models[0])?;
        let board = board(self.board.as_deref(), keyboard)?;
        let programs = models.iter().map(|&model| load::compiled(&map, model.clone(), &device, false));
        Ok(Setup {
            programs: programs.collect::<Result<_, _>>()?,
            map,
            device,
            board,
            keys: self.keys.or(keyboard.map(|k| k.keys() as u32)).unwrap_or(88),
            first_note: keyboard.map_or(FIRST_NOTE, |k| k.first_key),
            instructions: self.modes,
        })
    }
}

/// The programs of the keyboard, if there is one.
fn listed(program: &Program) -> Option<&[Playable]> {
    program.keyboards.first().map(|keyboard| &keyboard.programs[..])
}

/// The board that was named, the keyboard's, or the usual one.
fn board(wanted: Option<&str>, keyboard: Option<&Keyboard>) -> Result<Board, Failure> {
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

/// The prefix of all names of a program.
pub fn name(compiled: &Compiled) -> String {
    c::Names::new(&compiled.lowered.kernel).kernel
}

impl Setup {
    /// The only program, or the first.
    pub fn first(&self) -> &Compiled {
        &self.programs[0]
    }

    /// The modes of a key, by program.
    pub fn modes(&self) -> Vec<Modes> {
        self.programs.iter().map(|compiled| specialise(&compiled.lowered.kernel, self.instructions)).collect()
    }

    /// That there is a firmware for the board.
    pub fn supported(&self) -> Result<(), Failure> {
        match firmware::support(&self.board) {
            Some(_) => Ok(()),
            None => Err(self.not_whole(WholeError::Board(self.board.name.clone()))),
        }
    }

    /// The image of so many keys, and how they are divided between the cores.
    pub fn whole(&self, modes: &[Modes], keys: u32) -> Result<(Whole, Vec<u32>), Failure> {
        self.supported()?;
        let setup = image::setup(self.first(), &self.device, keys, self.board.cores, self.first_note);
        self.linked(modes, setup.map_err(Failure::Usage)?)
    }

    /// The image whose cycles are to be bounded: also where nothing is known of a motor, as they are the same with any.
    pub fn whole_to_judge(&self, modes: &[Modes], keys: u32) -> Result<(Whole, Vec<u32>), Failure> {
        self.supported()?;
        let setup = image::setup_to_judge(self.first(), &self.device, keys, self.board.cores, self.first_note);
        self.linked(modes, setup.map_err(Failure::Usage)?)
    }

    fn linked(&self, modes: &[Modes], setup: firmware::Setup) -> Result<(Whole, Vec<u32>), Failure> {
        let parts = self.programs.iter().map(|compiled| {
            let places = places(&compiled.lowered.origins, &self.map);
            (places, image::midi(compiled))
        });
        let parts: Vec<(Vec<Place>, Midi)> = parts.collect();
        let programs = modes.iter().zip(&parts);
        let programs: Vec<firmware::Program> =
            programs.map(|(modes, (places, midi))| firmware::Program { modes, places, midi }).collect();
        let whole = firmware::whole(&programs, &setup, &self.board).map_err(|error| self.not_whole(error))?;
        Ok((whole, setup.keys))
    }

    /// Keys that an image can have, at least and at most: each core has 1 to 255.
    pub fn keys_possible(&self) -> [u32; 2] {
        [self.board.cores, 255 * self.board.cores]
    }

    fn not_whole(&self, error: WholeError) -> Failure {
        match error {
            WholeError::Link(error) => no_link(error),
            WholeError::Code(error) => no_code(error),
            WholeError::Firmware(FirmwareError::Assembly(_)) => Failure::Defect(error.to_string()),
            WholeError::Board(_) => Failure::Usage(format!("{error}; make a .o or a .c for your own firmware")),
            WholeError::Firmware(FirmwareError::Keys(_)) => {
                let [least, most] = self.keys_possible();
                Failure::Usage(format!("{error}: give {least} to {most} with --keys"))
            }
            WholeError::Ports(..) | WholeError::Firmware(_) => Failure::Usage(error.to_string()),
        }
    }
}

pub fn no_code(error: ThumbError) -> Failure {
    match error {
        ThumbError::Bug(_) => Failure::Defect(error.to_string()),
        other => Failure::Usage(other.to_string()),
    }
}

/// A program that does not fit its board is wrong; anything else is ours.
pub fn no_link(error: LinkError) -> Failure {
    match error {
        LinkError::Full { .. } => {
            eprintln!("error: {error}");
            Failure::Program
        }
        LinkError::Nowhere { .. } => Failure::Usage(error.to_string()),
        other => Failure::Defect(other.to_string()),
    }
}
