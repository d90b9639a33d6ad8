//! From names to places: definition, references, renaming, the outline.

use std::collections::HashMap;

use lsp_types::{DocumentSymbol, Location, Position, SymbolKind, TextEdit, Uri, WorkspaceEdit};
use whippen_compiler::index::{Definition, NameKind};
use whippen_compiler::syntax::token::HARD_KEYWORDS;

use super::analysis::Analysis;
use super::diagnostics::location;
use super::{text, uri};

/// Where the name at a place is declared.
pub fn definition(analysis: &Analysis, position: Position) -> Option<Location> {
    let (_, definition) = analysis.at(text::byte(analysis.text(0), position))?;
    location(analysis, definition.span)
}

/// Every place of the name at a place, in all files of the program.
pub fn references(
    analysis: &Analysis,
    position: Position,
    declaration: bool,
) -> Option<Vec<Location>> {
    let (occurrence, definition) = analysis.at(text::byte(analysis.text(0), position))?;
    let all = analysis
        .index
        .occurrences
        .iter()
        .filter(|o| o.definition == occurrence.definition);
    let wanted = all.filter(|o| declaration || o.span != definition.span);
    Some(wanted.filter_map(|o| location(analysis, o.span)).collect())
}

/// Gives the name at a place another one everywhere.
///
/// # Errors
/// The new name is none, is taken, or the old one belongs to the standard library.
pub fn rename(analysis: &Analysis, position: Position, new: &str) -> Result<WorkspaceEdit, String> {
    let found = analysis.at(text::byte(analysis.text(0), position));
    let (occurrence, definition) = found.ok_or("there is no name here that could be changed")?;
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let begins = new.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !begins || !new.chars().all(letters) || HARD_KEYWORDS.contains(&new) {
        return Err(format!(
            "`{new}` cannot be a name: letters `A` to `Z`, digits and `_`, no digit first, no keyword"
        ));
    }
    if definition.span.file as usize >= analysis.uris.len() {
        return Err(format!(
            "`{}` belongs to the standard library",
            definition.name
        ));
    }
    if taken(analysis, definition, new) {
        return Err(format!("there is a `{new}` already"));
    }
    #[expect(clippy::mutable_key_type, reason = "the protocol's type")]
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for same in analysis
        .index
        .occurrences
        .iter()
        .filter(|o| o.definition == occurrence.definition)
    {
        let range = text::range(analysis.text(same.span.file), same.span);
        let file = analysis.uri(same.span.file).and_then(|u| uri::parse(&u));
        let file = file.ok_or("a file of the program cannot be named")?;
        changes.entry(file).or_default().push(TextEdit {
            range,
            new_text: new.to_string(),
        });
    }
    Ok(WorkspaceEdit {
        changes: Some(changes),
        ..WorkspaceEdit::default()
    })
}

/// Whether a name is used already where the definition's name counts.
fn taken(analysis: &Analysis, definition: &Definition, new: &str) -> bool {
    let global = matches!(
        definition.kind,
        NameKind::Instrument | NameKind::Term | NameKind::Keyboard
    );
    // Programs of a keyboard are called by their names.
    let programs = |d: &Definition| {
        matches!(
            (d.kind, definition.kind),
            (NameKind::Instrument, NameKind::Zones) | (NameKind::Zones, NameKind::Instrument)
        )
    };
    if analysis
        .index
        .definitions
        .iter()
        .any(|d| programs(d) && d.name == new)
    {
        return true;
    }
    let same_space = |d: &&Definition| match definition.kind {
        _ if global => d.kind == definition.kind,
        kind if kind.is_value() => d.kind.is_value(),
        kind => d.kind == kind && d.machine == definition.machine,
    };
    let near = |d: &&Definition| global || d.item == definition.item;
    analysis
        .index
        .definitions
        .iter()
        .filter(near)
        .filter(same_space)
        .any(|d| d.name == new)
}

/// Instruments, terms and keyboards of the document with what they declare.
pub fn outline(analysis: &Analysis) -> Vec<DocumentSymbol> {
    let all = &analysis.index.definitions;
    let here = |d: &&Definition| d.span.file == 0 && !d.name.is_empty();
    let is_item = |d: &Definition| {
        matches!(
            d.kind,
            NameKind::Instrument | NameKind::Term | NameKind::Keyboard
        )
    };
    all.iter()
        .filter(here)
        .filter(|d| is_item(d))
        .map(|item| {
            let inside = all
                .iter()
                .filter(here)
                .filter(|d| d.item == item.item && !is_item(d) && d.machine.is_none());
            let children = inside.map(|d| symbol(analysis, d, None)).collect();
            symbol(analysis, item, Some(children))
        })
        .collect()
}

#[expect(
    deprecated,
    reason = "the type has a field that is no more, and no default"
)]
fn symbol(
    analysis: &Analysis,
    d: &Definition,
    children: Option<Vec<DocumentSymbol>>,
) -> DocumentSymbol {
    let source = analysis.text(d.span.file);
    DocumentSymbol {
        name: d.name.clone(),
        detail: Some(format!(
            "{}{}",
            d.kind.title(),
            super::hover::dimension(analysis, d)
        )),
        kind: symbol_kind(d.kind),
        tags: None,
        deprecated: None,
        range: text::range(source, d.whole),
        selection_range: text::range(source, d.span),
        children,
    }
}

fn symbol_kind(kind: NameKind) -> SymbolKind {
    match kind {
        NameKind::Instrument => SymbolKind::CLASS,
        NameKind::Keyboard => SymbolKind::MODULE,
        NameKind::Zones => SymbolKind::CLASS,
        NameKind::Term => SymbolKind::FUNCTION,
        NameKind::Param => SymbolKind::CONSTANT,
        NameKind::Machine => SymbolKind::ENUM,
        NameKind::MachineState => SymbolKind::ENUM_MEMBER,
        NameKind::Bank => SymbolKind::ARRAY,
        NameKind::Number => SymbolKind::CONSTANT,
        NameKind::Body | NameKind::String => SymbolKind::OBJECT,
        NameKind::Event => SymbolKind::EVENT,
        NameKind::Force | NameKind::Sound | NameKind::Friction => SymbolKind::OPERATOR,
        NameKind::Sense
        | NameKind::State
        | NameKind::Pulse
        | NameKind::Noise
        | NameKind::Delay
        | NameKind::Table
        | NameKind::Coordinate
        | NameKind::Tension
        | NameKind::Slip => SymbolKind::FIELD,
        NameKind::Live | NameKind::Parameter | NameKind::Result => SymbolKind::PROPERTY,
        NameKind::Let => SymbolKind::VARIABLE,
    }
}
