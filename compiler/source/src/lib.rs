//! Source texts, places in them, and the origin of code in them.

mod origin;

pub use origin::Origin;

/// A half-open range of bytes in one source file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Span {
    /// Index of the file in the [`SourceMap`].
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The smallest span that covers both.
    pub fn to(self, other: Span) -> Span {
        Span {
            file: self.file,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }
}

/// One file: a name for messages and its text.
#[derive(Debug, Clone)]
pub struct SourceFile {
    /// The name shown in messages; for `std` a name in angle brackets.
    pub name: String,
    /// The text.
    pub text: String,
    /// The byte at which each line begins.
    line_starts: Vec<u32>,
}

/// The files of one program.
#[derive(Debug, Clone, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

impl SourceMap {
    /// Adds a file and gives its index.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> u32 {
        let text = text.into();
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let line_starts = std::iter::once(0)
            .chain(ends.map(|(at, _)| at as u32 + 1))
            .collect();
        self.files.push(SourceFile {
            name: name.into(),
            text,
            line_starts,
        });
        (self.files.len() - 1) as u32
    }

    /// The files in the order they were added.
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// The text a span covers.
    pub fn text(&self, span: Span) -> &str {
        self.files
            .get(span.file as usize)
            .and_then(|f| f.text.get(span.start as usize..span.end as usize))
            .unwrap_or("")
    }

    /// The line of the start of a span, counted from 1. A binary search: every message of a long
    /// text may ask.
    pub fn line(&self, span: Span) -> usize {
        let starts = self.files.get(span.file as usize).map(|f| &f.line_starts);
        starts.map_or(1, |starts| {
            starts.partition_point(|start| *start <= span.start).max(1)
        })
    }

    /// Line and column of the start of a span, both counted from 1, the column in characters.
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let line = self.line(span);
        let before = self.files.get(span.file as usize).and_then(|file| {
            let start = *file.line_starts.get(line - 1)? as usize;
            file.text.get(start..span.start as usize)
        });
        (line, before.map_or(0, |text| text.chars().count()) + 1)
    }
}
