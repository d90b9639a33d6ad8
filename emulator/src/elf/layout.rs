//! The memory that an image needs where no board says what there is, and where its vector table is.
//!
//! ```text
//!   segments -> pages of 4096 bytes -> runs;  writable ones reach at least 512 KiB, for heap and stack behind the data
//!   and RAM at 0x20000000, 512 KiB, whether or not a segment lies there
//! ```

use super::{Elf, Segment};

/// Where RAM is by default.
pub const RAM_BASE: u32 = 0x2000_0000;
/// How much of it there is by default.
pub const RAM_BYTES: u32 = 512 << 10;

const PAGE: u64 = 4096;
/// What a board made up for an image may have in all.
const MEMORY_BYTES_MAX: u64 = 256 << 20;

/// Why an image gets no memory of its own.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum LayoutError {
    /// It wants more than 256 MiB.
    TooMuch {
        /// How much, in bytes.
        bytes: u64,
    },
}

impl std::fmt::Display for LayoutError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self::TooMuch { bytes } = self;
        write!(
            f,
            "its segments want {} MiB of memory; at most 256 MiB are given",
            bytes >> 20
        )
    }
}

impl std::error::Error for LayoutError {}

/// A run of memory: base, size in bytes, whether it can be written.
pub type Run = (u32, u32, bool);

/// The memory for an image, besides `given` (base and size), which is there already.
///
/// # Errors
/// It is absurdly much.
pub fn regions_for(elf: &Elf, given: &[Run]) -> Result<Vec<Run>, LayoutError> {
    let mut wanted: Vec<(u64, u64, bool)> = Vec::new();
    for segment in &elf.segments {
        let in_place = segment.load == segment.run;
        wanted.push(pages(
            segment.run,
            segment.memory_bytes,
            segment.writable || !in_place,
        ));
        if !in_place && !segment.bytes.is_empty() {
            wanted.push(pages(segment.load, segment.bytes.len() as u32, false));
        }
    }
    if !given.iter().any(|(base, ..)| *base == RAM_BASE) {
        wanted.push(pages(RAM_BASE, RAM_BYTES, true));
    }
    let taken = given
        .iter()
        .map(|(base, bytes, _)| (u64::from(*base), u64::from(*base) + u64::from(*bytes)));
    let runs = without(merged(wanted), &taken.collect::<Vec<_>>());
    let bytes: u64 = runs.iter().map(|(from, to, _)| to - from).sum();
    if bytes > MEMORY_BYTES_MAX {
        return Err(LayoutError::TooMuch { bytes });
    }
    // No run is longer than what was just allowed, so sizes fit.
    Ok(runs
        .into_iter()
        .map(|(from, to, writable)| (from as u32, (to - from) as u32, writable))
        .collect())
}

/// Whole pages around a segment; writable memory goes on for 512 KiB.
fn pages(base: u32, bytes: u32, writable: bool) -> (u64, u64, bool) {
    let from = u64::from(base) / PAGE * PAGE;
    let room = if writable { u64::from(RAM_BYTES) } else { 0 };
    let end = (u64::from(base) + u64::from(bytes)).max(from + room);
    (from, end.next_multiple_of(PAGE).min(1 << 32), writable)
}

/// Sorted and without overlaps: what touches becomes one if both can be written, and ends before
/// the next otherwise.
fn merged(mut wanted: Vec<(u64, u64, bool)>) -> Vec<(u64, u64, bool)> {
    wanted.sort_unstable();
    let mut runs: Vec<(u64, u64, bool)> = Vec::new();
    for (from, to, writable) in wanted {
        match runs.last_mut() {
            // A page that is shared by code and data can be written.
            Some(last) if from < last.1 && last.2 && !writable => last.1 = last.1.max(to),
            Some(last) if from <= last.1 && last.2 == writable => last.1 = last.1.max(to),
            Some(last) if from < last.1 => {
                let (whole_from, whole_to) = (last.0, last.1.max(to));
                last.1 = from;
                if whole_from == from {
                    runs.pop();
                }
                runs.push((from, whole_to, true));
            }
            _ => runs.push((from, to, writable)),
        }
    }
    runs
}

/// What is left of runs when others are taken out.
fn without(runs: Vec<(u64, u64, bool)>, taken: &[(u64, u64)]) -> Vec<(u64, u64, bool)> {
    let cut = |runs: Vec<(u64, u64, bool)>, &(from, to): &(u64, u64)| {
        let pieces = |(a, b, w): (u64, u64, bool)| [(a, b.min(from), w), (a.max(to), b, w)];
        let overlaps = |r: &(u64, u64, bool)| r.0 < to && from < r.1;
        let (cut, kept): (Vec<_>, Vec<_>) = runs.into_iter().partition(overlaps);
        kept.into_iter()
            .chain(cut.into_iter().flat_map(pieces))
            .filter(|(a, b, _)| a < b)
            .collect()
    };
    let mut runs = taken.iter().fold(runs, cut);
    runs.sort_unstable();
    runs
}

/// Names that vendors give their tables.
const TABLES: [&str; 10] = [
    "__vectors",
    "__Vectors",
    "__isr_vector",
    "g_pfnVectors",
    "__VECTOR_TABLE",
    "__vector_table",
    "__VECTORS",
    "vector_table",
    "_vectors",
    "__interrupt_vector",
];

/// Where the vector table is: behind a usual name, else at the start of a segment or 256 bytes
/// behind it (where RP2040 has it, after its second boot stage). A table is a stack pointer and an
/// odd address in code.
pub fn vector_table(elf: &Elf) -> Option<u32> {
    let named = TABLES
        .iter()
        .filter_map(|name| elf.symbols.named(name).ok())
        .map(|s| s.address);
    let starts = elf
        .segments
        .iter()
        .flat_map(|s| [s.run, s.run.wrapping_add(0x100)]);
    let mut candidates: Vec<u32> = named
        .chain(starts)
        .filter(|address| is_table(elf, *address))
        .collect();
    // The table that leads to where the image says it begins is the one.
    let begins = |table: &u32| {
        word(elf, table.wrapping_add(4)).is_some_and(|reset| reset | 1 == elf.entry | 1)
    };
    match candidates.iter().position(begins) {
        Some(index) => Some(candidates.swap_remove(index)),
        None => candidates.first().copied(),
    }
}

fn is_table(elf: &Elf, address: u32) -> bool {
    let in_code = |target: u32| {
        elf.segments
            .iter()
            .any(|s| s.executable && s.contains(target & !1))
    };
    match (word(elf, address), word(elf, address.wrapping_add(4))) {
        (Some(stack), Some(reset)) => {
            stack != 0 && stack % 4 == 0 && reset & 1 == 1 && in_code(reset)
        }
        _ => false,
    }
}

fn word(elf: &Elf, address: u32) -> Option<u32> {
    let segment: &Segment = elf.segments.iter().find(|s| s.contains(address))?;
    let at = (address - segment.run) as usize;
    let bytes = segment.bytes.get(at..at.checked_add(4)?)?;
    bytes.try_into().ok().map(u32::from_le_bytes)
}
