//! What is wrong with a document.

use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, Location, NumberOrString,
};
use whippen_compiler::diag::{self, Code, Severity};
use whippen_compiler::source::Span;

use super::analysis::Analysis;
use super::{text, uri};

/// The diagnostics of the document, with what to do as a part of the message. Where files beside it
/// declare something twice, the document is told, at its beginning: it is what they were found for.
pub fn diagnostics(analysis: &Analysis) -> Vec<Diagnostic> {
    let all = analysis.diagnostics.iter().chain(&analysis.rings);
    all.filter_map(|d| match d.span.file {
        0 => Some(diagnostic(analysis, d)),
        _ if d.code == Code::DuplicateName => Some(told_at_beginning(analysis, d)),
        _ => None,
    })
    .collect()
}

fn told_at_beginning(analysis: &Analysis, found: &diag::Diagnostic) -> Diagnostic {
    let here = Span::default();
    let moved = diag::Diagnostic {
        span: here,
        ..found.clone().also(found.span, &*found.label)
    };
    diagnostic(analysis, &moved)
}

fn diagnostic(analysis: &Analysis, found: &diag::Diagnostic) -> Diagnostic {
    let hints: String = found
        .hints
        .iter()
        .map(|hint| format!("\nhelp: {hint}"))
        .collect();
    let related = found.others.iter().filter_map(|label| {
        let location = location(analysis, label.span)?;
        Some(DiagnosticRelatedInformation {
            location,
            message: label.text.clone(),
        })
    });
    Diagnostic {
        range: text::range(analysis.text(0), found.span),
        severity: Some(match found.severity() {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Note => DiagnosticSeverity::INFORMATION,
        }),
        code: Some(NumberOrString::String(found.code.number().to_string())),
        source: Some("whippen".to_string()),
        message: format!("{}\n{}{hints}", found.message, found.label),
        related_information: Some(related.collect()),
        ..Diagnostic::default()
    }
}

/// A span as the editor names it.
pub fn location(analysis: &Analysis, span: Span) -> Option<Location> {
    let uri = uri::parse(&analysis.uri(span.file)?)?;
    Some(Location {
        uri,
        range: text::range(analysis.text(span.file), span),
    })
}
