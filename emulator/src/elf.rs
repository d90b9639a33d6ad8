//! A bare-metal ELF: what to put where, what is called how, and for which core.
//!
//! ```text
//!   bytes --header--> 32-bit little-endian ARM?  no: what it is instead
//!            |
//!            +-- linked:      program headers ------------------+
//!            +-- relocatable: sections placed in RAM (`place`) --+--> Segments, Symbols, architecture
//! ```
//!
//! A segment has two addresses. It is loaded at one (LMA, in flash) and runs at the other (VMA);
//! they differ for initialized data, which start-up code copies. Whoever calls a function without
//! that code puts the bytes at both.
//!
//! Not here: source lines (`lines`), and which memory a board has for an image (`layout`).

mod attributes;
mod layout;
mod lines;
mod notes;
mod place;
mod relocate;
mod symbols;

pub use layout::{LayoutError, RAM_BASE, RAM_BYTES, regions_for, vector_table};
pub use lines::{Line, SourceLines};
pub use symbols::{Symbol, SymbolError, Symbols};

use object::elf::{EM_ARM, ET_DYN, ET_EXEC, ET_REL, PF_W, PF_X, PT_DYNAMIC, PT_INTERP, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, elf};
use whippen_isa::Arch;

use crate::memory::{Memory, MemoryError};

/// An ELF, read.
#[derive(Clone, Debug)]
pub struct Elf {
    /// Where it says that it begins; bit 0 stands for Thumb. 0 when it does not say.
    pub entry: u32,
    /// The oldest architecture of ours that has what it was compiled for; nothing when it does not
    /// say.
    pub arch: Option<Arch>,
    /// What to load, in the order of the file; none is empty.
    pub segments: Vec<Segment>,
    /// Names.
    pub symbols: Symbols,
    /// Of an object file, the names that it uses and does not define. They have addresses without
    /// memory.
    pub undefined: Vec<String>,
    /// Why an image of Whippen is not proven to be in time, if it says so.
    pub unproven: Option<String>,
}

/// A run of memory that an image fills.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Segment {
    /// Where it is loaded: the physical address, LMA.
    pub load: u32,
    /// Where it is when the program runs: the virtual address, VMA.
    pub run: u32,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its size in memory; what the bytes do not fill is zero at the start of `main`.
    pub memory_bytes: u32,
    /// Whether the program may store there.
    pub writable: bool,
    /// Whether it holds code.
    pub executable: bool,
}

impl Segment {
    /// Whether `address` lies in the segment as it runs.
    pub fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.run) < self.memory_bytes
    }
}

/// Why bytes are not an image that a Cortex-M could run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ElfError {
    /// No ELF at all; what it looks like.
    NotElf(&'static str),
    /// 64-bit.
    Wide,
    /// Big-endian.
    BigEndian,
    /// Another machine: its name, or its number.
    Machine(String),
    /// Neither an executable nor an object file.
    Kind(u16),
    /// It wants an operating system.
    Hosted(String),
    /// Compiled for a core that is no Cortex-M of ours.
    Architecture(String),
    /// Something in an object file that only a linker can do.
    NeedsLinker(String),
    /// Nothing to load.
    Empty,
    /// Cut off or corrupt.
    Corrupt(String),
}

impl std::fmt::Display for ElfError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotElf(looks) => write!(f, "is no ELF: {looks}"),
            Self::Wide => f.write_str("is a 64-bit ELF; a Cortex-M runs 32-bit ones"),
            Self::BigEndian => f.write_str("is a big-endian ELF; only little-endian ones are run"),
            Self::Machine(name) => write!(f, "is an ELF for {name}, not for ARM"),
            Self::Kind(kind) => write!(
                f,
                "is an ELF of type {kind}, neither an executable nor an object file"
            ),
            Self::Hosted(why) => {
                write!(
                    f,
                    "is a program for an operating system ({why}); only bare-metal images are run"
                )
            }
            Self::Architecture(name) => {
                write!(
                    f,
                    "is compiled for {name}; known are ARMv6-M, ARMv7-M and ARMv8-M (say --core to run it as one)"
                )
            }
            Self::NeedsLinker(what) => write!(f, "is an object file with {what}; link it first"),
            Self::Empty => f.write_str("has nothing to load"),
            Self::Corrupt(why) => write!(f, "is a corrupt ELF: {why}"),
        }
    }
}

impl std::error::Error for ElfError {}

pub(crate) type File<'data> = ElfFile32<'data, Endianness>;

fn corrupt(error: impl std::fmt::Display) -> ElfError {
    ElfError::Corrupt(error.to_string())
}

impl Elf {
    /// Reads an ELF for a Cortex-M: an image, or an object file whose sections need no linker.
    /// `any_core` accepts what was compiled for a core that is unknown here.
    ///
    /// # Errors
    /// What the bytes are instead, or what is wrong with them.
    pub fn parse(bytes: &[u8], any_core: bool) -> Result<Self, ElfError> {
        check_ident(bytes)?;
        let file = File::parse(bytes).map_err(corrupt)?;
        let (header, endian) = (file.elf_header(), file.endian());
        if header.e_machine(endian) != EM_ARM {
            return Err(ElfError::Machine(machine_name(header.e_machine(endian).0)));
        }
        let arch = match attributes::arch(&file) {
            Err(ElfError::Architecture(_)) if any_core => None,
            other => other?,
        };
        match header.e_type(endian) {
            ET_REL => place::placed(&file, arch),
            ET_EXEC | ET_DYN => linked(&file, arch),
            other => Err(ElfError::Kind(other.0)),
        }
    }
}

impl Elf {
    /// Copies the image to where it is loaded; if `started`, also to where it runs, as if start-up
    /// code had copied its data.
    ///
    /// # Errors
    /// The board has no memory there.
    pub fn load(&self, memory: &mut Memory, started: bool) -> Result<(), MemoryError> {
        for segment in &self.segments {
            memory.write(segment.load, &segment.bytes)?;
        }
        for segment in self.segments.iter().filter(|s| started && s.run != s.load) {
            memory.write(segment.run, &segment.bytes)?;
        }
        Ok(())
    }
}

fn linked(file: &File<'_>, arch: Option<Arch>) -> Result<Elf, ElfError> {
    let endian = file.endian();
    let mut segments = Vec::new();
    for header in file.elf_program_headers() {
        match header.p_type(endian) {
            PT_INTERP => return Err(ElfError::Hosted("it names a dynamic loader".into())),
            PT_DYNAMIC => return Err(ElfError::Hosted("it is dynamically linked".into())),
            PT_LOAD if header.p_memsz(endian) != 0 => segments.push(segment(file, header)?),
            _ => {}
        }
    }
    if segments.is_empty() {
        return Err(ElfError::Empty);
    }
    let entry = file.elf_header().e_entry(endian);
    Ok(Elf {
        entry,
        arch,
        segments,
        symbols: Symbols::read(file)?,
        undefined: Vec::new(),
        unproven: notes::unproven(file),
    })
}

fn segment(
    file: &File<'_>,
    header: &elf::ProgramHeader32<Endianness>,
) -> Result<Segment, ElfError> {
    let endian = file.endian();
    let bytes = header
        .data(endian, file.data())
        .map_err(|()| corrupt("a segment lies beyond the end of the file"))?;
    let (load, run) = (header.p_paddr(endian), header.p_vaddr(endian));
    let memory_bytes = header.p_memsz(endian);
    let last = u64::from(memory_bytes) - 1;
    if u64::from(load.max(run)) + last > u64::from(u32::MAX)
        || bytes.len() as u64 > u64::from(memory_bytes)
    {
        return Err(corrupt(format_args!(
            "the segment at {run:#010x} does not fit into 32 bits, or its sizes disagree"
        )));
    }
    let flags = header.p_flags(endian);
    let (writable, executable) = (flags.contains(PF_W), flags.contains(PF_X));
    Ok(Segment {
        load,
        run,
        bytes: bytes.to_vec(),
        memory_bytes,
        writable,
        executable,
    })
}

/// What files look like that are no ELF.
const LOOKS: [(&[u8], &str); 7] = [
    (
        b"!<arch>",
        "this is a library of object files; link it, or extract one",
    ),
    (
        b"UF2\n",
        "this is a UF2; the ELF it was made from is wanted",
    ),
    (
        b":",
        "this may be an Intel HEX file; the ELF it was made from is wanted",
    ),
    (
        b"S0",
        "this may be an S-record file; the ELF it was made from is wanted",
    ),
    (b"MZ", "this is a Windows program"),
    (b"\xcf\xfa\xed\xfe", "this is a macOS program"),
    (b"BC\xc0\xde", "this is LLVM bitcode; compile it first"),
];

fn check_ident(bytes: &[u8]) -> Result<(), ElfError> {
    if bytes.is_empty() {
        return Err(ElfError::NotElf("the file is empty"));
    }
    if !bytes.starts_with(b"\x7fELF") {
        let known = LOOKS
            .iter()
            .find(|(start, _)| bytes.starts_with(start))
            .map(|(_, looks)| *looks);
        let head = &bytes[..bytes.len().min(256)];
        let text = head
            .iter()
            .all(|b| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~' | 0x80..));
        let other = if text {
            "this is text"
        } else {
            "it does not begin with 0x7f ELF"
        };
        return Err(ElfError::NotElf(known.unwrap_or(other)));
    }
    match (bytes.get(4), bytes.get(5)) {
        (Some(2), _) => Err(ElfError::Wide),
        (_, Some(2)) => Err(ElfError::BigEndian),
        _ => Ok(()),
    }
}

fn machine_name(number: u16) -> String {
    const NAMES: [(u16, &str); 7] = [
        (3, "x86"),
        (8, "MIPS"),
        (20, "PowerPC"),
        (62, "x86-64"),
        (94, "Xtensa"),
        (183, "AArch64"),
        (243, "RISC-V"),
    ];
    let known = NAMES
        .iter()
        .find(|(n, _)| *n == number)
        .map(|(_, name)| (*name).to_string());
    known.unwrap_or_else(|| format!("machine {number}"))
}
