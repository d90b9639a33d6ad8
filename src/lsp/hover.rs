//! What is under the pointer.

use lsp_types::{Hover, HoverContents, MarkupContent, MarkupKind, Position};
use whippen_compiler::index::{Definition, NameKind};
use whippen_compiler::lower::Export;
use whippen_compiler::source::Span;
use whippen_compiler::syntax::token::{Token, lex};

use super::analysis::{Analysis, Number};
use super::{text, words};

/// So many lines of a declaration are shown.
const LINES_MAX: usize = 8;

/// A name's declaration and what is proven about it, or the meaning of a unit or a word; the
/// diagnostics of the place.
pub fn hover(analysis: &Analysis, position: Position) -> Option<Hover> {
    let source = analysis.text(0);
    let byte = text::byte(source, position);
    let named = analysis
        .at(byte)
        .map(|(occurrence, definition)| (occurrence.span, about(analysis, definition)));
    let (span, what) = named
        .or_else(|| word(source, byte))
        .or_else(|| wrong(analysis, byte))?;
    let message = wrong(analysis, byte)
        .filter(|(_, message)| *message != what)
        .map_or(String::new(), |(_, t)| format!("\n\n---\n\n{t}"));
    let contents = MarkupContent {
        kind: MarkupKind::Markdown,
        value: what + &message,
    };
    Some(Hover {
        contents: HoverContents::Markup(contents),
        range: Some(text::range(source, span)),
    })
}

/// The codes of the diagnostics at a place, and what they are about.
fn wrong(analysis: &Analysis, byte: usize) -> Option<(Span, String)> {
    let at = byte as u32;
    let here = |d: &&whippen_compiler::diag::Diagnostic| {
        d.span.file == 0 && d.span.start <= at && at <= d.span.end
    };
    let found: Vec<_> = analysis.diagnostics.iter().filter(here).collect();
    let lines = found
        .iter()
        .map(|d| format!("{}: {}", d.code.number(), d.code.title()))
        .collect::<Vec<_>>();
    Some((found.first()?.span, lines.join("\n\n")))
}

fn word(source: &str, byte: usize) -> Option<(Span, String)> {
    let tokens = lex(0, source, &mut Vec::new()).tokens;
    let token = tokens
        .iter()
        .find(|t| (t.span.start as usize) <= byte && byte <= t.span.end as usize)?;
    let written = &source[token.span.start as usize..token.span.end as usize];
    let meaning = match token.node {
        Token::Number(literal) => words::unit(literal.unit),
        _ => words::meaning(written),
    };
    Some((token.span, meaning?))
}

fn about(analysis: &Analysis, definition: &Definition) -> String {
    let mut parts = vec![format!(
        "```whip\n{}\n```",
        declaration(analysis, definition)
    )];
    if !definition.doc.is_empty() {
        parts.push(definition.doc.clone());
    }
    let remark = remark(analysis, definition);
    parts.extend((!remark.is_empty()).then_some(remark));
    let proven = analysis.number(definition).and_then(proven);
    parts.push(format!(
        "{}{}",
        definition.kind.title(),
        dimension(analysis, definition)
    ));
    parts.extend(proven);
    parts.join("\n\n")
}

/// The text of the declaration; of what has a block, the line that it begins with.
fn declaration(analysis: &Analysis, definition: &Definition) -> String {
    let whole = analysis.map.text(definition.whole);
    let lines: Vec<&str> = match definition.kind {
        NameKind::Instrument | NameKind::Term | NameKind::Keyboard => {
            let head = whole.split_once('{').map_or(whole, |(head, _)| head);
            return head.split_whitespace().collect::<Vec<_>>().join(" ");
        }
        _ => whole.lines().collect(),
    };
    let indent = lines
        .iter()
        .skip(1)
        .map(|l| l.len() - l.trim_start().len())
        .min()
        .unwrap_or(0);
    let mut shown: Vec<&str> = lines.iter().take(1).copied().collect();
    shown.extend(
        lines
            .iter()
            .skip(1)
            .take(LINES_MAX)
            .map(|line| line.get(indent..).unwrap_or(line)),
    );
    if lines.len() > LINES_MAX + 1 {
        shown.push("..");
    }
    shown.join("\n")
}

/// The comment at the end of the declaration's line.
fn remark(analysis: &Analysis, definition: &Definition) -> String {
    let source = analysis.text(definition.whole.file);
    let behind = source
        .get(definition.whole.end as usize..)
        .and_then(|rest| rest.lines().next())
        .unwrap_or_default();
    behind
        .trim_start()
        .strip_prefix("//")
        .map_or(String::new(), |comment| comment.trim().to_string())
}

/// The type as declared, or else as proven.
pub fn dimension(analysis: &Analysis, definition: &Definition) -> String {
    let of = |export: &Export| {
        export
            .dim
            .map(|dim| dim.name().map_or_else(|| dim.unit(), str::to_string))
    };
    let proven = || analysis.number(definition).and_then(|n| of(&n.export));
    definition
        .ty
        .clone()
        .or_else(proven)
        .map_or(String::new(), |name| format!(": {name}"))
}

fn proven(number: &Number) -> Option<String> {
    let Number { export, unit } = number;
    export.dim?;
    let (low, high) = (short(export.range.low), short(export.range.high));
    let unit = if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    };
    let range = if low == high {
        format!("always {low}{unit}")
    } else {
        format!("{low} .. {high}{unit}")
    };
    let error = match export.error.is_finite() {
        true => format!(
            "one tick adds an error of at most {}{unit}",
            short(export.error)
        ),
        false => "no bound of its error: it depends on a friction".to_string(),
    };
    let format = format!("format {}, {error}", export.format());
    Some(format!("{range}  \n{format}"))
}

/// Four significant digits at the most.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        0.0 => "0".to_string(),
        size if (1e-4..1e6).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
