//! Segments: the contents of each memory in one piece, as files hold them and start-up copies them.

use super::super::linked::{Linked, Segment};
use super::super::object::SectionKind;
use super::Linker;
use whippen_board::MemoryKind;

impl Linker<'_> {
    /// One segment for each memory and what its contents are; they are in order, so gaps are
    /// alignment.
    pub(super) fn segments(&self) -> Vec<Segment> {
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
