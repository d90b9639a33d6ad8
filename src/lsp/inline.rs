//! What stands inside or above the text: cycles and formats as hints, what fits as lenses.

use lsp_types::{
    CodeLens, Command, InlayHint, InlayHintKind, InlayHintLabel, InlayHintTooltip, Position, Range,
};
use whippen_compiler::index::Definition;

use super::analysis::Analysis;
use super::cost::Cost;
use super::text;

/// What fits, above each instrument and keyboard of the document.
pub fn lenses(analysis: &Analysis, cost: &Cost) -> Vec<CodeLens> {
    let lens = |(span, said): &(_, String)| CodeLens {
        range: text::range(analysis.text(0), *span),
        command: Some(Command {
            title: said.clone(),
            command: String::new(),
            arguments: None,
        }),
        data: None,
    };
    cost.fits.iter().map(lens).collect()
}

/// Fixed-point formats behind the names of what is declared, and cycles at the ends of lines.
pub fn hints(analysis: &Analysis, cost: Option<&Cost>, within: Range) -> Vec<InlayHint> {
    let wanted = |at: &Position| (within.start..=within.end).contains(at);
    let formats = analysis.index.definitions.iter().filter_map(|definition| {
        let format = format(analysis, definition)?;
        let at = text::position(analysis.text(0), definition.span.end as usize);
        wanted(&at).then(|| hint(at, format, "the fixed-point format of its proven range"))
    });
    let source = analysis.text(0);
    let ends = cost.into_iter().flat_map(|cost| &cost.lines);
    let cycles = ends.filter_map(|(line, cycles)| {
        let behind = Position {
            line: *line,
            character: u32::MAX,
        };
        let at = text::position(source, text::byte(source, behind));
        let label = match cycles {
            1 => "1 cycle".to_string(),
            cycles => format!("{cycles} cycles"),
        };
        let about = "at most, on the longest path through the worst-case mode";
        wanted(&at).then(|| hint(at, label, about))
    });
    formats.chain(cycles).collect()
}

/// The format of a value that is declared in the document; of a number, not of a state.
fn format(analysis: &Analysis, definition: &Definition) -> Option<String> {
    let number = analysis.number(definition)?;
    let is_here = definition.span.file == 0;
    (is_here && number.export.dim.is_some()).then(|| number.export.format())
}

fn hint(position: Position, label: String, about: &str) -> InlayHint {
    InlayHint {
        position,
        label: InlayHintLabel::String(label),
        kind: Some(InlayHintKind::TYPE),
        text_edits: None,
        tooltip: Some(InlayHintTooltip::String(about.to_string())),
        padding_left: Some(true),
        padding_right: None,
        data: None,
    }
}
