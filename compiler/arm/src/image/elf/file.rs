//! The container: headers, contents, tables.

use super::symbols::Symbols;
use crate::image::linked::Segment;
use crate::image::object::SectionKind;

const SHT_PROGBITS: u32 = 1;
const SHT_SYMTAB: u32 = 2;
const SHT_STRTAB: u32 = 3;
const SHT_NOTE: u32 = 7;
const SHT_NOBITS: u32 = 8;
const SHT_REL: u32 = 9;
const SHT_ARM_ATTRIBUTES: u32 = 0x7000_0003;
const SHF_WRITE: u32 = 1;
const SHF_ALLOC: u32 = 2;
const SHF_EXECINSTR: u32 = 4;
const SHF_INFO_LINK: u32 = 0x40;

const HEADER_BYTES: u32 = 52;
const PROGRAM_BYTES: u32 = 32;
const SECTION_BYTES: u32 = 40;

/// A section of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub name: String,
    kind: u32,
    flags: u32,
    pub address: u32,
    bytes: Vec<u8>,
    size: u32,
    link: u32,
    info: u32,
    align: u32,
    entry: u32,
}

impl Part {
    /// A section that is loaded.
    pub fn of(name: &str, kind: SectionKind, bytes: Vec<u8>, size: u32) -> Part {
        let (elf, flags) = match kind {
            SectionKind::Code => (SHT_PROGBITS, SHF_ALLOC | SHF_EXECINSTR),
            SectionKind::Constant => (SHT_PROGBITS, SHF_ALLOC),
            SectionKind::Data => (SHT_PROGBITS, SHF_ALLOC | SHF_WRITE),
            SectionKind::Zeroed => (SHT_NOBITS, SHF_ALLOC | SHF_WRITE),
        };
        Part {
            name: name.to_string(),
            kind: elf,
            flags,
            bytes,
            size,
            align: 4,
            ..Part::default()
        }
    }

    /// The same, at an address.
    pub fn at(self, address: u32) -> Part {
        Part { address, ..self }
    }

    /// The same, at multiples of `align`.
    pub fn aligned(self, align: u32) -> Part {
        Part {
            align: align.max(1),
            ..self
        }
    }

    /// A section for debuggers.
    pub fn debug(name: &str, bytes: Vec<u8>) -> Part {
        Part::plain(name, SHT_PROGBITS, bytes)
    }

    /// A note: its owner's name, a number that says what it is, and text.
    pub fn note(section: &str, owner: &str, kind: u32, text: &str) -> Part {
        let mut bytes = Vec::new();
        words(
            &mut bytes,
            &[owner.len() as u32 + 1, text.len() as u32, kind],
        );
        for part in [format!("{owner}\0"), text.to_string()] {
            append(&mut bytes, part.as_bytes(), 4);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        Part {
            align: 4,
            ..Part::plain(section, SHT_NOTE, bytes)
        }
    }

    fn plain(name: &str, kind: u32, bytes: Vec<u8>) -> Part {
        Part {
            name: name.to_string(),
            kind,
            size: bytes.len() as u32,
            bytes,
            align: 1,
            ..Part::default()
        }
    }

    /// Whether it holds code (else data), if it holds something that is loaded.
    pub fn holds_code(&self) -> Option<bool> {
        (self.flags & SHF_ALLOC != 0 && self.kind == SHT_PROGBITS)
            .then_some(self.flags & SHF_EXECINSTR != 0)
    }
}

/// The number of the section that was added as this, from 0.
pub(super) fn number(index: usize) -> u16 {
    index as u16 + 1
}

/// A file under construction.
#[derive(Debug)]
pub(super) struct File {
    entry: Option<u32>,
    parts: Vec<Part>,
    segments: Vec<Segment>,
    relocations: Vec<Part>,
}

impl File {
    /// An executable that begins somewhere, or a relocatable file.
    pub fn new(entry: Option<u32>) -> File {
        File {
            entry,
            parts: Vec::new(),
            segments: Vec::new(),
            relocations: Vec::new(),
        }
    }

    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    pub fn add(&mut self, part: Part) {
        self.parts.push(part);
    }

    pub fn segment(&mut self, segment: &Segment) {
        self.segments.push(segment.clone());
    }

    /// What a linker fills into a section: offset, number of the symbol, kind.
    pub fn relocations(&mut self, section: u16, entries: Vec<(u32, u32, u32)>) {
        if entries.is_empty() {
            return;
        }
        let name = format!(".rel{}", self.parts[usize::from(section) - 1].name);
        let words = entries
            .into_iter()
            .flat_map(|(at, symbol, kind)| [at, symbol << 8 | kind]);
        let bytes = words.flat_map(u32::to_le_bytes).collect();
        let part = Part::plain(&name, SHT_REL, bytes);
        let info = u32::from(section);
        self.relocations.push(Part {
            flags: SHF_INFO_LINK,
            info,
            align: 4,
            entry: 8,
            ..part
        });
    }

    /// The bytes of the file.
    pub fn finish(mut self, symbols: &Symbols, attributes: &[u8]) -> Vec<u8> {
        let symtab = (self.parts.len() + self.relocations.len()) as u32 + 1;
        self.relocations
            .iter_mut()
            .for_each(|part| part.link = symtab);
        let mut parts = std::mem::take(&mut self.parts);
        parts.append(&mut self.relocations);
        let table = Part::plain(".symtab", SHT_SYMTAB, symbols.table.clone());
        parts.push(Part {
            link: symtab + 1,
            info: symbols.first_global,
            align: 4,
            entry: 16,
            ..table
        });
        parts.push(Part::plain(".strtab", SHT_STRTAB, symbols.strings.clone()));
        parts.push(Part::plain(
            ".ARM.attributes",
            SHT_ARM_ATTRIBUTES,
            attributes.to_vec(),
        ));
        let mut names = vec![0];
        let mut name = |text: &str| {
            let at = names.len() as u32;
            names.extend(text.as_bytes());
            names.push(0);
            at
        };
        let mut name_at: Vec<u32> = parts.iter().map(|part| name(&part.name)).collect();
        name_at.push(name(".shstrtab"));
        parts.push(Part::plain(".shstrtab", SHT_STRTAB, names));
        self.write(&parts, &name_at)
    }

    fn write(&self, parts: &[Part], names: &[u32]) -> Vec<u8> {
        let mut out = vec![0; (HEADER_BYTES + PROGRAM_BYTES * self.segments.len() as u32) as usize];
        let starts: Vec<u32> = self
            .segments
            .iter()
            .map(|segment| append(&mut out, &segment.bytes, 4))
            .collect();
        let mut offsets = Vec::new();
        for part in parts {
            let inside = |s: &&Segment| {
                part.flags & SHF_ALLOC != 0 && part.address.wrapping_sub(s.run) < s.size
            };
            let segment = self.segments.iter().position(|s| inside(&s));
            offsets.push(match segment {
                // Its bytes stand in the segment; what starts as zero would stand behind it.
                Some(of) => {
                    starts[of]
                        + (part.address - self.segments[of].run)
                            .min(self.segments[of].bytes.len() as u32)
                }
                None if part.kind == SHT_NOBITS => out.len() as u32,
                None => append(&mut out, &part.bytes, part.align),
            });
        }
        let table = append(&mut out, &[], 4);
        out.extend([0; SECTION_BYTES as usize]);
        for ((part, &name), &offset) in parts.iter().zip(names).zip(&offsets) {
            let Part {
                kind,
                flags,
                address,
                size,
                link,
                info,
                align,
                entry,
                ..
            } = *part;
            words(
                &mut out,
                &[
                    name, kind, flags, address, offset, size, link, info, align, entry,
                ],
            );
        }
        let header = self.header(table, parts.len() as u16 + 1);
        out[..header.len()].copy_from_slice(&header);
        out
    }

    fn header(&self, sections: u32, count: u16) -> Vec<u8> {
        let mut out = b"\x7fELF\x01\x01\x01".to_vec();
        out.resize(16, 0);
        let kind: u32 = if self.entry.is_some() { 2 } else { 1 };
        let programs = if self.segments.is_empty() {
            0
        } else {
            HEADER_BYTES
        };
        // Type and machine (ARM); version; EABI 5, base procedure call standard.
        words(
            &mut out,
            &[
                40 << 16 | kind,
                1,
                self.entry.unwrap_or(0),
                programs,
                sections,
                self.flags(),
            ],
        );
        let sizes = [
            HEADER_BYTES,
            PROGRAM_BYTES,
            self.segments.len() as u32,
            SECTION_BYTES,
        ];
        sizes
            .iter()
            .for_each(|size| out.extend((*size as u16).to_le_bytes()));
        out.extend(count.to_le_bytes());
        out.extend((count - 1).to_le_bytes());
        let mut offset = HEADER_BYTES + PROGRAM_BYTES * self.segments.len() as u32;
        for segment in &self.segments {
            offset = offset.next_multiple_of(4);
            let bytes = segment.bytes.len() as u32;
            let flags = 4 | u32::from(segment.writable) << 1 | u32::from(segment.executable);
            words(
                &mut out,
                &[
                    1,
                    offset,
                    segment.run,
                    segment.load,
                    bytes,
                    segment.size,
                    flags,
                    4,
                ],
            );
            offset += bytes;
        }
        out
    }

    fn flags(&self) -> u32 {
        if self.entry.is_some() {
            0x0500_0200
        } else {
            0x0500_0000
        }
    }
}

fn words(out: &mut Vec<u8>, words: &[u32]) {
    words.iter().for_each(|word| out.extend(word.to_le_bytes()));
}

/// Adds bytes at the next multiple of `align` and gives their offset.
fn append(out: &mut Vec<u8>, bytes: &[u8], align: u32) -> u32 {
    out.resize(out.len().next_multiple_of(align.max(1) as usize), 0);
    out.extend(bytes);
    (out.len() - bytes.len()) as u32
}
