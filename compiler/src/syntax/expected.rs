//! Syntax errors in words.
//!
//! The generated parser knows which tokens it could have gone on with; a person wants to hear "an expression" or
//! "`when`". Errors that stand close behind another one are its consequences and are dropped.

use lalrpop_util::ParseError;

use super::ast::Spanned;
use super::build::Error;
use super::token::Token;
use crate::diag::{Code, Diagnostic};
use crate::source::Span;

/// So many tokens must have been understood since the last error before another one is believed.
const UNDERSTOOD: usize = 3;

/// The diagnostics of the errors worth telling.
pub(super) fn describe(file: u32, text: &str, tokens: &[Spanned<Token>], mut errors: Vec<Error>) -> Vec<Diagnostic> {
    errors.sort_by_key(|e| place(&e.error).0);
    let mut believed_from = 0;
    let mut diagnostics = Vec::new();
    for error in errors {
        let (start, end) = place(&error.error);
        let index = tokens.partition_point(|t| t.span.start < start);
        if index >= believed_from {
            let found = tokens.get(index).map(|t| t.node);
            let span = Span { file, start, end };
            let source = text.get(start as usize..end as usize).unwrap_or_default();
            diagnostics.push(diagnostic(expected(&error.error), found, source, span));
        }
        believed_from = believed_from.max(index + error.dropped_tokens.len() + UNDERSTOOD);
    }
    diagnostics
}

type Parse<'s> = ParseError<u32, Token<'s>, &'static str>;

fn place(error: &Parse) -> (u32, u32) {
    match error {
        ParseError::UnrecognizedToken { token, .. } | ParseError::ExtraToken { token } => (token.0, token.2),
        ParseError::UnrecognizedEof { location, .. } | ParseError::InvalidToken { location } => (*location, *location),
        ParseError::User { .. } => (0, 0),
    }
}

fn expected<'e>(error: &'e Parse) -> &'e [String] {
    match error {
        ParseError::UnrecognizedToken { expected, .. } | ParseError::UnrecognizedEof { expected, .. } => expected,
        _ => &[],
    }
}

fn diagnostic(expected: &[String], found: Option<Token>, source: &str, span: Span) -> Diagnostic {
    let expected: Vec<&str> = expected.iter().map(|e| e.trim_matches('"')).collect();
    let wanted = in_words(&expected);
    let found_text = match found {
        Some(_) if !source.is_empty() => format!("`{source}`"),
        _ => "the end".to_string(),
    };
    let diagnostic = Diagnostic::new(
        Code::UnexpectedToken,
        span,
        format!("expected {wanted}, found {found_text}"),
        format!("expected {wanted}"),
    );
    match found.and_then(|token| advice(token, &expected)) {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

/// What to do about some frequent mistakes.
fn advice(found: Token, expected: &[&str]) -> Option<&'static str> {
    use Token::*;
    let operator = expected.contains(&"and");
    match found {
        Less | LessEqual | Greater | GreaterEqual if operator => {
            Some("comparisons are not chained: write `a < b and b < c`")
        }
        Equals if operator => Some("`=` defines; values are compared with `<`, `<=`, `>`, `>=`, states with `is`"),
        Assign => Some("`:=` stands only in the actions of an event or a transition"),
        Comma if operator => Some("declarations need no separator"),
        _ if found.is_hard_keyword() && expected.contains(&"word") && !expected.contains(&"number") => {
            Some("a keyword cannot be a name")
        }
        _ => None,
    }
}

/// Groups of tokens with one name, the largest first: a group is named when all its tokens are expected.
const GROUPS: &[(&str, &[&str])] = &[
    ("an instrument, a term or a keyboard", &["instrument", "term", "keyboard"]),
    (
        "a declaration",
        &["sense", "live", "param", "let", "body", "states", "state", "next", "event", "pulse", "hold", "defined"],
    ),
    ("an expression", &["number", "word", "(", "-", "on", "off"]),
    ("an action", &["emit", "fire", "assigned"]),
    ("a setting", &["board", "device", "rate", "keys", "programs", "word"]),
    ("a line of the body", &["angle", "position", "inertia", "mass", "torque", "force"]),
    ("a note", &["sharp"]),
    ("a name", &["word"]),
    ("a transition", &["left"]),
];

/// Tokens that may follow almost anything; they are named only where nothing else is expected.
const OPERATORS: &[&str] = &["+", "-", "*", "/", "^", "<", "<=", ">", ">=", "and", "or", "is", "'", ".", "("];

/// The expected tokens as a person would say it.
fn in_words(expected: &[&str]) -> String {
    let mut left: Vec<&str> = expected.to_vec();
    let mut words: Vec<String> = Vec::new();
    for (name, members) in GROUPS {
        if members.iter().all(|m| left.contains(m)) {
            words.push((*name).to_string());
            let whole = members.contains(&"number") || members.contains(&"word");
            left.retain(|e| !(members.contains(e) || whole && begins_expression(e)));
        }
    }
    let operators = left.contains(&"+") || left.contains(&"and");
    left.retain(|e| !(operators && OPERATORS.contains(e)) && *e != "broken");
    for token in left {
        let sign = token.trim_end_matches(|c: char| c.is_ascii_digit());
        let sign = match sign {
            "defined" => "a definition".to_string(),
            _ => format!("`{sign}`"),
        };
        words.push(sign);
    }
    if operators {
        words.push("an operator".to_string());
    }
    words.dedup();
    match words.pop() {
        None => "nothing more".to_string(),
        Some(last) if words.is_empty() => last,
        Some(last) => format!("{} or {last}", words.join(", ")),
    }
}

/// Whether a token is implied where an expression or a name is expected.
fn begins_expression(token: &str) -> bool {
    super::token::SOFT_KEYWORDS.contains(&token) || matches!(token, "if" | "not" | "broken" | "number")
}
