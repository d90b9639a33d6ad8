//! Tells names that begin something from names that are used.

use super::{Tokens, assigns, at, defines, leaves};
use crate::syntax::token::Token;

/// Replaces a name that stands where a definition, a write or a transition may begin, and is followed by its sign.
pub(super) fn mark(mut tokens: Tokens) -> Tokens {
    for i in 0..tokens.len() {
        let Some(name) = tokens[i].node.name() else { continue };
        let begins = match i.checked_sub(1).and_then(|before| at(&tokens, before)) {
            Some(Token::Open(_) | Token::Close(_)) => true,
            Some(before) => before.ends_expression(),
            None => false,
        };
        if begins && assigns(&tokens, i) {
            tokens[i].node = Token::Assigned(name);
        } else if begins && defines(&tokens, i) {
            tokens[i].node = Token::Defined(name);
        } else if begins && leaves(&tokens, i) {
            tokens[i].node = Token::Left(name);
        }
    }
    tokens
}
