//! The board: a named one, or what an image wants and the command line adds.

use clap::ValueEnum;
use whippen_emulator::elf::{Elf, RAM_BASE, regions_for, vector_table};
use whippen_emulator::{Board, BoardKind, CoreKind, Machine, Ports, Region, build};

use super::{On, value};
use crate::cmd::setup::counted;
use crate::exit::Failure;

/// The boards by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum BoardName {
    /// One core at 150 MHz and the memory that the image wants
    Generic,
    /// Raspberry Pi RP2350: two Cortex-M33 at 150 MHz, with its devices and a converter
    Rp2350,
    /// Raspberry Pi RP2040: two Cortex-M0+ at 133 MHz, with its devices and a converter
    Rp2040,
    /// STM32F407: one Cortex-M4 at 168 MHz, with a few of its devices and a converter
    Stm32f4,
}

impl BoardName {
    /// The board, unless it is the generic one.
    fn kind(self) -> Option<BoardKind> {
        match self {
            Self::Generic => None,
            Self::Rp2350 => Some(BoardKind::Rp2350),
            Self::Rp2040 => Some(BoardKind::Rp2040),
            Self::Stm32f4 => Some(BoardKind::Stm32f4),
        }
    }

    /// The core that it has, unless that is free.
    pub fn core(self) -> Option<CoreKind> {
        Some(self.kind()?.board().core)
    }
}

/// A board, and how many of it have one keyboard.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Boards {
    pub name: BoardName,
    pub chips: u32,
}

/// Boards by name, `NAME` or `NAME*COUNT`.
pub fn boards(text: &str) -> Result<Boards, String> {
    let (name, chips) = counted(text.as_ref())?;
    let name = name.to_string_lossy();
    let Ok(name) = BoardName::from_str(&name, false) else {
        let all = BoardName::value_variants().iter();
        let names = all.filter_map(ValueEnum::to_possible_value);
        let names: Vec<String> = names.map(|own| own.get_name().to_string()).collect();
        return Err(format!("known boards are {}", names.join(", ")));
    };
    match (name, chips) {
        (BoardName::Generic, 2..) => Err("generic is one chip".to_string()),
        _ => Ok(Boards { name, chips }),
    }
}

/// A core by its name.
pub fn core(text: &str) -> Result<CoreKind, String> {
    let named =
        |kind: &CoreKind| kind.name() == text || kind.name().strip_prefix("cortex-") == Some(text);
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
    let parts = text.split_once(':').and_then(|(base, bytes)| {
        Some((
            u32::try_from(value::unsigned(base)?).ok()?,
            value::size(bytes)?,
        ))
    });
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

/// The machine for an image, and its devices if the board has any.
pub fn machine(elf: &Elf, core: CoreKind, on: &On) -> Result<(Machine, Option<Ports>), Failure> {
    let cannot_be = |e| Failure::Usage(format!("such a board cannot be: {e}"));
    let Some(kind) = on.board.name.kind() else {
        if let Some(option) = on.devices.wanted() {
            return Err(Failure::Usage(format!(
                "{option} needs a board with devices: --board rp2350, rp2040 or stm32f4"
            )));
        }
        return Ok((
            Machine::new(generic(elf, core, on)?).map_err(cannot_be)?,
            None,
        ));
    };
    if let Some(asked) = on.core.filter(|asked| *asked != kind.board().core) {
        let (asked, has) = (asked.name(), kind.board().core.name());
        return Err(Failure::Usage(format!(
            "--core {asked}: {} has a {has}; leave --core out",
            kind.name()
        )));
    }
    let mut board = kind.board();
    board.vector_table = vector_table(elf).unwrap_or(board.vector_table);
    board.regions.extend(given(on).map(region));
    let (mut machine, ports) = build(kind, board, on.devices.setup()?).map_err(cannot_be)?;
    on.devices.connect(&mut machine, &ports)?;
    Ok((machine, Some(ports)))
}

/// Memory of the command line: base, bytes, writable.
fn given(on: &On) -> impl Iterator<Item = (u32, u32, bool)> {
    on.ram
        .iter()
        .map(|m| (m.base, m.bytes, true))
        .chain(on.rom.iter().map(|m| (m.base, m.bytes, false)))
}

fn region((base, bytes, writable): (u32, u32, bool)) -> Region {
    match writable {
        true => Region::ram(&format!("RAM at {base:#010x}"), base, bytes),
        false => Region::rom(&format!("ROM at {base:#010x}"), base, bytes),
    }
}

/// One core, the memory of the command line, and around it what the image wants.
fn generic(elf: &Elf, core: CoreKind, on: &On) -> Result<Board, Failure> {
    let mut runs: Vec<(u32, u32, bool)> = given(on).collect();
    runs.extend(
        regions_for(elf, &runs)
            .map_err(|e| Failure::Usage(format!("the image cannot be loaded: {e}")))?,
    );
    let regions = runs.into_iter().map(region).collect();
    let vector_table = vector_table(elf).unwrap_or(0);
    Ok(Board {
        regions,
        vector_table,
        ..Board::generic(core)
    })
}

/// Where a stack begins that nobody has set: the end of the RAM at 0x20000000, else of the last RAM
/// there is.
pub fn stack_top(board: &Board) -> u32 {
    let mut ram = board.regions.iter().filter(|r| r.writable);
    let main = ram.clone().find(|r| r.contains(RAM_BASE));
    main.or_else(|| ram.next_back())
        .map_or(0, |r| r.base.wrapping_add(r.bytes) & !7)
}
