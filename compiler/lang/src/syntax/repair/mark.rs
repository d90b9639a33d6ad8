//! Tells names that begin something from names that are used.

use super::{Spanned, Tokens, assigns, at, defines, leaves};
use crate::syntax::token::{Level, Token};

/// Replaces a name that stands where a definition, a write or a transition may begin, and is
/// followed by its sign.
pub(super) fn mark(mut tokens: Tokens) -> Tokens {
    let mut open = Vec::new();
    for i in 0..tokens.len() {
        match tokens[i].node {
            Token::Open(level) => open.push(level),
            Token::Close(_) => drop(open.pop()),
            _ => {}
        }
        let (Some(name), Some(level)) = (tokens[i].node.name(), open.last()) else {
            continue;
        };
        let begins = match i.checked_sub(1).and_then(|before| at(&tokens, before)) {
            Some(Token::Open(_) | Token::Close(_) | Token::Text(_)) => true,
            Some(before) => before.ends_expression(),
            None => false,
        };
        tokens[i].node = match level {
            _ if !begins => continue,
            Level::Outer | Level::Bank
                if is_named_by_keyword(&tokens, i) || is_pushed(&tokens, i) =>
            {
                continue;
            }
            Level::Outer | Level::Bank if defines(&tokens, i) => Token::Defined(name),
            Level::Middle if leaves(&tokens, i) => Token::Left(name),
            Level::Middle | Level::Inner if assigns(&tokens, i) => Token::Assigned(name),
            _ => continue,
        };
    }
    tokens
}

/// Whether the name at a place stands behind `force NAME on`, and so is what is pushed, or behind
/// `sound NAME on`, and so is a side.
fn is_pushed(tokens: &[Spanned<Token>], i: usize) -> bool {
    let back = |steps: usize| i.checked_sub(steps).and_then(|before| at(tokens, before));
    back(1) == Some(Token::On)
        && back(2).is_some_and(|token| token.name().is_some())
        && matches!(back(3), Some(Token::Force | Token::Torque | Token::Sound))
}

/// Whether the name at a place stands behind a `torque`, `zones`, `feed` or `sound` that begins a
/// line: one that is no name in an expression.
fn is_named_by_keyword(tokens: &[Spanned<Token>], i: usize) -> bool {
    let back = |steps: usize| i.checked_sub(steps).and_then(|before| at(tokens, before));
    let torque = matches!(back(1), Some(Token::Torque | Token::Feed | Token::Sound));
    let zones = back(1) == Some(Token::Zones);
    (torque || zones)
        && match back(2) {
            Some(Token::Open(_) | Token::Close(_) | Token::Sharp(_) | Token::Text(_)) => true,
            // `noise noise`, and a `torque` behind it.
            Some(Token::Noise)
                if torque && back(3) == Some(Token::Noise) && !follows_sign(back(4)) =>
            {
                true
            }
            // `noise torque`, and a definition behind it.
            Some(Token::Noise) if torque && !follows_sign(back(3)) => false,
            // `noise zones` in an instrument; in a keyboard a name ends a setting so.
            Some(Token::Noise) if zones && begins_noise(back(3)) => false,
            // A noise may be called as it likes.
            Some(_) if torque && back(3) == Some(Token::Noise) => true,
            // What these lead is a value, unless they are names themselves.
            Some(token) if torque && leads_value(token) => {
                let before = back(3);
                !before.is_some_and(Token::ends_expression) || before.is_some_and(leads_value)
            }
            // `event name every` leads a value, too.
            Some(Token::Every) if back(4) == Some(Token::Event) => false,
            Some(token) => token.ends_expression(),
            None => false,
        }
}

/// Whether a `noise` behind such a token begins a declaration: it names nothing in a keyboard.
fn begins_noise(before: Option<Token>) -> bool {
    let sets = matches!(before, Some(Token::Board | Token::Device | Token::Programs));
    !sets && !follows_sign(before)
}

/// Whether what stands behind such a token is part of an expression.
fn follows_sign(before: Option<Token>) -> bool {
    let ends =
        |token: Token| token.ends_expression() || matches!(token, Token::Open(_) | Token::Close(_));
    before.is_some_and(|token| !ends(token))
}

/// Whether a value follows the word where it is a keyword.
fn leads_value(token: Token) -> bool {
    use Token::*;
    matches!(token, Over | Slew | Lasting | Glide | At)
}
