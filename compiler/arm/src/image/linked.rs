//! What linking gives: sections, names and hints with addresses.

use whippen_isa::Arch;

use super::lines::Place;
use super::object::{SectionKind, SymbolKind};

/// A section with an address.
#[derive(Debug, Clone, PartialEq)]
pub struct Linked {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: SectionKind,
    /// The memory it runs in.
    pub memory: String,
    /// Where it is stored.
    pub load: u32,
    /// Where it is when the program runs.
    pub run: u32,
    /// Its bytes; none if it starts as zero.
    pub bytes: Vec<u8>,
    /// Its size in bytes.
    pub size: u32,
    /// From an address on, code belongs to a place, by address.
    pub lines: Vec<(u32, Option<Place>)>,
}

/// A run of memory to be filled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Where it is stored.
    pub load: u32,
    /// Where it is when the program runs.
    pub run: u32,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its size in memory; the rest is zero.
    pub size: u32,
    /// Whether it holds code.
    pub executable: bool,
    /// Whether the program stores there.
    pub writable: bool,
}

/// A name with an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// The name.
    pub name: String,
    /// Its address; bit 0 is not set.
    pub address: u32,
    /// Bytes it names.
    pub size: u32,
    /// What it names.
    pub kind: SymbolKind,
    /// Whether other objects see it.
    pub global: bool,
    /// Index of its section; none for the bounds of memory.
    pub section: Option<usize>,
}

impl Image {
    /// Bytes that are stored.
    pub fn stored_bytes(&self) -> u32 {
        self.segments
            .iter()
            .map(|segment| segment.bytes.len() as u32)
            .sum()
    }

    /// Bytes of memory while it runs, without stacks: what is not read where it is stored.
    pub fn run_bytes(&self) -> u32 {
        self.segments
            .iter()
            .filter(|s| s.run != s.load || s.writable)
            .map(|segment| segment.size)
            .sum()
    }
}

/// Code and data with addresses.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// The architecture of the cores.
    pub arch: Arch,
    /// Where it begins; bit 0 is not set.
    pub entry: u32,
    /// By address.
    pub sections: Vec<Linked>,
    /// What is to be loaded, by address.
    pub segments: Vec<Segment>,
    /// By address.
    pub symbols: Vec<Named>,
    /// Heads of loops, and how often they run at most each time the loop is entered.
    pub loops: Vec<(u32, u32)>,
    /// Indirect branches, and where they may go.
    pub targets: Vec<(u32, Vec<u32>)>,
}
