//! The certificate: what is claimed of an image, as text. One line an entry; numbers are decimal or
//! begin with `0x`. `docs/audit.md` lists the lines.

mod print;
mod read;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use whippen_isa::timing::Pipe;
use whippen_isa::{ItState, reg};

use crate::elf::not_apart;
use crate::facts::{ALL, Facts, Interval, holds};
use crate::legs::HELPER;
use crate::place::Place;

/// The first line.
const HEADER: &str = "whippen-certificate 1";

/// Cycles of one access, fetch or wait at most: far more than any takes, and so few that those of
/// an instruction's words, each with all that it may wait for, are a number of 16 bits.
const WORD_CYCLES: u16 = 255;

/// Cycles of a function at most: far more than any deadline, and so few that sums of them are
/// numbers of 64 bits.
pub(crate) const CYCLES: u64 = 1 << 40;

/// A memory: where it lies, and how long an access and a fetch take (0: nobody can say).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Cycles of an access.
    pub access: u16,
    /// Cycles of a fetch.
    pub fetch: u16,
    /// Whether neighbouring words lie in neighbouring banks.
    pub striped: bool,
    /// Its banks.
    pub banks: Vec<u8>,
}

/// Addresses behind which devices are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bus {
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Cycles of a read.
    pub read: u16,
    /// Cycles of a write.
    pub write: u16,
}

/// A DMA that is at work while the cores play.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dma {
    /// First address of the bus whose bridge it uses too.
    pub bus: u32,
    /// Cycles that an access of a core behind that bridge waits for it, at most.
    pub wait: u16,
    /// Its accesses of memory between two ticks for which a core may wait: none where cores go
    /// first there.
    pub accesses: u32,
}

/// The other core at a bridge to devices that both go to in their ticks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Neighbour {
    /// First address of the bus.
    pub bus: u32,
    /// Of each core, cycles that an access there waits for the other one, at most.
    pub waits: Vec<u16>,
}

/// Everything that is claimed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Certificate {
    /// The name of the core.
    pub core: String,
    /// A number that stands for its table of cycles.
    pub table: u64,
    /// Cycles that a frame may take.
    pub deadline: u64,
    /// Whether data in a bank that is fetched from cost a cycle.
    pub fetches: bool,
    /// How many cores play, or run parts.
    pub cores: u32,
    /// Memories, by address.
    pub memories: Vec<Memory>,
    /// Buses.
    pub buses: Vec<Bus>,
    /// A DMA, if one is at work.
    pub dma: Option<Dma>,
    /// The other core at a bridge, if that is charged.
    pub neighbour: Option<Neighbour>,
    /// Code and constants, by first address, with what stands for their bytes.
    pub sections: Vec<(u32, u64)>,
    /// What stands for the text of the Kernels.
    pub kernels: u64,
    /// Where vectors lead that nobody uses.
    pub dead: u32,
    /// Indirect branches by address, and where they may go.
    pub targets: Vec<(u32, Vec<u32>)>,
    /// The frame of each core, while each program plays.
    pub frames: Vec<Frame>,
}

/// The frame of a core while a program plays.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Frame {
    /// Which core.
    pub core: u32,
    /// Which program.
    pub program: u32,
    /// Where its table of vectors lies.
    pub vectors: u32,
    /// Accesses of the other core between two of its ticks.
    pub visits: u32,
    /// Cycles from the request to the return, at most.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack: u32,
    /// What it runs; who calls stands behind what it calls.
    pub functions: Vec<Function>,
    /// The other core, where it runs parts of this one's instrument.
    pub helper: Option<Helper>,
}

/// A core that has neither ticks nor interrupts of its own: it waits for the other one's number,
/// runs parts, and writes that number.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Helper {
    /// Where its table of vectors lies.
    pub vectors: u32,
    /// Accesses of the other core to its memory in each of its legs.
    pub visits: Vec<u32>,
    /// What it runs, as of a frame.
    pub functions: Vec<Function>,
}

impl Frame {
    /// What a core runs in this frame.
    pub fn functions_of(&self, core: u32) -> &[Function] {
        match &self.helper {
            Some(helper) if core != self.core => &helper.functions,
            _ => &self.functions,
        }
    }

    /// The same, to be added to.
    pub fn functions_on(&mut self, core: u32) -> &mut Vec<Function> {
        match &mut self.helper {
            Some(helper) if core != self.core => &mut helper.functions,
            _ => &mut self.functions,
        }
    }
}

/// What a function is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// One that returns.
    #[default]
    Plain,
    /// The tick of keys: the first piece is the entry, the last one the end, others are modes.
    Keys,
    /// The handler of the tick's interrupt.
    Handler,
    /// What runs between ticks.
    Idle,
    /// What a core runs between the places where it meets the other one: a piece is a leg, and
    /// leads to the next one, the last to the first.
    Legs,
    /// A function as far as a place in it, or in what it calls; ways that never come there do not
    /// count.
    Until,
}

const KINDS: [(Kind, &str); 6] = [
    (Kind::Plain, "plain"),
    (Kind::Keys, "keys"),
    (Kind::Handler, "handler"),
    (Kind::Idle, "idle"),
    (Kind::Legs, "legs"),
    (Kind::Until, "until"),
];

/// A function.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Function {
    /// Its name, for messages.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Banks that may be fetched from while it runs.
    pub fetched: u32,
    /// Whether it hands out addresses of the stack.
    pub hands_stack: bool,
    /// Bytes of stack.
    pub stack: u32,
    /// The place where one of [`Kind::Until`] ends, and the state of the pipeline there.
    pub until: Option<(u32, u128)>,
    /// Where it returns to, and whether a 32-bit instruction is there: at no less cost than any
    /// place it does return to. None: the most expensive.
    pub returns: Option<(u32, bool)>,
    /// Words that registers hold where it is entered.
    pub entered: Vec<(u8, [i64; 2])>,
    /// Registers that point into the section that begins there, where a piece begins behind the
    /// first.
    pub bases: Vec<(u8, u32)>,
    /// Heads of loops, and their rounds.
    pub loops: Vec<(u32, u32)>,
    /// Calls in it that are followed: the caller's number, the address behind the call, the callee.
    /// The first is its own.
    pub contexts: Vec<[u32; 3]>,
    /// Calls in it that are not followed.
    pub calls: Vec<Call>,
    /// Pieces.
    pub pieces: Vec<Piece>,
}

/// A call whose callee is bounded as a function of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The address of the call.
    pub site: u32,
    /// The callee.
    pub callee: u32,
    /// The number of the function, and how often a mode of a key runs in it (of others 0); none
    /// where it is never called from there.
    pub costs: Option<(u32, u32)>,
}

/// From an entry to the next piece's, or to the return.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Piece {
    /// Its first instruction.
    pub entry: u32,
    /// Cycles at most; between ticks of one instruction.
    pub cycles: u64,
    /// The stack and what registers point to at its entry.
    pub place: u32,
    /// The state of the pipeline at its entry.
    pub begins: u128,
    /// States of the pipeline.
    pub pipes: Vec<u128>,
    /// Stacks.
    pub places: Vec<Place>,
    /// Facts.
    pub facts: Vec<Facts>,
    /// Loops: context and head, and the cycles of a round.
    pub rounds: Vec<(u32, u32, u64)>,
    /// Places in the code.
    pub points: Vec<Point>,
}

/// A place in the code: what is claimed wherever execution comes here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Point {
    /// The call it is in.
    pub context: u32,
    /// The address.
    pub at: u32,
    /// The state of IT.
    pub it: ItState,
    /// Its stack.
    pub place: u32,
    /// The loops it is in, outermost first.
    pub loops: Vec<u32>,
    /// Pipeline, facts, and cycles that remain at most: these, and those of a round for each round
    /// that remains.
    pub states: Vec<(u32, u32, i64)>,
}

/// Whether none is there twice.
fn distinct<T: Ord>(all: impl Iterator<Item = T>) -> bool {
    let mut known = BTreeSet::new();
    let mut all = all;
    all.all(|one| known.insert(one))
}

impl Certificate {
    /// That nothing is said twice, memories and buses lie apart, a DMA uses one of these, every
    /// core has a frame for every program, and numbers are such that sums of them are.
    pub(crate) fn is_well_formed(&self) -> Result<(), &'static str> {
        self.has_board()?;
        let targets = self
            .targets
            .iter()
            .flat_map(|(at, to)| to.iter().chain([at]));
        // They are looked up by address.
        let mut pairs = self.targets.windows(2);
        let twice = pairs.any(|pair| pair[0].0 >= pair[1].0)
            || self.targets.iter().any(|(_, to)| !distinct(to.iter()));
        if twice || targets.clone().any(|at| at & 1 != 0) {
            return Err("a branch has targets that are none");
        }
        let helped = self.frames.iter().filter(|own| own.helper.is_some());
        let playing = match helped.count() {
            0 => self.cores,
            all if all == self.frames.len() && self.cores == 2 => 1,
            _ => return Err("a core both plays and helps"),
        };
        let programs = self.frames.len() as u32 / playing.max(1);
        let wanted = (0..playing).flat_map(|core| (0..programs).map(move |own| (core, own)));
        let frames = self.frames.iter().map(|frame| (frame.core, frame.program));
        if programs == 0 || !frames.eq(wanted) {
            return Err("not every core has a frame for every program");
        }
        // Where its stack ends stands in its vectors.
        let vectors = self.frames.iter().map(|own| (own.core, own.vectors));
        let helping = self.frames.iter().filter_map(|own| own.helper.as_ref());
        let mut vectors = vectors.chain(helping.map(|own| (HELPER, own.vectors)));
        if vectors.any(|(core, at)| self.vectors(core) != Some(at)) {
            return Err("a core has two tables of vectors");
        }
        match self.functions().all(Function::is_well_formed) {
            true => Ok(()),
            false => Err("a function says something twice, or what cannot be"),
        }
    }

    /// Of what is claimed of the board.
    fn has_board(&self) -> Result<(), &'static str> {
        let memories = self.memories.iter().map(|own| (own.base, own.size));
        let buses = self.buses.iter().map(|own| (own.base, own.size));
        if not_apart(memories.chain(buses)).is_some() {
            return Err("memories or buses overlap, or go beyond all addresses");
        }
        if !self.memories.iter().all(Memory::has_banks) {
            return Err("a memory has no banks for all of its words");
        }
        let of_memories = self.memories.iter().flat_map(|own| [own.access, own.fetch]);
        let of_buses = self.buses.iter().flat_map(|own| [own.read, own.write]);
        let of_dma = self.dma.iter().map(|own| own.wait);
        let of_neighbour = self.neighbour.iter().flat_map(|own| own.waits.clone());
        let mut waits = of_memories
            .chain(of_buses)
            .chain(of_dma)
            .chain(of_neighbour);
        if waits.any(|cycles| cycles > WORD_CYCLES) {
            return Err("a word takes more cycles than any does");
        }
        let is_bridge = |base| self.buses.iter().any(|bus| bus.base == base);
        if self.dma.is_some_and(|dma| !is_bridge(dma.bus)) {
            return Err("a DMA is behind a bridge that is none");
        }
        match &self.neighbour {
            Some(other) if !is_bridge(other.bus) || other.waits.len() != self.cores as usize => {
                Err("cores meet at a bridge that is none, or others than there are")
            }
            _ if self.cores > 2 => Err("there are more cores than sections are named after"),
            _ => Ok(()),
        }
    }

    /// Where the table of vectors of a core lies.
    pub(crate) fn vectors(&self, core: u32) -> Option<u32> {
        let mut frames = self.frames.iter();
        frames.find_map(|frame| match &frame.helper {
            _ if frame.core == core => Some(frame.vectors),
            helper => helper.as_ref().map(|own| own.vectors),
        })
    }

    /// The functions of all frames.
    fn functions(&self) -> impl Iterator<Item = &Function> {
        self.frames.iter().flat_map(|frame| {
            let helping = frame.helper.iter().flat_map(|own| &own.functions);
            frame.functions.iter().chain(helping)
        })
    }
}

impl Memory {
    /// Whether each of its words lies in a bank; where nobody knows a time nobody asks.
    fn has_banks(&self) -> bool {
        let count = self.banks.len() as u32;
        let whole = self.striped || self.size.checked_rem(count) == Some(0);
        let known = count > 0 && whole && self.banks.iter().all(|bank| *bank < 32);
        known || self.access == 0 && self.fetch == 0
    }
}

impl Function {
    fn is_well_formed(&self) -> bool {
        // Where SP and PC are follows from the code.
        let holds_words = |register: u8| register < 15 && register != reg::SP;
        let entered = |(register, [low, high]): &(u8, Interval)| {
            holds_words(*register) && low <= high && holds(ALL, [*low, *high])
        };
        distinct(self.entered.iter().map(|(register, _)| register))
            && distinct(self.bases.iter().map(|(register, _)| register))
            && distinct(self.loops.iter().map(|(head, _)| head))
            && distinct(self.contexts.iter())
            && distinct(self.calls.iter().map(|call| (call.site, call.callee)))
            && distinct(self.pieces.iter().map(|piece| piece.entry))
            && self.until.is_some() == (self.kind == Kind::Until)
            && self.entered.iter().all(entered)
            && self.bases.iter().all(|(register, _)| holds_words(*register))
            // Whoever enters a loop is in a round.
            && self.loops.iter().all(|(_, rounds)| *rounds > 0)
            && self.pieces.iter().all(|piece| piece.cycles <= CYCLES)
    }
}

impl Piece {
    /// A state of the pipeline by its number.
    pub(crate) fn pipe(&self, number: u32) -> Option<Pipe> {
        self.pipes
            .get(number as usize)
            .map(|bits| Pipe::from_bits(*bits))
    }
}
