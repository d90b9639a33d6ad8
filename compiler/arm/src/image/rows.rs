//! The code of an image as a table: a row for each instruction, with the line it is made for.
//!
//! Not here: its cycles, which depend on how one comes there (`listing` counts them going straight
//! on, an emulator as it goes).

use whippen_isa::{ItState, decode};

use super::lines::Place;
use super::linked::{Image, Linked, Named};
use super::listing::target;
use super::object::{SectionKind, SymbolKind};

/// An instruction where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeRow {
    /// Its address when the program runs.
    pub address: u32,
    /// It in words, with the name of where a branch goes.
    pub text: String,
    /// The function it is in, if it has a name.
    pub function: Option<String>,
    /// The line of source it is made for, if there is one.
    pub place: Option<Place>,
}

/// All instructions of an image, by section and address.
pub fn code_rows(image: &Image) -> Vec<CodeRow> {
    let sections = image.sections.iter().enumerate();
    let of_code = sections.filter(|(_, section)| section.kind == SectionKind::Code);
    of_code
        .flat_map(|(index, section)| rows_of(image, index, section))
        .collect()
}

fn rows_of(image: &Image, index: usize, section: &Linked) -> Vec<CodeRow> {
    let symbols = image.symbols.iter();
    let own: Vec<&Named> = symbols
        .filter(|symbol| symbol.section == Some(index))
        .collect();
    let (mut rows, mut it, mut is_data) = (Vec::new(), ItState::OUTSIDE, false);
    let mut function: Option<&Named> = None;
    let mut at = 0;
    while at + 2 <= section.bytes.len() {
        let address = section.run + at as u32;
        for symbol in own.iter().filter(|symbol| symbol.address == address) {
            match symbol.name.as_bytes() {
                [b'$', b'd', ..] => is_data = true,
                [b'$', b't', ..] => is_data = false,
                _ if symbol.kind == SymbolKind::Function => {
                    (function, it) = (Some(*symbol), ItState::OUTSIDE);
                }
                _ => {}
            }
        }
        let half = |at: usize| {
            let two = section.bytes.get(at..at + 2);
            two.map_or(0, |two| u16::from_le_bytes([two[0], two[1]]))
        };
        let read = decode(half(at), half(at + 2), image.arch, it);
        let Some(inst) = read.ok().filter(|_| !is_data) else {
            at += 2;
            continue;
        };
        let line = section.lines.partition_point(|(from, _)| *from <= address);
        let line = line.checked_sub(1).map(|line| &section.lines[line]);
        let inside = function.filter(|own| address - own.address < own.size.max(1));
        rows.push(CodeRow {
            address,
            text: format!("{inst}{}", target(image, &inst, address)),
            function: inside.map(|own| own.name.clone()),
            place: line.and_then(|(_, place)| place.clone()),
        });
        it = inst.it_behind(it).unwrap_or_default();
        at += inst.size() as usize;
    }
    rows
}
