//! The firmware around the keys: one core or two, the converter's tick, safety, parameters, MIDI,
//! watchdog.
//!
//! ```text
//!   core 0   tick: converter -> keys -> service, guard      between ticks: mailbox, watchdog
//!   core 1   tick: converter -> keys -> service, guard      between ticks: events of both cores -> MIDI (a single core: here too)
//! ```
//!
//! The texts in `firmware/` are assembled with the constants of a program and a board; `tick`,
//! `service` and `guard` once for each core, because every number in them is a constant of that
//! core. What a board must say is in two texts of its own. docs/firmware.md describes what the
//! texts do, for those who use it.
//!
//! [`whole()`] puts the keys' code into it: an image that starts by itself.
//!
//! Not here: the code of the keys (`thumb`), addresses (`image`), files.

mod boards;
mod constants;
mod running;
mod tables;
mod whole;
mod zones;

use std::collections::BTreeMap;
use std::fmt;

use constants::{PROGRAMS_MAX, RECORD_MAX};

use whippen_arm::asm::{AsmError, Source, assemble};
use whippen_arm::image::Object;
use whippen_arm::thumb::StateLayout;
use whippen_deterministic::parallel;
use whippen_kernel::Kernel;

use boards::{frame, shared};

pub use boards::{Support, Unsupported, support};
pub use constants::constants;
pub use running::{BEGINS, DEAD, Owner, PARTS, RUNNING, Running, owner};
pub use whole::{Instrument, Part, Program, Whole, WholeError, divided, whole};
pub use zones::zone_name;

/// What a program and its keyboard say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setup {
    /// Keys of each core of the board, 1 to 255.
    pub keys: Vec<u32>,
    /// Ticks per second.
    pub rate_hz: u32,
    /// What the motor stands.
    pub motor: Motor,
    /// Sensor words between which a key is in mid-travel: where a word that does not change may be
    /// a fault.
    pub mid_travel: [u16; 2],
    /// The MIDI note of the first key; 21 is A0.
    pub first_note: u32,
    /// How much energy a key may give, where that is limited.
    pub passivity: Option<Passivity>,
}

/// What a key may give beyond what it got, in any span of time, and how that is observed. The unit
/// of energy is a drive word times a sensor word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Passivity {
    /// That energy, 2^18 to 2^30.
    pub credit: u32,
    /// Ticks from a drive word to the sensor word that ends the way on which it acted, 1 to 16.
    pub past: u32,
    /// The key's own damping, which takes a part of what the motor gives: 1/256 of a drive word for
    /// a sensor word a tick, at most 8191.
    pub damping: u32,
}

/// What a motor stands, in drive words: 32768 is its peak current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motor {
    /// The word of its rated current.
    pub rated: u32,
    /// How long it stands its peak current (ms).
    pub peak_ms: u32,
    /// The word of 1 N.
    pub newton: u32,
}

/// Which events become MIDI messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Midi {
    /// The event whose first argument is a speed.
    pub note: Option<u32>,
    /// The event that ends a note.
    pub release: Option<u32>,
    /// How far a speed is shifted right to be an index of the table.
    pub speed_shift: u32,
    /// Velocity by speed.
    pub velocities: [u8; 128],
}

/// Why there is no firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FirmwareError {
    /// So many keys on a core, not 1 to 255.
    Keys(u32),
    /// Keys are given for so many cores, and the board has another number of them.
    Cores(usize, usize),
    /// A program's parts have so many keys, and the cores so many.
    Parts(u32, u32),
    /// A record of so many bytes, more than the frame can reach.
    Record(u32),
    /// So many programs, not 1 to 64.
    Programs(usize),
    /// The board's core is one for which the limit of energy is not made.
    PassivityCore,
    /// Credit, past or damping of the passivity are out of range, or the core has none.
    Passivity,
    /// The motor's rated word is not between 1 and 32767, or it stands its peak for less than 1 ms
    /// or more than 10 s.
    Motor,
    /// A board's text is no assembly.
    Assembly(AsmError),
}

impl fmt::Display for FirmwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareError::Keys(keys) => write!(f, "{keys} keys on a core; the firmware takes 1 to 255"),
            FirmwareError::Cores(given, has) => write!(f, "keys of {given} cores for a board with {has}"),
            FirmwareError::Parts(parts, keys) => {
                write!(f, "the zones of a program have {parts} keys and the keyboard {keys}: give it that many")
            }
            FirmwareError::Record(bytes) => {
                write!(f, "a key's record takes {bytes} bytes; the firmware takes at most {RECORD_MAX}")
            }
            FirmwareError::Programs(count) => write!(f, "{count} programs; the firmware takes 1 to {PROGRAMS_MAX}"),
            FirmwareError::Motor => {
                f.write_str("the rated current must be below the peak, and the peak last between 1 ms and 10 s")
            }
            FirmwareError::Passivity => f.write_str(
                "passivity is out of reach: energy, delays or damping are not within what the firmware's words can say",
            ),
            FirmwareError::PassivityCore => {
                f.write_str("passivity is watched on Cortex-M4 and M33 only: take another board, or no [passivity]")
            }
            FirmwareError::Assembly(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FirmwareError {}

impl From<AsmError> for FirmwareError {
    fn from(error: AsmError) -> Self {
        FirmwareError::Assembly(error)
    }
}

/// From a sensor word to the drive word of the same key (bytes), for so many keys of a core: what
/// [`thumb::compile_for_frame`](whippen_arm::thumb::compile_for_frame) must be told.
pub fn distance(keys: u32) -> u32 {
    (2 * keys).next_multiple_of(4)
}

/// Names of the cores' blocks, and of the objects of the keys of the first program.
pub const CORES: [&str; 2] = ["core0", "core1"];

/// The name of the object of a core's keys of a program.
pub fn keys_name(core: usize, program: usize) -> String {
    if program == 0 {
        CORES[core].to_string()
    } else {
        format!("{}_{program}", CORES[core])
    }
}

/// Neighbouring keys of a core that play one instrument.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// The prefix of its symbols: [`keys_name`], or [`zone_name`] where the core has several.
    pub name: String,
    /// Which part of the program it belongs to; the rest of that may be on the other core.
    pub part: usize,
    /// Its first key, counted from the first of the core.
    pub first: u32,
    /// How many keys it has.
    pub keys: u32,
    /// Where its state has what.
    pub layout: StateLayout,
}

/// A program as the firmware sees it.
#[derive(Debug, Clone)]
pub struct Played<'a> {
    /// What each part plays, and which of its events are notes.
    pub parts: Vec<(&'a Kernel, &'a Midi)>,
    /// By core: its keys from the first on.
    pub cores: &'a [Vec<Segment>],
}

/// The kernel for keys from one on: values per key begin there.
pub fn keys_of(kernel: &Kernel, first: u32) -> Kernel {
    let mut own = kernel.clone();
    for keyed in &mut own.keyed {
        // A list that is too short goes on with its last value.
        let from = (first as usize).min(keyed.values.len().saturating_sub(1));
        keyed.values.drain(..from);
    }
    own
}

/// Whether some core has keys of several instruments in one program: then records are listed
/// (`zones`).
pub fn zoned(programs: &[Played]) -> bool {
    programs
        .iter()
        .flat_map(|program| program.cores)
        .any(|segments| segments.len() > 1)
}

/// The objects of a firmware, to be linked with those of the keys of all programs, which are
/// compiled for the names of their segments, with records of one size unless some core has several
/// instruments. The image begins at `reset`, with the first program.
///
/// # Errors
/// Programs, keys, records or motor are out of range; a text of the board is wrong.
pub fn objects(
    programs: &[Played],
    setup: &Setup,
    board: &Support,
) -> Result<Vec<Object>, FirmwareError> {
    let constants = constants(programs, setup, board)?;
    let mut tables = vec![tables::text(programs)];
    for (number, program) in programs.iter().enumerate().filter(|_| zoned(programs)) {
        for (core, segments) in program.cores.iter().enumerate() {
            let name = keys_name(core, number);
            tables.push(zones::records(&name, core, segments));
            tables.extend((segments.len() > 1).then(|| zones::text(&name, core, segments)));
        }
    }
    let alone = shared(board).chain([board.tick]).map(|source| vec![source]);
    let mut texts: Vec<(Vec<Source>, Option<usize>)> =
        alone.map(|sources| (sources, None)).collect();
    let start = texts.len() - 1;
    texts.extend((0..setup.keys.len()).map(|core| (frame(board), Some(core))));
    texts.extend(tables.iter().map(|text| {
        (
            vec![Source {
                name: "tables",
                text,
            }],
            None,
        )
    }));
    let assembled = parallel::map(texts, |(sources, core)| {
        let Some(core) = core else {
            return assemble(&sources, &constants, board.board.arch);
        };
        let mut own = constants.clone();
        own.extend(of_frame(setup.keys[core], board, core));
        Ok(of_core(
            assemble(&sources, &own, board.board.arch)?,
            core,
            programs.len(),
        ))
    });
    let mut objects = assembled
        .into_iter()
        .collect::<Result<Vec<Object>, AsmError>>()?;
    let frame = objects[start]
        .sections
        .iter_mut()
        .filter(|section| section.name == ".text.frame");
    frame.for_each(|section| section.name = ".text.start.board".into());
    Ok(objects)
}

/// What the frame of a core is told besides the [`constants`].
pub fn of_frame(keys: u32, board: &Support, core: usize) -> BTreeMap<String, i64> {
    let all = [
        ("KEYS", keys),
        ("DISTANCE", distance(keys)),
        ("STACK", board.board.stacks[core]),
    ];
    all.into_iter()
        .map(|(name, value)| (name.to_string(), value.into()))
        .collect()
}

/// The texts of a firmware as they are assembled, those of a frame together; a frame is told
/// [`of_frame`] besides the [`constants`].
pub fn sources<'a>(board: &Support<'a>) -> Vec<Vec<Source<'a>>> {
    shared(board)
        .map(|source| vec![source])
        .chain([frame(board)])
        .collect()
}

/// The frame of one core: its names and sections say so, and nobody else sees what is in it but the
/// tick.
fn of_core(mut object: Object, core: usize, programs: usize) -> Object {
    let (number, core) = (core, CORES[core]);
    let rename = |name: &str| match name {
        "tick" => format!("tick_{core}"),
        "block" => core.to_string(),
        "entry" => ["reset", "core1_start"][number].to_string(),
        "exceptions" => format!("vectors{number}"),
        "guards" | "ledger" => format!("{name}{number}"),
        other => other.to_string(),
    };
    let of_programs = |what: &str| {
        (0..programs)
            .map(|at| format!("{}_{what}", keys_name(number, at)))
            .collect()
    };
    let targets = |name: &String| -> Vec<String> {
        match name.as_str() {
            "keys_tick" => of_programs("tick"),
            "keys_begin" => of_programs("begin"),
            // With one program there is never another one that could begin.
            "beginning" if programs == 1 => Vec::new(),
            other => vec![rename(other)],
        }
    };
    for section in &mut object.sections {
        section.name = section.name.replace(".frame", &format!(".{core}.frame"));
        section
            .fixups
            .iter_mut()
            .for_each(|fixup| fixup.symbol = rename(&fixup.symbol));
        for hint in &mut section.hints {
            if let whippen_arm::image::Hint::Targets { symbols, .. } = hint {
                *symbols = symbols.iter().flat_map(targets).collect();
            }
        }
    }
    for symbol in &mut object.symbols {
        symbol.global &=
            symbol.section.is_none() || ["tick", "exceptions"].contains(&symbol.name.as_str());
        symbol.name = rename(&symbol.name);
    }
    object
}
