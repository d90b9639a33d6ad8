//! What a debugger wants to know: which line each instruction belongs to, and where functions begin
//! and end.
//!
//! DWARF 4, by `gimli`. File names are as they were given to the command, relative to `.`, so the
//! same program gives the same bytes wherever it is built.

use std::collections::BTreeMap;

use gimli::constants::{
    DW_AT_decl_file, DW_AT_decl_line, DW_AT_external, DW_AT_high_pc, DW_AT_language, DW_AT_low_pc,
    DW_AT_name, DW_AT_producer, DW_AT_ranges, DW_AT_stmt_list, DW_LANG_C99, DW_TAG_subprogram,
};
use gimli::write::{
    Address, AttributeValue, DwarfUnit, EndianVec, FileId, LineProgram, LineString, Range,
    RangeList, RelocateWriter, Relocation, RelocationTarget, Sections,
};
use gimli::{Encoding, Format, LineEncoding, LittleEndian};

use super::lines::Place;

/// A section of code.
#[derive(Debug, Clone)]
pub(super) struct Code {
    /// Its index.
    pub section: usize,
    /// Its size in bytes.
    pub size: u32,
    /// Functions: name, offset, size.
    pub functions: Vec<(String, u32, u32)>,
    /// From an offset on, code belongs to a place.
    pub lines: Vec<(u32, Option<Place>)>,
}

/// What an address in a section for debuggers is relative to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum To {
    /// The section of code with this index.
    Code(usize),
    /// Another section for debuggers.
    Debug(&'static str),
}

/// A word to be filled in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Hole {
    /// Its offset.
    pub at: u32,
    /// What it is relative to.
    pub to: To,
    /// Added to that.
    pub addend: u32,
}

/// A section for debuggers.
#[derive(Debug, Clone)]
pub(super) struct Debug {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    pub holes: Vec<Hole>,
}

/// Everything about some code; nothing where no line of it is known.
pub(super) fn sections(code: &[Code]) -> Vec<Debug> {
    let mut places = code
        .iter()
        .flat_map(|code| &code.lines)
        .filter_map(|(_, place)| place.as_ref());
    let Some(first) = places.next() else {
        return Vec::new();
    };
    let mut unit = DebugUnit::new(&name(&first.file));
    code.iter().for_each(|code| unit.add(code));
    // The writer refuses only what could not be spelled, such as a name with a zero byte; then
    // there is nothing.
    unit.written().unwrap_or_default()
}

/// A file's name as DWARF can hold it: not empty, without zero bytes.
fn name(file: &str) -> Vec<u8> {
    let kept: Vec<u8> = file.bytes().filter(|byte| *byte != 0).collect();
    if kept.is_empty() { b"?".to_vec() } else { kept }
}

struct DebugUnit {
    dwarf: DwarfUnit,
    files: BTreeMap<String, FileId>,
    ranges: Vec<Range>,
}

impl DebugUnit {
    fn new(file: &[u8]) -> DebugUnit {
        let encoding = Encoding {
            format: Format::Dwarf32,
            version: 4,
            address_size: 4,
        };
        let mut dwarf = DwarfUnit::new(encoding);
        let line = LineEncoding {
            minimum_instruction_length: 2,
            ..LineEncoding::default()
        };
        let string = |text: &[u8]| LineString::String(text.to_vec());
        dwarf.unit.line_program =
            LineProgram::new(encoding, line, string(b"."), None, string(file), None);
        let root = dwarf.unit.get_mut(dwarf.unit.root());
        root.set(DW_AT_producer, AttributeValue::String(b"Whippen".to_vec()));
        root.set(DW_AT_language, AttributeValue::Language(DW_LANG_C99));
        root.set(DW_AT_name, AttributeValue::String(file.to_vec()));
        root.set(DW_AT_stmt_list, AttributeValue::LineProgramRef);
        root.set(DW_AT_low_pc, AttributeValue::Address(Address::Constant(0)));
        DebugUnit {
            dwarf,
            files: BTreeMap::new(),
            ranges: Vec::new(),
        }
    }

    fn file(&mut self, file: &str) -> FileId {
        let program = &mut self.dwarf.unit.line_program;
        *self.files.entry(file.to_string()).or_insert_with(|| {
            let directory = program.default_directory();
            program.add_file(LineString::String(name(file)), directory, None)
        })
    }

    fn add(&mut self, code: &Code) {
        if code.lines.iter().all(|(_, place)| place.is_none()) {
            return;
        }
        let begin = Address::Symbol {
            symbol: code.section,
            addend: 0,
        };
        self.ranges.push(Range::StartLength {
            begin,
            length: u64::from(code.size),
        });
        self.rows(code, begin);
        for (function, at, size) in &code.functions {
            // A function without a size ends where the next begins.
            let next = code
                .functions
                .iter()
                .map(|other| other.1)
                .filter(|next| next > at)
                .min();
            let size = if *size == 0 {
                next.unwrap_or(code.size) - at
            } else {
                *size
            };
            self.function(code, function, *at, size);
        }
    }

    fn rows(&mut self, code: &Code, begin: Address) {
        self.dwarf.unit.line_program.begin_sequence(Some(begin));
        let mut last = None;
        for (at, place) in &code.lines {
            let row = match place {
                Some(place) => (self.file(&place.file), u64::from(place.line)),
                None => (self.last_file(), 0),
            };
            if last == Some(row) {
                continue;
            }
            last = Some(row);
            let program = &mut self.dwarf.unit.line_program;
            program.row().address_offset = u64::from(*at);
            (program.row().file, program.row().line) = row;
            program.generate_row();
        }
        self.dwarf
            .unit
            .line_program
            .end_sequence(u64::from(code.size));
    }

    /// Some file: a row of nobody needs one.
    fn last_file(&mut self) -> FileId {
        match self.files.values().next() {
            Some(file) => *file,
            None => self.file("?"),
        }
    }

    fn function(&mut self, code: &Code, function: &str, at: u32, size: u32) {
        let place = code
            .lines
            .iter()
            .rev()
            .find(|(offset, _)| *offset <= at)
            .and_then(|(_, place)| place.clone());
        let file = place.as_ref().map(|place| self.file(&place.file));
        let unit = &mut self.dwarf.unit;
        let entry = unit.add(unit.root(), DW_TAG_subprogram);
        let entry = unit.get_mut(entry);
        entry.set(DW_AT_name, AttributeValue::String(name(function)));
        entry.set(DW_AT_external, AttributeValue::Flag(true));
        let low = Address::Symbol {
            symbol: code.section,
            addend: i64::from(at),
        };
        entry.set(DW_AT_low_pc, AttributeValue::Address(low));
        entry.set(DW_AT_high_pc, AttributeValue::Udata(u64::from(size)));
        if let (Some(file), Some(place)) = (file, place) {
            entry.set(DW_AT_decl_file, AttributeValue::FileIndex(Some(file)));
            entry.set(
                DW_AT_decl_line,
                AttributeValue::Udata(u64::from(place.line)),
            );
        }
    }

    fn written(mut self) -> gimli::write::Result<Vec<Debug>> {
        let unit = &mut self.dwarf.unit;
        let ranges = unit.ranges.add(RangeList(self.ranges));
        unit.get_mut(unit.root())
            .set(DW_AT_ranges, AttributeValue::RangeListRef(ranges));
        let mut sections = Sections::new(DebugWriter::default());
        self.dwarf.write(&mut sections)?;
        let mut out = Vec::new();
        sections.for_each(|id, writer| {
            if !writer.bytes.slice().is_empty() {
                out.push(Debug {
                    name: id.name(),
                    bytes: writer.bytes.slice().to_vec(),
                    holes: writer.holes.clone(),
                });
            }
            gimli::write::Result::Ok(())
        })?;
        Ok(out)
    }
}

/// Bytes and holes.
#[derive(Debug, Clone)]
struct DebugWriter {
    bytes: EndianVec<LittleEndian>,
    holes: Vec<Hole>,
}

impl Default for DebugWriter {
    fn default() -> DebugWriter {
        DebugWriter {
            bytes: EndianVec::new(LittleEndian),
            holes: Vec::new(),
        }
    }
}

impl RelocateWriter for DebugWriter {
    type Writer = EndianVec<LittleEndian>;

    fn writer(&self) -> &Self::Writer {
        &self.bytes
    }

    fn writer_mut(&mut self) -> &mut Self::Writer {
        &mut self.bytes
    }

    fn relocate(&mut self, relocation: Relocation) {
        let to = match relocation.target {
            RelocationTarget::Symbol(section) => To::Code(section),
            RelocationTarget::Section(id) => To::Debug(id.name()),
        };
        self.holes.push(Hole {
            at: relocation.offset as u32,
            to,
            addend: relocation.addend as u32,
        });
    }
}
