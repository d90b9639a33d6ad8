//! ELF files: an executable for debuggers and flash programmers, a relocatable file for linkers.
//!
//! ```text
//!   header | program headers | sections .. | .debug_* | .rel.* | .symtab .strtab .ARM.attributes .shstrtab | section headers
//! ```
//!
//! The container is in `file`; here is what goes in.

mod attributes;
mod file;
mod symbols;

use whippen_isa::Arch;

use super::dwarf::{self, Code, Debug, To};
use super::fixup::{FixupError, put_addend};
use super::flow;
use super::lines::Place;
use super::linked::{Image, Linked};
use super::object::{Object, Section, SectionKind};
use super::unwind;
use super::variables::Variables;
use file::{File, Part};
use symbols::{Entry, Symbols};

const R_ARM_ABS32: u32 = 2;

/// The section of the note that says what is not proven of an image.
const UNPROVEN_SECTION: &str = ".note.whippen";
/// The section of the certificate (`whippen-audit` reads it).
const CERTIFICATE_SECTION: &str = ".whippen.certificate";
/// The section with the text of the Kernels that it is of.
const KERNELS_SECTION: &str = ".whippen.kernels";
/// Who writes the note.
const NOTE_OWNER: &str = "Whippen";
/// A note of this kind says what is not proven.
const NOTE_UNPROVEN: u32 = 0x100;

/// An image as an executable, with its symbols, lines and variables.
#[derive(Debug)]
pub struct Executable<'a> {
    image: &'a Image,
    /// Names and bytes of the sections for debuggers.
    debug: Vec<(&'static str, Vec<u8>)>,
}

impl<'a> Executable<'a> {
    /// An image whose keys have such variables.
    pub fn new(image: &'a Image, variables: &[Variables]) -> Executable<'a> {
        let code: Vec<Code> = (0..image.sections.len())
            .filter_map(|index| linked_code(image, index))
            .collect();
        let flow = flow::of_image(image);
        let state = |name: &str| {
            let symbol = image.symbols.iter().find(|symbol| symbol.name == name)?;
            let section = symbol.section?;
            Some((section, symbol.address - image.sections[section].run))
        };
        let program = dwarf::Described {
            code: &code,
            flow: &flow,
            rows: &unwind::rows(&flow),
            variables: placed(variables, state),
        };
        let address = |to: &To| match to {
            To::Code(index) => image.sections[*index].run,
            To::Debug(_) => 0,
        };
        let debug = dwarf::sections(&program).into_iter();
        Executable {
            image,
            debug: debug
                .map(|section| (section.name, section.filled(address)))
                .collect(),
        }
    }

    /// What is loaded alone, for programs and not for debuggers.
    pub fn bare(image: &'a Image) -> Executable<'a> {
        Executable {
            image,
            debug: Vec::new(),
        }
    }

    /// The file; one that is not proven to be in time has a note that says why.
    pub fn file(self, unproven: Option<&str>) -> Vec<u8> {
        let note = |why| Part::note(UNPROVEN_SECTION, NOTE_OWNER, NOTE_UNPROVEN, why);
        self.with(unproven.map(note))
    }

    /// The file with a certificate and the Kernels that it is of, as texts in sections that are
    /// not loaded.
    pub fn certified(self, certificate: &str, kernels: &str) -> Vec<u8> {
        self.with([
            Part::debug(CERTIFICATE_SECTION, certificate.into()),
            Part::debug(KERNELS_SECTION, kernels.into()),
        ])
    }

    fn with(self, more: impl IntoIterator<Item = Part>) -> Vec<u8> {
        let image = self.image;
        let mut file = File::new(Some(image.entry | 1));
        for Linked {
            name,
            kind,
            bytes,
            size,
            run,
            ..
        } in &image.sections
        {
            file.add(Part::of(name, *kind, bytes.clone(), *size).at(*run));
        }
        image
            .segments
            .iter()
            .for_each(|segment| file.segment(segment));
        for (name, bytes) in self.debug {
            file.add(Part::debug(name, bytes));
        }
        more.into_iter().for_each(|part| file.add(part));
        let mut symbols = Symbols::new(file.parts());
        symbols.add(image_symbols(image));
        file.finish(&symbols, &attributes::section(image.arch, true))
    }
}

/// The file of an image, with what debuggers want.
pub fn executable(image: &Image, variables: &[Variables], unproven: Option<&str>) -> Vec<u8> {
    Executable::new(image, variables).file(unproven)
}

/// What an image names.
fn image_symbols(image: &Image) -> Vec<Entry> {
    let named = image.symbols.iter().map(|symbol| Entry {
        name: symbol.name.clone(),
        value: symbol.address,
        size: symbol.size,
        kind: symbol.kind,
        global: symbol.global,
        place: symbol.section.map_or(symbols::ABSOLUTE, file::number),
    });
    named.collect()
}

/// An object as a relocatable file, its lines and variables included.
///
/// # Errors
/// A fixup that leaves its section, or whose addend does not fit its place.
pub fn relocatable(
    object: &Object,
    arch: Arch,
    places: &[Place],
    variables: &[Variables],
) -> Result<Vec<u8>, FixupError> {
    let mut file = File::new(None);
    for section in &object.sections {
        let mut bytes = section.bytes.clone();
        section
            .fixups
            .iter()
            .try_for_each(|f| put_addend(&mut bytes, f.at, f.kind, f.addend))?;
        file.add(Part::of(&section.name, section.kind, bytes, section.size).aligned(section.align));
    }
    let code: Vec<Code> = (0..object.sections.len())
        .filter_map(|index| object_code(object, index, places))
        .collect();
    let flow = flow::of_object(object, arch);
    let state = |name: &str| {
        let symbol = object.symbols.iter().find(|symbol| symbol.name == name)?;
        Some((symbol.section?, symbol.offset))
    };
    let debug = dwarf::sections(&dwarf::Described {
        code: &code,
        flow: &flow,
        rows: &unwind::rows(&flow),
        variables: placed(variables, state),
    });
    for section in &debug {
        file.add(Part::debug(section.name, section.filled(|_| 0)));
    }
    let mut symbols = Symbols::new(file.parts());
    symbols.add(object_symbols(object));
    for (index, section) in object.sections.iter().enumerate() {
        let entry =
            |f: &super::object::Fixup| (f.at, symbols.number(&f.symbol), f.kind.elf_number());
        file.relocations(
            file::number(index),
            section.fixups.iter().map(entry).collect(),
        );
    }
    for (index, section) in debug.iter().enumerate() {
        // A section's symbol has the section's number.
        let first = object.sections.len();
        let number = |to: &To| match to {
            To::Code(index) => file::number(*index),
            To::Debug(name) => {
                file::number(first + debug.iter().position(|d| d.name == *name).unwrap_or(0))
            }
        };
        let entry = |hole: &dwarf::Hole| (hole.at, u32::from(number(&hole.to)), R_ARM_ABS32);
        file.relocations(
            file::number(first + index),
            section.holes.iter().map(entry).collect(),
        );
    }
    Ok(file.finish(&symbols, &attributes::section(arch, false)))
}

/// Variables whose state is somewhere.
fn placed(
    all: &[Variables],
    place: impl Fn(&str) -> Option<(usize, u32)>,
) -> Vec<(&Variables, (usize, u32))> {
    let own = all.iter();
    own.filter_map(|own| Some((own, place(&format!("{}_state", own.name))?)))
        .collect()
}

/// What an object defines and what it wants.
fn object_symbols(object: &Object) -> Vec<Entry> {
    let entry = |symbol: &super::object::Symbol| Entry {
        name: symbol.name.clone(),
        value: symbol.offset,
        size: symbol.size,
        kind: symbol.kind,
        global: symbol.global || symbol.section.is_none(),
        place: symbol.section.map_or(symbols::UNDEFINED, file::number),
    };
    let mut entries: Vec<Entry> = object.symbols.iter().map(entry).collect();
    for fixup in object.sections.iter().flat_map(|section| &section.fixups) {
        if entries.iter().all(|entry| entry.name != fixup.symbol) {
            entries.push(Entry::undefined(&fixup.symbol));
        }
    }
    entries
}

fn linked_code(image: &Image, index: usize) -> Option<Code> {
    let section = &image.sections[index];
    let inside = image
        .symbols
        .iter()
        .filter(|symbol| symbol.section == Some(index));
    let functions = inside.filter(|symbol| symbol.kind == super::object::SymbolKind::Function);
    let functions = functions
        .map(|f| (f.name.clone(), f.address - section.run, f.size))
        .collect();
    let lines = section
        .lines
        .iter()
        .map(|(address, place)| (address - section.run, place.clone()))
        .collect();
    (section.kind == SectionKind::Code).then_some(Code {
        section: index,
        base: section.run,
        size: section.size,
        functions,
        lines,
    })
}

fn object_code(object: &Object, index: usize, places: &[Place]) -> Option<Code> {
    let Section {
        kind,
        size,
        ref lines,
        ..
    } = object.sections[index];
    let inside = object
        .symbols
        .iter()
        .filter(|symbol| symbol.section == Some(index));
    let functions = inside.filter(|symbol| symbol.kind == super::object::SymbolKind::Function);
    let functions = functions
        .map(|f| (f.name.clone(), f.offset, f.size))
        .collect();
    let place = |origin: Option<u32>| origin.and_then(|o| places.get(o as usize)).cloned();
    let lines = lines
        .iter()
        .map(|row| (row.at, place(row.origin)))
        .collect();
    (kind == SectionKind::Code).then_some(Code {
        section: index,
        base: flow::base(index),
        size,
        functions,
        lines,
    })
}

impl Debug {
    /// Its bytes, where code begins at `address` and other sections for debuggers at 0.
    fn filled(&self, address: impl Fn(&To) -> u32) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        for hole in &self.holes {
            let at = hole.at as usize;
            let value = address(&hole.to).wrapping_add(hole.addend);
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        bytes
    }
}
