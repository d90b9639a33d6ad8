//! What `build` and `budget` start from: an instrument, compiled, and the keyboard and board it is
//! for.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::budget::{NotBounded, NotDivided, whole_divided};
use whippen_compiler::check::{self, Keyboard, Options, Playable, Program};
use whippen_compiler::diag::{Severity, nearest};
use whippen_compiler::firmware::{self, FirmwareError, Instrument, Midi, Part, Whole, WholeError};
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
    /// So many instructions for all modes of a key, which are faster the more there may be; 0 for
    /// one mode that knows nothing
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

/// What a program plays.
pub struct Playing {
    /// Its name.
    pub name: String,
    /// By rising key.
    pub parts: Vec<PlayingPart>,
}

/// Neighbouring keys that play one instrument.
pub struct PlayingPart {
    /// Which of the setup's instruments.
    pub instrument: usize,
    /// MIDI numbers of its lowest and highest key, where it is a zone; otherwise it is all keys,
    /// however many there are.
    pub notes: Option<(u8, u8)>,
}

impl Playing {
    /// How many keys it has, if it says so.
    fn keys(&self) -> Option<u32> {
        self.parts.iter().map(PlayingPart::keys).sum()
    }

    /// Its instruments, each once.
    pub fn instruments(&self) -> Vec<usize> {
        let mut all: Vec<usize> = Vec::new();
        for part in &self.parts {
            if !all.contains(&part.instrument) {
                all.push(part.instrument);
            }
        }
        all
    }
}

impl PlayingPart {
    /// How many keys it has, if it says so.
    pub fn keys(&self) -> Option<u32> {
        self.notes.map(|(first, last)| u32::from(last - first) + 1)
    }
}

/// Everything that code is made of.
pub struct Setup {
    pub map: SourceMap,
    /// At least one.
    pub instruments: Vec<Compiled>,
    /// At least one; several only for an image.
    pub programs: Vec<Playing>,
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
            (None, Some([only])) => &program.instruments[only.parts[0].instrument],
            _ => load::instrument(&program, name)?,
        };
        self.setup(map, &program, &[model])
    }

    /// The instrument or the zones that were named, or all programs of the keyboard, or the only
    /// instrument.
    pub fn all(&self) -> Result<Setup, Failure> {
        let (map, program, name) = self.checked()?;
        let listed = listed(&program).unwrap_or_default();
        let zones = listed
            .iter()
            .filter(|playable| name.is_none_or(|name| playable.name == name));
        let chosen: Vec<Playable> = zones.cloned().collect();
        if chosen.is_empty()
            || name.is_some_and(|name| program.instruments.iter().any(|m| m.name == name))
        {
            let model = load::instrument(&program, name)?;
            return self.setup(map, &program, &[model]);
        }
        self.programs(map, &program, &chosen)
    }

    fn checked(&self) -> Result<(SourceMap, Program, Option<&str>), Failure> {
        let (files, name) = load::split(&self.words)?;
        let options = Options {
            sets: load::sets(&self.sets)?,
            rate_hz: self.rate,
        };
        let (map, program) = load::checked(&load::read(&files)?, &options, Severity::Warning)?;
        Ok((map, program, name))
    }

    /// One program for each instrument.
    fn setup(
        &self,
        map: SourceMap,
        program: &Program,
        models: &[&Model],
    ) -> Result<Setup, Failure> {
        let playing = |(instrument, model): (usize, &&Model)| Playing {
            name: model.name.clone(),
            parts: vec![PlayingPart {
                instrument,
                notes: None,
            }],
        };
        let programs = models.iter().enumerate().map(playing).collect();
        self.compiled(map, program, models, programs)
    }

    /// Programs of the keyboard.
    fn programs(
        &self,
        map: SourceMap,
        program: &Program,
        chosen: &[Playable],
    ) -> Result<Setup, Failure> {
        let mut used: Vec<usize> = Vec::new();
        let mut programs = Vec::new();
        for playable in chosen {
            let plain = playable.parts.len() == 1;
            let part = |part: &check::Part| {
                let instrument = used
                    .iter()
                    .position(|&at| at == part.instrument)
                    .unwrap_or_else(|| {
                        used.push(part.instrument);
                        used.len() - 1
                    });
                PlayingPart {
                    instrument,
                    notes: (!plain).then_some((part.first_key, part.last_key)),
                }
            };
            let parts = playable.parts.iter().map(part).collect();
            programs.push(Playing {
                name: playable.name.clone(),
                parts,
            });
        }
        let models: Vec<&Model> = used.iter().map(|&at| &program.instruments[at]).collect();
        self.compiled(map, program, &models, programs)
    }

    fn compiled(
        &self,
        map: SourceMap,
        program: &Program,
        models: &[&Model],
        programs: Vec<Playing>,
    ) -> Result<Setup, Failure> {
        let keyboard = program.keyboards.first();
        let device = load::device(self.device.as_deref(), program, models[0])?;
        let board = board(self.board.as_deref(), keyboard)?;
        let instruments = models
            .iter()
            .map(|&model| load::compiled(&map, model.clone(), &device, false));
        Ok(Setup {
            instruments: instruments.collect::<Result<_, _>>()?,
            programs,
            map,
            device,
            board,
            keys: self
                .keys
                .or(keyboard.map(|k| k.keys() as u32))
                .unwrap_or(88),
            first_note: keyboard.map_or(FIRST_NOTE, |k| k.first_key),
            instructions: self.modes,
        })
    }
}

/// The programs of the keyboard, if there is one.
fn listed(program: &Program) -> Option<&[Playable]> {
    program
        .keyboards
        .first()
        .map(|keyboard| &keyboard.programs[..])
}

/// The board that was named, the keyboard's, or the usual one.
fn board(wanted: Option<&str>, keyboard: Option<&Keyboard>) -> Result<Board, Failure> {
    let name = wanted
        .or(keyboard.and_then(|k| k.board.as_deref()))
        .unwrap_or("rp2350");
    if name.ends_with(".toml") {
        return board::load(Path::new(name)).map_err(|e| Failure::Usage(e.to_string()));
    }
    board::bundled(name).ok_or_else(|| {
        let near =
            nearest(name, board::bundled_names()).map(|near| format!("; did you mean `{near}`?"));
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
    whippen_compiler::c99::Names::new(&compiled.lowered.kernel).kernel
}

impl Setup {
    /// The only instrument, or the first.
    pub fn first(&self) -> &Compiled {
        &self.instruments[0]
    }

    /// The modes of a key, by instrument.
    pub fn modes(&self) -> Vec<Modes> {
        self.instruments
            .iter()
            .map(|compiled| specialise(&compiled.lowered.kernel, self.instructions))
            .collect()
    }

    /// A program whose keys do not all play the same, if there is one.
    pub fn zones(&self) -> Option<&Playing> {
        self.programs.iter().find(|program| program.parts.len() > 1)
    }

    /// That there is a firmware for the board.
    pub fn supported(&self) -> Result<(), Failure> {
        match firmware::support(&self.board) {
            Ok(_) => Ok(()),
            Err(why) => Err(self.not_whole(WholeError::Board(why))),
        }
    }

    /// The image of so many keys, and how they are divided between the cores.
    pub fn whole(&self, modes: &[Modes], keys: u32) -> Result<(Whole, Vec<u32>), Failure> {
        self.supported()?;
        let setup = image::setup(
            self.first(),
            &self.device,
            keys,
            self.board.cores,
            self.first_note,
        );
        self.linked(modes, setup.map_err(Failure::Usage)?)
    }

    /// The image whose cycles are to be bounded: also where nothing is known of a motor, as they
    /// are the same with any.
    pub fn whole_to_judge(&self, modes: &[Modes], keys: u32) -> Result<(Whole, Vec<u32>), Failure> {
        self.supported()?;
        let setup = image::setup_to_judge(
            self.first(),
            &self.device,
            keys,
            self.board.cores,
            self.first_note,
        );
        self.linked(modes, setup.map_err(Failure::Usage)?)
    }

    fn linked(
        &self,
        modes: &[Modes],
        mut setup: firmware::Setup,
    ) -> Result<(Whole, Vec<u32>), Failure> {
        let keys: u32 = setup.keys.iter().sum();
        if let Some(zones) = self
            .programs
            .iter()
            .find(|program| program.keys().is_some_and(|own| own != keys))
        {
            let (name, own) = (&zones.name, zones.keys().unwrap_or_default());
            return Err(Failure::Usage(format!(
                "`{name}` are zones for the {own} keys of their keyboard, not for {keys}: leave --keys away"
            )));
        }
        let parts = self.instruments.iter().map(|compiled| {
            let places = places(&compiled.lowered.origins, &self.map);
            (places, image::midi(compiled))
        });
        let parts: Vec<(Vec<Place>, Midi)> = parts.collect();
        let instrument = |at: usize| {
            let (places, midi) = &parts[at];
            Instrument {
                modes: &modes[at],
                places,
                midi,
            }
        };
        let part = |part: &PlayingPart| Part {
            keys: part.keys().unwrap_or(keys),
            values_from: part
                .notes
                .map_or(0, |(first, _)| u32::from(first - self.first_note)),
            instrument: instrument(part.instrument),
        };
        let program = |program: &Playing| firmware::Program {
            parts: program.parts.iter().map(part).collect(),
        };
        let programs: Vec<firmware::Program> = self.programs.iter().map(program).collect();
        let whole =
            whole_divided(&programs, &mut setup, &self.board).map_err(|error| match error {
                NotDivided::Whole(error) => self.not_whole(error),
                NotDivided::Bound(error) => not_bounded(&error),
            })?;
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
            WholeError::Board(..) => {
                Failure::Usage(format!("{error}; make a .o or a .c for your own firmware"))
            }
            WholeError::Firmware(FirmwareError::Keys(_)) => {
                let [least, most] = self.keys_possible();
                Failure::Usage(format!("{error}: give {least} to {most} with --keys"))
            }
            WholeError::Ports(..) | WholeError::Firmware(_) => Failure::Usage(error.to_string()),
        }
    }
}

/// Why an image has no bound: what its board says, or a mistake of the firmware's.
pub fn not_bounded(error: &NotBounded) -> Failure {
    let message = format!("no bound: {error}");
    if error.is_the_boards() {
        Failure::Usage(message)
    } else {
        Failure::Defect(message)
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
