//! Object files: sections placed in RAM one after the other, so that a compiled function can be
//! called without a linker.
//!
//! ```text
//!   0x20000000  .text.*  .rodata.*  .data.*  .bss.*     each aligned as it asks
//! ```
//!
//! Names that the file does not define get addresses where there is no memory, so that whoever
//! calls or loads them faults there, and the rest can be called all the same. Tables for unwinding
//! are left out. Whatever else an object file may contain than the relocations of `relocate` is a
//! linker's work, and the error says so.

use super::layout::RAM_BASE;
use super::relocate::{self, Relocation};
use super::symbols::{self, Symbol, Symbols};
use super::{Elf, ElfError, File, Segment, corrupt};
use object::elf::{
    SHF_ALLOC, SHF_EXECINSTR, SHF_TLS, SHF_WRITE, SHN_ABS, SHN_COMMON, SHT_ARM_EXIDX, SHT_NOBITS,
    SHT_NOTE, STB_WEAK, STT_FUNC,
};
use object::read::elf::{Rel, SectionHeader, Sym};
use object::{Endianness, SectionIndex, SymbolIndex, elf};
use whippen_isa::Arch;

type Header = elf::SectionHeader32<Endianness>;

/// Where names go that are not defined: out of every board's memory, within a branch's reach of
/// RAM.
const NOWHERE: u32 = RAM_BASE + (15 << 20);
/// So far apart that the offset into an array still tells whose it was.
const NOWHERE_BYTES: u32 = 1024;

/// Object files larger than this in memory are not placed.
const PLACED_BYTES_MAX: u32 = 8 << 20;

pub(super) fn placed(file: &File<'_>, arch: Option<Arch>) -> Result<Elf, ElfError> {
    let mut placement = Placement::of(file)?;
    placement.relocate_all()?;
    if placement.segments.is_empty() {
        return Err(ElfError::Empty);
    }
    let symbols = placement.symbols()?;
    Ok(Elf {
        entry: 0,
        arch,
        segments: placement.segments,
        symbols,
        undefined: placement.undefined,
        unproven: None,
    })
}

struct Placement<'f, 'data> {
    file: &'f File<'data>,
    /// Address of each section by its number, of those that are placed.
    addresses: Vec<Option<u32>>,
    /// Which segment a section became.
    places: Vec<Option<usize>>,
    segments: Vec<Segment>,
    /// Names that are referred to and not defined, in the order of their addresses.
    undefined: Vec<String>,
}

impl<'f, 'data> Placement<'f, 'data> {
    fn of(file: &'f File<'data>) -> Result<Self, ElfError> {
        let table = file.elf_section_table();
        let (addresses, places) = (vec![None; table.len()], vec![None; table.len()]);
        let mut placement = Self {
            file,
            addresses,
            places,
            segments: Vec::new(),
            undefined: Vec::new(),
        };
        let mut next = RAM_BASE;
        // Code, constants, data, then what is zero.
        for rank in 0..4 {
            for (index, header) in table
                .enumerate()
                .filter(|(_, h)| rank_of(h, file.endian()) == Some(rank))
            {
                placement.place(index, header, &mut next)?;
            }
        }
        Ok(placement)
    }

    fn place(
        &mut self,
        index: SectionIndex,
        header: &Header,
        next: &mut u32,
    ) -> Result<(), ElfError> {
        let endian = self.file.endian();
        let flags = header.sh_flags(endian);
        if flags.contains(SHF_TLS) {
            return Err(ElfError::NeedsLinker("thread-local data".into()));
        }
        let align = header
            .sh_addralign(endian)
            .clamp(1, 4096)
            .next_power_of_two();
        let run = next.checked_next_multiple_of(align).unwrap_or(u32::MAX);
        let memory_bytes = header.sh_size(endian);
        *next = run.saturating_add(memory_bytes);
        if *next - RAM_BASE > PLACED_BYTES_MAX {
            return Err(ElfError::NeedsLinker(
                "more than 8 MiB of code and data".into(),
            ));
        }
        let bytes = header
            .data(endian, self.file.data())
            .map_err(corrupt)?
            .to_vec();
        let (writable, executable) = (flags.contains(SHF_WRITE), flags.contains(SHF_EXECINSTR));
        self.addresses[index.0] = Some(run);
        self.places[index.0] = Some(self.segments.len());
        self.segments.push(Segment {
            load: run,
            run,
            bytes,
            memory_bytes,
            writable,
            executable,
        });
        Ok(())
    }

    fn relocate_all(&mut self) -> Result<(), ElfError> {
        let (file, endian) = (self.file, self.file.endian());
        for section in file.elf_section_table().iter() {
            let target = section.sh_info(endian) as usize;
            let place = self.places.get(target).copied().flatten();
            if let (Some((entries, _)), Some(place)) =
                (section.rel(endian, file.data()).map_err(corrupt)?, place)
            {
                for entry in entries {
                    self.relocate(place, entry)?;
                }
            }
        }
        Ok(())
    }

    fn relocate(&mut self, place: usize, entry: &elf::Rel32<Endianness>) -> Result<(), ElfError> {
        let endian = self.file.endian();
        let (offset, kind) = (entry.r_offset(endian), entry.r_type(endian));
        let (symbol, thumb) = self.symbol_value(SymbolIndex(entry.r_sym(endian) as usize))?;
        let segment = &mut self.segments[place];
        let relocation = Relocation {
            kind: kind.0,
            place: segment.run.wrapping_add(offset),
            symbol,
            thumb,
        };
        relocate::apply(&mut segment.bytes, offset, &relocation)
    }

    /// The value of a symbol, and whether it is a Thumb function.
    fn symbol_value(&mut self, index: SymbolIndex) -> Result<(u32, bool), ElfError> {
        let (table, endian) = (self.file.elf_symbol_table(), self.file.endian());
        if index.0 == 0 {
            return Ok((0, false));
        }
        let symbol = table.symbol(index).map_err(corrupt)?;
        let value = symbol.st_value(endian);
        if symbol.st_shndx(endian) == SHN_ABS {
            return Ok((value, false));
        }
        if let Some(base) = self.base(symbol, index)? {
            let thumb = symbol.st_type() == STT_FUNC && value & 1 != 0;
            return Ok((base.wrapping_add(value & !u32::from(thumb)), thumb));
        }
        let name = table.symbol_name(endian, symbol).map_err(corrupt)?;
        let name = String::from_utf8_lossy(name).into_owned();
        match (symbol.is_common(endian), symbol.st_bind() == STB_WEAK) {
            (true, _) => Err(ElfError::NeedsLinker(format!(
                "the common symbol `{name}` (compile with -fno-common)"
            ))),
            (_, true) => Ok((0, false)),
            _ => self.nowhere(name).map(|address| (address, true)),
        }
    }

    /// The address of a name that is not defined.
    fn nowhere(&mut self, name: String) -> Result<u32, ElfError> {
        let index = self
            .undefined
            .iter()
            .position(|n| *n == name)
            .unwrap_or_else(|| {
                self.undefined.push(name);
                self.undefined.len() - 1
            });
        // Beyond 512 of them they would leave a branch's reach.
        match index {
            0..512 => Ok(NOWHERE + index as u32 * NOWHERE_BYTES),
            _ => Err(ElfError::NeedsLinker(
                "more than 512 names that it does not define".into(),
            )),
        }
    }

    fn base(
        &self,
        symbol: &elf::Sym32<Endianness>,
        index: SymbolIndex,
    ) -> Result<Option<u32>, ElfError> {
        if symbol.st_shndx(self.file.endian()) == SHN_COMMON {
            return Ok(None);
        }
        let table = self.file.elf_symbol_table();
        let section = table
            .symbol_section(self.file.endian(), symbol, index)
            .map_err(corrupt)?;
        Ok(section.and_then(|s| self.addresses.get(s.0).copied().flatten()))
    }

    fn symbols(&self) -> Result<Symbols, ElfError> {
        let (table, endian) = (self.file.elf_symbol_table(), self.file.endian());
        let mut found = Vec::new();
        for (index, symbol) in table.enumerate().filter(|(_, s)| !s.is_undefined(endian)) {
            let name = table.symbol_name(endian, symbol).map_err(corrupt)?;
            if let Some(base) = self.base(symbol, index)? {
                let value = base.wrapping_add(symbol.st_value(endian));
                found.extend(symbols::one(
                    &String::from_utf8_lossy(name),
                    symbol,
                    value,
                    symbol.st_size(endian),
                ));
            }
        }
        let undefined = self.undefined.iter().zip(0..).map(|(name, index)| Symbol {
            name: format!("{name} (not linked)"),
            address: NOWHERE + index * NOWHERE_BYTES,
            bytes: NOWHERE_BYTES,
            function: true,
            global: true,
        });
        Ok(Symbols::new(found.into_iter().chain(undefined).collect()))
    }
}

/// 0 code, 1 constants, 2 data, 3 zero; nothing for what is not placed.
fn rank_of(header: &Header, endian: Endianness) -> Option<u32> {
    let (kind, flags) = (header.sh_type(endian), header.sh_flags(endian));
    let left_out = kind == SHT_NOTE || kind == SHT_ARM_EXIDX || header.sh_size(endian) == 0;
    if !flags.contains(SHF_ALLOC) || left_out {
        return None;
    }
    Some(
        match (
            kind == SHT_NOBITS,
            flags.contains(SHF_EXECINSTR),
            flags.contains(SHF_WRITE),
        ) {
            (true, ..) => 3,
            (_, true, _) => 0,
            (_, _, false) => 1,
            (_, _, true) => 2,
        },
    )
}
