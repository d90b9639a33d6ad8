//! Diagnostics as text: code, message, excerpts of the source with labels, hints. The drawing is
//! ariadne's.

use std::fmt;
use std::ops::Range;

use ariadne::{CharSet, Color, Config, IndexType, Label, Report, ReportKind};

use super::excerpt::{Excerpt, shortened};
use super::{Diagnostic, Severity};
use whippen_source::{SourceMap, Span};

/// One diagnostic with excerpts of the files it points at, lines and columns counted from 1,
/// columns in characters. Ends with a newline. Places outside of their file are moved to its end.
pub fn render(map: &SourceMap, diagnostic: &Diagnostic, colour: bool) -> String {
    let (kind, tint) = match diagnostic.severity() {
        Severity::Error => (ReportKind::Error, Color::Red),
        Severity::Warning => (ReportKind::Warning, Color::Yellow),
        Severity::Note => (ReportKind::Custom("Note", Color::Blue), Color::Blue),
    };
    let config = Config::default()
        .with_color(colour)
        .with_index_type(IndexType::Char)
        .with_char_set(CharSet::Unicode);
    let drawing = Drawing::new(map, diagnostic);
    let label = |span: Span, text: &str, colour: Color| {
        let order = i32::try_from(span.start).unwrap_or(i32::MAX);
        Label::new(drawing.place(span))
            .with_message(shortened(text))
            .with_color(colour)
            .with_order(order)
    };
    let others = diagnostic
        .others
        .iter()
        .map(|o| label(o.span, &o.text, Color::Cyan));
    let mut report = Report::build(kind, drawing.place(diagnostic.span))
        .with_config(config)
        .with_code(diagnostic.code.number())
        .with_message(shortened(&diagnostic.message))
        .with_label(label(diagnostic.span, &diagnostic.label, tint).with_priority(1))
        .with_labels(others);
    report.with_helps(diagnostic.hints.iter().map(|hint| shortened(hint)));
    let mut drawn = Vec::new();
    match report.finish().write(drawing.sources(), &mut drawn) {
        Ok(()) => drawing.with_columns(tidy(&String::from_utf8_lossy(&drawn), colour)),
        Err(error) => format!(
            "{}: {} ({error})\n",
            diagnostic.code.number(),
            diagnostic.message
        ),
    }
}

/// How many errors, warnings and notes there are (`2 errors, 1 warning`); empty if there are none.
pub fn summary(diagnostics: &[Diagnostic]) -> String {
    let count = |severity: Severity, name: &str| {
        let count = diagnostics
            .iter()
            .filter(|d| d.severity() == severity)
            .count();
        match count {
            0 => None,
            1 => Some(format!("1 {name}")),
            _ => Some(format!("{count} {name}s")),
        }
    };
    let kinds = [
        (Severity::Error, "error"),
        (Severity::Warning, "warning"),
        (Severity::Note, "note"),
    ];
    kinds
        .into_iter()
        .filter_map(|(severity, name)| count(severity, name))
        .collect::<Vec<_>>()
        .join(", ")
}

/// A file in ariadne's cache: two files may have one name.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct FileId {
    index: u32,
    name: String,
}

impl fmt::Display for FileId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.name)
    }
}

fn file_id(map: &SourceMap, index: u32) -> FileId {
    let name = map
        .files()
        .get(index as usize)
        .map_or("<unknown>", |f| f.name.as_str());
    FileId {
        index,
        name: name.to_string(),
    }
}

fn text(map: &SourceMap, index: u32) -> &str {
    map.files()
        .get(index as usize)
        .map_or("", |f| f.text.as_str())
}

/// The files that a diagnostic points at, as far as they are shown.
struct Drawing<'m> {
    map: &'m SourceMap,
    spans: Vec<Span>,
    files: Vec<(FileId, Excerpt)>,
}

impl<'m> Drawing<'m> {
    fn new(map: &'m SourceMap, diagnostic: &Diagnostic) -> Drawing<'m> {
        let others = diagnostic.others.iter().map(|other| other.span);
        let spans: Vec<Span> = others.chain([diagnostic.span]).collect();
        let mut files: Vec<u32> = spans.iter().map(|span| span.file).collect();
        files.sort_unstable();
        files.dedup();
        let excerpt = |file: u32| {
            let own = spans.iter().filter(|span| span.file == file);
            let ends = own.flat_map(|span| [span.start, span.end]);
            let places: Vec<usize> = ends.map(|byte| characters(map, file, byte)).collect();
            let excerpt = Excerpt::of(&plain(text(map, file)), &places);
            (file_id(map, file), excerpt)
        };
        let files = files.into_iter().map(excerpt).collect();
        Drawing { map, spans, files }
    }

    /// A span in characters of what is shown.
    fn place(&self, span: Span) -> (FileId, Range<usize>) {
        let own = self.files.iter().find(|(id, _)| id.index == span.file);
        let at = |byte: u32| {
            let at = characters(self.map, span.file, byte);
            own.map_or(at, |(_, excerpt)| excerpt.place(at))
        };
        let start = at(span.start);
        (file_id(self.map, span.file), start..at(span.end).max(start))
    }

    fn sources(&self) -> impl ariadne::Cache<FileId> {
        let files = self.files.iter();
        let files: Vec<(FileId, String)> = files
            .map(|(id, excerpt)| (id.clone(), excerpt.text.clone()))
            .collect();
        ariadne::sources(files)
    }

    /// With the columns of the files, which those of cut lines are not.
    fn with_columns(&self, mut drawn: String) -> String {
        for span in &self.spans {
            let (id, shown) = self.place(*span);
            let own = self.files.iter().find(|(own, _)| *own == id);
            let Some((_, excerpt)) = own else { continue };
            let before: Vec<char> = excerpt.text.chars().take(shown.start).collect();
            let begin = before
                .iter()
                .rposition(|c| *c == '\n')
                .map_or(0, |at| at + 1);
            let (line, column) = self.map.line_column(*span);
            let place = |column: usize| format!("{id}:{line}:{column} ]");
            let cut = before.len() - begin + 1;
            if cut != column {
                drawn = drawn.replace(&place(cut), &place(column));
            }
        }
        drawn
    }
}

/// How many characters of a file stand before a byte.
fn characters(map: &SourceMap, file: u32, byte: u32) -> usize {
    let before = text(map, file).char_indices();
    before.take_while(|(at, _)| *at < byte as usize).count()
}

/// A text in which whatever could end a line or steer the terminal, other than a newline, is
/// replaced, character by character.
fn plain(text: &str) -> String {
    let plain = |c: char| match c {
        '\n' | '\t' => c,
        '\r' => ' ',
        '\u{2028}' | '\u{2029}' => '\u{fffd}',
        c if c.is_control() => '\u{fffd}',
        c => c,
    };
    text.chars().map(plain).collect()
}

/// Without spaces at the ends of lines; without colour also without the escape sequences that
/// ariadne writes all the same around the name of a kind of its own (`Note`).
fn tidy(drawn: &str, colour: bool) -> String {
    let mut parts = drawn.split("\u{1b}[");
    let first = parts.next().unwrap_or_default();
    let plain = parts
        .map(|part| part.split_once('m').map_or(part, |(_, rest)| rest))
        .collect::<String>();
    let text = if colour {
        drawn.to_string()
    } else {
        format!("{first}{plain}")
    };
    text.lines()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect()
}
