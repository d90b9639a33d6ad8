//! The object of a core's keys: sections and symbols of their code, state, histories, events and
//! tables.

use super::emit::Bytes;
use super::literal::Literals;
use super::memory::memory;
use super::state_layout::StateLayout;
use super::{Options, names};
use crate::image::{Fixup, Object, Section, SectionKind, Symbol, SymbolKind};
use whippen_kernel::Kernel;

/// Sections and symbols of code and memory.
pub(super) fn object(
    kernel: &Kernel,
    layout: &StateLayout,
    options: &Options,
    literals: &Literals,
    code: Bytes,
) -> Object {
    let name = &options.name;
    let mut object = Object {
        sections: Vec::new(),
        symbols: code.symbols,
    };
    object.sections.push(Section {
        name: format!(".text.{name}"),
        kind: SectionKind::Code,
        align: 4,
        size: code.bytes.len() as u32,
        bytes: code.bytes,
        fixups: code.fixups,
        lines: code.lines,
        hints: code.hints,
    });
    let [mut state, histories] = memory(kernel, layout);
    state.literals(layout, literals, name);
    state.modes(layout, name);
    if let Some(at) = layout.apart {
        state.address(at, names::histories(name));
        if layout.ring.is_some() {
            state.address(at + 4, names::events(name));
        }
    }
    let symbol = |name, section, size| Symbol {
        name,
        section: Some(section),
        offset: 0,
        size,
        kind: SymbolKind::Data,
        global: true,
    };
    object
        .symbols
        .push(symbol(names::state(name), 1, layout.size));
    object.sections.push(data(
        format!(".data.{name}"),
        SectionKind::Data,
        state.bytes,
        state.fixups,
    ));
    if layout.apart.is_some() {
        object
            .symbols
            .push(symbol(names::histories(name), 2, layout.size_apart));
        let section = format!(".data.{name}.histories");
        object.sections.push(data(
            section,
            SectionKind::Data,
            histories.bytes,
            histories.fixups,
        ));
        if let Some(ring) = layout.ring {
            object.symbols.push(symbol(
                names::events(name),
                object.sections.len(),
                ring.size(),
            ));
            let zeroed = data(
                format!(".bss.{name}.events"),
                SectionKind::Zeroed,
                Vec::new(),
                Vec::new(),
            );
            object.sections.push(Section {
                size: ring.size(),
                ..zeroed
            });
        }
    }
    for (index, table) in kernel.tables.iter().enumerate() {
        let bytes: Vec<u8> = table
            .values
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let (section, table) = (object.sections.len(), names::table(name, index as u32));
        object.symbols.push(Symbol {
            global: false,
            ..symbol(table, section, bytes.len() as u32)
        });
        object.sections.push(data(
            format!(".rodata.{name}.{index}"),
            SectionKind::Constant,
            bytes,
            Vec::new(),
        ));
    }
    object
}

/// A section of data, at words.
fn data(name: String, kind: SectionKind, bytes: Vec<u8>, fixups: Vec<Fixup>) -> Section {
    Section {
        name,
        kind,
        align: 4,
        size: bytes.len() as u32,
        bytes,
        fixups,
        lines: Vec::new(),
        hints: Vec::new(),
    }
}
