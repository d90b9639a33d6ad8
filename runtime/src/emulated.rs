//! Hardware emulation as an engine, `emulated`: the image that `whippen build` makes, on the
//! emulated board, with its firmware and all its cores.
//!
//! ```text
//!   words --converter--> firmware, keys' code --drive row--> drive words
//!              samples <--converter--'   `--rings--> events     frames, missed ticks, faults --> Load
//! ```
//!
//! A board starts: its cores begin one after the other and force comes up over 20 ms. The engine
//! lets it do so with the words of the first tick, then puts the keys' states back to where they
//! were before their first tick, with all gains at 1. From there on every tick is a tick of the
//! instrument, as on any other engine. What the firmware does for safety it does here too: a sensor
//! that stays at its rail frees the key, a hot motor is held back; [`Emulated::load`] tells.
//!
//! Not here: values inside of a tick, which no firmware keeps.

mod events;
mod load;
mod mailbox;
mod memory;
mod sound;
mod start;
mod steps;

use std::ops::Range;

use whippen_compiler::board::Board;
use whippen_compiler::firmware::{
    FirmwareImage, ProgramCode, ZoneCode, core_block, drive_offset_bytes,
};
use whippen_compiler::kernel::Kernel;
use whippen_compiler::keyboard::{CoreId, Layout, ProgramId};
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, Compiled, unobserved};
use whippen_compiler::rate::Rate;
use whippen_emulator::{BoardKind, Converter, ConverterSetup, Machine, Ports, Stop};

use self::load::Frames;
pub use self::load::{CoreLoad, Load};
use self::mailbox::Mailbox;
use self::steps::StepRecorder;
pub use self::steps::{BoardStep, BoardSteps, REGISTERS};
use crate::board;
use crate::device::Device;
use crate::image::{self, ImageInstrument};

/// The MIDI number of the first key; only the serial port, to which nobody listens, depends on it.
const FIRST_NOTE: u8 = 21;
/// Cycles between looks at whether a tick is over that has lasted longer than it may.
const SLICE: u64 = 48;

/// A board to be emulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmulatedBoard {
    /// Which.
    pub kind: BoardKind,
    /// How many keys its image has at least; those that nobody plays do what the last one does.
    pub keys: u32,
}

impl From<BoardKind> for EmulatedBoard {
    /// With the keys that are played.
    fn from(kind: BoardKind) -> EmulatedBoard {
        EmulatedBoard { kind, keys: 1 }
    }
}

impl EmulatedBoard {
    /// How many cores it has, each of which has a key at least.
    pub fn cores(self) -> u32 {
        self.kind.board().cores as u32
    }
}

/// A running board.
pub struct Emulated {
    machine: Machine,
    ports: Ports,
    image: FirmwareImage,
    /// By instrument: what its keys play.
    kernels: Vec<Kernel>,
    /// Keys that are played; the board may have more.
    keys: usize,
    /// Words in and out of a key.
    words_of_key: [usize; 2],
    frames: Frames,
    /// Bytes of events taken, by core and zone.
    taken: Vec<Vec<u32>>,
    load: Load,
    mailbox: Mailbox,
    /// Samples to come that are of ticks before the first.
    samples_before: usize,
    /// Instruction by instruction, where that is wanted.
    steps: Option<Box<StepRecorder>>,
    /// The words of the last tick.
    last_words: Vec<u16>,
    trouble: Option<String>,
}

impl Emulated {
    /// The image of so many keys on a board.
    ///
    /// # Errors
    /// There is no image, in words.
    pub fn new(
        compiled: &Compiled,
        device: &Device,
        on: EmulatedBoard,
        keys: usize,
    ) -> Result<Emulated, String> {
        let keys = u32::try_from(keys).map_err(|e| e.to_string())?;
        let layout = Layout::of_one_instrument(&compiled.model.name, keys, FIRST_NOTE);
        Emulated::of_layout(&layout, &[compiled], device, on)
    }

    /// The image of a keyboard whose first program plays, with the values of all its keys in each
    /// instrument.
    ///
    /// # Errors
    /// There is no image, in words.
    pub fn of_layout(
        layout: &Layout,
        instruments: &[&Compiled],
        device: &Device,
        on: EmulatedBoard,
    ) -> Result<Emulated, String> {
        let board = board::bundled(on.kind.name()).ok_or("there is no board to emulate")?;
        let first = instruments.first().ok_or("there are no keys")?;
        // Each core has a key at least, but for an instrument that is played once.
        let count = match first.model.is_of_key() {
            true => layout.keys.max(board.cores).max(on.keys),
            false => layout.keys,
        };
        let on_board = layout.with_keys(count).map_err(|e| e.to_string())?;
        let setup = image::setup(first, device, count, board.cores, FIRST_NOTE)?;
        let of_image =
            |of: &&Compiled| ImageInstrument::new(of, INSTRUCTIONS, None, &mut unobserved);
        let parts: Vec<ImageInstrument> = instruments
            .iter()
            .map(of_image)
            .collect::<Result<_, _>>()
            .map_err(|e| format!("{e:?}"))?;
        let borrowed = ImageInstrument::borrow_all(&parts);
        let built = pipeline::build(&on_board, &borrowed, &setup, &board, &mut unobserved)
            .map_err(|e| e.to_string())?;
        let kernels = parts.into_iter().map(|part| part.modes.kernel).collect();
        let keys = layout.keys as usize;
        let mut emulated = Emulated::loaded(built, kernels, keys, setup.rate_hz, &board, on.kind)?;
        let kernel = &first.lowered.kernel;
        emulated.words_of_key =
            [kernel.inputs.len(), kernel.outputs.len()].map(|words| words.max(1));
        Ok(emulated)
    }

    /// The board with its image, about to start.
    fn loaded(
        image: FirmwareImage,
        kernels: Vec<Kernel>,
        keys: usize,
        rate_hz: Rate,
        board: &Board,
        kind: BoardKind,
    ) -> Result<Emulated, String> {
        let converter = ConverterSetup {
            // The firmware says how many words there are.
            keys: image.keys_of_cores.iter().sum(),
            rate: rate_hz.fraction(),
        };
        let (mut machine, ports) =
            whippen_emulator::build(kind, kind.board(), converter).map_err(|e| e.to_string())?;
        for segment in &image.image.segments {
            let memory = &mut machine.bus.memory;
            memory
                .write(segment.load, &segment.bytes)
                .map_err(|e| e.to_string())?;
        }
        machine.reset();
        let load = Load {
            period_cycles: rate_hz.cycles_min(board.clock_hz),
            ..Load::default()
        };
        let cores = &image.program(ProgramId(0)).cores;
        let taken = cores.iter().map(|core| vec![0; core.zones.len()]).collect();
        Ok(Emulated {
            machine,
            ports,
            image,
            kernels,
            keys,
            words_of_key: [1, 1],
            frames: Frames::default(),
            taken,
            load,
            mailbox: Mailbox::default(),
            samples_before: 0,
            steps: None,
            last_words: Vec::new(),
            trouble: None,
        })
    }

    /// The program that plays.
    fn program(&self) -> &ProgramCode {
        self.image.program(ProgramId(0))
    }

    /// A core's keys, from the first on.
    fn zones(&self, core: usize) -> &[ZoneCode] {
        &self.program().core(CoreId(core as u32)).zones
    }

    /// What must precede the first tick, with its words: the board starts.
    pub fn start(&mut self, words: &[u16]) {
        if let Err(why) = self.begin(words) {
            self.trouble.get_or_insert(why);
        }
    }

    /// One tick.
    pub fn tick(&mut self, words: &[u16], drive: &mut [i16]) {
        if self.trouble.is_some() {
            return;
        }
        if let Err(why) = self.run_tick(words, drive) {
            self.trouble = Some(why);
        }
    }

    /// Why it stopped, if it did.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// From now on it keeps the cycles of every tick, and of these ticks (the first is 0) every
    /// instruction.
    pub fn record_steps(&mut self, ticks: Range<u64>) {
        self.steps = Some(Box::new(StepRecorder::new(ticks, self.machine.cores())));
    }

    /// What was kept, where it was wanted.
    pub fn take_steps(&mut self) -> Option<BoardSteps> {
        let mut steps = self.steps.take()?.steps;
        steps.segments.clone_from(&self.image.image.segments);
        Some(steps)
    }

    /// What the run took so far.
    pub fn load(&self) -> Load {
        let core = |core: usize| CoreLoad {
            keys: self.image.keys_of_cores[core],
            frame_cycles_max: self.frames.longest[core],
            frame_cycles: self.frames.total[core],
            missed: self.block(core, core_block::MISSED).unwrap_or(0),
            faults: self.block(core, core_block::FAULTS).unwrap_or(0),
        };
        Load {
            cores: self.cores().map(core).collect(),
            ..self.load.clone()
        }
    }

    fn run_tick(&mut self, words: &[u16], drive: &mut [i16]) -> Result<(), String> {
        self.load.ticks += 1;
        self.post()?;
        self.serve(words)?;
        let outs = self.words_of_key[1];
        for (at, word) in drive.iter_mut().enumerate() {
            *word = self.drive_word(at / outs, at % outs)?;
        }
        Ok(())
    }

    /// A tick on the board.
    fn serve(&mut self, words: &[u16]) -> Result<(), String> {
        self.give(words)?;
        let tick = self.ticks()? + 1;
        let in_time = self.until_served(tick)?;
        if !in_time || self.ticks()? != tick || self.missed()? > 0 {
            return Err(self.late());
        }
        Ok(())
    }

    /// Words each way of a key.
    fn words_each_way(&self) -> usize {
        self.words_of_key[0].max(self.words_of_key[1])
    }

    /// A drive word of a key in the tick that was served last.
    fn drive_word(&self, key: usize, port: usize) -> Result<i16, String> {
        let keys_of_cores = &self.image.keys_of_cores;
        let first = keys_of_cores[0] as usize;
        let (core, own) = if key < first {
            (0, key)
        } else {
            (1, key - first)
        };
        let row = self.block(core, core_block::ROW)?;
        let each_way = self.words_each_way() as u32;
        let distance = drive_offset_bytes(keys_of_cores[core] * each_way);
        let address = row + distance + 2 * (own as u32 * each_way + port as u32);
        let mut bytes = [0; 2];
        self.read(address, &mut bytes)?;
        Ok(i16::from_le_bytes(bytes))
    }

    /// Sensor words for one tick; a key that only the board has does what the last one does.
    fn give(&mut self, words: &[u16]) -> Result<(), String> {
        let count = self.image.keys_of_cores.iter().sum::<u32>() as usize;
        let ([ins, _], each_way) = (self.words_of_key, self.words_each_way());
        let mut row: Vec<u16> = Vec::new();
        for key in 0..count {
            let own = key.min(self.keys.saturating_sub(1)) * ins;
            let words = words.iter().skip(own).take(ins).copied();
            // What is driven and not measured has a word in that nobody reads.
            row.extend(words.chain(std::iter::repeat(0)).take(each_way));
        }
        self.converter()?.samples.extend(row);
        self.last_words.clear();
        self.last_words.extend(words);
        Ok(())
    }

    /// Runs until both cores have served a tick; whether they had when the next was requested, and
    /// were back in the code that it interrupted.
    fn until_served(&mut self, tick: u32) -> Result<bool, String> {
        let (request, deadline) = (self.request_cycle(tick - 1)?, self.request_cycle(tick)?);
        if let (Some(steps), Some(of_keys)) = (&mut self.steps, self.load.ticks.checked_sub(1)) {
            steps.begin(of_keys, request);
        }
        loop {
            // Not beyond the next request, lest its frame is taken for this one.
            let left = deadline.saturating_sub(self.cycle());
            self.slice(if left == 0 { SLICE } else { left })?;
            let served = |core: usize| {
                Ok(self.block(core, core_block::TICK)? >= tick
                    && self.machine.cpu(core).exception() == 0)
            };
            if self.all(served)? {
                let cores = self.cores();
                let took = cores.map(|core| self.frames.served(core, request));
                let took: Vec<u64> = took.collect();
                let slowest = took.iter().max().copied();
                if let Some(steps) = &mut self.steps {
                    steps.end(took);
                }
                return Ok(slowest.is_none_or(|cycles| request + cycles <= deadline));
            }
            if self.ticks()? > tick.saturating_add(2) {
                return Ok(false);
            }
        }
    }

    /// What is said of a tick that is missed.
    fn late(&self) -> String {
        let keys = self.image.keys_of_cores.iter().map(u32::to_string);
        let keys: Vec<String> = keys.collect();
        format!(
            "a tick is missed after {} ticks: {} keys take more than {} cycles, entry and exit of the \
             interrupt included",
            self.load.ticks,
            keys.join(" and "),
            self.load.period_cycles
        )
    }

    /// The cycle in which the converter requests a tick, counted from 0.
    fn request_cycle(&mut self, tick: u32) -> Result<u64, String> {
        Ok(self.converter()?.cycle_of(tick))
    }

    /// Runs for so long, or until a core has left an exception; the core that met a breakpoint, if
    /// one did.
    fn slice(&mut self, cycles: u64) -> Result<Option<usize>, String> {
        let until = self.cycle() + cycles;
        self.frames.has_resumed = false;
        let frames = &mut self.frames;
        let stop = match self.steps.as_mut().filter(|steps| steps.is_recording()) {
            Some(steps) => self.machine.run_observed(until, &mut steps.with(frames)),
            None => self.machine.run_observed(until, frames),
        };
        match stop {
            Stop::Limit => Ok(None),
            Stop::Breakpoint { core, .. } => Ok(Some(core)),
            stop => Err(format!("the board stopped: {stop}")),
        }
    }

    /// The cycle of the core that is ahead: where one sleeps, that may be one without keys.
    fn cycle(&self) -> u64 {
        let cycles = (0..self.machine.cores()).map(|core| self.machine.cycle(core));
        cycles.max().unwrap_or(0)
    }

    fn cores(&self) -> std::ops::Range<usize> {
        0..self.image.keys_of_cores.len()
    }

    /// Whether something holds on all cores.
    fn all(&self, holds: impl Fn(usize) -> Result<bool, String>) -> Result<bool, String> {
        self.cores()
            .try_fold(true, |all, core| Ok(all && holds(core)?))
    }

    /// Ticks that any core has missed.
    fn missed(&self) -> Result<u32, String> {
        self.cores()
            .map(|core| self.block(core, core_block::MISSED))
            .sum()
    }

    fn converter(&mut self) -> Result<&mut Converter, String> {
        self.machine
            .bus
            .device_mut(self.ports.converter)
            .ok_or_else(|| "the board has no converter".to_string())
    }

    fn ticks(&mut self) -> Result<u32, String> {
        Ok(self.converter()?.ticks())
    }
}
