//! Source lines of an image, from its DWARF.

use addr2line::Context;
use addr2line::gimli::{Dwarf, EndianSlice, Error, RunTimeEndian, SectionId};
use object::{Object, ObjectSection};
use std::collections::BTreeMap;

use super::File;

/// A line of source.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Line {
    /// The file, as the compiler was given it.
    pub file: String,
    /// Counted from 1.
    pub line: u32,
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

/// Which line each instruction comes from.
#[derive(Clone, Default, Debug)]
pub struct SourceLines {
    /// First address -> address behind the last, and the line.
    runs: BTreeMap<u32, (u32, Line)>,
}

/// More lines than this are not kept: a corrupt table may claim any number.
const LINES_MAX: usize = 4 << 20;

impl SourceLines {
    /// Reads the lines of a linked image. Without debugging information, or where it is corrupt,
    /// what there is: lines are an aid, and their absence no error.
    pub fn read(elf: &[u8]) -> Self {
        let Ok(file) = File::parse(elf) else {
            return Self::default();
        };
        let data = |id: SectionId| {
            file.section_by_name(id.name())
                .and_then(|s| s.data().ok())
                .unwrap_or(&[])
        };
        let load = |id| Ok::<_, Error>(EndianSlice::new(data(id), RunTimeEndian::Little));
        let context = Dwarf::load(load).and_then(Context::from_dwarf);
        let Ok(context) = context else {
            return Self::default();
        };
        let Ok(locations) = context.find_location_range(0, 1 << 32) else {
            return Self::default();
        };
        let run = |(from, bytes, location): (u64, u64, addr2line::Location<'_>)| {
            let line = Line {
                file: location.file?.to_string(),
                line: location.line?,
            };
            Some((
                u32::try_from(from).ok()?,
                (u32::try_from(from + bytes).ok()?, line),
            ))
        };
        Self {
            runs: locations.take(LINES_MAX).filter_map(run).collect(),
        }
    }

    /// The line that the instruction at `address` comes from.
    pub fn at(&self, address: u32) -> Option<&Line> {
        let (_, (end, line)) = self.runs.range(..=address).next_back()?;
        (address < *end).then_some(line)
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }
}
