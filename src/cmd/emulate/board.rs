//! The board: a named one, or what an image wants and the command line adds.

use clap::ValueEnum;
use whippen_emulator::elf::{Elf, RAM_BASE, regions_for, vector_table};
use whippen_emulator::{Board, CoreKind, Region};

use super::{On, value};
use crate::exit::Failure;

/// The boards by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum BoardName {
    /// One core at 150 MHz and the memory that the image wants
    Generic,
}

/// A core by its name.
pub fn core(text: &str) -> Result<CoreKind, String> {
    let named = |kind: &CoreKind| kind.name() == text || kind.name().strip_prefix("cortex-") == Some(text);
    CoreKind::ALL.into_iter().find(named).ok_or_else(|| {
        let names = CoreKind::ALL.map(CoreKind::name).join(", ");
        format!("known cores are {names}")
    })
}

/// Where memory is.
#[derive(Clone, Copy, Debug)]
pub struct MemoryRange {
    base: u32,
    bytes: u32,
}

/// `ADDR:SIZE`
pub fn memory(text: &str) -> Result<MemoryRange, String> {
    let parts = text
        .split_once(':')
        .and_then(|(base, bytes)| Some((u32::try_from(value::unsigned(base)?).ok()?, value::size(bytes)?)));
    let (base, bytes) = parts.ok_or("write ADDR:SIZE, such as 0x20000000:512K")?;
    let whole = base % 4096 == 0 && bytes % 4096 == 0 && bytes != 0;
    if !whole || base.checked_add(bytes - 1).is_none() {
        return Err("address and size must be multiples of 4096 within 32 bits".into());
    }
    // What no microcontroller has would only take the host's memory.
    if bytes > 256 << 20 {
        return Err("at most 256M".into());
    }
    Ok(MemoryRange { base, bytes })
}

/// The board for an image.
pub fn board(elf: &Elf, core: CoreKind, on: &On) -> Result<Board, Failure> {
    match on.board {
        BoardName::Generic => generic(elf, core, on),
    }
}

/// One core, the memory of the command line, and around it what the image wants.
fn generic(elf: &Elf, core: CoreKind, on: &On) -> Result<Board, Failure> {
    let given = on.ram.iter().map(|m| (m.base, m.bytes, true)).chain(on.rom.iter().map(|m| (m.base, m.bytes, false)));
    let mut runs: Vec<(u32, u32, bool)> = given.collect();
    runs.extend(regions_for(elf, &runs).map_err(|e| Failure::Usage(format!("the image cannot be loaded: {e}")))?);
    let region = |(base, bytes, writable): (u32, u32, bool)| match writable {
        true => Region::ram(&format!("RAM at {base:#010x}"), base, bytes),
        false => Region::rom(&format!("ROM at {base:#010x}"), base, bytes),
    };
    let regions = runs.into_iter().map(region).collect();
    let vector_table = vector_table(elf).unwrap_or(0);
    Ok(Board { regions, vector_table, ..Board::generic(core) })
}

/// Where a stack begins that nobody has set: the end of the RAM at 0x20000000, else of the last RAM there is.
pub fn stack_top(board: &Board) -> u32 {
    let mut ram = board.regions.iter().filter(|r| r.writable);
    let main = ram.clone().find(|r| r.contains(RAM_BASE));
    main.or_else(|| ram.next_back()).map_or(0, |r| r.base.wrapping_add(r.bytes) & !7)
}
