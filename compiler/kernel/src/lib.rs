//! An intermediate representation in SSA form with structured control, the *Kernel*: one tick of
//! one key as integers, with the memory it works on; the engines run it for N keys.
//!
//! Real numbers end before it. What a sensor word does to the words of memory and to
//! the drive word is written out bit by bit: 1-, 32- and 64-bit integers in SSA form, explicit
//! shifts and rounding, structured control (`if` and `loop` are instructions that own [`Region`]s).
//! Whoever runs a Kernel has nothing left to choose, so the interpreter, the code for the host and
//! the code for the target agree in every bit.
//!
//! ```text
//!   in words -> | per-key record: cells, keyed constants                               | -> out words
//!               | delay lines (one ring index for all of a length, shared by all keys) | -> events
//!               | shared: live values, tables                                          | -> probes
//! ```
//!
//! Each value carries the interval it was proven to stay in. The proof is local: the table of
//! operators says which interval a result has, given those of the operands, and [`verify()`] checks
//! that every declared interval holds it. No operator can overflow then, no index can leave its
//! cell, whatever words come in; what a host may change between ticks is held to its declared
//! range. Only [`Op::Assume`] puts something in that intervals cannot show, and the checked
//! interpreter looks after it.
//!
//! | part | what it settles |
//! | --- | --- |
//! | [`op`] | every operator in one line: name, signature, meaning, interval of the result |
//! | [`build`] | makes Kernels, instruction by instruction, with types and intervals from the table |
//! | `print`, [`mod@parse`] | the text of a Kernel, both ways |
//! | [`mod@verify`] | types, dominance, effects, intervals, sizes |
//! | [`layout`], [`memory`] | where everything lies; what operators on memory mean |
//! | [`wave`] | one tick of a string |
//! | [`interp`] | the reference engine, built from the table alone |
//! | `strip` | the same Kernel without probes |
//! | `walk`, `region` | the walk that translators share; every instruction of a region, and what is counted over them |
//! | [`random`] | random valid Kernels and inputs, for tests of every engine |
//!
//! Not here: reals, units, formats (they end in `lower`), machine code (`jit`, `arm`).

pub mod build;
pub mod interp;
pub mod layout;
mod loaded;
pub mod memory;
pub mod op;
pub mod parse;
mod print;
pub mod random;
mod region;
mod strip;
pub mod verify;
mod walk;
pub mod wave;

pub use build::Builder;
pub use interp::Interp;
pub use loaded::Code;
pub use loaded::Loaded;
pub use memory::{EngineError, Happened, Memory};
pub use op::{Effect, Immediate, Op, OpError, ROWS};
pub use parse::{ParseError, parse};
pub use region::{AllInsts, all_insts};
pub use strip::sweep_insts;
pub use strip::{sweep, without_probes, without_probes_in_same_memory};
pub use verify::{Verified, VerifyError, verify};
pub use walk::Walk;

use std::fmt;
use whippen_ids::{IdMap, impl_id};
use whippen_rate::Rate;

/// A type of value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Type {
    /// A bool: 0 or 1.
    I1,
    /// A 32-bit signed integer.
    I32,
    /// A 64-bit signed integer.
    I64,
}

impl Type {
    /// Every type.
    pub const ALL: [Type; 3] = [Type::I1, Type::I32, Type::I64];

    /// All values of the type.
    pub const fn range(self) -> Range {
        match self {
            Type::I1 => Range { low: 0, high: 1 },
            Type::I32 => Range {
                low: i32::MIN as i64,
                high: i32::MAX as i64,
            },
            Type::I64 => Range {
                low: i64::MIN,
                high: i64::MAX,
            },
        }
    }

    /// The value of this type that agrees with `exact` in its low bits.
    pub const fn wrap(self, exact: i128) -> i64 {
        match self {
            Type::I1 => (exact & 1) as i64,
            Type::I32 => exact as i32 as i64,
            Type::I64 => exact as i64,
        }
    }

    /// Width in bits.
    pub const fn bits(self) -> u32 {
        match self {
            Type::I1 => 1,
            Type::I32 => 32,
            Type::I64 => 64,
        }
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "i{}", self.bits())
    }
}

/// A closed interval of integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Range {
    /// Lower end.
    pub low: i64,
    /// Upper end.
    pub high: i64,
}

impl Range {
    /// From `low` to `high`.
    pub const fn new(low: i64, high: i64) -> Range {
        Range { low, high }
    }

    /// One value alone.
    pub const fn point(value: i64) -> Range {
        Range {
            low: value,
            high: value,
        }
    }

    /// Whether `value` lies inside.
    pub const fn has(self, value: i64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Whether all of `other` lies inside.
    pub const fn contains(self, other: Range) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    /// The smallest interval that holds both.
    #[must_use]
    pub fn union(self, other: Range) -> Range {
        Range {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether it holds nothing.
    pub const fn is_empty(self) -> bool {
        self.low > self.high
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "[{}..{}]", self.low, self.high)
    }
}

/// An SSA value: its id in [`Kernel::values`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(pub u32);

impl_id!(Value);

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "v{}", self.0)
    }
}

/// What is known of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ValueInfo {
    /// Its type.
    pub ty: Type,
    /// Where it stays.
    pub range: Range,
}

/// A word that enters (`u16`) or leaves (`i16`) each key in each tick. An input outside its range
/// is clamped to it when it is read, so nothing a host feeds can leave a proven range.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Port {
    /// Name.
    pub name: String,
    /// Values it takes: within 0 .. 65535 for an input, -32768 .. 32767 for an output.
    pub range: Range,
}

/// A value shared by all keys that the host may change between ticks.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Live {
    /// Name.
    pub name: String,
    /// Values it takes (within i32).
    pub range: Range,
    /// Value at the start.
    pub init: i32,
}

/// A constant of each key.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Keyed {
    /// Name.
    pub name: String,
    /// Values it takes (within i32).
    pub range: Range,
    /// One value per key, in the order of the keys; an engine with more keys repeats the last.
    pub values: Vec<i32>,
}

/// Memory of each key that survives the tick: `len` words of one type.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cell {
    /// Name.
    pub name: String,
    /// Type of a word.
    pub ty: Type,
    /// How many words: 1 for a scalar, more for a grid.
    pub len: u32,
    /// Values it holds; what is stored must be proven to lie within.
    pub range: Range,
    /// Value of every word before `init`.
    pub init: i64,
}

/// A delay line of each key. `delay n` reads what was pushed `n` ticks ago (1 ..= len); one push
/// per tick, after the delays, so that a ring of `len` slots is enough: `delay len` reads the slot
/// that the push then overwrites. All keys share one ring index. Before `init` every slot holds the
/// value of the range that is nearest to zero.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Line {
    /// Name.
    pub name: String,
    /// How many ticks it remembers.
    pub len: u32,
    /// Values it holds; stored as u16 if they fit, else as i32.
    pub range: Range,
}

impl Line {
    /// What every slot holds before `init`: the value that is nearest to 0.
    pub fn first_value(&self) -> i64 {
        0.clamp(self.range.low, self.range.high)
    }
}

/// Constants in rows of equal length.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Words of a row.
    pub columns: u32,
    /// Its values, row by row.
    pub values: Vec<i32>,
}

impl Table {
    /// How many rows it has.
    pub fn rows(&self) -> usize {
        self.values.len() / (self.columns as usize).max(1)
    }

    /// A word of it.
    pub fn entry(&self, row: usize, column: usize) -> Option<i32> {
        let at = row.checked_mul(self.columns as usize)? + column;
        self.values.get(at).copied()
    }
}

/// A kind of event.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Event {
    /// Name.
    pub name: String,
    /// How many i32 arguments it carries.
    pub args: u32,
}

/// A value exported to traces; removing all probes changes nothing else.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Type of the value.
    pub ty: Type,
}

/// One tick over N keys.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Kernel {
    /// Name.
    pub name: String,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// Sensor words.
    pub inputs: Vec<Port>,
    /// Drive words.
    pub outputs: Vec<Port>,
    /// Live values.
    pub lives: Vec<Live>,
    /// Per-key constants.
    pub keyed: Vec<Keyed>,
    /// Memory.
    pub cells: Vec<Cell>,
    /// Delay lines.
    pub lines: Vec<Line>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Kinds of events.
    pub events: Vec<Event>,
    /// Exported values.
    pub probes: Vec<Probe>,
    /// All SSA values; some may be defined nowhere and used nowhere.
    pub values: IdMap<Value, ValueInfo>,
    /// Run once per key before the first tick, with the first tick's inputs; may not `out`, `emit`
    /// or `probe`.
    pub init: Region,
    /// Run for every key in every tick.
    pub tick: Region,
}

/// How the name of a cell ends in which the sample of a channel stands when a tick is over. It is a
/// hard keyword of the language: no name of a program ends so.
pub const CHANNEL: &str = ".emit";

/// The sample that stands for full scale.
pub const FULL_SCALE: i64 = 1 << 30;

impl Kernel {
    /// The cells of its channels: one for both sides, or left and right.
    pub fn channels(&self) -> Vec<usize> {
        let cells = self.cells.iter().enumerate();
        let of_channels = cells.filter(|(_, cell)| cell.name.ends_with(CHANNEL));
        of_channels.map(|(at, _)| at).collect()
    }

    /// The same where live values and constants per key are whatever they are: memory alone holds
    /// their values at first, and no code knows them.
    #[must_use]
    pub fn for_any_values(&self) -> Kernel {
        let mut any = self.clone();
        for live in &mut any.lives {
            live.init = 0;
        }
        for keyed in &mut any.keyed {
            keyed.values.clear();
        }
        any
    }

    /// The lines that `init` does not fill: [`Line::first_value`] is all that they hold at first.
    pub fn unfilled_lines(&self) -> Vec<usize> {
        let is_filled = |line: usize| {
            let mut insts = self.init.insts.iter();
            insts.any(|inst| matches!(inst.op, Op::Fill(of) if of as usize == line))
        };
        let lines = 0..self.lines.len();
        lines.filter(|line| !is_filled(*line)).collect()
    }
}

/// A straight run of instructions; control enters at the top and leaves at the bottom.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Region {
    /// Values defined on entry: index and carried values of a loop; none otherwise.
    pub params: Vec<Value>,
    /// Instructions in order.
    pub insts: Vec<Inst>,
    /// Values handed out at the bottom.
    pub yields: Vec<Value>,
}

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Inst {
    /// What it does.
    pub op: Op,
    /// Values it reads.
    pub args: Vec<Value>,
    /// Values it defines.
    pub results: Vec<Value>,
    /// `if`: then and else; `loop`: the body; otherwise none.
    pub regions: Vec<Region>,
    /// Which place of the source it was made for, by number; means nothing to engines.
    pub origin: Option<u32>,
}
