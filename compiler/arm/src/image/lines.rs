//! The source line of an origin: where somebody who steps through the code expects to be.
//!
//! A term of the standard library has no file that a debugger could open, and for who writes an
//! instrument `plectrum(..)` is one step. So code from there belongs to the line of the user's own
//! text that calls it, and code from the user's own terms to their own lines.

use whippen_source::Origin;
use whippen_source::{SourceMap, Span};

/// A line of source, and what stands there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file, as it was named.
    pub file: String,
    /// Counted from 1.
    pub line: u32,
    /// The declaration: `force contact`.
    pub item: String,
}

/// The places of a program's origins, in their order.
pub fn places(origins: &[Origin], map: &SourceMap) -> Vec<Place> {
    origins.iter().map(|origin| place(origin, map)).collect()
}

fn place(origin: &Origin, map: &SourceMap) -> Place {
    let own = |span: &&Span| {
        map.files()
            .get(span.file as usize)
            .is_some_and(|file| !file.name.starts_with('<'))
    };
    let span = std::iter::once(&origin.span)
        .chain(&origin.calls)
        .find(own)
        .unwrap_or(&origin.span);
    let file = map
        .files()
        .get(span.file as usize)
        .map_or_else(String::new, |file| file.name.clone());
    Place {
        file,
        line: map.line_column(*span).0 as u32,
        item: origin.item.clone(),
    }
}
