//! Diagnostics as text: code, message, excerpts of the source with labels, hints. The drawing is
//! ariadne's.

use std::fmt;
use std::ops::Range;

use ariadne::{CharSet, Color, Config, IndexType, Label, Report, ReportKind};

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
    let main = place(map, diagnostic.span);
    let label = |span: Span, text: &str, colour: Color| {
        let order = i32::try_from(span.start).unwrap_or(i32::MAX);
        Label::new(place(map, span))
            .with_message(text)
            .with_color(colour)
            .with_order(order)
    };
    let others = diagnostic
        .others
        .iter()
        .map(|o| label(o.span, &o.text, Color::Cyan));
    let mut report = Report::build(kind, main)
        .with_config(config)
        .with_code(diagnostic.code.number())
        .with_message(&diagnostic.message)
        .with_label(label(diagnostic.span, &diagnostic.label, tint).with_priority(1))
        .with_labels(others);
    report.with_helps(&diagnostic.hints);
    let mut drawn = Vec::new();
    match report.finish().write(excerpts(map, diagnostic), &mut drawn) {
        Ok(()) => tidy(&String::from_utf8_lossy(&drawn), colour),
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

/// A span in characters.
fn place(map: &SourceMap, span: Span) -> (FileId, Range<usize>) {
    let text = text(map, span.file);
    let characters = |byte: u32| {
        text.char_indices()
            .take_while(|(at, _)| *at < byte as usize)
            .count()
    };
    let start = characters(span.start);
    (
        file_id(map, span.file),
        start..characters(span.end).max(start),
    )
}

/// The files that the diagnostic points at. Whatever could end a line or steer the terminal, other
/// than a newline, is replaced, character by character.
fn excerpts(map: &SourceMap, diagnostic: &Diagnostic) -> impl ariadne::Cache<FileId> {
    let mut files: Vec<u32> = diagnostic.others.iter().map(|o| o.span.file).collect();
    files.push(diagnostic.span.file);
    files.sort_unstable();
    files.dedup();
    let plain = |c: char| match c {
        '\n' | '\t' => c,
        '\r' => ' ',
        '\u{2028}' | '\u{2029}' => '\u{fffd}',
        c if c.is_control() => '\u{fffd}',
        c => c,
    };
    ariadne::sources(files.into_iter().map(move |index| {
        let text: String = text(map, index).chars().map(plain).collect();
        (file_id(map, index), text)
    }))
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
