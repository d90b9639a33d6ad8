//! The bytes of an object as instructions: offset, encoding, cycles, text.
//!
//! Cycles are those of going straight on from the function's beginning, conditional branches not
//! taken: what a reader adds up along a line.

use super::Function;
use crate::image::{Fixup, Object, Section, SectionKind, SymbolKind, outcome};
use std::fmt::Write;
use whippen_isa::timing::{Core, Pipe};
use whippen_isa::{Inst, ItState, Op, decode};

/// All functions of an object, in the order of their sections and offsets.
pub(super) fn functions(object: &Object, core: &Core) -> Vec<Function> {
    let mut all = Vec::new();
    for (index, section) in object.sections.iter().enumerate() {
        if section.kind != SectionKind::Code {
            continue;
        }
        let mut symbols: Vec<_> = object
            .symbols
            .iter()
            .filter(|symbol| symbol.section == Some(index) && symbol.kind == SymbolKind::Function)
            .collect();
        symbols.sort_by_key(|symbol| symbol.offset);
        all.extend(symbols.into_iter().map(|symbol| Function {
            name: symbol.name.clone(),
            mode: None,
            cycles: None,
            text: lines(section, symbol.offset, symbol.offset + symbol.size, core),
        }));
    }
    all
}

/// The instructions between two offsets.
fn lines(section: &Section, from: u32, to: u32, core: &Core) -> String {
    let (mut text, mut pipe, mut it) = (String::new(), Pipe::default(), ItState::OUTSIDE);
    let mut at = from;
    while at < to {
        let half = |at: u32| {
            let bytes = section.bytes.get(at as usize..)?.first_chunk()?;
            Some(u16::from_le_bytes(*bytes))
        };
        let (first, second) = (half(at).unwrap_or(0), half(at + 2).unwrap_or(0));
        let Ok(inst) = decode(first, second, core.arch, it) else {
            let _ = writeln!(text, "{at:04x}  {first:04x}");
            at += 2;
            continue;
        };
        let (behind, cost) = core.issue(pipe, &core.prepare(&inst), at, &outcome(&inst, it));
        (pipe, it) = (behind, inst.it_behind(it).unwrap_or_default());
        let code = match inst.size() {
            4 => format!("{first:04x} {second:04x}"),
            _ => format!("{first:04x}"),
        };
        let target = target(section, &inst, at);
        let _ = writeln!(
            text,
            "{at:04x}  {code:9}  {:2}  {inst}{target}",
            cost.cycles()
        );
        at += inst.size();
    }
    text
}

/// Where a branch goes, or whose address is filled in.
fn target(section: &Section, inst: &Inst, at: u32) -> String {
    let filled = |fixup: &&Fixup| fixup.at == at;
    if let Some(fixup) = section.fixups.iter().find(filled) {
        return format!(" ; {}", fixup.symbol);
    }
    match inst.op() {
        Op::B => format!(
            " ; {:04x}",
            at.wrapping_add(4).wrapping_add_signed(inst.offset())
        ),
        _ => String::new(),
    }
}
