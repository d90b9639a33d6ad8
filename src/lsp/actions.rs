//! Quick fixes: the suggestions of diagnostics, done.

use std::collections::HashMap;

use lsp_types::{CodeAction, CodeActionKind, Diagnostic, Range, TextEdit, WorkspaceEdit};
use whippen_compiler::diag::Suggestion;

use super::analysis::Analysis;
use super::diagnostics::{diagnostics, location};

/// The fixes of the diagnostics that a range touches.
pub fn actions(analysis: &Analysis, range: Range) -> Vec<CodeAction> {
    let shown = diagnostics(analysis);
    let here = analysis
        .diagnostics
        .iter()
        .filter(|d| d.span.file == 0)
        .zip(&shown);
    here.filter(|(_, shown)| shown.range.start <= range.end && range.start <= shown.range.end)
        .flat_map(|(found, shown)| {
            found
                .suggestions
                .iter()
                .filter_map(|s| action(analysis, s, shown))
        })
        .collect()
}

fn action(analysis: &Analysis, suggestion: &Suggestion, shown: &Diagnostic) -> Option<CodeAction> {
    let (place, new) = (
        location(analysis, suggestion.span)?,
        &suggestion.replacement,
    );
    let title = match (suggestion.span.start == suggestion.span.end, new.is_empty()) {
        (true, _) => format!("insert `{new}`"),
        (false, true) => format!("remove `{}`", analysis.map.text(suggestion.span)),
        (false, false) => format!("replace with `{new}`"),
    };
    let edit = TextEdit {
        range: place.range,
        new_text: new.clone(),
    };
    Some(CodeAction {
        title,
        kind: Some(CodeActionKind::QUICKFIX),
        diagnostics: Some(vec![shown.clone()]),
        edit: Some(WorkspaceEdit {
            changes: Some(HashMap::from([(place.uri, vec![edit])])),
            ..WorkspaceEdit::default()
        }),
        is_preferred: Some(true),
        ..CodeAction::default()
    })
}
