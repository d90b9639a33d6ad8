//! A board as the linker sees it.

use whippen_isa::Arch;
use whippen_isa::timing::Core;

/// What kind of memory it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryKind {
    /// Keeps its contents; the image is stored there.
    Flash,
    /// Holds nothing at the start: what must be there is copied from flash first, unless there is
    /// none.
    Ram,
}

/// A run of memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// Its name in the board's file.
    pub name: String,
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// What kind.
    pub kind: MemoryKind,
}

/// Which sections go into a memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placement {
    /// A section's name, or its beginning followed by `*`; the longest that fits counts.
    pub pattern: String,
    /// Name of the memory.
    pub memory: String,
}

/// What the chip looks for when it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// A vector table at the beginning.
    Vectors,
    /// A vector table at the beginning, and an image definition block in the first 4 KiB (RP2350
    /// datasheet 5.9.5).
    ImageDef,
    /// 256 bytes of second-stage boot code with a checksum, then the vector table (RP2040 datasheet
    /// 2.8.1.3).
    Boot2,
}

/// A board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Board {
    /// Its name.
    pub name: String,
    /// The architecture of its cores.
    pub arch: Arch,
    /// How many cores.
    pub cores: u32,
    /// Cycles per second.
    pub clock_hz: u32,
    /// What it looks for when it starts.
    pub start: Start,
    /// The family that its bootloader takes UF2 files for, if it takes any.
    pub uf2_family: Option<u32>,
    /// Its memory, by address.
    pub memory: Vec<Memory>,
    /// What goes where.
    pub places: Vec<Placement>,
}

impl Board {
    /// The memory of a section, if the board has a place for it.
    pub fn memory_for(&self, section: &str) -> Option<&Memory> {
        let fits = |place: &&Placement| match place.pattern.strip_suffix('*') {
            Some(start) => section.starts_with(start),
            None => section == place.pattern,
        };
        let place = self
            .places
            .iter()
            .filter(fits)
            .max_by_key(|place| place.pattern.len())?;
        self.memory
            .iter()
            .find(|memory| memory.name == place.memory)
    }

    /// Where the image is stored, if it is not loaded straight into RAM.
    pub fn flash(&self) -> Option<&Memory> {
        self.memory
            .iter()
            .find(|memory| memory.kind == MemoryKind::Flash)
    }

    /// The cycles of its core.
    pub fn timing(&self) -> Core {
        timing(self.arch)
    }
}

/// The core of our boards that has this architecture.
pub fn timing(arch: Arch) -> Core {
    match arch {
        Arch::V6M => Core::cortex_m0plus(),
        Arch::V7EM => Core::cortex_m4(),
        Arch::V8M => Core::cortex_m33(),
    }
}
