//! Tokens with the comments around them.

use crate::syntax::repair::types;
use crate::syntax::token::{Token, lex};

/// A comment on a line of its own.
#[derive(Debug, Clone, Copy)]
pub(super) struct Note<'s> {
    pub text: &'s str,
    /// Whether a blank line stands before it.
    pub blank: bool,
}

/// A token, as written, with its comments.
#[derive(Debug, Clone)]
pub(super) struct Piece<'s> {
    pub token: Token<'s>,
    pub text: &'s str,
    /// First byte.
    pub start: u32,
    /// The comments on lines of their own before it.
    pub before: Vec<Note<'s>>,
    /// Whether a blank line stands right before it.
    pub blank: bool,
    /// The comment behind it on its line.
    pub after: Option<&'s str>,
}

/// The pieces of a text, and the comments behind the last.
pub(super) fn pieces(text: &str) -> (Vec<Piece<'_>>, Vec<Note<'_>>) {
    let lexed = lex(0, text, &mut Vec::new());
    let tokens = types::join(text, lexed.tokens);
    let mut comments = lexed.comments.iter().peekable();
    let mut pieces: Vec<Piece> = Vec::with_capacity(tokens.len());
    let mut end = 0;
    for token in &tokens {
        let mut before = Vec::new();
        while let Some(comment) = comments.next_if(|c| c.span.start < token.span.start) {
            attach(
                text,
                end,
                comment.span.start,
                comment.node,
                pieces.last_mut(),
                &mut before,
            );
            end = comment.span.end;
        }
        let blank = newlines(text, end, token.span.start) > 1;
        let slice = &text[token.span.start as usize..token.span.end as usize];
        pieces.push(Piece {
            token: token.node,
            text: slice,
            start: token.span.start,
            before,
            blank,
            after: None,
        });
        end = token.span.end;
    }
    let mut tail = Vec::new();
    for comment in comments {
        attach(
            text,
            end,
            comment.span.start,
            comment.node,
            pieces.last_mut(),
            &mut tail,
        );
        end = comment.span.end;
    }
    (without_last_commas(pieces), tail)
}

/// Gives a comment to the piece whose line it ends, or else to what comes after it. `end` is the
/// end of what stands before the comment.
fn attach<'s>(
    text: &str,
    end: u32,
    start: u32,
    comment: &'s str,
    last: Option<&mut Piece<'s>>,
    before: &mut Vec<Note<'s>>,
) {
    let newlines = newlines(text, end, start);
    match last {
        Some(piece) if newlines == 0 && before.is_empty() => piece.after = Some(comment),
        _ => before.push(Note {
            text: comment,
            blank: newlines > 1,
        }),
    }
}

fn newlines(text: &str, start: u32, end: u32) -> usize {
    text[start as usize..end as usize].matches('\n').count()
}

/// Drops commas before closing brackets; their comments go to their neighbours.
fn without_last_commas(pieces: Vec<Piece>) -> Vec<Piece> {
    let mut kept: Vec<Piece> = Vec::with_capacity(pieces.len());
    let mut pieces = pieces.into_iter().peekable();
    while let Some(mut piece) = pieces.next() {
        let closes = pieces
            .peek_mut()
            .filter(|next| matches!(next.token, Token::RightParen | Token::Close(_)));
        let (Token::Comma, Some(next), Some(last)) = (piece.token, closes, kept.last_mut()) else {
            kept.push(piece);
            continue;
        };
        if last.after.is_none() && piece.before.is_empty() {
            last.after = piece.after.take();
        }
        let after = piece.after.map(|text| Note { text, blank: false });
        next.before
            .splice(0..0, piece.before.into_iter().chain(after));
    }
    kept
}
