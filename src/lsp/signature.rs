//! The call around a place: which term, and which of its parameters is being written.

use lsp_types::{
    Documentation, MarkupContent, MarkupKind, ParameterInformation, ParameterLabel, Position,
    SignatureHelp, SignatureInformation,
};
use whippen_compiler::index::{Definition, NameKind};
use whippen_compiler::syntax::ast::Spanned;
use whippen_compiler::syntax::token::{Token, lex};

use super::analysis::Analysis;
use super::{text, words};

/// A call that is not over yet.
pub struct Call<'s> {
    pub callee: &'s str,
    /// Commas since its bracket.
    pub commas: usize,
    /// The parameter named in the present argument.
    pub named: Option<&'s str>,
}

/// The innermost call around a place.
pub fn call(source: &str, byte: usize) -> Option<Call<'_>> {
    let tokens = lex(0, source, &mut Vec::new()).tokens;
    let before = &tokens[..tokens.partition_point(|t| t.span.end as usize <= byte)];
    let (mut depth, mut commas, mut argument) = (0usize, 0, before.len());
    for (n, token) in before.iter().enumerate().rev() {
        match token.node {
            Token::RightParen => depth += 1,
            Token::LeftParen if depth > 0 => depth -= 1,
            Token::LeftParen => {
                let callee = n.checked_sub(1).and_then(|n| before[n].node.name())?;
                let named = named(if commas == 0 {
                    &before[n + 1..]
                } else {
                    &before[argument..]
                });
                return Some(Call {
                    callee,
                    commas,
                    named,
                });
            }
            Token::Comma if depth == 0 => {
                argument = if commas == 0 { n + 1 } else { argument };
                commas += 1;
            }
            // No call reaches over a brace or a declaration.
            Token::Open(_) | Token::Close(_) | Token::Let | Token::Param | Token::Equals => {
                return None;
            }
            _ => {}
        }
    }
    None
}

fn named<'s>(argument: &[Spanned<Token<'s>>]) -> Option<&'s str> {
    match argument {
        [name, colon, ..] if colon.node == Token::Colon => name.node.name(),
        _ => None,
    }
}

/// The parameters of a term.
pub fn parameters<'a>(
    analysis: &'a Analysis,
    term: &str,
) -> Option<(&'a Definition, Vec<&'a Definition>)> {
    let term = &analysis.index.definitions[analysis.index.item_named(term, NameKind::Term)?];
    let all = analysis
        .index
        .inside(term.item)
        .map(|(_, d)| d)
        .filter(|d| d.kind == NameKind::Parameter);
    Some((term, all.collect()))
}

/// The help for the call around a place.
pub fn help(analysis: &Analysis, position: Position) -> Option<SignatureHelp> {
    let source = analysis.text(0);
    let call = call(source, text::byte(source, position))?;
    let Callee { label, names, doc } = match parameters(analysis, call.callee) {
        Some((term, parameters)) => Callee::of_term(analysis, term, &parameters),
        None => Callee::built_in(call.callee)?,
    };
    let of_name = |name: &str| names.iter().position(|n| n.split(':').next() == Some(name));
    let active = call
        .named
        .map_or(Some(call.commas), of_name)
        .map(|n| n as u32);
    let parameter = |name: &String| ParameterInformation {
        label: ParameterLabel::Simple(name.clone()),
        documentation: None,
    };
    let signature = SignatureInformation {
        label,
        documentation: Some(Documentation::MarkupContent(MarkupContent {
            kind: MarkupKind::Markdown,
            value: doc,
        })),
        parameters: Some(names.iter().map(parameter).collect()),
        active_parameter: active,
    };
    Some(SignatureHelp {
        signatures: vec![signature],
        active_signature: Some(0),
        active_parameter: active,
    })
}

/// What is shown of what is called.
struct Callee {
    label: String,
    /// Its parameters, as they stand in the label.
    names: Vec<String>,
    doc: String,
}

impl Callee {
    fn of_term(analysis: &Analysis, term: &Definition, parameters: &[&Definition]) -> Callee {
        let shown = |d: &Definition| format!("{}: {}", d.name, d.ty.as_deref().unwrap_or_default());
        let names: Vec<String> = parameters.iter().map(|d| shown(d)).collect();
        let all = analysis.index.inside(term.item).map(|(_, d)| d);
        let results: Vec<String> = all
            .filter(|d| d.kind == NameKind::Result)
            .map(shown)
            .collect();
        Callee {
            label: format!(
                "{}({}) -> {}",
                term.name,
                names.join(", "),
                results.join(", ")
            ),
            names,
            doc: term.doc.clone(),
        }
    }

    fn built_in(callee: &str) -> Option<Callee> {
        let (_, shape, what) = words::BUILT_IN.iter().find(|(name, ..)| *name == callee)?;
        let inside = shape
            .split_once('(')
            .map_or("", |(_, rest)| rest.trim_end_matches(')'));
        Some(Callee {
            label: (*shape).to_string(),
            names: inside.split(", ").map(str::to_string).collect(),
            doc: (*what).to_string(),
        })
    }
}
