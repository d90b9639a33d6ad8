//! Objects become an image: every section gets an address in the board's memory, and addresses are
//! filled in.
//!
//! ```text
//!   flash   start | vectors | code and constants that stay | tables | contents of RAM
//!   RAM     code, constants, data  (copied at the start)   | zeroed data (cleared at the start)
//! ```
//!
//! Sections go where the board's patterns say, within a memory in the order of the objects. What a
//! start-up routine needs has names: `__copy_table_start` to `__copy_table_end` are entries (from,
//! to, bytes), `__zero_table_start` to `__zero_table_end` entries (at, bytes), all multiples of 4;
//! and of each memory `__NAME_start`, `__NAME_end` and `__NAME_free`, the first address that nobody
//! uses.
//!
//! Not here: what is executed first (the object that defines the entry), files.

mod error;

use std::collections::HashMap;

use super::boot::{IMAGE_DEF, checked_boot2};
use super::fixup::apply;
use super::lines::Place;
use super::linked::{Image, Linked, Named, Segment};
use super::object::{Fixup, Hint, Object, Section, SectionKind, Symbol, SymbolKind};
use whippen_board::{Board, Memory, MemoryKind, Start};

pub use error::LinkError;

/// An object, and the places of its origins.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The object.
    pub object: &'a Object,
    /// What the origins of its lines mean.
    pub places: &'a [Place],
}

/// Links objects for a board; the image begins at the global symbol `entry`.
///
/// # Errors
/// Names that are missing or defined twice, sections without a place, memory that is full, branches
/// that do not reach.
pub fn link(board: &Board, inputs: &[Input], entry: &str) -> Result<Image, LinkError> {
    let start = start_object(board, inputs)?;
    let mut all = vec![Input {
        object: &start,
        places: &[],
    }];
    all.extend(inputs);
    let mut linker = Linker {
        board,
        inputs: &all,
        places: HashMap::new(),
        sections: Vec::new(),
        bounds: Vec::new(),
    };
    linker.place_all()?;
    linker.finish(entry)
}

/// What the linker itself adds: the chip's start block, and room for the tables of the start-up
/// routine.
fn start_object(board: &Board, inputs: &[Input]) -> Result<Object, LinkError> {
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

/// Where a memory is used.
struct Bound<'a> {
    memory: &'a Memory,
    /// Behind what is copied or stored there.
    filled: u32,
    /// Behind everything.
    free: u32,
}

struct Linker<'a> {
    board: &'a Board,
    inputs: &'a [Input<'a>],
    /// Where section `.1` of input `.0` is in the list.
    places: HashMap<(usize, usize), usize>,
    sections: Vec<Linked>,
    bounds: Vec<Bound<'a>>,
}

impl<'a> Linker<'a> {
    fn place_all(&mut self) -> Result<(), LinkError> {
        for memory in &self.board.memory {
            self.place_in(memory)?;
        }
        self.store()?;
        self.fill_tables();
        Ok(())
    }

    fn place_in(&mut self, memory: &'a Memory) -> Result<(), LinkError> {
        let mut next = u64::from(memory.base);
        let mut filled = next;
        for zeroed in [false, true] {
            for (input, index, section) in self.sections_of(memory, zeroed)? {
                let run = next.next_multiple_of(u64::from(section.align.max(1)));
                let mut bytes = section.bytes.clone();
                if self.board.start == Start::Boot2 && section.name == ".boot2" {
                    bytes = checked_boot2(&bytes).ok_or(LinkError::Boot2)?;
                }
                let size = if zeroed {
                    section.size
                } else {
                    bytes.len() as u32
                };
                next = run + u64::from(size);
                let wanted = next - u64::from(memory.base);
                if wanted > u64::from(memory.size) {
                    return Err(LinkError::Full {
                        memory: memory.name.clone(),
                        wanted,
                        size: memory.size,
                    });
                }
                self.places.insert((input, index), self.sections.len());
                self.sections.push(Linked {
                    name: section.name.clone(),
                    kind: section.kind,
                    memory: memory.name.clone(),
                    load: run as u32,
                    run: run as u32,
                    bytes,
                    size,
                    lines: self.lines_of(input, section, run as u32),
                });
            }
            // Start-up copies and clears words.
            next = next.next_multiple_of(4);
            filled = if zeroed { filled } else { next };
        }
        self.bounds.push(Bound {
            memory,
            filled: filled as u32,
            free: next as u32,
        });
        Ok(())
    }

    /// The sections that go into a memory, zeroed ones or others: what the chip looks for first,
    /// then input by input.
    fn sections_of(
        &self,
        memory: &Memory,
        zeroed: bool,
    ) -> Result<Vec<(usize, usize, &'a Section)>, LinkError> {
        let mut found = Vec::new();
        for (number, input) in self.inputs.iter().enumerate() {
            for (index, section) in input.object.sections.iter().enumerate() {
                let is_zeroed = section.kind == SectionKind::Zeroed;
                let nowhere = || LinkError::Nowhere {
                    section: section.name.clone(),
                    board: self.board.name.clone(),
                };
                let wanted = self.board.memory_for(&section.name).ok_or_else(nowhere)?;
                if wanted.name == memory.name && is_zeroed == zeroed {
                    found.push((number, index, section));
                }
            }
        }
        let rank = |name: &str| {
            [".boot2", ".vectors", ".image_def"]
                .iter()
                .position(|n| *n == name)
                .unwrap_or(3)
        };
        found.sort_by_key(|(_, _, section)| rank(&section.name));
        Ok(found)
    }

    fn lines_of(&self, input: usize, section: &Section, run: u32) -> Vec<(u32, Option<Place>)> {
        let place = |origin: Option<u32>| {
            origin
                .and_then(|o| self.inputs[input].places.get(o as usize))
                .cloned()
        };
        section
            .lines
            .iter()
            .map(|row| (run + row.at, place(row.origin)))
            .collect()
    }

    /// Finds room in flash for the contents of RAM; without flash they are loaded where they run.
    fn store(&mut self) -> Result<(), LinkError> {
        let Some(flash) = self.board.flash() else {
            return Ok(());
        };
        let end = self
            .bounds
            .iter()
            .find(|b| b.memory.name == flash.name)
            .map_or(flash.base, |b| b.filled);
        let mut next = u64::from(end);
        for bound in self
            .bounds
            .iter()
            .filter(|b| b.memory.kind == MemoryKind::Ram)
        {
            let base = bound.memory.base;
            let inside =
                |s: &&mut Linked| s.memory == bound.memory.name && s.kind != SectionKind::Zeroed;
            self.sections
                .iter_mut()
                .filter(inside)
                .for_each(|s| s.load = (next + u64::from(s.run - base)) as u32);
            next += u64::from(bound.filled - base);
        }
        if let Some(bound) = self.bounds.iter_mut().find(|b| b.memory.name == flash.name) {
            bound.free = bound.free.max(next.min(u64::from(u32::MAX)) as u32);
        }
        let wanted = next - u64::from(flash.base);
        if wanted > u64::from(flash.size) {
            return Err(LinkError::Full {
                memory: flash.name.clone(),
                wanted,
                size: flash.size,
            });
        }
        Ok(())
    }

    /// The contents of `.copy_table` and `.zero_table`.
    fn fill_tables(&mut self) {
        let (mut copy, mut zero) = (Vec::new(), Vec::new());
        let end = self
            .board
            .flash()
            .and_then(|f| self.bounds.iter().find(|b| b.memory.name == f.name));
        let mut load = end.map(|bound| bound.filled);
        for bound in self
            .bounds
            .iter()
            .filter(|b| b.memory.kind == MemoryKind::Ram)
        {
            let bytes = bound.filled - bound.memory.base;
            // Without flash everything is in its place already.
            copy.extend([
                load.unwrap_or(0),
                bound.memory.base,
                if load.is_some() { bytes } else { 0 },
            ]);
            zero.extend([bound.filled, bound.free - bound.filled]);
            load = load.map(|at| at + bytes);
        }
        for (name, words) in [(".copy_table", copy), (".zero_table", zero)] {
            if let Some(section) = self
                .sections
                .iter_mut()
                .find(|section| section.name == name)
            {
                section.bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            }
        }
    }

    fn finish(mut self, entry: &str) -> Result<Image, LinkError> {
        let globals = self.globals()?;
        for (number, input) in self.inputs.iter().enumerate() {
            let own = self.own_symbols(number);
            for (index, section) in input.object.sections.iter().enumerate() {
                for fixup in &section.fixups {
                    self.fix(
                        self.places[&(number, index)],
                        section,
                        fixup,
                        &own,
                        &globals,
                    )?;
                }
            }
        }
        let wanted = || LinkError::Undefined {
            symbol: entry.to_string(),
            section: "the start".to_string(),
        };
        let (entry, _) = *globals.get(entry).ok_or_else(wanted)?;
        let (loops, targets) = self.hints(&globals)?;
        let symbols = self.symbols();
        let segments = self.segments();
        Ok(Image {
            arch: self.board.arch,
            entry,
            sections: self.sections,
            segments,
            symbols,
            loops,
            targets,
        })
    }

    /// Address and kind of each global name.
    fn globals(&self) -> Result<HashMap<String, (u32, SymbolKind)>, LinkError> {
        let mut globals = HashMap::new();
        for symbol in self.symbols().into_iter().filter(|symbol| symbol.global) {
            if globals
                .insert(symbol.name.clone(), (symbol.address, symbol.kind))
                .is_some()
            {
                return Err(LinkError::Twice {
                    symbol: symbol.name,
                });
            }
        }
        Ok(globals)
    }

    /// Address and kind of each name that an input defines.
    fn own_symbols(&self, input: usize) -> HashMap<&'a str, (u32, SymbolKind)> {
        let object = self.inputs[input].object;
        let place = |symbol: &'a Symbol| {
            let section = &self.sections[self.places[&(input, symbol.section?)]];
            Some((
                symbol.name.as_str(),
                (section.run + symbol.offset, symbol.kind),
            ))
        };
        object.symbols.iter().filter_map(place).collect()
    }

    fn fix(
        &mut self,
        place: usize,
        section: &Section,
        fixup: &Fixup,
        own: &HashMap<&str, (u32, SymbolKind)>,
        globals: &HashMap<String, (u32, SymbolKind)>,
    ) -> Result<(), LinkError> {
        let (symbol, name) = (fixup.symbol.clone(), section.name.clone());
        let found = own.get(symbol.as_str()).or_else(|| globals.get(&symbol));
        let Some(&(address, kind)) = found else {
            return Err(LinkError::Undefined {
                symbol,
                section: name,
            });
        };
        let linked = &mut self.sections[place];
        let thumb = u32::from(kind == SymbolKind::Function);
        let value = address.wrapping_add_signed(fixup.addend) | thumb;
        apply(
            &mut linked.bytes,
            fixup.at,
            fixup.kind,
            value,
            linked.run.wrapping_add(fixup.at),
        )
        .map_err(|error| LinkError::Fixup {
            symbol,
            section: name,
            error,
        })
    }

    #[expect(clippy::type_complexity, reason = "the two lists of the image")]
    fn hints(
        &self,
        globals: &HashMap<String, (u32, SymbolKind)>,
    ) -> Result<(Vec<(u32, u32)>, Vec<(u32, Vec<u32>)>), LinkError> {
        let (mut loops, mut targets) = (Vec::new(), Vec::new());
        let mut last: Option<(&Vec<String>, Vec<u32>)> = None;
        for (number, input) in self.inputs.iter().enumerate() {
            let own = self.own_symbols(number);
            for (index, section) in input.object.sections.iter().enumerate() {
                let run = self.sections[self.places[&(number, index)]].run;
                for hint in &section.hints {
                    match hint {
                        Hint::Loop { at, rounds_max } => loops.push((run + at, *rounds_max)),
                        Hint::Targets { at, symbols } => {
                            let address = |symbol: &String| {
                                let found =
                                    own.get(symbol.as_str()).or_else(|| globals.get(symbol));
                                let undefined = || LinkError::Undefined {
                                    symbol: symbol.clone(),
                                    section: section.name.clone(),
                                };
                                found.map(|(address, _)| *address).ok_or_else(undefined)
                            };
                            // Whoever goes to the next key goes where the one before does.
                            let to = match last {
                                Some((same, to)) if same == symbols => to,
                                _ => symbols
                                    .iter()
                                    .map(address)
                                    .collect::<Result<Vec<u32>, LinkError>>()?,
                            };
                            targets.push((run + at, to.clone()));
                            last = Some((symbols, to));
                        }
                    }
                }
            }
        }
        loops.sort_unstable();
        targets.sort_unstable();
        Ok((loops, targets))
    }

    /// All names by address: those of the inputs, and the bounds of memory.
    fn symbols(&self) -> Vec<Named> {
        let mut all = Vec::new();
        for (number, input) in self.inputs.iter().enumerate() {
            for symbol in &input.object.symbols {
                let Some(section) = symbol
                    .section
                    .map(|section| self.places[&(number, section)])
                else {
                    continue;
                };
                let address = self.sections[section].run + symbol.offset;
                let Symbol {
                    name,
                    size,
                    kind,
                    global,
                    ..
                } = symbol.clone();
                all.push(Named {
                    name,
                    address,
                    size,
                    kind,
                    global,
                    section: Some(section),
                });
            }
        }
        for bound in &self.bounds {
            let end = bound.memory.base.wrapping_add(bound.memory.size);
            for (what, address) in [
                ("start", bound.memory.base),
                ("end", end),
                ("free", bound.free),
            ] {
                let name = format!("__{}_{what}", bound.memory.name);
                all.push(Named {
                    name,
                    address,
                    size: 0,
                    kind: SymbolKind::Label,
                    global: true,
                    section: None,
                });
            }
        }
        all.sort_by(|a, b| (a.address, &a.name).cmp(&(b.address, &b.name)));
        all
    }

    /// One segment for each memory and what its contents are; they are in order, so gaps are
    /// alignment.
    fn segments(&self) -> Vec<Segment> {
        let mut segments = Vec::new();
        for memory in &self.board.memory {
            let inside: Vec<&Linked> = self
                .sections
                .iter()
                .filter(|s| s.memory == memory.name && s.size > 0)
                .collect();
            let (Some(first), Some(last)) = (inside.first(), inside.last()) else {
                continue;
            };
            let mut bytes = Vec::new();
            for section in inside
                .iter()
                .filter(|section| section.kind != SectionKind::Zeroed)
            {
                bytes.resize((section.run - first.run) as usize, 0);
                bytes.extend(&section.bytes);
            }
            if !bytes.is_empty() {
                // As much as start-up copies.
                bytes.resize(bytes.len().next_multiple_of(4), 0);
            }
            let size = (last.run + last.size - first.run).max(bytes.len() as u32);
            let executable = inside
                .iter()
                .any(|section| section.kind == SectionKind::Code);
            let writable = memory.kind == MemoryKind::Ram;
            segments.push(Segment {
                load: first.load,
                run: first.run,
                bytes,
                size,
                executable,
                writable,
            });
        }
        segments
    }
}
