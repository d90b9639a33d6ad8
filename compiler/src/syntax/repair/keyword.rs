//! Keywords used as names.

use super::{Tokens, at};
use crate::diag::{Code, Diagnostic};
use crate::syntax::token::Token;

/// Makes a name of a keyword that stands where only a name can stand, and reports it.
pub(super) fn repair<'s>(text: &'s str, mut tokens: Tokens<'s>, diagnostics: &mut Vec<Diagnostic>) -> Tokens<'s> {
    for i in 1..tokens.len() {
        if !tokens[i].node.is_hard_keyword() {
            continue;
        }
        let (before, after) = (tokens[i - 1].node, at(&tokens, i + 1));
        let named = match after {
            Some(Token::Equals | Token::Open(_)) => introduces(before),
            Some(Token::Colon) => introduces(before) || matches!(before, Token::LeftParen | Token::Comma),
            _ => false,
        };
        if named {
            let span = tokens[i].span;
            let name = &text[span.start as usize..span.end as usize];
            let message = format!("`{name}` is a keyword and cannot be a name");
            let hint = format!("choose another name, such as `{name}_1`");
            diagnostics.push(Diagnostic::new(Code::UnexpectedToken, span, message, "a name is expected").hint(hint));
            tokens[i].node = Token::Word(name);
        }
    }
    tokens
}

/// Whether the keyword is followed by the name of what it declares.
fn introduces(token: Token) -> bool {
    use Token::*;
    matches!(token, Instrument | Term | Keyboard | Sense | Param | Let | Body | States | State | Next | Pulse | Force)
}
