//! What the linker itself adds to an image: the start block of the chip, and the tables by which
//! start-up copies and clears memory.

use super::super::boot::{IMAGE_DEF, checked_boot2};
use super::super::object::{Object, Section, SectionKind, Symbol, SymbolKind};
use super::{Input, LinkError};
use whippen_board::{Board, MemoryKind, Start};

/// What the linker itself adds: the chip's start block, and room for the tables of the start-up
/// routine.
pub(super) fn start_object(board: &Board, inputs: &[Input]) -> Result<Object, LinkError> {
    let mut object = Object::default();
    let section = |name: &str, bytes: Vec<u8>| Section {
        name: name.to_string(),
        kind: SectionKind::Constant,
        align: 4,
        size: bytes.len() as u32,
        bytes,
        fixups: Vec::new(),
        lines: Vec::new(),
        hints: Vec::new(),
    };
    if board.start == Start::ImageDef {
        let bytes = IMAGE_DEF
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect();
        object.sections.push(section(".image_def", bytes));
    }
    let boot2 = inputs
        .iter()
        .flat_map(|input| &input.object.sections)
        .find(|section| section.name == ".boot2");
    if board.start == Start::Boot2
        && boot2.is_none_or(|section| checked_boot2(&section.bytes).is_none())
    {
        return Err(LinkError::Boot2);
    }
    // One entry for each memory, whether or not it is used.
    let rams = board
        .memory
        .iter()
        .filter(|memory| memory.kind == MemoryKind::Ram)
        .count();
    for (name, words) in [("copy", 3), ("zero", 2)] {
        let bytes = vec![0; 4 * words * rams];
        let index = object.sections.len();
        for (end, offset) in [("start", 0), ("end", bytes.len() as u32)] {
            let name = format!("__{name}_table_{end}");
            let kind = SymbolKind::Data;
            object.symbols.push(Symbol {
                name,
                section: Some(index),
                offset,
                size: 0,
                kind,
                global: true,
            });
        }
        object
            .sections
            .push(section(&format!(".{name}_table"), bytes));
    }
    Ok(object)
}
