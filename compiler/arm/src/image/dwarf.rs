//! What a debugger wants to know: which line each instruction belongs to, where functions begin and
//! end, how their frames unwind, and what their variables are.
//!
//! DWARF 4, by `gimli`. File names are as they were given to the command, relative to `.`, so the
//! same program gives the same bytes wherever it is built.

mod frames;
mod variables;
mod writer;

use std::collections::BTreeMap;

use gimli::constants::{
    DW_AT_decl_file, DW_AT_decl_line, DW_AT_external, DW_AT_high_pc, DW_AT_language, DW_AT_low_pc,
    DW_AT_name, DW_AT_producer, DW_AT_ranges, DW_AT_stmt_list, DW_LANG_C99, DW_TAG_subprogram,
};
use gimli::write::{
    Address, AttributeValue, DwarfUnit, FileId, LineProgram, LineString, Range, RangeList,
    Sections, UnitEntryId,
};
use gimli::{Encoding, Format, LineEncoding};

use super::flow::Flow;
use super::lines::Place;
use super::unwind::Row;
use super::variables::Variables;
use variables::{ModeCode, Types};
use writer::{DebugWriter, taken};

/// How code and frames are written.
const ENCODING: Encoding = Encoding {
    format: Format::Dwarf32,
    version: 4,
    address_size: 4,
};

/// A section of code.
#[derive(Debug, Clone)]
pub(super) struct Code {
    /// Its index.
    pub section: usize,
    /// Its address among the rows of [`sections`].
    pub base: u32,
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

/// What is told about some code.
#[derive(Debug)]
pub(super) struct Described<'a> {
    pub code: &'a [Code],
    pub flow: &'a Flow<'a>,
    /// How frames unwind.
    pub rows: &'a [Row],
    /// Variables, and the section and offset of their state.
    pub variables: Vec<(&'a Variables, (usize, u32))>,
}

/// Everything about some code: how its frames unwind and, where some of its lines are known, lines,
/// functions and variables.
pub(super) fn sections(program: &Described) -> Vec<Debug> {
    let mut sections = Sections::new(DebugWriter::default());
    let lines = program.code.iter().flat_map(|code| &code.lines);
    let mut places = lines.filter_map(|(_, place)| place.as_ref());
    let unit = places.next().map(|first| {
        let mut unit = DebugUnit::new(&name(&first.file));
        for (own, state) in &program.variables {
            variables::add_state(&mut unit.dwarf.unit, &mut unit.types, own, *state);
        }
        program.code.iter().for_each(|code| unit.add(program, code));
        unit
    });
    // The writer refuses only what could not be spelled, such as a name with a zero byte; then
    // there is nothing.
    let written = unit.map_or(Ok(()), |unit| unit.write(&mut sections));
    let frames = frames::table(program.code, program.rows);
    let written = written.and_then(|()| frames.write_debug_frame(&mut sections.debug_frame));
    written.and_then(|()| taken(&sections)).unwrap_or_default()
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
    types: Types,
}

impl DebugUnit {
    fn new(file: &[u8]) -> DebugUnit {
        let mut dwarf = DwarfUnit::new(ENCODING);
        let line = LineEncoding {
            minimum_instruction_length: 2,
            ..LineEncoding::default()
        };
        let string = |text: &[u8]| LineString::String(text.to_vec());
        dwarf.unit.line_program =
            LineProgram::new(ENCODING, line, string(b"."), None, string(file), None);
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
            types: Types::default(),
        }
    }

    fn file(&mut self, file: &str) -> FileId {
        let program = &mut self.dwarf.unit.line_program;
        *self.files.entry(file.to_string()).or_insert_with(|| {
            let directory = program.default_directory();
            program.add_file(LineString::String(name(file)), directory, None)
        })
    }

    fn add(&mut self, program: &Described, code: &Code) {
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
            let entry = self.function(code, function, *at, size);
            let mode = program
                .variables
                .iter()
                .find_map(|(own, _)| Some((*own, own.mode(function)?)));
            if let Some((own, mode)) = mode {
                let of = ModeCode {
                    own,
                    mode,
                    code,
                    range: (*at, size),
                };
                let unit = &mut self.dwarf.unit;
                variables::add_locals(unit, &mut self.types, program, &of, entry);
            }
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

    fn function(&mut self, code: &Code, function: &str, at: u32, size: u32) -> UnitEntryId {
        let place = code
            .lines
            .iter()
            .rev()
            .find(|(offset, _)| *offset <= at)
            .and_then(|(_, place)| place.clone());
        let file = place.as_ref().map(|place| self.file(&place.file));
        let unit = &mut self.dwarf.unit;
        let id = unit.add(unit.root(), DW_TAG_subprogram);
        let entry = unit.get_mut(id);
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
        id
    }

    fn write(mut self, sections: &mut Sections<DebugWriter>) -> gimli::write::Result<()> {
        let unit = &mut self.dwarf.unit;
        let ranges = unit.ranges.add(RangeList(self.ranges));
        unit.get_mut(unit.root())
            .set(DW_AT_ranges, AttributeValue::RangeListRef(ranges));
        self.dwarf.write(sections)
    }
}
