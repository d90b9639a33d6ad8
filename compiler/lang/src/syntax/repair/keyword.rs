//! Keywords used as names: `on` and `off` may name states and what is emitted, others are
//! reported. Where a declaration takes `on` or `off` all the same, the values of that name are it,
//! so that there is one message and not one for each.

use super::{Tokens, at};
use crate::diag::{Code, Diagnostic};
use crate::syntax::token::Token;

/// Makes a name of a keyword that stands where only a name can stand, and reports it.
pub(super) fn repair<'s>(
    text: &'s str,
    mut tokens: Tokens<'s>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Tokens<'s> {
    let mut taken = Vec::new();
    let mut open = Vec::new();
    for i in 1..tokens.len() {
        match tokens[i - 1].node {
            Token::LeftParen | Token::Open(_) => open.push(tokens[i - 1].node),
            Token::RightParen | Token::Close(_) => drop(open.pop()),
            _ => {}
        }
        let in_list = matches!(open.last(), Some(Token::Open(_)));
        if !tokens[i].node.is_hard_keyword() {
            continue;
        }
        let span = tokens[i].span;
        let name = &text[span.start as usize..span.end as usize];
        if may_be_on_or_off(&tokens, i) {
            tokens[i].node = Token::Word(name);
        } else if only_a_name(tokens[i - 1].node, at(&tokens, i + 1), in_list) {
            let message = format!("`{name}` is a keyword and cannot be a name");
            let hint = format!("choose another name, such as `{name}_1`");
            diagnostics.push(
                Diagnostic::new(Code::UnexpectedToken, span, message, "a name is expected")
                    .hint(hint),
            );
            if matches!(tokens[i].node, Token::On | Token::Off) {
                taken.push(tokens[i].node);
            }
            tokens[i].node = Token::Word(name);
        }
    }
    for i in 1..tokens.len() {
        // Behind what ends an expression `on` says what something acts on.
        if taken.contains(&tokens[i].node) && !tokens[i - 1].node.ends_expression() {
            let span = tokens[i].span;
            tokens[i].node = Token::Word(&text[span.start as usize..span.end as usize]);
        }
    }
    tokens
}

/// Whether `on` or `off` stands where a state does, or what is emitted.
fn may_be_on_or_off(tokens: &Tokens, i: usize) -> bool {
    use Token::*;
    let asked = match tokens[i - 1].node {
        Is | Arrow | Emit => true,
        Not => i > 1 && tokens[i - 2].node == Is,
        _ => false,
    };
    let leaves = matches!(at(tokens, i + 1), Some(Arrow));
    matches!(tokens[i].node, On | Off) && (asked || leaves)
}

/// Whether only a name can stand between these two; in a list in braces a value may stand before a
/// colon.
fn only_a_name(before: Token, after: Option<Token>, in_list: bool) -> bool {
    use Token::*;
    let declared = matches!(
        before,
        Instrument
            | Term
            | Keyboard
            | Sense
            | Param
            | Let
            | Body
            | States
            | State
            | Next
            | Event
            | Pulse
            | Force
            | Hold
    );
    match after {
        Some(Equals | Open(_)) => declared,
        Some(Colon) => declared || before == LeftParen || before == Comma && !in_list,
        Some(When) => matches!(before, Event | Hold | Arrow),
        Some(LeftParen) => before == Emit,
        Some(Arrow) => true,
        _ => false,
    }
}
