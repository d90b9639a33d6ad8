//! The listing: source lines and instructions side by side, with cycles and what they are made of.
//!
//! ```text
//!   grand-piano.whip:63  let push = if contact is ..  | 20000104  fb51 3012  smmlar r0, r1, r2, r3    2  late r2
//! ```
//!
//! Cycles are those of going straight on from the function's beginning, branches not taken: what a
//! reader adds up along a line. A bound over all paths is not this file's.

use std::collections::BTreeMap;
use std::fmt::Write;

use whippen_isa::timing::{Core, Outcome, Pipe, Reason};
use whippen_isa::{Arch, Inst, ItState, Op, decode};

use super::lines::Place;
use super::linked::{Image, Linked, Named};
use super::object::{SectionKind, SymbolKind};
use whippen_board::timing;
use whippen_source::SourceMap;

/// Width of the column of source.
const SOURCE: usize = 64;
/// Width of the column of instructions.
const TEXT: usize = 34;

/// All code of an image beside its source.
pub fn listing(image: &Image, map: &SourceMap) -> String {
    let sources = map
        .files()
        .iter()
        .map(|file| (file.name.as_str(), file.text.lines().collect()))
        .collect();
    let mut writer = ListingWriter {
        image,
        sources,
        core: timing(image.arch),
        text: String::new(),
    };
    for (index, section) in image.sections.iter().enumerate() {
        if section.kind == SectionKind::Code {
            writer.section(index, section);
        }
    }
    writer.text
}

struct ListingWriter<'a> {
    image: &'a Image,
    sources: BTreeMap<&'a str, Vec<&'a str>>,
    core: Core,
    text: String,
}

/// What is going on at an address.
struct State {
    pipe: Pipe,
    it: ItState,
    place: Option<Place>,
    /// Data among the code.
    data: bool,
}

impl ListingWriter<'_> {
    fn section(&mut self, index: usize, section: &Linked) {
        let _ = writeln!(
            self.text,
            "{} in {}, {} bytes",
            section.name, section.memory, section.size
        );
        let symbols = self
            .image
            .symbols
            .iter()
            .filter(|symbol| symbol.section == Some(index));
        let names: Vec<Named> = symbols.cloned().collect();
        let mut state = State {
            pipe: Pipe::default(),
            it: ItState::OUTSIDE,
            place: None,
            data: false,
        };
        let mut at = 0;
        while at < section.bytes.len() {
            let address = section.run + at as u32;
            names
                .iter()
                .filter(|name| name.address == address)
                .for_each(|name| self.name(name, &mut state));
            let row = section
                .lines
                .partition_point(|(from, _)| *from <= address)
                .checked_sub(1);
            let place = row.and_then(|row| section.lines[row].1.clone());
            let source = self.source(place.as_ref(), &mut state);
            at += self.line(&section.bytes[at..], address, &source, &mut state);
        }
        self.text.push('\n');
    }

    fn name(&mut self, symbol: &Named, state: &mut State) {
        match symbol.name.as_bytes() {
            [b'$', b'd', ..] => state.data = true,
            [b'$', b't', ..] => state.data = false,
            _ => {
                let _ = writeln!(self.text, "{:SOURCE$} | {}:", "", symbol.name);
            }
        }
        if symbol.kind == SymbolKind::Function {
            (state.pipe, state.it, state.place) = (Pipe::default(), ItState::OUTSIDE, None);
        }
    }

    /// The source of an address, where it is not that of the line above.
    fn source(&self, place: Option<&Place>, state: &mut State) -> String {
        if state.place.as_ref() == place {
            return String::new();
        }
        state.place = place.cloned();
        let Some(Place { file, line, .. }) = place else {
            return "-".to_string();
        };
        let text = self
            .sources
            .get(file.as_str())
            .and_then(|lines| lines.get(*line as usize - 1));
        let name = file.rsplit('/').next().unwrap_or(file);
        let whole = format!("{name}:{line}  {}", text.map_or("", |text| text.trim()));
        whole.chars().take(SOURCE).collect()
    }

    /// One instruction, or a piece of data; gives its size.
    fn line(&mut self, bytes: &[u8], address: u32, source: &str, state: &mut State) -> usize {
        let half = |at: usize| Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
        let Some(first) = half(0).filter(|_| !state.data) else {
            return self.data(bytes, address, source);
        };
        let second = half(2).unwrap_or(0);
        let Ok(inst) = decode(first, second, self.image.arch, state.it) else {
            return self.data(&bytes[..2], address, source);
        };
        let (pipe, cost) = self.core.issue(
            state.pipe,
            &self.core.prepare(&inst),
            address,
            &outcome(&inst, state.it),
        );
        state.pipe = pipe;
        state.it = inst.it_behind(state.it).unwrap_or_default();
        let code = if inst.size() == 4 {
            format!("{first:04x} {second:04x}")
        } else {
            format!("{first:04x}")
        };
        let text = format!("{}{}", inst, target(self.image, &inst, address));
        let why = if plain(&cost) {
            String::new()
        } else {
            format!("  {}", parts(&cost))
        };
        let cycles = cost.cycles();
        let row =
            format!("{source:SOURCE$} | {address:08x}  {code:9}  {text:TEXT$} {cycles:3}{why}");
        let _ = writeln!(self.text, "{}", row.trim_end());
        inst.size() as usize
    }

    fn data(&mut self, bytes: &[u8], address: u32, source: &str) -> usize {
        let size = if bytes.len() >= 4 && address.is_multiple_of(4) {
            4
        } else {
            bytes.len().min(2)
        };
        let value = bytes[..size]
            .iter()
            .rev()
            .fold(0u32, |value, byte| value << 8 | u32::from(*byte));
        let _ = writeln!(
            self.text,
            "{source:SOURCE$} | {address:08x}  {value:0width$x}",
            width = 2 * size
        );
        size
    }
}

/// Where a branch goes, by name; empty for other instructions.
pub(super) fn target(image: &Image, inst: &Inst, address: u32) -> String {
    if !matches!(inst.op(), Op::B | Op::BL | Op::CBZ | Op::CBNZ) {
        return String::new();
    }
    let to = address.wrapping_add(4).wrapping_add_signed(inst.offset());
    let inside =
        |s: &&Named| s.kind == SymbolKind::Function && to.wrapping_sub(s.address) < s.size.max(1);
    match image.symbols.iter().find(inside) {
        Some(symbol) if symbol.address == to => format!(" ; {}", symbol.name),
        Some(symbol) => format!(" ; {}+{:#x}", symbol.name, to - symbol.address),
        None => format!(" ; {to:08x}"),
    }
}

/// Straight on: a conditional branch is not taken, a branch goes where it is closest.
pub(crate) fn outcome(inst: &Inst, it: ItState) -> Outcome {
    let branches = matches!(inst.op(), Op::B | Op::BL | Op::BX | Op::BLX);
    let always = inst.cond.is_none() && !it.inside();
    if branches && always {
        Outcome::taken(0, false)
    } else {
        Outcome::NEXT
    }
}

/// Whether there is nothing to explain.
fn plain(cost: &whippen_isa::timing::Cost) -> bool {
    cost.parts()
        .all(|(reason, cycles)| reason == Reason::Issue && cycles == 1)
}

/// `1 issue, 1 late r0`
fn parts(cost: &whippen_isa::timing::Cost) -> String {
    let text = cost.to_string();
    text.split_once(": ")
        .map_or(text.clone(), |(_, parts)| parts.to_string())
}

/// The architecture's own name, for titles.
pub(super) fn arch_name(arch: Arch) -> &'static str {
    match arch {
        Arch::V6M => "ARMv6-M",
        Arch::V7EM => "ARMv7E-M",
        Arch::V8M => "ARMv8-M",
    }
}
