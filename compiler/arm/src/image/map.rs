//! The map: how full each memory is, what lies where, and what a key costs.

use std::fmt::Write;

use super::linked::{Image, Linked};
use super::listing::arch_name;
use super::object::{SectionKind, SymbolKind};
use whippen_board::{Board, MemoryKind};

/// The map of an image on its board.
pub fn map(image: &Image, board: &Board) -> String {
    let mut text = String::new();
    let mhz = f64::from(board.clock_hz) / 1e6;
    let _ = writeln!(
        text,
        "{}: {} cores, {}, {mhz} MHz",
        board.name,
        board.cores,
        arch_name(board.arch)
    );
    let _ = writeln!(text, "entry {:08x}\n", image.entry);
    memory(&mut text, image, board);
    sections(&mut text, image);
    symbols(&mut text, image);
    text
}

fn memory(text: &mut String, image: &Image, board: &Board) {
    let _ = writeln!(
        text,
        "{:12} {:>8} {:>9} {:>9} {:>9}",
        "memory", "base", "bytes", "used", "free"
    );
    for memory in &board.memory {
        let run = image
            .sections
            .iter()
            .filter(|s| s.memory == memory.name)
            .map(|s| s.run + s.size - memory.base)
            .max();
        let inside = |load: u32| load.wrapping_sub(memory.base) < memory.size;
        let stored = image
            .segments
            .iter()
            .filter(|s| inside(s.load) && memory.kind == MemoryKind::Flash);
        let stored = stored
            .map(|s| s.load - memory.base + s.bytes.len() as u32)
            .max();
        let used = run.max(stored).unwrap_or(0);
        let _ = writeln!(
            text,
            "{:12} {:08x} {:9} {used:9} {:9}",
            memory.name,
            memory.base,
            memory.size,
            memory.size.saturating_sub(used)
        );
    }
}

fn sections(text: &mut String, image: &Image) {
    let _ = writeln!(
        text,
        "\n{:8} {:8} {:>9}  {:8}  section",
        "runs at", "stored", "bytes", "what"
    );
    for Linked {
        name,
        kind,
        run,
        load,
        size,
        ..
    } in &image.sections
    {
        let what = match kind {
            SectionKind::Code => "code",
            SectionKind::Constant => "constant",
            SectionKind::Data => "data",
            SectionKind::Zeroed => "zeroed",
        };
        let stored = if *kind == SectionKind::Zeroed {
            String::new()
        } else {
            format!("{load:08x}")
        };
        let _ = writeln!(text, "{run:08x} {stored:8} {size:9}  {what:8}  {name}");
    }
}

fn symbols(text: &mut String, image: &Image) {
    let _ = writeln!(
        text,
        "\n{:8} {:>9}  {:8}  symbol",
        "address", "bytes", "what"
    );
    for symbol in image
        .symbols
        .iter()
        .filter(|symbol| !symbol.name.starts_with('$'))
    {
        let what = match symbol.kind {
            SymbolKind::Function => "function",
            SymbolKind::Data => "data",
            SymbolKind::Label => "place",
        };
        let _ = writeln!(
            text,
            "{:08x} {:9}  {what:8}  {}",
            symbol.address, symbol.size, symbol.name
        );
    }
}
