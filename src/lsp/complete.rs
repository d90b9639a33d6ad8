//! What may be written next.

use lsp_types::{CompletionItem, CompletionItemKind, Position};
use whippen_compiler::index::{Definition, NameKind};
use whippen_compiler::syntax::ast::Spanned;
use whippen_compiler::syntax::token::{Token, lex};
use whippen_compiler::units::{DIMENSIONS, UNITS};

use super::analysis::Analysis;
use super::hover::dimension;
use super::{signature, text, words};

/// The words that may stand at a place; the editor chooses those that begin as what is written
/// there.
pub fn complete(analysis: &Analysis, position: Position) -> Vec<CompletionItem> {
    let source = analysis.text(0);
    let byte = text::byte(source, position);
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let before = &source[..byte];
    let begin = before.trim_end_matches(word).len();
    if in_comment(before) {
        return Vec::new();
    }
    if behind_number(&source[..begin]) {
        return units();
    }
    let tokens = lex(0, &source[..begin], &mut Vec::new()).tokens;
    let place = CursorPlace {
        analysis,
        byte,
        tokens: &tokens,
    };
    match tokens.last().map(|t| t.node) {
        Some(Token::Dot) => place.results(),
        Some(Token::Is) => place.states(2),
        Some(Token::Not) if tokens.len() > 1 && tokens[tokens.len() - 2].node == Token::Is => {
            place.states(3)
        }
        Some(Token::Colon) if place.declares() => types(),
        _ => place.names(),
    }
}

fn in_comment(before: &str) -> bool {
    before
        .rsplit('\n')
        .next()
        .is_some_and(|line| line.contains("//"))
}

/// Whether a number and exactly one space end the text, or the `*` or `/` of a unit.
fn behind_number(before: &str) -> bool {
    let number = |text: &str| {
        let start = text
            .trim_end_matches(|c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_')
            .len();
        let digits = &text[start..];
        digits.starts_with(|c: char| c.is_ascii_digit()) && digits.parse::<f64>().is_ok()
    };
    let unit = |c: char| c.is_ascii_alphanumeric() || "*/^-".contains(c);
    let rest = before.trim_end_matches(unit);
    let begun = &before[rest.len()..];
    let goes_on = begun.is_empty()
        || begun.ends_with(['*', '/']) && !begun.starts_with(|c: char| !c.is_ascii_alphabetic());
    goes_on && rest.strip_suffix(' ').is_some_and(number)
}

fn item(label: &str, kind: CompletionItemKind, detail: String) -> CompletionItem {
    CompletionItem {
        label: label.to_string(),
        kind: Some(kind),
        detail: Some(detail),
        ..CompletionItem::default()
    }
}

fn units() -> Vec<CompletionItem> {
    UNITS
        .iter()
        .map(|unit| item(unit.name, CompletionItemKind::UNIT, unit.title.to_string()))
        .collect()
}

fn types() -> Vec<CompletionItem> {
    let named = DIMENSIONS.iter().map(|d| {
        item(
            d.name,
            CompletionItemKind::TYPE_PARAMETER,
            d.unit.to_string(),
        )
    });
    named
        .chain([item(
            "bool",
            CompletionItemKind::TYPE_PARAMETER,
            "on or off".to_string(),
        )])
        .collect()
}

/// What stands before a place.
struct CursorPlace<'a> {
    analysis: &'a Analysis,
    byte: usize,
    tokens: &'a [Spanned<Token<'a>>],
}

impl CursorPlace<'_> {
    /// The name so many tokens before the place.
    fn back(&self, n: usize) -> Option<&str> {
        self.tokens
            .len()
            .checked_sub(n)
            .and_then(|at| self.tokens[at].node.name())
    }

    fn item(&self) -> Option<usize> {
        let all = &self.analysis.index.items;
        let begun =
            |s: &&whippen_compiler::source::Span| s.file == 0 && (s.start as usize) <= self.byte;
        let around = self.analysis.index.item_at(0, self.byte as u32);
        // A block that is not closed yet may have been cut short.
        around.or_else(|| {
            all.iter()
                .filter(begun)
                .max_by_key(|s| s.start)
                .and_then(|s| all.iter().position(|o| o == s))
        })
    }

    /// Whether the colon before the place follows the name of a declaration, not of an argument.
    fn declares(&self) -> bool {
        let kind = self
            .tokens
            .len()
            .checked_sub(3)
            .map(|at| self.tokens[at].node);
        let header = self
            .tokens
            .iter()
            .rev()
            .find(|t| matches!(t.node, Token::Term | Token::Open(_) | Token::Close(_)));
        matches!(
            kind,
            Some(Token::Sense | Token::State | Token::Pulse | Token::Delay | Token::Table)
        ) || header.is_some_and(|t| t.node == Token::Term)
    }

    /// Results of the term that the name before the dot calls; in a keyboard, the parameters of the
    /// instrument.
    fn results(&self) -> Vec<CompletionItem> {
        let Some(name) = self.back(2) else {
            return Vec::new();
        };
        let index = &self.analysis.index;
        let called = || {
            let at = index.find(self.item()?, name, |k| k == NameKind::Let)?;
            let term = index.item_named(index.definitions[at].calls.as_ref()?, NameKind::Term)?;
            Some((index.definitions[term].item, NameKind::Result))
        };
        let instrument = || {
            Some((
                index.definitions[index.item_named(name, NameKind::Instrument)?].item,
                NameKind::Param,
            ))
        };
        let Some((of, kind)) = called().or_else(instrument) else {
            return Vec::new();
        };
        let wanted = |d: &&Definition| {
            d.kind == kind || (kind == NameKind::Param && d.kind == NameKind::Live)
        };
        self.shown(index.inside(of).map(|(_, d)| d).filter(wanted))
    }

    fn shown<'d>(&self, definitions: impl Iterator<Item = &'d Definition>) -> Vec<CompletionItem> {
        let detail = |d: &Definition| format!("{}{}", d.kind.title(), dimension(self.analysis, d));
        definitions
            .map(|d| item(&d.name, symbol(d.kind), detail(d)))
            .collect()
    }

    /// States of the machine so many tokens back.
    fn states(&self, back: usize) -> Vec<CompletionItem> {
        let index = &self.analysis.index;
        let machine = self.back(back).zip(self.item());
        let machine =
            machine.and_then(|(name, item)| index.find(item, name, |k| k == NameKind::Machine));
        machine.map_or(Vec::new(), |machine| self.shown(index.states(machine)))
    }

    /// Arguments of the call, names in scope, functions, terms, keywords.
    fn names(&self) -> Vec<CompletionItem> {
        let index = &self.analysis.index;
        let call = signature::call(self.analysis.text(0), self.byte);
        let parameters = call
            .and_then(|call| signature::parameters(self.analysis, call.callee))
            .map(|(_, all)| all);
        let argument = |d: &&Definition| CompletionItem {
            insert_text: Some(format!("{}: ", d.name)),
            ..item(
                &format!("{}:", d.name),
                CompletionItemKind::FIELD,
                d.ty.clone().unwrap_or_default(),
            )
        };
        let mut all: Vec<CompletionItem> = parameters.iter().flatten().map(argument).collect();
        let scoped = self
            .item()
            .into_iter()
            .flat_map(|item| index.inside(item))
            .map(|(_, d)| d);
        all.extend(self.shown(scoped.filter(|d| {
            d.kind.is_value()
                || matches!(
                    d.kind,
                    NameKind::Machine | NameKind::Body | NameKind::String | NameKind::Zones
                )
        })));
        let items = index
            .definitions
            .iter()
            .filter(|d| matches!(d.kind, NameKind::Term | NameKind::Instrument));
        all.extend(self.shown(items));
        let built_in = |(name, shape, _): &(&str, &str, &str)| {
            item(name, CompletionItemKind::FUNCTION, (*shape).to_string())
        };
        all.extend(words::BUILT_IN.iter().map(built_in));
        let keyword = |(name, _): &(&str, &str)| {
            item(name, CompletionItemKind::KEYWORD, "keyword".to_string())
        };
        all.extend(words::KEYWORDS.iter().map(keyword));
        all
    }
}

fn symbol(kind: NameKind) -> CompletionItemKind {
    match kind {
        NameKind::Term => CompletionItemKind::FUNCTION,
        NameKind::Instrument | NameKind::Keyboard | NameKind::Zones => CompletionItemKind::CLASS,
        NameKind::Param => CompletionItemKind::CONSTANT,
        NameKind::Machine => CompletionItemKind::ENUM,
        NameKind::MachineState => CompletionItemKind::ENUM_MEMBER,
        NameKind::Event => CompletionItemKind::EVENT,
        _ => CompletionItemKind::VARIABLE,
    }
}
