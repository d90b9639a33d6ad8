//! Repairs between lexer and grammar: mistakes that are easier to see in the row of tokens than in
//! the grammar.
//!
//! ```text
//!   tokens -> keyword   a keyword used as a name becomes a name
//!          -> types     a type that is written as a unit becomes one name
//!          -> adjacent  a number followed by a word: an unknown unit, or a `*` is missing
//!          -> bracket   every bracket gets its partner; braces get their level
//!          -> mark      names that begin a definition, a write or a transition are told from other names
//! ```
//!
//! Afterwards brackets are balanced, and the beginning of everything that the grammar can begin
//! anew with is a token of its own kind, so that its recovery never leaves a block by the wrong
//! brace. Every change is reported, except marks and
//! joined types.

mod adjacent;
mod bracket;
mod keyword;
mod mark;
pub(in crate::syntax) mod types;

use super::ast::Spanned;
use super::token::Token;
use crate::diag::Diagnostic;

/// Tokens with their places.
type Tokens<'s> = Vec<Spanned<Token<'s>>>;

/// Runs all repairs.
pub(super) fn repair<'s>(
    text: &'s str,
    tokens: Tokens<'s>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Tokens<'s> {
    let tokens = keyword::repair(text, tokens, diagnostics);
    let tokens = types::join(text, tokens);
    let tokens = adjacent::repair(text, tokens, diagnostics);
    let tokens = bracket::repair(tokens, diagnostics);
    mark::mark(tokens)
}

/// The token at a place, where there is one.
fn at<'s>(tokens: &[Spanned<Token<'s>>], index: usize) -> Option<Token<'s>> {
    tokens.get(index).map(|t| t.node)
}

/// Whether the name at a place is followed by `=`.
fn defines(tokens: &[Spanned<Token>], index: usize) -> bool {
    matches!(at(tokens, index + 1), Some(Token::Equals))
}

/// Whether the name at a place is followed by `:=` or `' :=`.
fn assigns(tokens: &[Spanned<Token>], index: usize) -> bool {
    match at(tokens, index + 1) {
        Some(Token::Assign) => true,
        Some(Token::Prime) => matches!(at(tokens, index + 2), Some(Token::Assign)),
        _ => false,
    }
}

/// Whether the name at a place is followed by `->`.
fn leaves(tokens: &[Spanned<Token>], index: usize) -> bool {
    matches!(at(tokens, index + 1), Some(Token::Arrow))
}
