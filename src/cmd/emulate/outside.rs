//! Parts on the pins of an emulated chip: a knob, a bench of keys or columns of converters, as a
//! board's file and a device's say, and a DAC that hears what the program sounds.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::board::Board;
use whippen_compiler::rate::Rate;
use whippen_emulator::elf::Elf;
use whippen_emulator::{DacErrors, DacPins, DeviceId, HeardFrame, Machine, SoundDac};
use whippen_runtime::files::write_whole;
use whippen_runtime::sound::write_words;

use super::bench::WiredBench;
use super::columns::WiredColumns;
use super::knob::WiredKnob;
use crate::cmd::setup::find_board;
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::hardware::BOARD;

/// What is on the pins.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Parts on the pins of rp2350")]
pub struct PartArgs {
    #[command(flatten)]
    pub on: OnPins,
    /// What moves and drives: winding, constant of the motor, what turns or goes down [default:
    /// gimbal of a knob, voice_coil of a bench, column_coil of columns]
    #[arg(long, value_name = "NAME|FILE.toml", requires = "on_pins", value_hint = ValueHint::FilePath)]
    pub device: Option<OsString>,
    /// Where a hand or a finger is, once the image has ticks: a table such as t_s,angle_deg from
    /// where the knob stands then, or t_s,x_mm of keys; its end ends the run
    #[arg(long, value_name = "FILE", requires = "on_pins", value_hint = ValueHint::FilePath)]
    pub motion: Option<PathBuf>,
    /// The keys that fingers press, such as 0,3 [default: all]
    #[arg(
        long,
        value_name = "KEYS",
        value_delimiter = ',',
        requires = "motion",
        conflicts_with = "knob"
    )]
    pub pressed: Vec<usize>,
    /// A table over time: of a knob angle, the hand's torque and the motor's, a current, whether
    /// the driver is enabled; of keys their places and currents, whether bridges are awake
    /// or amplifiers enabled
    #[arg(short, long, value_name = "FILE.csv", requires = "on_pins", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// What the DAC of the board's `[i2s]` is given: a WAV file with the words of both sides
    #[arg(long, value_name = "FILE.wav", requires = "on_pins", value_hint = ValueHint::FilePath)]
    pub heard: Option<PathBuf>,
}

/// The board whose parts they are.
#[derive(Debug, Clone, clap::Args)]
#[group(id = "on_pins", multiple = false)]
pub struct OnPins {
    /// Wire a knob's sensor, driver and motor to the pins that the `[knob]` of this board names
    #[arg(long, value_name = "BOARD|FILE.toml", value_hint = ValueHint::FilePath)]
    pub knob: Option<OsString>,
    /// Wire keys with sensors, bridges and coils to the pins that the `[bench]` of this board names
    #[arg(long, value_name = "BOARD|FILE.toml", value_hint = ValueHint::FilePath)]
    pub bench: Option<OsString>,
    /// Wire columns of converters, with amplifiers, coils and keys, to the pins that `[columns]` of
    /// this board names
    #[arg(long, value_name = "BOARD|FILE.toml", value_hint = ValueHint::FilePath)]
    pub columns: Option<OsString>,
}

impl PartArgs {
    /// The files that are read.
    pub fn files(&self) -> Vec<PathBuf> {
        let on = &self.on;
        let names = on.knob.iter().chain(&on.bench).chain(&on.columns);
        let boards = names.filter_map(|name| BOARD.file(name));
        let device = device::file(self.device.as_deref());
        boards.chain(device).chain(self.motion.clone()).collect()
    }

    /// Wires the parts that are wanted.
    pub fn connect(&self, machine: &mut Machine, elf: &Elf) -> Result<Outside, Failure> {
        let mut outside = Outside {
            moved: None,
            dac: None,
        };
        let (option, name) = match (&self.on.knob, &self.on.bench, &self.on.columns) {
            (Some(name), ..) => ("--knob", name),
            (_, Some(name), _) => ("--bench", name),
            (.., Some(name)) => ("--columns", name),
            (None, None, None) => return Ok(outside),
        };
        if machine.bus.pins.count() == 0 {
            let board = format!("{option} needs a board with pins: --board rp2350");
            return Err(Failure::Usage(board));
        }
        let wrong = |what: &str| Failure::Usage(format!("{option} {}: {what}", name.display()));
        let board = find_board(Some(name), None)?;
        outside.moved = Some(match option {
            "--knob" => {
                let knob = board.knob.as_ref().ok_or_else(|| {
                    wrong("this board has no `[knob]`, which says what its pins lead to")
                })?;
                Moved::Knob(WiredKnob::connect(self, machine, elf, knob)?)
            }
            "--bench" => {
                let bench = board.bench.as_ref().ok_or_else(|| {
                    wrong("this board has no `[bench]`, which says what its pins lead to")
                })?;
                Moved::Bench(WiredBench::connect(self, machine, elf, bench)?)
            }
            _ => {
                let columns = board.columns.as_ref().ok_or_else(|| {
                    wrong("this board has no `[columns]`, which say what its pins lead to")
                })?;
                Moved::Columns(WiredColumns::connect(self, machine, elf, columns)?)
            }
        });
        if self.heard.is_some() && board.i2s.is_none() {
            let what = "--heard asks for what a DAC is given, and this board has no `[i2s]`";
            return Err(wrong(what));
        }
        outside.dac = self
            .heard
            .is_some()
            .then(|| WiredDac::connect(machine, &board))
            .flatten();
        Ok(outside)
    }

    /// Writes table and sound, as far as they are wanted.
    pub fn write(&self, outside: &Outside) -> Outcome {
        let table = match &outside.moved {
            Some(Moved::Knob(knob)) => knob.table(),
            Some(Moved::Bench(bench)) => bench.table(),
            Some(Moved::Columns(columns)) => columns.table(),
            None => None,
        };
        if let (Some(path), Some(table)) = (&self.out, table) {
            write_whole(path, |w| w.write_all(table.as_bytes()))
                .map_err(|e| Failure::Usage(e.to_string()))?;
        }
        if let (Some(path), Some(dac)) = (&self.heard, &outside.dac) {
            write_words(path, dac.rate, dac.words.iter().copied())
                .map_err(|e| Failure::Usage(e.to_string()))?;
        }
        Ok(())
    }
}

/// What is on the pins.
pub struct Outside {
    moved: Option<Moved>,
    dac: Option<WiredDac>,
}

/// What a hand moves.
enum Moved {
    Knob(WiredKnob),
    Bench(WiredBench),
    Columns(WiredColumns),
}

impl Outside {
    /// The cycle up to which the hand holds still, if there is something that it could move.
    pub fn next(&self) -> Option<u64> {
        match self.moved.as_ref()? {
            Moved::Knob(knob) => Some(knob.rows.next()),
            Moved::Bench(bench) => Some(bench.rows.next()),
            Moved::Columns(columns) => Some(columns.rows.next()),
        }
    }

    /// Whether the hand has done all that it does.
    pub fn is_over(&self) -> bool {
        match &self.moved {
            Some(Moved::Knob(knob)) => knob.rows.is_over(),
            Some(Moved::Bench(bench)) => bench.rows.is_over(),
            Some(Moved::Columns(columns)) => columns.rows.is_over(),
            None => false,
        }
    }

    /// A row, if it is time for one; then the hand goes on.
    pub fn pass(&mut self, machine: &mut Machine) {
        if self.next().is_none_or(|next| machine.cycle(0) < next) {
            return;
        }
        match &mut self.moved {
            Some(Moved::Knob(knob)) => knob.pass(machine),
            Some(Moved::Bench(bench)) => bench.pass(machine),
            Some(Moved::Columns(columns)) => columns.pass(machine),
            None => {}
        }
        if let Some(dac) = &mut self.dac {
            dac.pass(machine);
        }
    }

    /// What there is and how it stands, in words: a line for each.
    pub fn told(&self, machine: &Machine) -> Vec<String> {
        let moved = self.moved.as_ref().map(|moved| match moved {
            Moved::Knob(knob) => format!("knob          {}", knob.told(machine)),
            Moved::Bench(bench) => format!("bench         {}", bench.told(machine)),
            Moved::Columns(columns) => format!("columns       {}", columns.told(machine)),
        });
        let dac = self.dac.as_ref();
        let dac = dac.map(|dac| format!("sound         {}", dac.told(machine)));
        moved.into_iter().chain(dac).collect()
    }

    /// Takes what came last.
    pub fn end(&mut self, machine: &mut Machine) {
        if let Some(dac) = &mut self.dac {
            dac.pass(machine);
        }
    }
}

/// A DAC on the pins, and what it was given.
struct WiredDac {
    id: DeviceId,
    rate: Rate,
    words: Vec<[i32; 2]>,
}

impl WiredDac {
    fn connect(machine: &mut Machine, board: &Board) -> Option<WiredDac> {
        let port = board.i2s?;
        let pins = DacPins {
            clock: port.clock,
            side: port.side,
            data: port.data,
        };
        let clock_hz = machine.board().clock_hz;
        let period = whippen_compiler::board::SoundPort::period_cycles(board);
        Some(WiredDac {
            id: SoundDac::attach(&mut machine.bus, pins, clock_hz.into()),
            rate: Rate::new(clock_hz, period)?,
            words: Vec::new(),
        })
    }

    fn pass(&mut self, machine: &mut Machine) {
        if let Some(dac) = machine.bus.device_mut::<SoundDac>(self.id) {
            let words = |frame: HeardFrame| frame.words;
            self.words.extend(dac.take_frames().into_iter().map(words));
        }
    }

    fn told(&self, machine: &Machine) -> String {
        let dac = machine.bus.device::<SoundDac>(self.id);
        let errors = dac.map(SoundDac::errors).unwrap_or_default();
        let wrong = match errors == DacErrors::default() {
            true => String::new(),
            false => format!(
                "; against the DAC's datasheet: {} times its clock, {} times the time before or after it, {} times \
                 the length of a word",
                errors.clock, errors.near, errors.length
            ),
        };
        format!("{} frames{wrong}", self.words.len())
    }
}
