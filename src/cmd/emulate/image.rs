//! From a file to a machine with the image in its memory.

use std::path::Path;

use whippen_emulator::elf::{Elf, SourceLines};
use whippen_emulator::{Converter, CoreKind, Machine, Ports};
use whippen_isa::Arch;
use whippen_isa::timing::Rules;
use whippen_runtime::files::{self, InputKind};

use super::outside::Outside;
use super::uart::OpenDoor;
use super::{On, board, ports};
use crate::exit::Failure;
use crate::say::tell;

/// An image, loaded.
pub struct Image {
    /// What was read.
    pub elf: Elf,
    /// Where it runs.
    pub machine: Machine,
    /// Its source lines.
    pub lines: SourceLines,
    /// The devices that talk to the host, of a board that has them.
    pub ports: Option<Ports>,
    /// What is on its pins.
    pub outside: Outside,
    /// What is at the other end of its first serial port, if something is.
    pub door: Option<OpenDoor>,
}

/// Reads a file whole.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let failed =
        |message: String| Failure::Usage(format!("cannot read `{}`: {message}", path.display()));
    files::read_bytes(path, InputKind::IMAGE).map_err(|e| failed(e.message))
}

impl Image {
    /// Reads an ELF and makes a machine for it.
    pub fn load(path: &Path, on: &On) -> Result<Self, Failure> {
        let bytes = read(path)?;
        let wrong =
            |why: &dyn std::fmt::Display| Failure::Usage(format!("`{}` {why}", path.display()));
        let elf = Elf::parse(&bytes, on.core.is_some()).map_err(|e| wrong(&e))?;
        let core = core_for(&elf, on.board.name.core().or(on.core));
        let (mut machine, ports) = board::machine(&elf, core, on)?;
        machine.set_rules(Rules {
            shifted_register_flags: on.shifted_flags,
            ..Rules::default()
        });
        elf.load(&mut machine.bus.memory, false).map_err(|e| {
            wrong(&format_args!(
                "does not fit the board: {e}; --ram and --rom add memory"
            ))
        })?;
        if !elf.undefined.is_empty() {
            tell!(
                "note: the object file is not linked; it faults if it comes to {}",
                listed(&elf.undefined)
            );
        }
        if let Some(why) = &elf.unproven {
            tell!("note: the image says that it is not proven to be in time: {why}");
        }
        Ok(Self {
            lines: SourceLines::read(&bytes),
            outside: on.parts.connect(&mut machine, &elf)?,
            elf,
            machine,
            ports,
            door: None,
        })
    }

    /// The converter, when the board has one and it has had at least one tick.
    pub fn converter(&self) -> Option<&Converter> {
        ports::converter(&self.machine, self.ports.as_ref()?)
    }

    /// An address in words: symbol, offset and line, as far as they are known.
    pub fn place(&self, address: u32) -> String {
        let mut text = match self.elf.symbols.covering(address) {
            Some((symbol, 0)) => symbol.name.clone(),
            Some((symbol, offset)) => format!("{}+{offset:#x}", symbol.name),
            None => format!("{address:#010x}"),
        };
        if let Some(line) = self.lines.at(address) {
            text.push_str(&format!(" ({line})"));
        }
        text
    }
}

fn listed(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|n| format!("`{n}`")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// The core of the command line, else the one the image was compiled for, else a Cortex-M33.
fn core_for(elf: &Elf, asked: Option<CoreKind>) -> CoreKind {
    let compiled_for = elf.arch.map(core_of);
    if let (Some(asked), Some(arch)) = (asked, elf.arch)
        && asked.arch() < arch
    {
        let (made_for, asked) = (core_of(arch).name(), asked.name());
        tell!(
            "note: the image was compiled for a {made_for}; a {asked} lacks some of its instructions"
        );
    }
    asked.or(compiled_for).unwrap_or(CoreKind::CortexM33)
}

fn core_of(arch: Arch) -> CoreKind {
    match arch {
        Arch::V6M => CoreKind::CortexM0Plus,
        Arch::V7EM => CoreKind::CortexM4,
        Arch::V8M => CoreKind::CortexM33,
    }
}
