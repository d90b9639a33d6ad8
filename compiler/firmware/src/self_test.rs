//! The self-test: an image that runs the programs of a core's timing rules and ticks of a key under
//! the core's cycle counter, and tells what it found beside what was expected.
//!
//! ```text
//!   rules of the core --walk by its table--> expected --.
//!   modes of a key --------compile---> ticks of a key --+--> link --> image
//!   texts of the board's start, self_test.s ------------'
//! ```
//!
//! What a program is expected to take is what the table says, instruction by instruction. What a
//! tick is expected to take depends on what the key does, so who builds the image runs it first.
//!
//! Not here: running it (the runtime).

mod rows;

use std::fmt;

use whippen_arm::asm::{AsmError, Source, assemble};
use whippen_arm::image::{Image, Input, LinkError, Object, Place, SectionKind, link};
use whippen_arm::thumb::{self, Built, ThumbError, TickAbi, compile_for_frame};
use whippen_isa::timing::{Core, programs, rules};
use whippen_modes::Modes;

use super::board_texts::{CONVERTER_START, KNOB_START};
use super::boards::{FILL, Support};
use super::drive_offset_bytes;
use super::offsets::assembly_constants;
use rows::TestRow;

/// What is tested.
#[derive(Debug, Clone, Copy)]
pub struct SelfTest<'a> {
    /// The board's texts.
    pub support: &'a Support<'a>,
    /// The table that says what is expected.
    pub timing: &'a Core,
    /// The name of the instrument whose key is ticked.
    pub instrument: &'a str,
    /// The modes of the key, without probes.
    pub modes: &'a Modes,
    /// Places of its origins.
    pub places: &'a [Place],
    /// Sensor words, one a tick.
    pub motion: &'a [u16],
    /// What each tick is expected to take, as far as that is known.
    pub ticks: &'a [u32],
    /// Bits per second of the serial port.
    pub baud: u32,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum SelfTestError {
    /// The rules of the core cannot be read: a bug.
    Rules(String),
    /// The texts are wrong: a bug.
    Text(AsmError),
    /// There is no code for the key.
    Code(ThumbError),
    /// It cannot be laid out in the board's memory.
    Link(LinkError),
}

impl fmt::Display for SelfTestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SelfTestError::Rules(line) => write!(f, "the rules of the core: {line}"),
            SelfTestError::Text(error) => error.fmt(f),
            SelfTestError::Code(error) => error.fmt(f),
            SelfTestError::Link(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SelfTestError {}

/// Offsets of the words of the block `self_test` (bytes): docs/firmware.md has all of them.
pub mod self_test_block {
    /// 0 while it runs, 1 once it is done, 2 after a fault of the processor.
    pub const STATE: u32 = 8;
    /// How many programs there are.
    pub const PROGRAMS: u32 = 16;
    /// How many of them differ.
    pub const DIFFER: u32 = 20;
    /// How many ticks of a key there are.
    pub const TICKS: u32 = 24;
    /// How many of them differ.
    pub const TICKS_DIFFER: u32 = 28;
}

/// What runs the programs.
const RUNNER: Source<'static> = Source {
    name: "firmware/self_test.s",
    text: include_str!("self_test.s"),
};

/// The prefix of the key's names.
const TESTED: &str = "tested";

impl SelfTest<'_> {
    /// The image; it begins at `self_test_reset`.
    ///
    /// # Errors
    /// The key has no code, or memory is full; a bug.
    pub fn image(&self) -> Result<Image, SelfTestError> {
        let board = self.support.board;
        let all = programs(rules(board.arch), self.timing).map_err(SelfTestError::Rules)?;
        let rows: Vec<TestRow> = (all.iter())
            .filter(|program| program.apart.is_none())
            .map(|program| TestRow::new(program, self.timing))
            .collect();
        let mut key = self.key().map_err(SelfTestError::Code)?;
        // Code lies where core 1 has its own: not with the data, on which it would wait.
        let code = (key.object.sections.iter_mut()).filter(|s| s.kind == SectionKind::Code);
        code.for_each(|section| section.name = format!(".text.core1.{}", section.name));
        let objects = self.texts(&rows, &key).map_err(SelfTestError::Text)?;
        let inputs = objects.iter().map(|object| Input {
            object,
            places: &[],
        });
        let of_key = Input {
            object: &key.object,
            places: self.places,
        };
        let inputs: Vec<Input> = inputs.chain([of_key]).collect();
        link(board, &inputs, "self_test_reset").map_err(SelfTestError::Link)
    }

    /// Words of the key, each way.
    fn words(&self) -> u32 {
        let kernel = &self.modes.kernel;
        kernel.inputs.len().max(kernel.outputs.len()) as u32
    }

    /// One key, as an image has it.
    fn key(&self) -> Result<Built, ThumbError> {
        let options = thumb::Options {
            name: TESTED.to_string(),
            keys: 1,
            gain: true,
            probes: false,
            arch: self.support.board.arch,
        };
        let abi = TickAbi {
            drive_offset: drive_offset_bytes(self.words()),
            record_bytes_min: 0,
            shares: false,
        };
        compile_for_frame(self.modes, &options, &abi)
    }

    fn texts(&self, rows: &[TestRow], key: &Built) -> Result<Vec<Object>, AsmError> {
        let board = self.support.board;
        let mut constants = assembly_constants();
        let gain = key.layout.gain(0).unwrap_or_default();
        constants.extend(self.support.numbers());
        let own = [
            ("UART_DIVISOR", board.clock_hz / 16 / self.baud.max(1)),
            ("MONITOR", 0),
            ("STACK0", board.stacks[0]),
            ("SMALL", u32::from(board.arch == whippen_isa::Arch::V6M)),
            ("PROGRAMS", rows.len() as u32),
            ("TICKS", self.motion.len() as u32),
            ("WORDS", self.words()),
            ("GAIN", gain),
        ];
        constants.extend(own.map(|(name, value)| (name.to_string(), value.into())));
        let banner = format!(
            "whippen self-test: {} of {}, and {}\\r\\nexpected  found what\\r\\n",
            self.timing.name, board.name, self.instrument
        );
        let ends = [
            format!(" of {} programs differ\\r\\n", rows.len()),
            format!(
                " of {} ticks of {} differ; cycles of the longest, its call and the counter included:",
                self.motion.len(),
                self.instrument
            ),
        ];
        let table = rows::as_assembly(rows, (self.motion, self.ticks), &banner, &ends);
        let table = Source {
            name: "self-test tables",
            text: &table,
        };
        let is_of_start = |source: &&Source| {
            source.name != CONVERTER_START.name && source.name != KNOB_START.name
        };
        let start = self.support.rest.iter().filter(is_of_start).copied();
        start
            .chain([FILL, RUNNER, table])
            .map(|source| assemble(&[source], &constants, board.arch))
            .collect()
    }
}
