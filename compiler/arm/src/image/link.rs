//! Objects become an image: every section gets an address in the board's memory, and addresses are
//! filled in.
//!
//! ```text
//!   flash   start | vectors | code and constants that stay | tables | contents of RAM
//!   RAM     code, constants, data  (copied at the start)   | zeroed data (cleared at the start)
//! ```
//!
//! Sections go where the board's patterns say, within a memory in the order of the objects. What a
//! start-up routine needs has names: `__copy_table_start` to `__copy_table_end` are entries (from,
//! to, bytes), `__zero_table_start` to `__zero_table_end` entries (at, bytes), all multiples of 4;
//! and of each memory `__NAME_start`, `__NAME_end` and `__NAME_free`, the first address that nobody
//! uses.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `start` | what the linker itself adds: the chip's start block, room for the tables |
//! | `placement` | where each section lies, and where its contents are stored |
//! | `symbols` | the address of each name |
//! | `resolve` | fixups and hints, by those addresses |
//! | `segments` | the contents of each memory, as files hold them |
//!
//! Not here: what is executed first (the object that defines the entry), files.

mod error;
mod placement;
mod resolve;
mod segments;
mod start;
mod symbols;

use std::collections::HashMap;

use super::lines::Place;
use super::linked::{Image, Linked};
use super::object::Object;
use start::start_object;
use whippen_board::{Board, Memory};

pub use error::LinkError;

/// An object, and the places of its origins.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The object.
    pub object: &'a Object,
    /// What the origins of its lines mean.
    pub places: &'a [Place],
}

/// Links objects for a board; the image begins at the global symbol `entry`.
///
/// # Errors
/// Names that are missing or defined twice, sections without a place, memory that is full, branches
/// that do not reach.
pub fn link(board: &Board, inputs: &[Input], entry: &str) -> Result<Image, LinkError> {
    let start = start_object(board, inputs)?;
    let mut all = vec![Input {
        object: &start,
        places: &[],
    }];
    all.extend(inputs);
    let mut linker = Linker {
        board,
        inputs: &all,
        places: HashMap::new(),
        sections: Vec::new(),
        bounds: Vec::new(),
    };
    linker.place_all()?;
    linker.finish(entry)
}

/// Where a memory is used.
struct MemoryUse<'a> {
    memory: &'a Memory,
    /// Behind what is copied or stored there.
    filled: u32,
    /// Behind everything.
    free: u32,
}

struct Linker<'a> {
    board: &'a Board,
    inputs: &'a [Input<'a>],
    /// Where section `.1` of input `.0` is in the list.
    places: HashMap<(usize, usize), usize>,
    sections: Vec<Linked>,
    bounds: Vec<MemoryUse<'a>>,
}

impl Linker<'_> {
    /// The image of sections that are placed.
    fn finish(mut self, entry: &str) -> Result<Image, LinkError> {
        let globals = self.globals()?;
        self.resolve_fixups(&globals)?;
        let undefined = || LinkError::Undefined {
            symbol: entry.to_string(),
            section: "the start".to_string(),
        };
        let (entry, _) = *globals.get(entry).ok_or_else(undefined)?;
        let hints = self.resolve_hints(&globals)?;
        let symbols = self.symbols();
        let segments = self.segments();
        Ok(Image {
            arch: self.board.arch,
            entry,
            sections: self.sections,
            segments,
            symbols,
            loops: hints.loops,
            targets: hints.targets,
        })
    }
}
