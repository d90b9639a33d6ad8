//! Semantic tokens: what each name of the text stands for, which colours by words cannot tell.

use lsp_types::{SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokensLegend};
use whippen_compiler::index::{Definition, NameKind};

use super::analysis::Analysis;
use super::text;

/// The types that tokens have, by their numbers.
const TYPES: [SemanticTokenType; 10] = [
    SemanticTokenType::CLASS,
    SemanticTokenType::NAMESPACE,
    SemanticTokenType::FUNCTION,
    SemanticTokenType::PARAMETER,
    SemanticTokenType::VARIABLE,
    SemanticTokenType::PROPERTY,
    SemanticTokenType::ENUM,
    SemanticTokenType::ENUM_MEMBER,
    SemanticTokenType::EVENT,
    SemanticTokenType::STRUCT,
];

/// What may be said of a token besides, by bits.
const MODIFIERS: [SemanticTokenModifier; 4] = [
    SemanticTokenModifier::DECLARATION,
    SemanticTokenModifier::READONLY,
    SemanticTokenModifier::MODIFICATION,
    SemanticTokenModifier::DEFAULT_LIBRARY,
];

/// The types and modifiers in the order of their numbers.
pub fn legend() -> SemanticTokensLegend {
    SemanticTokensLegend {
        token_types: TYPES.to_vec(),
        token_modifiers: MODIFIERS.to_vec(),
    }
}

/// The names of the document in the order of the text, each told from the one before it.
pub fn tokens(analysis: &Analysis) -> Vec<SemanticToken> {
    let source = analysis.text(0);
    let mut before = lsp_types::Position::default();
    let mut tokens = Vec::new();
    let here = analysis.index.occurrences.iter();
    for occurrence in here.filter(|occurrence| occurrence.span.file == 0) {
        let definition = &analysis.index.definitions[occurrence.definition];
        let range = text::range(source, occurrence.span);
        // A name is on one line, and of two names of one place the first counts.
        let is_new = tokens.is_empty() || range.start > before;
        if range.start.line != range.end.line || range.start == range.end || !is_new {
            continue;
        }
        let delta_line = range.start.line - before.line;
        let from = if delta_line == 0 { before.character } else { 0 };
        let is_declaration = definition.span == occurrence.span;
        tokens.push(SemanticToken {
            delta_line,
            delta_start: range.start.character - from,
            length: range.end.character - range.start.character,
            token_type: number(&TYPES, &token_type(definition.kind)),
            token_modifiers_bitset: modifiers(analysis, definition, is_declaration),
        });
        before = range.start;
    }
    tokens
}

fn number<T: PartialEq>(all: &[T], one: &T) -> u32 {
    all.iter().position(|known| known == one).unwrap_or(0) as u32
}

fn modifiers(analysis: &Analysis, definition: &Definition, is_declaration: bool) -> u32 {
    let is_of_library = definition.span.file as usize >= analysis.uris.len();
    let is_kept = matches!(
        definition.kind,
        NameKind::State | NameKind::Live | NameKind::Pulse | NameKind::Delay
    );
    let is_constant = matches!(definition.kind, NameKind::Param | NameKind::Number);
    let bits = [is_declaration, is_constant, is_kept, is_of_library];
    (bits.iter().enumerate()).fold(0, |all, (at, bit)| all | u32::from(*bit) << at)
}

fn token_type(kind: NameKind) -> SemanticTokenType {
    match kind {
        NameKind::Instrument | NameKind::Zones => SemanticTokenType::CLASS,
        NameKind::Keyboard => SemanticTokenType::NAMESPACE,
        NameKind::Term | NameKind::Table => SemanticTokenType::FUNCTION,
        NameKind::Parameter | NameKind::Slip => SemanticTokenType::PARAMETER,
        NameKind::Machine => SemanticTokenType::ENUM,
        NameKind::MachineState => SemanticTokenType::ENUM_MEMBER,
        NameKind::Event => SemanticTokenType::EVENT,
        NameKind::Body | NameKind::String | NameKind::Bank => SemanticTokenType::STRUCT,
        NameKind::Force | NameKind::Sound | NameKind::Friction | NameKind::Result => {
            SemanticTokenType::PROPERTY
        }
        NameKind::Sense
        | NameKind::Param
        | NameKind::Live
        | NameKind::Let
        | NameKind::State
        | NameKind::Pulse
        | NameKind::Noise
        | NameKind::Delay
        | NameKind::Coordinate
        | NameKind::Tension
        | NameKind::Number => SemanticTokenType::VARIABLE,
    }
}
