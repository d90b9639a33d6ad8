//! Bytes of sections for debuggers, with holes where addresses are to be filled in.

use gimli::LittleEndian;
use gimli::write::{EndianVec, RelocateWriter, Relocation, RelocationTarget, Sections};

use super::{Debug, Hole, To};

/// All sections that have something.
pub(super) fn taken(sections: &Sections<DebugWriter>) -> gimli::write::Result<Vec<Debug>> {
    let mut out = Vec::new();
    sections.for_each(|id, writer| {
        if !writer.bytes.slice().is_empty() {
            out.push(Debug {
                name: id.name(),
                bytes: writer.bytes.slice().to_vec(),
                holes: writer.holes.clone(),
            });
        }
        gimli::write::Result::Ok(())
    })?;
    Ok(out)
}

/// Bytes and holes.
#[derive(Debug, Clone)]
pub(super) struct DebugWriter {
    bytes: EndianVec<LittleEndian>,
    holes: Vec<Hole>,
}

impl Default for DebugWriter {
    fn default() -> DebugWriter {
        DebugWriter {
            bytes: EndianVec::new(LittleEndian),
            holes: Vec::new(),
        }
    }
}

impl RelocateWriter for DebugWriter {
    type Writer = EndianVec<LittleEndian>;

    fn writer(&self) -> &Self::Writer {
        &self.bytes
    }

    fn writer_mut(&mut self) -> &mut Self::Writer {
        &mut self.bytes
    }

    fn relocate(&mut self, relocation: Relocation) {
        let to = match relocation.target {
            RelocationTarget::Symbol(section) => To::Code(section),
            RelocationTarget::Section(id) => To::Debug(id.name()),
        };
        self.holes.push(Hole {
            at: relocation.offset as u32,
            to,
            addend: relocation.addend as u32,
        });
    }
}
