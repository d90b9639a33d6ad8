//! The set-up of `build` and `budget`: compiled instruments, and the keyboard, device and board
//! they are for.

mod chips;
mod origin;
mod usual;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueHint;
use whippen_compiler::board::{Board, COLUMN_KEYS};
use whippen_compiler::check::{Keyboard, Options, Program};
use whippen_compiler::diag::Severity;
use whippen_compiler::firmware::{
    self, FirmwareError, FirmwareImage, ImageError, Monitor, OwnTexts, SensorTuning,
};
use whippen_compiler::image::LinkError;
use whippen_compiler::keyboard::{InstrumentId, Layout, ZoneId};
use whippen_compiler::model::Model;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, BuildError, Compiled, Partitioned, unobserved};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_compiler::thumb::ThumbError;
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{self, ImageInstrument};

pub use self::chips::{Chip, counted, file_of_chip, keys_of_chips};
use self::usual::keys_of;
pub use self::usual::{FIRST_NOTE, KEYS, usual_keys};
use super::calibration::CalibrationArgs;
use super::load;
use super::monitor_image::MonitorImageArgs;
use super::opened::Opened;
use super::option;
use super::own_firmware::{FirmwareArgs, Unbounded, own_failure};
use super::progress;
use super::settings::SettingArgs;
use crate::device;
use crate::exit::Failure;
use crate::hardware::BOARD;
use crate::say::tell;

#[derive(Debug, clap::Args)]
pub struct SetupArgs {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// The board, by name or as a TOML file; the keyboard's, or rp2350 otherwise. `rp2350*2` are
    /// two, each with half of the keys
    #[arg(long, value_name = "NAME|FILE.toml[*CHIPS]")]
    board: Option<OsString>,
    /// How many keys on all cores and chips; as many as the keyboard has, or 88 otherwise
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = option::keys)]
    keys: Option<u32>,
    #[arg(long = "tick-rate", visible_alias = "rate", value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    rate: Option<Rate>,
    /// So many instructions for all modes of a key, which are faster the more there may be; 0 for
    /// one mode that knows nothing
    #[arg(long, value_name = "INSTRUCTIONS", allow_negative_numbers = true, default_value_t = INSTRUCTIONS, value_parser = option::modes)]
    modes: usize,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[command(flatten)]
    calibration: CalibrationArgs,
    /// Notes have 14 bits of velocity over MIDI, seven of them in a control change 88 ahead of each
    #[arg(long)]
    fine_velocity: bool,
    #[command(flatten)]
    firmware: FirmwareArgs,
    #[command(flatten)]
    pub monitor: MonitorImageArgs,
}

/// Everything that code is made of.
#[derive(Clone)]
pub struct ImageSetup {
    pub map: SourceMap,
    /// At least one: those of the layout.
    pub instruments: Arc<[Compiled]>,
    /// At least one program; several only for an image.
    pub layout: Layout,
    pub device: Device,
    pub board: Board,
    /// How many keys are wanted.
    pub keys: u32,
    /// How many chips are to have them.
    pub chips: u32,
    /// Which of several chips it is for.
    pub chip: Option<Chip>,
    /// Through what sensors are read, if not as they are.
    tuning: Option<SensorTuning>,
    /// Instructions for all modes of a key.
    mode_instructions: usize,
    /// Whether notes have 14 bits of velocity.
    fine_velocity: bool,
    /// What takes the place of the firmware's texts.
    own_texts: OwnTexts,
    /// What is at the serial port in place of MIDI.
    monitor: Option<Monitor>,
}

impl SetupArgs {
    /// Reads the program.
    pub fn open(&self) -> Result<Opened<'_>, Failure> {
        Opened::words(&self.words)
    }

    /// The only file that is named, where it is an image and no program.
    pub fn image(&self) -> Option<&Path> {
        let [only] = &self.words[..] else {
            return None;
        };
        let path = Path::new(only);
        (path.extension()? == "elf").then_some(path)
    }

    /// All files that are read besides the program's.
    pub fn files(&self) -> Vec<PathBuf> {
        let name = self.board.as_deref().and_then(|name| counted(name).ok());
        let board = name.and_then(|(name, _)| BOARD.file(&name)).into_iter();
        let board = board.chain(device::file(self.device.as_deref()));
        let board = board.chain(self.calibration.files().cloned());
        let board = board.chain(self.firmware.files());
        board.chain(self.settings.files()).collect()
    }

    /// The instrument that was named, the only one, or the only one of the keyboard.
    fn instrument_of(
        &self,
        map: SourceMap,
        program: &Program,
        name: Option<&str>,
    ) -> Result<ImageSetup, Failure> {
        let layout = program.keyboards.first().map(|keyboard| &keyboard.layout);
        let model = match (name, layout.map(|layout| &*layout.programs)) {
            (None, Some([only])) => &program.instruments[only.zone(ZoneId(0)).instrument.index()],
            (None, Some(several @ [_, _, ..])) => {
                let names: Vec<&str> = several.iter().map(|own| own.name.as_str()).collect();
                let names = names.join(", ");
                return Err(Failure::Usage(format!(
                    "the keyboard has several programs, name one of them after the files: {names}"
                )));
            }
            _ => load::instrument(program, name)?,
        };
        self.of_one_instrument(map, program, model)
    }

    /// What is named: zones or an instrument; or the only program of the keyboard, or the only
    /// instrument.
    pub fn one_program(&self, opened: &Opened) -> Result<ImageSetup, Failure> {
        let ((map, program), name) = (self.checked(opened)?, opened.name);
        let are_zones = program.keyboards.first().is_some_and(|keyboard| {
            let own = match name {
                Some(name) => keyboard.layout.program_named(name),
                None if keyboard.layout.programs.len() == 1 => keyboard.layout.programs.first(),
                None => None,
            };
            own.is_some_and(|own| own.is_split())
        });
        if are_zones {
            self.programs_of(map, &program, name)
        } else {
            self.instrument_of(map, &program, name)
        }
    }

    /// The instrument or the zones that were named, or all programs of the keyboard, or the only
    /// instrument.
    pub fn all_programs(&self, opened: &Opened) -> Result<ImageSetup, Failure> {
        let (map, program) = self.checked(opened)?;
        self.programs_of(map, &program, opened.name)
    }

    fn programs_of(
        &self,
        map: SourceMap,
        program: &Program,
        name: Option<&str>,
    ) -> Result<ImageSetup, Failure> {
        let names_instrument =
            name.is_some_and(|name| program.instruments.iter().any(|model| model.name == name));
        let wanted = program.keyboards.first().map(|keyboard| {
            let is_wanted = |own: &str| name.is_none_or(|name| own == name);
            keyboard.layout.only(|program| is_wanted(&program.name))
        });
        match wanted {
            Some((layout, used)) if !layout.programs.is_empty() && !names_instrument => {
                let model = |id: &InstrumentId| &program.instruments[id.index()];
                let models: Vec<&Model> = used.iter().map(model).collect();
                self.compiled(map, program, &models, layout)
            }
            _ => {
                let model = load::instrument(program, name)?;
                self.of_one_instrument(map, program, model)
            }
        }
    }

    fn checked(&self, opened: &Opened) -> Result<(SourceMap, Program), Failure> {
        let options = Options {
            sets: self.settings.all(opened)?,
            rate_hz: self.rate,
            ..Options::default()
        };
        load::checked(&opened.sources, &options, Severity::Warning)
    }

    /// An instrument on all keys.
    fn of_one_instrument(
        &self,
        map: SourceMap,
        program: &Program,
        model: &Model,
    ) -> Result<ImageSetup, Failure> {
        let usual = usual_keys(model);
        let (keys, first_note) = program
            .keyboards
            .first()
            .map_or((usual, FIRST_NOTE), |own| {
                (own.layout.keys, own.layout.first_note)
            });
        let layout = Layout::of_one_instrument(&model.name, keys, first_note);
        self.compiled(map, program, &[model], layout)
    }

    fn compiled(
        &self,
        map: SourceMap,
        program: &Program,
        models: &[&Model],
        layout: Layout,
    ) -> Result<ImageSetup, Failure> {
        let device = load::device(self.device.as_deref(), &map, program, models[0])?;
        let keyboard = program.keyboards.first();
        let (name, chips) = self.board_and_chips(keyboard)?;
        let board = find_board(name.as_deref(), keyboard)?;
        let tuning = self.calibration.tuning(&device)?;
        let own_texts = self.firmware.texts(&board)?;
        let monitor = self.monitor.of_image(&board)?;
        chips::check_no_monitor(chips, monitor)?;
        let compile = |&model: &&Model| load::compiled(&map, model.clone(), &device, false);
        let instruments = models.iter().map(compile).collect::<Result<_, _>>()?;
        Ok(ImageSetup {
            keys: self.keys.unwrap_or(keys_of(&board, &layout, chips)),
            chips,
            chip: None,
            instruments,
            layout,
            map,
            device,
            board,
            tuning,
            mode_instructions: self.modes,
            fine_velocity: self.fine_velocity,
            own_texts,
            monitor,
        })
    }
}

/// The board that was named, the keyboard's, or the usual one.
pub fn find_board(wanted: Option<&OsStr>, keyboard: Option<&Keyboard>) -> Result<Board, Failure> {
    let of_keyboard = keyboard.and_then(|k| k.board.as_deref());
    let name = wanted.unwrap_or_else(|| OsStr::new(of_keyboard.unwrap_or("rp2350")));
    let found = match BOARD.file(name) {
        Some(path) if path.exists() => board::load(&path).map_err(|e| e.to_string()),
        Some(_) => Err(BOARD.absent(name)),
        None => (name.to_str().and_then(board::bundled)).ok_or_else(|| BOARD.absent(name)),
    };
    found.map_err(Failure::Usage)
}

/// The prefix of all names of an instrument in code.
pub fn symbol_prefix(compiled: &Compiled) -> String {
    whippen_compiler::c99::Names::new(&compiled.lowered.kernel).kernel
}

impl ImageSetup {
    /// What a board plays: the programs of a layout.
    ///
    /// # Errors
    /// What is wrong with an instrument, which is printed.
    pub fn of_board(
        map: &SourceMap,
        models: &[&Model],
        layout: Layout,
        device: &Device,
        board: Board,
    ) -> Result<ImageSetup, Failure> {
        let compile = |&model: &&Model| {
            let compiled = pipeline::compile(model.clone(), device.scales(), false);
            compiled.map_err(|error| load::report_compile_error(map, error))
        };
        Ok(ImageSetup {
            map: map.clone(),
            instruments: models.iter().map(compile).collect::<Result<_, _>>()?,
            keys: layout.keys,
            chips: 1,
            chip: None,
            layout,
            device: device.clone(),
            board,
            tuning: None,
            mode_instructions: INSTRUCTIONS,
            fine_velocity: false,
            own_texts: OwnTexts::default(),
            monitor: None,
        })
    }

    /// That nothing is asked for that only a firmware around the keys can do, where there is none.
    pub fn check_asks_for_no_firmware(&self) -> Result<(), Failure> {
        let asked = [
            ("--calibration", self.tuning.is_some(), "sensors are"),
            ("--fine-velocity", self.fine_velocity, "MIDI is"),
            ("--firmware", !self.own_texts.is_empty(), "firmware is"),
            ("--monitor", self.monitor.is_some(), "the serial port is"),
        ];
        match asked.into_iter().find(|(_, is_asked, _)| *is_asked) {
            None => Ok(()),
            Some((option, _, what)) => Err(Failure::Usage(format!(
                "{option} is for whole images, .elf and .uf2, that play: elsewhere {what} not \
                 Whippen's"
            ))),
        }
    }

    /// The only instrument, or the first.
    pub fn first(&self) -> &Compiled {
        &self.instruments[0]
    }

    /// The instruments as images need them, with their modes.
    pub fn image_instruments(&self) -> Result<Vec<ImageInstrument>, Failure> {
        let prepare = |compiled: &Compiled| {
            let (instructions, map) = (self.mode_instructions, Some(&self.map));
            let what = format!("the modes of {}", compiled.model.name);
            let made = progress::during(&what, || {
                ImageInstrument::new(compiled, instructions, map, &mut unobserved)
            });
            let instrument = made.map_err(|error| load::report_compile_error(&self.map, error))?;
            if instrument.modes.work_limited {
                tell!(
                    "note: `{}` has too many combinations of states to try them all: its {} modes \
                     are the best of those that were tried; `--modes {}` tries more",
                    compiled.model.name,
                    instrument.modes.modes.len(),
                    4 * instructions
                );
            }
            Ok(instrument)
        };
        self.instruments.iter().map(prepare).collect()
    }

    /// That there is a firmware for the board.
    pub fn check_supported(&self) -> Result<(), Failure> {
        match firmware::support_with(&self.board, &self.own_texts) {
            Ok(_) => Ok(()),
            Err(why) => Err(self.image_failure(ImageError::Board(why))),
        }
    }

    /// The image of the keys that are wanted.
    pub fn build(&self, instruments: &[ImageInstrument]) -> Result<FirmwareImage, Failure> {
        let made = self.build_with(instruments, self.keys, image::setup)?;
        Ok(made.image)
    }

    /// The image of so many keys whose cycles are to be bounded, as far as they are not yet: also
    /// where nothing is known of a motor, as they are the same with any.
    pub fn build_to_bound(
        &self,
        instruments: &[ImageInstrument],
        keys: u32,
    ) -> Result<Partitioned, Failure> {
        self.build_with(instruments, keys, image::setup_to_bound)
    }

    fn build_with(
        &self,
        instruments: &[ImageInstrument],
        keys: u32,
        setup: impl Fn(&Compiled, &Device, u32, u32, u8) -> Result<firmware::Setup, String>,
    ) -> Result<Partitioned, Failure> {
        self.check_supported()?;
        let (cores, first_note) = (self.board.cores, self.layout.first_note);
        let mut setup =
            setup(self.first(), &self.device, keys, cores, first_note).map_err(Failure::Usage)?;
        setup.tuning.clone_from(&self.tuning);
        setup.fine_velocity = self.fine_velocity;
        setup.own_texts.clone_from(&self.own_texts);
        setup.monitor = self.monitor;
        setup.passes_midi = self.chip.is_some();
        let layout = self
            .layout
            .with_keys(keys)
            .map_err(|error| Failure::Usage(format!("{error}: leave --keys away")))?;
        let borrowed = ImageInstrument::borrow_all(instruments);
        let made = progress::during(&format!("an image of {keys} keys"), || {
            pipeline::build_bounded(&layout, &borrowed, &setup, &self.board, &mut unobserved)
        });
        made.map_err(|error| match error {
            BuildError::Image(error) => self.image_failure(error),
            BuildError::Bound(error) => self.not_bounded(&error.into()),
        })
    }

    /// Keys that an image can have, at least and at most: each core has 1 to 255, or columns as the
    /// board has, and what is no
    /// instrument of a key is played once.
    pub fn keys_possible(&self) -> [u32; 2] {
        if !self.first().model.is_of_key() {
            return [1, 1];
        }
        let cores = self.board.cores;
        match &self.board.columns {
            // Each core has a column.
            Some(columns) => [1 + COLUMN_KEYS * (cores - 1), columns.keys()],
            None => [cores, 255 * cores],
        }
    }

    /// Why an image has no bound: what its board says, or a mistake of the firmware's.
    pub fn not_bounded(&self, why: &Unbounded) -> Failure {
        let message = format!("no bound: {why}");
        if why.error.is_the_boards() || !self.own_texts.is_empty() {
            Failure::Usage(message)
        } else {
            Failure::Defect(message)
        }
    }

    /// Bits per second of the monitor's serial port, if it has one.
    pub fn monitor_baud(&self) -> Option<u32> {
        self.monitor.map(|monitor| monitor.baud)
    }

    /// What takes the place of the firmware's texts.
    pub fn own_texts(&self) -> &OwnTexts {
        &self.own_texts
    }

    fn image_failure(&self, error: ImageError) -> Failure {
        if let Some(failure) = own_failure(&self.own_texts, &error) {
            return failure;
        }
        match error {
            ImageError::Link(error) => link_failure(error),
            ImageError::Code(error) => code_failure(error),
            ImageError::Firmware(FirmwareError::Assembly(_)) => Failure::Defect(error.to_string()),
            ImageError::Board(..) => {
                Failure::Usage(format!("{error}; make a .o or a .c for your own firmware"))
            }
            ImageError::Firmware(FirmwareError::Keys(_)) => {
                let [least, most] = self.keys_possible();
                Failure::Usage(format!("{error}: give {least} to {most} with --keys"))
            }
            ImageError::Ports(..) | ImageError::Once(_) | ImageError::Firmware(_) => {
                Failure::Usage(error.to_string())
            }
        }
    }
}

/// Code that cannot be made: too much was asked for, or the compiler is wrong.
pub fn code_failure(error: ThumbError) -> Failure {
    match error {
        ThumbError::Bug(_) => Failure::Defect(error.to_string()),
        other => Failure::Usage(other.to_string()),
    }
}

/// A program that does not fit its board is wrong; anything else is ours.
pub fn link_failure(error: LinkError) -> Failure {
    match error {
        LinkError::Full { .. } => Failure::Full(error.to_string()),
        LinkError::Nowhere { .. } => Failure::Usage(error.to_string()),
        other => Failure::Defect(other.to_string()),
    }
}
