//! The description of a chip and its board: cores, clock, memories with their banks and times,
//! buses with devices, stacks, what goes where.
//!
//! Linker, firmware and bound read this one description; it comes from a file
//! (`instruments/hardware/*.toml`, read by `whippen_runtime::board`). [`Board::contradiction`]
//! finds what cannot be true of any board. The emulator has tables of its own, so that it can
//! judge.
//!
//! Not here: reading files, pipelines of cores (`whippen_isa::timing`), the firmware's texts.

mod bench;
mod columns;
mod contradiction;
mod i2s;
mod knob;
mod memory;

use whippen_isa::Arch;
use whippen_isa::timing::Core;

pub use bench::{Bench, CONVERSION_CYCLES, CONVERSIONS, DmaTraffic, PACE_SLICE, TICK_SLICE};
pub use columns::{
    COLUMN_KEYS, COLUMNS_MAX, CONVERTER_RANGES, ColumnWires, Columns, ConverterRange,
};
pub use contradiction::Contradiction;
pub use i2s::SoundPort;
pub use knob::{FRAME_CYCLES, Knob, Shaft, Wire};
pub use memory::{AccessTime, BANKS_MAX, BankSet, Bus, Memory, MemoryKind};

/// Which sections go into a memory.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Placement {
    /// A section's name, or its beginning followed by `*`; the longest that fits counts.
    pub pattern: String,
    /// Name of the memory.
    pub memory: String,
}

/// What the chip looks for when it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
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
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
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
    /// Whether its cores fetch and access data through a port each; else both share one.
    pub fetches_apart: bool,
    /// Names of the banks of its memories.
    pub banks: Vec<String>,
    /// Its memory, by address.
    pub memory: Vec<Memory>,
    /// Where its devices are, by address.
    pub buses: Vec<Bus>,
    /// Devices that the firmware uses, by name, with the first address of each.
    pub devices: Vec<(String, u32)>,
    /// Number of the interrupt of a tick: the converter's, that of the knob's sensor, or that of
    /// the slice of PWM which counts the ticks of a bench or of columns.
    pub converter_interrupt: u32,
    /// Where the stack of each core ends: the address behind its highest word.
    pub stacks: Vec<u32>,
    /// What goes where.
    pub places: Vec<Placement>,
    /// The knob on its pins, in place of the emulator's converter.
    pub knob: Option<Knob>,
    /// The key bench on its pins, in place of that.
    pub bench: Option<Bench>,
    /// Columns of keys on its pins, in place of these.
    pub columns: Option<Columns>,
    /// The DAC on its pins, beside one of these.
    pub i2s: Option<SoundPort>,
}

/// What is at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target<'a> {
    /// Memory.
    Memory(&'a Memory),
    /// A bus with devices.
    Bus(&'a Bus),
    /// Nothing that the board describes.
    Nothing,
}

impl Board {
    /// What is at an address.
    pub fn target(&self, address: u32) -> Target<'_> {
        if let Some(memory) = self.memory.iter().find(|own| own.contains(address)) {
            return Target::Memory(memory);
        }
        match self.buses.iter().find(|own| own.contains(address)) {
            Some(bus) => Target::Bus(bus),
            None => Target::Nothing,
        }
    }

    /// The memory that an address is in.
    pub fn memory_at(&self, address: u32) -> Option<&Memory> {
        self.memory.iter().find(|own| own.contains(address))
    }

    /// The first address of a device.
    pub fn device(&self, name: &str) -> Option<u32> {
        let found = self.devices.iter().find(|(own, _)| own == name);
        found.map(|(_, base)| *base)
    }

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
