//! Types that are written as units (`kg/m`, `1/s`): their tokens become one, so that a type is one
//! name to the grammar.
//!
//! A type stands behind the colon of `sense`, `state`, `pulse`, `delay` and `table`, behind the
//! `over` of a table, and behind the colon of the parameters and results of a term; nowhere else is
//! anything joined.

use super::{Spanned, Tokens, at};
use crate::syntax::token::Token;
use whippen_source::Span;

/// Joins them.
pub(in crate::syntax) fn join<'s>(text: &'s str, tokens: Tokens<'s>) -> Tokens<'s> {
    let mut joined = Vec::with_capacity(tokens.len());
    let mut in_head = false;
    let mut i = 0;
    while i < tokens.len() {
        match tokens[i].node {
            Token::Term => in_head = true,
            Token::Open(_) | Token::Close(_) => in_head = false,
            _ => {}
        }
        let end = match begins_type(&tokens, i, in_head) {
            true => end_of_units(&tokens, i)
                .filter(|end| is_one_line(text, tokens[i].span, tokens[*end].span))
                .unwrap_or(i),
            false => i,
        };
        let token = tokens[i];
        joined.push(match end > i {
            false => token,
            true => {
                let (start, end) = (token.span.start, tokens[end].span.end);
                Spanned {
                    node: Token::Word(&text[start as usize..end as usize]),
                    span: Span { end, ..token.span },
                }
            }
        });
        i = end + 1;
    }
    joined
}

/// Whether no line ends, and so no comment stands, between the begin of one span and the end of
/// another.
fn is_one_line(text: &str, first: Span, last: Span) -> bool {
    !text[first.start as usize..last.end as usize].contains('\n')
}

/// Whether a type stands at a place.
fn begins_type(tokens: &[Spanned<Token>], i: usize, in_head: bool) -> bool {
    let back = |steps: usize| i.checked_sub(steps).and_then(|before| at(tokens, before));
    let declared = matches!(
        back(3),
        Some(Token::Sense | Token::State | Token::Pulse | Token::Delay | Token::Table)
    );
    back(1) == Some(Token::Colon) && (in_head || declared)
        || back(1) == Some(Token::Over) && is_of_table(tokens, i)
}

/// Whether what stands before a place is `table name: type over`.
fn is_of_table(tokens: &[Spanned<Token>], i: usize) -> bool {
    // As far back as a type of some factors is long.
    const FAR: usize = 24;
    let colon = tokens[..i]
        .iter()
        .rev()
        .take(FAR)
        .position(|t| t.node == Token::Colon);
    let table = colon.and_then(|back| i.checked_sub(back + 3));
    table.is_some_and(|table| tokens[table].node == Token::Table)
}

/// The last token of factors joined by `*` and `/`; none where there is but a name.
fn end_of_units(tokens: &[Spanned<Token>], first: usize) -> Option<usize> {
    let mut last = end_of_factor(tokens, first)?;
    while matches!(at(tokens, last + 1), Some(Token::Star | Token::Slash)) {
        last = end_of_factor(tokens, last + 2)?;
    }
    (last > first).then_some(last)
}

/// The last token of `1`, `kg`, `m^2` or `s^-1`.
fn end_of_factor(tokens: &[Spanned<Token>], i: usize) -> Option<usize> {
    let is_number = |i: usize| matches!(at(tokens, i), Some(Token::Number(n)) if n.unit.is_empty());
    if is_number(i) {
        return Some(i);
    }
    at(tokens, i)?.name()?;
    if at(tokens, i + 1) != Some(Token::Caret) {
        return Some(i);
    }
    let exponent = i + 2 + usize::from(at(tokens, i + 2) == Some(Token::Minus));
    is_number(exponent).then_some(exponent)
}
