//! The Kernel: one tick of one key as integer SSA, with the memory it works on; the engines run it for N keys.
//!
//! Values are 1-, 32- or 64-bit integers. Each value carries the interval it was proven to stay in, so no operator can
//! overflow; should it be fed something outside all the same, arithmetic wraps, and every engine wraps alike. Control is
//! structured: `if` and `loop` are instructions that own [`Region`]s.
//!
//! ```text
//!   in words -> | per-key record: cells | delay lines (ring index shared by all keys) | -> out words
//!               | shared: live values, tables                                         | -> events, probes
//! ```
//!
//! What an operator means is in `op`, once. `interp` is built from that alone; other engines only agree with it.
//! A Kernel prints and parses (`print`, `parse`); `verify` checks types, dominance and every range.
//!
//! Not here: reals, units, formats (they end in `fix::lower`), machine code.

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

/// A closed interval of integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Range {
    /// Lower end.
    pub low: i64,
    /// Upper end.
    pub high: i64,
}

/// An SSA value: index into [`Kernel::values`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(pub u32);

/// What is known of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ValueInfo {
    /// Its type.
    pub ty: Type,
    /// Where it stays.
    pub range: Range,
}

/// A word that enters (`u16`) or leaves (`i16`) each key in each tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Name.
    pub name: String,
    /// Values it takes: within 0 .. 65535 for an input, -32768 .. 32767 for an output.
    pub range: Range,
}

/// A value shared by all keys that the host may change between ticks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Live {
    /// Name.
    pub name: String,
    /// Values it takes (within i32).
    pub range: Range,
    /// Value at the start.
    pub init: i32,
}

/// A constant of each key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keyed {
    /// Name.
    pub name: String,
    /// Values it takes (within i32).
    pub range: Range,
    /// One value per key, in the order of the keys; an engine with more keys repeats the last.
    pub values: Vec<i32>,
}

/// Memory of each key that survives the tick: `len` words of one type.
#[derive(Debug, Clone, PartialEq, Eq)]
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

/// A delay line of each key. `delay n` reads what was pushed `n` ticks ago (1 ..= len); one push per tick; all keys share
/// one ring index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Name.
    pub name: String,
    /// How many ticks it remembers.
    pub len: u32,
    /// Values it holds; stored as u16 if they fit, else as i32.
    pub range: Range,
}

/// Constants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Its values.
    pub values: Vec<i32>,
}

/// A kind of event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// Name.
    pub name: String,
    /// How many i32 arguments it carries.
    pub args: u32,
}

/// A value exported to traces; removing all probes changes nothing else.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Type of the value.
    pub ty: Type,
}

/// One tick over N keys.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Kernel {
    /// Name.
    pub name: String,
    /// Ticks per second.
    pub rate_hz: u32,
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
    /// All SSA values.
    pub values: Vec<ValueInfo>,
    /// Run once per key before the first tick, with the first tick's inputs; may not `out`, `emit` or `probe`.
    pub init: Region,
    /// Run for every key in every tick.
    pub tick: Region,
}

/// A straight run of instructions; control enters at the top and leaves at the bottom.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Region {
    /// Values defined on entry: index and carried values of a loop; none otherwise.
    pub params: Vec<Value>,
    /// Instructions in order.
    pub insts: Vec<Inst>,
    /// Values handed out at the bottom.
    pub yields: Vec<Value>,
}

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inst {
    /// What it does.
    pub op: Op,
    /// Values it reads.
    pub args: Vec<Value>,
    /// Values it defines.
    pub results: Vec<Value>,
    /// `if`: then and else; `loop`: the body; otherwise none.
    pub regions: Vec<Region>,
}

/// Operators with their immediates; types, meaning and range transfer are in the table of `op`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Op {
    /// `-> t`: a constant (type from the result).
    Const(i64),
    /// `t t -> t` for i32, i64.
    Add,
    /// `t t -> t`
    Sub,
    /// `t t -> t`, low word.
    Mul,
    /// `i32 i32 -> i64`: the whole product (SMULL).
    MulWide,
    /// `i64 i32 i32 -> i64`: accumulator plus product (SMLAL).
    MacWide,
    /// `t t -> t`
    Min,
    /// `t t -> t`
    Max,
    /// `t -> t`: left shift by 0 ..= 63.
    Shl(u8),
    /// `t -> t`: arithmetic right shift, rounding towards minus infinity.
    Sar(u8),
    /// `t -> t`: arithmetic right shift, rounding half up: `(a + 2^(n-1)) >> n`, in unbounded integers, then wrapped.
    SarRound(u8),
    /// `i32 i32 -> i32`: `floor(a * 2^n / b + 1/2)` in unbounded integers, then wrapped; 0 where `b` is 0.
    DivRound(u8),
    /// `i64 -> i32`: `floor(sqrt(a))`, 0 where `a` is negative.
    Sqrt,
    /// `i32 -> i64`
    Widen,
    /// `i64 -> i32`: low word.
    Narrow,
    /// `t t -> i1`
    Eq,
    /// `t t -> i1`
    Lt,
    /// `t t -> i1`
    Le,
    /// `i1 i1 -> i1`
    And,
    /// `i1 i1 -> i1`
    Or,
    /// `i1 -> i1`
    Not,
    /// `i1 t t -> t`
    Select,
    /// `-> i32`: word of an input port (index).
    In(u32),
    /// `i32 ->`: word of an output port (index).
    Out(u32),
    /// `-> i32`: live value (index).
    Live(u32),
    /// `-> i32`: per-key constant (index).
    Keyed(u32),
    /// `-> t`: word 0 of a cell (index), as stored now.
    Get(u32),
    /// `t ->`: stores word 0 of a cell; later `Get`s in the same tick see it.
    Set(u32),
    /// `i32 -> t`: a word of a cell; the index must be proven inside.
    GetAt(u32),
    /// `i32 t ->`: stores a word of a cell.
    SetAt(u32),
    /// `-> i32`: line (index), what was pushed so many ticks ago (1 ..= len).
    Delay(u32, u32),
    /// `i32 ->`: pushes onto a line; at most once per tick and not inside `if` or `loop`; seen from the next tick on.
    Push(u32),
    /// `i32 ->`: fills a whole line; in `init` only.
    Fill(u32),
    /// `i32 -> i32`: entry of a table (index); the index must be proven inside.
    Lookup(u32),
    /// `i32.. ->`: an event (index) of this key in this tick.
    Emit(u32),
    /// `t ->`: exports a value (index).
    Probe(u32),
    /// `i1 ->` yields: runs the first or the second region.
    If,
    /// `t.. ->` yields: runs the region so many times with parameters (i32 index from 0, carried values).
    Loop(u32),
}
