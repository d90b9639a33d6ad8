//! Spaces between pieces of one line.

use super::pieces::Piece;
use crate::syntax::token::Token;

/// Whether a space stands between `pieces[at]` and the piece before it, both in the row that begins
/// at `row`.
pub(super) fn before(pieces: &[Piece], row: usize, at: usize) -> bool {
    use Token::*;
    let left = pieces[at - 1].token;
    match (left, pieces[at].token) {
        (LeftParen | LeftBracket | Dot, _)
        | (_, Comma | RightParen | LeftBracket | RightBracket | Colon | Prime)
        | (Open(_), Close(_)) => false,
        // A point or a power behind a number would be taken for a part of it or of its unit.
        (_, Dot) => matches!(left, Number(_)),
        (_, Caret) => has_unit(left),
        (Caret, _) => has_unit(pieces[at - 2].token),
        (Minus, _) => row < at - 1 && ends_value(pieces, row, at - 2),
        (_, LeftParen) => !is_called(pieces, row, at - 1) && !is_friction(pieces, row, at - 1),
        _ => true,
    }
}

fn has_unit(token: Token) -> bool {
    matches!(token, Token::Number(literal) if !literal.unit.is_empty())
}

/// Whether a value ends with a piece: it may end one, and is no keyword of its place.
pub(super) fn ends_value(pieces: &[Piece], row: usize, at: usize) -> bool {
    let token = pieces[at].token;
    let keyword = token.name().is_some() && (at == row || pieces[at - 1].token.ends_expression());
    token.ends_expression() && !keyword
}

/// Whether the piece before a round bracket is what is called: a name, and no keyword of its place.
pub(super) fn is_called(pieces: &[Piece], row: usize, at: usize) -> bool {
    pieces[at].token.name().is_some() && at > row && !pieces[at - 1].token.ends_expression()
}

/// Whether a piece is the name of a friction, behind the keyword that begins the row.
fn is_friction(pieces: &[Piece], row: usize, at: usize) -> bool {
    at == row + 1 && pieces[row].token == Token::Friction
}

/// `pieces[from..to]` on one line, comments left out.
pub(super) fn flat(pieces: &[Piece], row: usize, from: usize, to: usize) -> String {
    let mut text = String::new();
    for at in from..to {
        if at > from && before(pieces, row, at) {
            text.push(' ');
        }
        text.push_str(pieces[at].text);
    }
    text
}
