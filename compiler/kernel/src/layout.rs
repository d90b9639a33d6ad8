//! Memory layout: offsets of everything that a kernel declares, for every engine of the host.
//!
//! ```text
//! columns  | cell: key 0, key 1, ... | grid[0]: key 0, ... | grid[1]: key 0, ... | keyed: key 0, ... | ...
//! rows     | slot 0: key 0, key 1, ... | slot 1: key 0, key 1, ... | ...             one block per delay line
//! rings    one index per distinct length of line: the slot that is written in this tick
//! events   | tick tick key event arg arg | ...                                       bounded
//! ```
//!
//! Keys lie side by side, so that one load brings the same word of several keys. Words have 32
//! bits; an `i1` or `i32` takes one, an `i64` two, the low one first. Rows hold `u16` where the
//! line's range fits, else `i32`; with slots outside and keys inside, one tick of all keys touches
//! one row per delay.

use super::{Kernel, Range, Type, Verified};
use std::fmt;

/// How many events are kept until they are drained.
pub const EVENTS_MAX: usize = 4096;

/// Words before an event's arguments: tick (two), key, event.
pub const EVENT_HEAD: usize = 4;

/// How many keys a keyboard may have.
pub const KEYS_MAX: usize = 1 << 16;

/// How many bytes all memory may take.
pub const BYTES_MAX: u64 = 1 << 30;

/// Why no memory can be laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayoutError {
    /// No keys, or more than [`KEYS_MAX`].
    Keys(usize),
    /// More than [`BYTES_MAX`] bytes.
    Bytes(u64),
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            LayoutError::Keys(keys) => write!(f, "{keys} keys, where 1 to {KEYS_MAX} are possible"),
            LayoutError::Bytes(bytes) => {
                write!(f, "{bytes} bytes of memory, more than {BYTES_MAX}")
            }
        }
    }
}

impl std::error::Error for LayoutError {}

/// Place of a delay line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinePlace {
    /// Whether its rows hold `u16` (else `i32`).
    pub narrow: bool,
    /// First element of its first row among the rows of that width.
    pub start: usize,
    /// Which ring index it uses.
    pub ring: usize,
    /// Slots.
    pub len: usize,
}

/// Where everything lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Keys.
    pub keys: usize,
    /// First word of the columns of each cell.
    pub cells: Vec<usize>,
    /// First word of the column of each per-key constant.
    pub keyed: Vec<usize>,
    /// Words of all columns.
    pub column_words: usize,
    /// Place of each line.
    pub lines: Vec<LinePlace>,
    /// Elements of all rows of `u16`.
    pub narrow_len: usize,
    /// Elements of all rows of `i32`.
    pub wide_len: usize,
    /// The distinct lengths of lines.
    pub rings: Vec<usize>,
    /// Words of an event.
    pub event_words: usize,
}

/// Words a value of this type takes.
pub const fn words(ty: Type) -> usize {
    match ty {
        Type::I1 | Type::I32 => 1,
        Type::I64 => 2,
    }
}

impl Layout {
    /// Lays out the memory of so many keys.
    ///
    /// # Errors
    /// No keys, too many, too much memory.
    pub fn new(kernel: Verified, keys: usize) -> Result<Layout, LayoutError> {
        if keys == 0 || keys > KEYS_MAX {
            return Err(LayoutError::Keys(keys));
        }
        let kernel = kernel.kernel();
        let mut layout = Layout::empty(keys);
        layout.place_columns(kernel);
        for line in &kernel.lines {
            layout.place_line(line.len as usize, line.range);
        }
        layout.event_words = EVENT_HEAD
            + kernel
                .events
                .iter()
                .map(|event| event.args as usize)
                .max()
                .unwrap_or(0);
        let bytes = layout.bytes();
        if bytes > BYTES_MAX {
            Err(LayoutError::Bytes(bytes))
        } else {
            Ok(layout)
        }
    }

    fn empty(keys: usize) -> Layout {
        Layout {
            keys,
            cells: Vec::new(),
            keyed: Vec::new(),
            column_words: 0,
            lines: Vec::new(),
            narrow_len: 0,
            wide_len: 0,
            rings: Vec::new(),
            event_words: 0,
        }
    }

    fn place_columns(&mut self, kernel: &Kernel) {
        let mut at = 0_usize;
        for cell in &kernel.cells {
            self.cells.push(at);
            at += words(cell.ty) * cell.len as usize * self.keys;
        }
        self.keyed = (0..kernel.keyed.len())
            .map(|index| at + index * self.keys)
            .collect();
        self.column_words = at + kernel.keyed.len() * self.keys;
    }

    /// First of the words that hold a word of a cell of this key.
    pub fn place(&self, ty: Type, key: usize, cell: usize, word: usize) -> usize {
        self.cells[cell] + (word * self.keys + key) * words(ty)
    }

    fn place_line(&mut self, len: usize, range: Range) {
        let ring = self
            .rings
            .iter()
            .position(|ring| *ring == len)
            .unwrap_or_else(|| {
                self.rings.push(len);
                self.rings.len() - 1
            });
        let narrow = Range::new(0, u16::MAX.into()).contains(range);
        let total = if narrow {
            &mut self.narrow_len
        } else {
            &mut self.wide_len
        };
        self.lines.push(LinePlace {
            narrow,
            start: *total,
            ring,
            len,
        });
        *total += len * self.keys;
    }

    /// Bytes of columns and lines.
    fn bytes(&self) -> u64 {
        4 * self.column_words as u64 + 2 * self.narrow_len as u64 + 4 * self.wide_len as u64
    }
}
