//! The engine `emulated`: the image that `whippen build` makes, on the emulated board, with its
//! firmware and all its cores.
//!
//! ```text
//!   words --converter--> firmware, keys' code --drive row--> drive words
//!                                  `--rings--> events          frames, missed ticks, faults --> Load
//! ```
//!
//! A board starts: its cores begin one after the other and force comes up over 20 ms. The engine
//! lets it do so with the words of the first tick, then puts the keys' states back to where they
//! were before their first tick, with all gains at 1. From there on every tick is a tick of the
//! instrument, as on any other engine. What the firmware does for safety it does here too: a sensor
//! that stays at its rail frees the key, a hot motor is held back; [`Emulated::load`] tells.
//!
//! Not here: values inside of a tick, which no firmware keeps.

mod load;

use whippen_compiler::budget::whole_divided;
use whippen_compiler::firmware::{self, CORES, Instrument, Midi, Segment, Whole, distance};
use whippen_compiler::kernel::{Happened, Kernel, without_probes};
use whippen_compiler::modes::{INSTRUCTIONS, Modes, specialise};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::thumb::EVENT_MARK;
use whippen_emulator::{BoardKind, Converter, ConverterSetup, Machine, Ports, Stop, build};

use self::load::Frames;
pub use self::load::{CoreLoad, Load};
use crate::device::Device;
use crate::{board, image};

/// The MIDI number of the first key; only the serial port, to which nobody listens, depends on it.
const FIRST_NOTE: u8 = 21;
/// Cycles between looks at whether a tick is over.
const SLICE: u64 = 48;
/// Ticks after which a board that does not play will not.
const START_TICKS: u32 = 44_100;

/// Offsets in a core's block; docs/firmware.md has the table.
mod at {
    pub const TICK: u32 = 28;
    pub const MISSED: u32 = 36;
    pub const FAULTS: u32 = 40;
    pub const ROW: u32 = 56;
}

/// A running board.
pub struct Emulated {
    machine: Machine,
    ports: Ports,
    whole: Whole,
    /// By part: what its keys play.
    kernels: Vec<Kernel>,
    /// Keys that are played; the board may have one more.
    keys: usize,
    /// By core.
    of_core: Vec<u32>,
    frames: Frames,
    /// Bytes of events taken, by core and segment.
    taken: Vec<Vec<u32>>,
    load: Load,
    trouble: Option<String>,
}

impl Emulated {
    /// The image of so many keys on a board of that kind.
    ///
    /// # Errors
    /// There is no image, in words.
    pub fn new(
        compiled: &Compiled,
        device: &Device,
        kind: BoardKind,
        keys: usize,
    ) -> Result<Emulated, String> {
        Emulated::of_parts(&[(keys, compiled)], device, kind)
    }

    /// The image of neighbouring keys that play different instruments, from the lowest up: how
    /// many, and which, with the values of these keys.
    ///
    /// # Errors
    /// There is no image, in words.
    pub fn of_parts(
        parts: &[(usize, &Compiled)],
        device: &Device,
        kind: BoardKind,
    ) -> Result<Emulated, String> {
        let board = board::bundled(kind.name()).ok_or("there is no board to emulate")?;
        let keys: usize = parts.iter().map(|(keys, _)| keys).sum();
        // Each core has a key at least.
        let count = u32::try_from(keys)
            .map_err(|e| e.to_string())?
            .max(board.cores);
        let more = count - keys as u32;
        let (_, first) = parts.first().ok_or("there are no keys")?;
        let mut setup = image::setup(first, device, count, board.cores, FIRST_NOTE)?;
        let kernels: Vec<Kernel> = parts
            .iter()
            .map(|(_, of)| without_probes(&of.lowered.kernel))
            .collect();
        let modes: Vec<Modes> = kernels
            .iter()
            .map(|kernel| specialise(kernel, INSTRUCTIONS))
            .collect();
        let notes: Vec<Midi> = parts.iter().map(|(_, of)| image::midi(of)).collect();
        let part = |at: usize| firmware::Part {
            keys: parts[at].0 as u32 + if at + 1 == parts.len() { more } else { 0 },
            values_from: 0,
            instrument: Instrument {
                modes: &modes[at],
                places: &[],
                midi: &notes[at],
            },
        };
        let program = firmware::Program {
            parts: (0..parts.len()).map(part).collect(),
        };
        let whole = whole_divided(&[program], &mut setup, &board).map_err(|e| e.to_string())?;
        let converter = ConverterSetup {
            keys: count,
            rate_hz: setup.rate_hz,
        };
        let (mut machine, ports) =
            build(kind, kind.board(), converter).map_err(|e| e.to_string())?;
        for segment in &whole.image.segments {
            machine
                .bus
                .memory
                .write(segment.load, &segment.bytes)
                .map_err(|e| e.to_string())?;
        }
        machine.reset();
        let load = Load {
            period_cycles: u64::from(board.clock_hz / setup.rate_hz),
            ..Load::default()
        };
        let (of_core, frames) = (setup.keys, Frames::default());
        let taken = whole.programs[0]
            .iter()
            .map(|segments| vec![0; segments.len()])
            .collect();
        Ok(Emulated {
            machine,
            ports,
            whole,
            kernels,
            keys,
            of_core,
            frames,
            taken,
            load,
            trouble: None,
        })
    }

    /// A core's keys, from the first on.
    fn segments(&self, core: usize) -> &[Segment] {
        &self.whole.programs[0][core]
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
        if let Err(why) = self.one(words, drive) {
            self.trouble = Some(why);
        }
    }

    /// Why it stopped, if it did.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// What the run took so far.
    pub fn load(&self) -> Load {
        let core = |core: usize| CoreLoad {
            keys: self.of_core[core],
            frame_cycles_max: self.frames.longest[core],
            frame_cycles: self.frames.total[core],
            missed: self.block(core, at::MISSED).unwrap_or(0),
            faults: self.block(core, at::FAULTS).unwrap_or(0),
        };
        Load {
            cores: self.cores().map(core).collect(),
            ..self.load.clone()
        }
    }

    /// Events since the last call.
    pub fn drain(&mut self) -> Vec<Happened> {
        let of_cores: Result<Vec<Vec<Happened>>, String> =
            self.cores().map(|core| self.events(core)).collect();
        match of_cores {
            Ok(all) => all.concat(),
            Err(why) => {
                self.trouble.get_or_insert(why);
                Vec::new()
            }
        }
    }

    /// Starts the board, lets force come up, puts the keys back to their beginning.
    fn begin(&mut self, words: &[u16]) -> Result<(), String> {
        self.give(words)?;
        let entry = |core: usize| self.symbol(&format!("{}_tick", CORES[core]));
        let entries: Vec<u32> = self.cores().map(entry).collect::<Result<_, _>>()?;
        entries
            .iter()
            .for_each(|&entry| self.machine.set_breakpoint(entry));
        let mut fresh: Vec<Option<Vec<Vec<u8>>>> = vec![None; entries.len()];
        while fresh.iter().any(Option::is_none) {
            if let Some(core) = self.slice(10_000)? {
                self.machine.clear_breakpoint(entries[core]);
                fresh[core] = Some(self.states(core)?);
            }
            self.in_time()?;
        }
        while !self.all(|core| self.is_up(core))? {
            let next = self.ticks()? + 1;
            self.until_served(next)?;
            self.in_time()?;
        }
        for (core, states) in fresh.into_iter().flatten().enumerate() {
            for (at, state) in states.into_iter().enumerate() {
                self.put_back(&self.segments(core)[at].clone(), state)?;
            }
        }
        self.frames = Frames::default();
        Ok(())
    }

    fn in_time(&mut self) -> Result<(), String> {
        if self.ticks()? < START_TICKS {
            Ok(())
        } else {
            Err("the board does not begin to play: its ticks may be too long (`whippen budget` says how many keys fit)"
                .to_string())
        }
    }

    /// The state of a segment's keys, with all gains at 1.
    fn put_back(&mut self, segment: &Segment, mut state: Vec<u8>) -> Result<(), String> {
        for key in 0..segment.keys {
            if let Some(gain) = segment.layout.gain(key) {
                state[gain as usize..][..4].copy_from_slice(&(1_u32 << 16).to_le_bytes());
            }
        }
        let to = self.symbol(&format!("{}_state", segment.name))?;
        self.machine
            .bus
            .memory
            .write(to, &state)
            .map_err(|e| e.to_string())
    }

    fn one(&mut self, words: &[u16], drive: &mut [i16]) -> Result<(), String> {
        self.give(words)?;
        let tick = self.ticks()? + 1;
        self.until_served(tick)?;
        self.load.ticks += 1;
        let missed = self.missed()?;
        if self.ticks()? != tick || missed > 0 {
            let (longest, period) = (self.longest(), self.load.period_cycles);
            let ticks = self.load.ticks;
            return Err(format!(
                "a tick is missed after {ticks} ticks: it took up to {longest} of {period} cycles"
            ));
        }
        let first = self.of_core[0] as usize;
        for (key, word) in drive.iter_mut().enumerate() {
            let (core, own) = if key < first {
                (0, key)
            } else {
                (1, key - first)
            };
            let address =
                self.block(core, at::ROW)? + distance(self.of_core[core]) + 2 * own as u32;
            let mut bytes = [0; 2];
            self.machine
                .bus
                .memory
                .read(address, &mut bytes)
                .map_err(|e| e.to_string())?;
            *word = i16::from_le_bytes(bytes);
        }
        Ok(())
    }

    /// Sensor words for one tick; a key that only the board has does what the last one does.
    fn give(&mut self, words: &[u16]) -> Result<(), String> {
        let count = self.of_core.iter().sum::<u32>() as usize;
        let last = words.last().copied().unwrap_or(0);
        let row: Vec<u16> = words[..self.keys.min(words.len())]
            .iter()
            .copied()
            .chain(std::iter::repeat(last))
            .take(count)
            .collect();
        self.converter()?.samples.extend(row);
        Ok(())
    }

    /// Runs until both cores have served a tick.
    fn until_served(&mut self, tick: u32) -> Result<(), String> {
        loop {
            self.slice(SLICE)?;
            let served = |core: usize| {
                Ok(self.block(core, at::TICK)? >= tick && self.machine.cpu(core).exception() == 0)
            };
            if self.all(served)? {
                return Ok(());
            }
            if self.ticks()? > tick.saturating_add(2) {
                let (longest, period) = (self.longest(), self.load.period_cycles);
                let keys: Vec<String> = self.of_core.iter().map(u32::to_string).collect();
                return Err(format!(
                    "ticks are missed, {} keys take too long: up to {longest} of {period} cycles",
                    keys.join(" and ")
                ));
            }
        }
    }

    /// Runs for so long; the core that met a breakpoint, if one did.
    fn slice(&mut self, cycles: u64) -> Result<Option<usize>, String> {
        let now = self
            .cores()
            .map(|core| self.machine.cycle(core))
            .max()
            .unwrap_or(0);
        let until = now + cycles;
        match self.machine.run_observed(until, &mut self.frames) {
            Stop::Limit => Ok(None),
            Stop::Breakpoint { core, .. } => Ok(Some(core)),
            stop => Err(format!("the board stopped: {stop}")),
        }
    }

    fn cores(&self) -> std::ops::Range<usize> {
        0..self.of_core.len()
    }

    /// Whether something holds on all cores.
    fn all(&self, holds: impl Fn(usize) -> Result<bool, String>) -> Result<bool, String> {
        self.cores()
            .try_fold(true, |all, core| Ok(all && holds(core)?))
    }

    /// Ticks that any core has missed.
    fn missed(&self) -> Result<u32, String> {
        self.cores().map(|core| self.block(core, at::MISSED)).sum()
    }

    /// The longest tick of each core, in words.
    fn longest(&self) -> String {
        let longest: Vec<String> = self
            .cores()
            .map(|core| self.frames.longest[core].to_string())
            .collect();
        longest.join(" and ")
    }

    fn is_up(&self, core: usize) -> Result<bool, String> {
        for segment in self.segments(core) {
            let state = self.symbol(&format!("{}_state", segment.name))?;
            for key in 0..segment.keys {
                let gain = segment.layout.gain(key);
                if gain
                    .map(|gain| self.word(state + gain))
                    .transpose()?
                    .is_some_and(|gain| gain != 1 << 16)
                {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// The states of a core's segments.
    fn states(&self, core: usize) -> Result<Vec<Vec<u8>>, String> {
        let state = |segment: &Segment| {
            let mut state = vec![0; segment.layout.size() as usize];
            let from = self.symbol(&format!("{}_state", segment.name))?;
            self.machine
                .bus
                .memory
                .read(from, &mut state)
                .map_err(|e| e.to_string())?;
            Ok(state)
        };
        self.segments(core).iter().map(state).collect()
    }

    /// What a core's keys emitted since the last call.
    fn events(&mut self, core: usize) -> Result<Vec<Happened>, String> {
        let mut all = Vec::new();
        for at in 0..self.segments(core).len() {
            let (happened, taken) = self.events_of(core, at)?;
            self.taken[core][at] = taken;
            all.extend(happened);
        }
        // One zone after the other has told its ticks.
        if self.segments(core).len() > 1 {
            all.sort_by_key(|happened| happened.tick);
        }
        Ok(all)
    }

    /// What a segment's keys emitted, and how many bytes of it are taken then.
    fn events_of(&self, core: usize, at: usize) -> Result<(Vec<Happened>, u32), String> {
        let (segment, mut taken) = (&self.segments(core)[at], self.taken[core][at]);
        let Some(ring) = segment.layout.events() else {
            return Ok((Vec::new(), taken));
        };
        let kernel = &self.kernels[segment.part];
        let state = self.symbol(&format!("{}_state", segment.name))?;
        let start = self.symbol(&format!("{}_events", segment.name))? + ring.start;
        if self.word(state + ring.lost)? > 0 {
            return Err("more events in a tick than the ring holds".to_string());
        }
        let head = self.word(state + ring.head)?;
        let first = if core == 0 { 0 } else { self.of_core[0] };
        let mut all = Vec::new();
        while taken != head {
            let record = |at: u32| self.word(start + (taken.wrapping_add(at) & (ring.bytes - 1)));
            let (tick, what) = (record(0)?, record(4)?);
            if what == EVENT_MARK {
                taken = ring.behind_mark(taken);
                continue;
            }
            let event = what >> 16;
            let args = kernel
                .events
                .get(event as usize)
                .map_or(0, |event| event.args);
            let args: Result<Vec<i32>, String> = (0..args)
                .map(|arg| Ok(record(8 + 4 * arg)? as i32))
                .collect();
            let key = (what & 0xffff) + first;
            let happened = Happened {
                tick: tick.into(),
                key,
                event,
                args: args?,
            };
            // The key that only the board has is nobody's.
            if (key as usize) < self.keys {
                all.push(happened);
            }
            taken = taken.wrapping_add(ring.event);
        }
        Ok((all, taken))
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

    fn block(&self, core: usize, offset: u32) -> Result<u32, String> {
        self.word(self.symbol(CORES[core])? + offset)
    }

    fn symbol(&self, name: &str) -> Result<u32, String> {
        let found = self
            .whole
            .image
            .symbols
            .iter()
            .find(|symbol| symbol.name == name);
        found
            .map(|symbol| symbol.address)
            .ok_or_else(|| format!("the image has no `{name}`"))
    }

    fn word(&self, address: u32) -> Result<u32, String> {
        let mut bytes = [0; 4];
        self.machine
            .bus
            .memory
            .read(address, &mut bytes)
            .map_err(|e| e.to_string())?;
        Ok(u32::from_le_bytes(bytes))
    }
}
