//! An image as the bound sees it: final bytes, names of places, hints, and whose each instruction
//! is.

use std::collections::BTreeMap;

use super::memory::{Extent, Reach};
use super::{Annotations, Code, Step};
use whippen_arm::image::{Image, Place, SectionKind};
use whippen_board::Board;

/// Code with names.
#[derive(Debug, Clone, Default)]
pub struct Program {
    /// Instructions and constants.
    pub code: Code,
    /// What the image knows of loops and indirect branches.
    pub annotations: Annotations,
    /// Address (bit 0 clear) of each symbol.
    pub symbols: BTreeMap<String, u32>,
    /// The symbols at each address.
    pub names: BTreeMap<u32, Vec<String>>,
    /// Its sections, by address.
    pub sections: Vec<Extent>,
    /// From this address on, instructions belong to this place, up to the next.
    lines: BTreeMap<u32, Option<Place>>,
}

impl Program {
    /// The code of an image. Data is left out: its bytes change.
    pub fn of(image: &Image) -> Self {
        let mut program = Self::default();
        for section in &image.sections {
            if matches!(section.kind, SectionKind::Code | SectionKind::Constant) {
                program.code.add(section.run, section.bytes.clone());
            }
            program.lines.extend(section.lines.iter().cloned());
        }
        for symbol in &image.symbols {
            program
                .names
                .entry(symbol.address & !1)
                .or_default()
                .push(symbol.name.clone());
        }
        program.sections = image.sections.iter().map(Extent::of).collect();
        program.symbols = image
            .symbols
            .iter()
            .map(|symbol| (symbol.name.clone(), symbol.address & !1))
            .collect();
        program.annotations.loops = image.loops.iter().copied().collect();
        program.annotations.targets = image.targets.iter().cloned().collect();
        program
    }

    /// The addresses of the words from an address to the end of its section.
    pub fn words_of(&self, from: u32) -> impl Iterator<Item = u32> + use<> {
        let end = self
            .section_at(from)
            .map_or(from, |section| section.base + section.size);
        (from..end).step_by(4)
    }

    /// The section that an address is in.
    pub fn section_at(&self, address: u32) -> Option<&Extent> {
        self.sections
            .iter()
            .find(|section| section.contains(address))
    }

    /// Where accesses to the section go that an address is in.
    pub fn reach_of(&self, board: &Board, address: u32) -> Option<Reach> {
        Some(self.section_at(address)?.reach(board))
    }

    /// Whose an instruction is.
    pub fn place(&self, address: u32) -> Option<&Place> {
        self.lines
            .range(..=address)
            .next_back()
            .and_then(|(_, place)| place.as_ref())
    }

    /// The cycles of a path by place, in the order in which the path comes to them; those that are
    /// nobody's under none.
    pub fn by_place(&self, path: &[Step]) -> Vec<(Option<&Place>, u64)> {
        let mut cycles: Vec<(Option<&Place>, u64)> = Vec::new();
        for step in path {
            let place = self.place(step.address);
            match cycles.iter_mut().find(|(known, _)| *known == place) {
                Some((_, sum)) => *sum += step.cycles,
                None => cycles.push((place, step.cycles)),
            }
        }
        cycles
    }

    /// The cycles of a path by declaration, the most expensive first.
    pub fn by_item(&self, path: &[Step]) -> Vec<(&str, u64)> {
        let mut cycles: BTreeMap<&str, u64> = BTreeMap::new();
        for step in path {
            let item = self
                .place(step.address)
                .map_or("the key's frame", |place| place.item.as_str());
            *cycles.entry(item).or_default() += step.cycles;
        }
        let mut cycles: Vec<_> = cycles.into_iter().collect();
        cycles.sort_by_key(|(_, cycles)| std::cmp::Reverse(*cycles));
        cycles
    }
}
