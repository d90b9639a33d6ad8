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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::board;
    use crate::cores::tests::{section, whole};
    use crate::memory::{Accessed, Waits};
    use whippen_arm::image::{Named, SymbolKind};

    fn place(item: &str) -> Place {
        Place {
            file: "own.whip".into(),
            line: 1,
            item: item.into(),
        }
    }

    /// Code with lines and a name, constants, and words that start as zero.
    fn program() -> Program {
        let mut sections = vec![
            section(".text.core0", 0x2000_0000, 8),
            section(".rodata", 0x2000_0100, 4),
            section(".bss", 0x2004_0000, 12),
        ];
        sections[0].bytes = (1..=8).collect();
        let line = |item: Option<&str>| item.map(place);
        sections[0].lines = vec![
            (0x2000_0000, line(Some("force a"))),
            (0x2000_0004, line(None)),
            (0x2000_0006, line(Some("force b"))),
        ];
        sections[1].kind = SectionKind::Constant;
        sections[1].bytes = vec![9; 4];
        sections[2].bytes = vec![7; 12];
        let mut image = whole(1, sections).image;
        image.symbols = vec![Named {
            name: "tick".into(),
            address: 0x2000_0002,
            size: 6,
            kind: SymbolKind::Function,
            global: true,
            section: Some(0),
        }];
        image.loops = vec![(0x2000_0002, 9)];
        image.targets = vec![(0x2000_0004, vec![0x2000_0000])];
        Program::of(&image)
    }

    #[test]
    fn code_names_and_hints_are_those_of_the_image() {
        let program = program();
        assert_eq!(program.code.word(0x2000_0000), Some(0x0403_0201));
        assert_eq!(program.code.byte(0x2000_0103), Some(9));
        assert_eq!(program.code.byte(0x2004_0000), None);
        assert_eq!(program.symbols["tick"], 0x2000_0002);
        assert_eq!(program.names[&0x2000_0002], ["tick"]);
        assert_eq!(program.annotations.loops[&0x2000_0002], 9);
        assert_eq!(program.annotations.targets[&0x2000_0004], [0x2000_0000]);
    }

    #[test]
    fn a_section_has_words_and_banks() {
        let program = program();
        let words: Vec<u32> = program.words_of(0x2004_0004).collect();
        assert_eq!(words, [0x2004_0004, 0x2004_0008]);
        assert_eq!(program.words_of(0x2004_000c).count(), 0);
        let name = |at| program.section_at(at).map(|section| section.name.as_str());
        assert_eq!(name(0x2000_0103), Some(".rodata"));
        assert_eq!(name(0x2000_0104), None);
        let banks = |at| program.reach_of(&board(), at).map(|reach| reach.banks);
        assert_eq!(banks(0x2000_0000), Some(0b11));
        assert_eq!(banks(0x2004_0000), Some(0b111_0000));
        assert_eq!(banks(0x2000_0104), None);
    }

    #[test]
    fn cycles_belong_to_places_and_to_what_is_declared() {
        let program = program();
        let path = [(0, 1), (2, 2), (4, 4), (6, 8), (0, 16)].map(|(at, cycles)| Step {
            address: 0x2000_0000 + at,
            cycles,
            waits: Waits::default(),
            accessed: Accessed::Nothing,
            times: 1,
        });
        let (a, b) = (place("force a"), place("force b"));
        assert_eq!(program.place(0x2000_0003), Some(&a));
        assert_eq!(program.place(0x2000_0005), None);
        assert_eq!(program.place(0x1fff_fffe), None);
        assert_eq!(
            program.by_place(&path),
            [(Some(&a), 19), (None, 4), (Some(&b), 8)]
        );
        assert_eq!(
            program.by_item(&path),
            [("force a", 19), ("force b", 8), ("the key's frame", 4)]
        );
    }
}
