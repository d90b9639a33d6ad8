//! The engines behind one door: `jit`, `interp`, `ideal` and `emulated` run the same instrument on
//! the same words.

use std::fmt;
use std::str::FromStr;

use whippen_compiler::ideal::{Ideal, What};
use whippen_compiler::kernel::{self, Interp, Kernel};
use whippen_compiler::lower::{Export, ExportKind, LoweredEvent, LoweredEventKind};
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;

#[cfg(not(target_family = "wasm"))]
use whippen_compiler::jit::{JitCode, Options};

use crate::device::Device;
use crate::emulated::{Emulated, EmulatedBoard};

/// Which engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineKind {
    /// The Kernel compiled for this machine; interpreted where nothing can be (a module in a
    /// browser), which gives the same bits.
    Jit,
    /// The Kernel interpreted: the reference.
    Interp,
    /// The Model in f64: the yardstick.
    Ideal,
    /// The image of `whippen build` on an emulated board.
    Emulated(EmulatedBoard),
}

/// The board of the engine `emulated` where nobody says otherwise.
const RP2350: EmulatedBoard = EmulatedBoard {
    kind: BoardKind::Rp2350,
    keys: 1,
};

/// The engines by name.
pub const ENGINES: &[(&str, EngineKind)] = &[
    ("jit", EngineKind::Jit),
    ("interp", EngineKind::Interp),
    ("ideal", EngineKind::Ideal),
    ("emulated", EngineKind::Emulated(RP2350)),
];

impl EngineKind {
    /// The board, if it is [`EngineKind::Emulated`].
    pub fn board(self) -> Option<EmulatedBoard> {
        match self {
            EngineKind::Emulated(board) => Some(board),
            _ => None,
        }
    }
}

impl FromStr for EngineKind {
    type Err = String;

    fn from_str(text: &str) -> Result<EngineKind, String> {
        let names: Vec<&str> = ENGINES.iter().map(|(name, _)| *name).collect();
        let found = ENGINES
            .iter()
            .find(|(name, _)| *name == text)
            .map(|(_, kind)| *kind);
        found.ok_or_else(|| format!("engines are {}", names.join(", ")))
    }
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let name = ENGINES
            .iter()
            .find(|(_, kind)| kind == self || kind.board().is_some() && self.board().is_some())
            .map_or("", |(name, _)| name);
        f.write_str(name)
    }
}

/// Something that happened in a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Happened {
    /// The key.
    pub key: u32,
    /// What: an index into the lowered events.
    pub event: usize,
    /// Arguments (SI).
    pub args: Vec<f64>,
}

/// What `jit` is where no code can be made at run time.
#[cfg(target_family = "wasm")]
type JitCode = Interp;

#[cfg(target_family = "wasm")]
fn jit(kernel: &Kernel, keys: usize) -> Result<JitCode, String> {
    Interp::new(kernel, keys).map_err(|e| e.to_string())
}

#[cfg(not(target_family = "wasm"))]
fn jit(kernel: &Kernel, keys: usize) -> Result<JitCode, String> {
    let options = Options { probes: true };
    JitCode::build(kernel, keys, options).map_err(|e| e.to_string())
}

/// A running instrument.
pub enum Engine<'c> {
    /// See [`EngineKind::Jit`].
    Jit(&'c Compiled, Box<JitCode>),
    /// See [`EngineKind::Interp`].
    Interp(&'c Compiled, Box<Interp>),
    /// See [`EngineKind::Ideal`].
    Ideal(&'c Compiled, Box<Ideal<'c>>),
    /// See [`EngineKind::Emulated`].
    Emulated(&'c Compiled, Box<Emulated>),
}

impl<'c> Engine<'c> {
    /// An engine of `keys` keys at rest.
    ///
    /// # Errors
    /// The host's code generator refuses (an unsupported machine), or there is no image of so many
    /// keys, in words.
    pub fn new(
        kind: EngineKind,
        compiled: &'c Compiled,
        device: &Device,
        keys: usize,
    ) -> Result<Engine<'c>, String> {
        let kernel = &compiled.lowered.kernel;
        Ok(match kind {
            EngineKind::Emulated(board) => Engine::Emulated(
                compiled,
                Box::new(Emulated::new(compiled, device, board, keys)?),
            ),
            EngineKind::Jit => Engine::Jit(compiled, Box::new(jit(kernel, keys)?)),
            EngineKind::Interp => Engine::Interp(
                compiled,
                Box::new(Interp::new(kernel, keys).map_err(|e| e.to_string())?),
            ),
            EngineKind::Ideal => Engine::Ideal(
                compiled,
                Box::new(Ideal::new(&compiled.model, &device.scales(), keys)),
            ),
        })
    }

    /// What must precede the first tick, with its words.
    pub fn start(&mut self, words: &[u16]) {
        match self {
            Engine::Jit(_, code) => code.init(words),
            Engine::Interp(_, interp) => interp.init(words),
            Engine::Ideal(..) => {}
            Engine::Emulated(_, board) => board.start(words),
        }
    }

    /// One tick of all keys: sensor words in, drive words out, key after key, and for each key in
    /// the order of its ports.
    pub fn tick(&mut self, words: &[u16], drive: &mut [i16]) {
        match self {
            Engine::Jit(_, code) => code.tick(words, drive),
            Engine::Interp(_, interp) => interp.tick(words, drive),
            Engine::Emulated(_, board) => board.tick(words, drive),
            Engine::Ideal(compiled, ideal) => {
                ideal.tick(words);
                let words = compiled.lowered.kernel.outputs.len().max(1);
                for (key, drive) in drive.chunks_mut(words).enumerate() {
                    ideal.drive_words(key, drive);
                }
            }
        }
    }

    /// Changes a live value (SI; a bool is 0 or 1), clamped to its range, from the next tick on. A
    /// board takes it from its mailbox, one value after the other: some ticks later.
    ///
    /// # Errors
    /// There is none with this index, in words.
    pub fn set_live(&mut self, live: usize, value: f64) -> Result<(), String> {
        let word = |compiled: &Compiled| {
            let meaning = compiled.lowered.lives.get(live);
            let none = || format!("no live value has the number {live}");
            meaning.map(|of| of.quantize(value)).ok_or_else(none)
        };
        match self {
            Engine::Jit(c, code) => code.set_live(live, word(c)?).map_err(|e| e.to_string()),
            Engine::Interp(c, interp) => interp.set_live(live, word(c)?).map_err(|e| e.to_string()),
            Engine::Emulated(c, board) => {
                board.set_live(live as u32, word(c)?);
                Ok(())
            }
            Engine::Ideal(c, ideal) => {
                word(c)?;
                ideal.set_live(live, value);
                Ok(())
            }
        }
    }

    /// Whether it knows values inside of a tick: [`Engine::value`].
    pub fn observes(&self) -> bool {
        !matches!(self, Engine::Emulated(..))
    }

    /// From now on a board keeps what it lets hear.
    ///
    /// # Errors
    /// It has no converter.
    pub fn listen(&mut self) -> Result<(), String> {
        match self {
            Engine::Emulated(_, board) => board.listen(),
            _ => Ok(()),
        }
    }

    /// The board, on [`EngineKind::Emulated`].
    pub fn board(&self) -> Option<&Emulated> {
        match self {
            Engine::Emulated(_, board) => Some(board),
            _ => None,
        }
    }

    /// The board, to tell it what to keep.
    pub(crate) fn board_mut(&mut self) -> Option<&mut Emulated> {
        match self {
            Engine::Emulated(_, board) => Some(board),
            _ => None,
        }
    }

    /// The exported value of the last tick (SI; states and bools as indices); not a number where
    /// the engine does not [observe](Engine::observes).
    pub fn value(&self, key: usize, index: usize, export: &Export) -> f64 {
        let probes = |all: &[i64], count: usize| export.value(all[key * count + index]);
        match self {
            Engine::Jit(c, code) => probes(code.probes(), c.lowered.exports.len()),
            Engine::Interp(c, interp) => probes(interp.probes(), c.lowered.exports.len()),
            Engine::Ideal(c, ideal) => ideal_value(c, ideal, key, export.kind),
            Engine::Emulated(..) => f64::NAN,
        }
    }

    /// What happened since the last call, in the order in which it did.
    pub fn drain(&mut self) -> Vec<Happened> {
        match self {
            Engine::Jit(c, code) => decode(&c.lowered.events, code.drain_events()),
            Engine::Interp(c, interp) => decode(&c.lowered.events, interp.drain_events()),
            Engine::Emulated(c, board) => decode(&c.lowered.events, board.drain()),
            Engine::Ideal(c, ideal) => ideal
                .occurrences()
                .iter()
                .filter_map(|o| {
                    let kind = match o.what {
                        What::Emission(e) => LoweredEventKind::Emission(e),
                        What::Rule(r) => {
                            LoweredEventKind::Rule(c.model.rule_name(&c.model.rules[r as usize]))
                        }
                    };
                    let event = c.lowered.events.iter().position(|e| e.kind == kind)?;
                    Some(Happened {
                        key: o.key,
                        event,
                        args: o.args.clone(),
                    })
                })
                .collect(),
        }
    }
}

fn ideal_value(c: &Compiled, ideal: &Ideal, key: usize, kind: ExportKind) -> f64 {
    let model = &c.model;
    match kind {
        ExportKind::Sense(s) => ideal.sensed(key, s as usize),
        ExportKind::Slope(s) => ideal.slope(key, s as usize),
        ExportKind::Curvature(s) => ideal.curvature(key, s as usize),
        ExportKind::Total(drive) => ideal.force_on(key, model.drives()[drive as usize]),
        ExportKind::Force(i) => ideal.value(key, model.forces[i as usize].value),
        ExportKind::Named(i) => ideal.value(key, model.named[i as usize].value),
        ExportKind::Sound(i) => ideal.value(key, model.sounds[i as usize].value),
        ExportKind::Channel(i) => ideal.value(key, model.channels[i as usize]),
        ExportKind::Cell(id) => ideal.before(key).cells[id],
        ExportKind::Machine(id) => f64::from(ideal.before(key).machines[id]),
    }
}

pub(crate) fn decode(meanings: &[LoweredEvent], records: Vec<kernel::Happened>) -> Vec<Happened> {
    let one = |r: kernel::Happened| {
        let lsbs = &meanings[r.event as usize].arg_lsbs;
        let args = r
            .args
            .iter()
            .zip(lsbs)
            .map(|(&word, lsb)| f64::from(word) * lsb)
            .collect();
        Happened {
            key: r.key,
            event: r.event as usize,
            args,
        }
    };
    records.into_iter().map(one).collect()
}
