//! The object of a core's keys: sections and symbols of their code, state, histories, events and
//! tables.

use super::emit::Bytes;
use super::literal::Literals;
use super::memory::{Memory, memory};
use super::state_layout::{Ring, StateLayout};
use super::{Options, ThumbError, names};
use crate::asm::{Source, assemble};
use crate::image::{Object, Section, SectionKind, Symbol, SymbolKind};
use std::collections::BTreeMap;
use whippen_isa::Arch;
use whippen_kernel::{Kernel, Table};

/// Sections and symbols of code and memory.
pub(super) fn assemble_object(
    kernel: &Kernel,
    layout: &StateLayout,
    options: &Options,
    literals: &Literals,
    code: Bytes,
) -> Object {
    let name = &options.name;
    let mut object = code_object(name, code);
    let [mut state, histories] = memory(kernel, layout);
    state.literals(layout, literals, name);
    state.modes(layout, name);
    if let Some(at) = layout.apart {
        state.address(at, names::histories(name));
        if layout.ring.is_some() {
            state.address(at + 4, names::events(name));
        }
    }
    let section = format!(".data.{name}");
    add_data(&mut object, names::state(name), filled(section, state));
    if layout.apart.is_some() {
        let section = format!(".data.{name}.histories");
        let section = filled(section, histories);
        add_data(&mut object, names::histories(name), section);
        if let Some(ring) = &layout.ring {
            add_data(&mut object, names::events(name), event_ring(name, ring));
        }
    }
    for (index, table) in kernel.tables.iter().enumerate() {
        add_table(&mut object, name, index, table);
    }
    object
}

/// The object with its first section, the code.
fn code_object(name: &str, code: Bytes) -> Object {
    let section = Section {
        name: format!(".text.{name}"),
        kind: SectionKind::Code,
        align: 4,
        size: code.bytes.len() as u32,
        bytes: code.bytes,
        fixups: code.fixups,
        lines: code.lines,
        hints: code.hints,
    };
    Object {
        sections: vec![section],
        symbols: code.symbols,
    }
}

/// Adds a section of code that is written as text, with the labels that get a name.
pub(super) fn append_code(
    object: &mut Object,
    section: String,
    arch: Arch,
    text: &str,
    name: impl Fn(&str) -> Option<String>,
) -> Result<(), ThumbError> {
    let source = Source {
        name: "routines.s",
        text,
    };
    let routines =
        assemble(&[source], &BTreeMap::new(), arch).map_err(|e| ThumbError::Bug(e.to_string()))?;
    let own = object.sections.len();
    for symbol in routines.symbols {
        if let Some(name) = name(&symbol.name) {
            object.symbols.push(Symbol {
                name,
                section: Some(own),
                ..symbol
            });
        }
    }
    let is_code = |section: &Section| section.kind == SectionKind::Code && section.size != 0;
    let code = routines.sections.into_iter().find(is_code);
    object.sections.extend(code.map(|code| Section {
        name: section,
        ..code
    }));
    Ok(())
}

/// Adds a section of data, and the global symbol of all of it.
fn add_data(object: &mut Object, symbol: String, section: Section) {
    object.symbols.push(Symbol {
        name: symbol,
        section: Some(object.sections.len()),
        offset: 0,
        size: section.size,
        kind: SymbolKind::Data,
        global: true,
    });
    object.sections.push(section);
}

/// Adds a table, whose symbol is the object's own.
fn add_table(object: &mut Object, name: &str, index: usize, table: &Table) {
    let bytes = table.values.iter().flat_map(|word| word.to_le_bytes());
    let memory = Memory {
        bytes: bytes.collect(),
        fixups: Vec::new(),
    };
    let section = Section {
        kind: SectionKind::Constant,
        ..filled(format!(".rodata.{name}.{index}"), memory)
    };
    add_data(object, names::table(name, index as u32), section);
    if let Some(symbol) = object.symbols.last_mut() {
        symbol.global = false;
    }
}

/// Room for events, zero at first.
fn event_ring(name: &str, ring: &Ring) -> Section {
    let empty = Memory {
        bytes: Vec::new(),
        fixups: Vec::new(),
    };
    Section {
        kind: SectionKind::Zeroed,
        size: ring.size(),
        ..filled(format!(".bss.{name}.events"), empty)
    }
}

/// A section of data that is filled, at words.
fn filled(name: String, memory: Memory) -> Section {
    Section {
        name,
        kind: SectionKind::Data,
        align: 4,
        size: memory.bytes.len() as u32,
        bytes: memory.bytes,
        fixups: memory.fixups,
        lines: Vec::new(),
        hints: Vec::new(),
    }
}
