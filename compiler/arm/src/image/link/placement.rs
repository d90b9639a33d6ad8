//! Placement: which memory each section runs in and at which address, and where in flash the
//! contents of RAM are stored.

use super::super::boot::checked_boot2;
use super::super::lines::Place;
use super::super::linked::Linked;
use super::super::object::{Section, SectionKind};
use super::{LinkError, Linker, MemoryUse};
use whippen_board::{Memory, MemoryKind, Start};

/// That a memory which is filled up to this address is large enough.
fn check_room(memory: &Memory, end: u64) -> Result<(), LinkError> {
    let wanted = end - u64::from(memory.base);
    if wanted > u64::from(memory.size) {
        return Err(LinkError::Full {
            memory: memory.name.clone(),
            wanted,
            size: memory.size,
        });
    }
    Ok(())
}

impl<'a> Linker<'a> {
    /// Gives every section its address.
    pub(super) fn place_all(&mut self) -> Result<(), LinkError> {
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
                check_room(memory, next)?;
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
        self.bounds.push(MemoryUse {
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
        check_room(flash, next)
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
}
