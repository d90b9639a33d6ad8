//! Rows cut into cells, and cells in columns.

use super::pieces::Piece;
use super::rows::{Row, RowKind};
use super::space;
use crate::syntax::token::Token;

/// A part of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    /// What it begins with; cells of one column begin alike.
    pub key: String,
    pub text: String,
    /// Its columns: at least those of its text.
    pub width: usize,
}

impl Cell {
    pub fn new(key: &str, text: String) -> Cell {
        Cell {
            key: key.to_string(),
            width: text.chars().count(),
            text,
        }
    }
}

/// Where a row is cut: the first piece of every cell but the first, and what the cell begins with.
pub(super) fn cuts(pieces: &[Piece], row: &Row) -> Vec<(usize, String)> {
    let head = row.from..row.block.as_ref().map_or(row.to, |b| b.open);
    let signs: &[(Token, &str)] = match row.kind {
        RowKind::Param => &[
            (Token::Equals, "="),
            (Token::In, "in"),
            (Token::Glide, "glide"),
        ],
        RowKind::Force if is_on_a_sense(pieces, row) => &[(Token::On, "on"), (Token::Equals, "=")],
        RowKind::Definition | RowKind::Force | RowKind::PerKey => &[(Token::Equals, "=")],
        RowKind::State => &[(Token::Colon, ":"), (Token::In, "in"), (Token::Equals, "=")],
        RowKind::Pulse => &[
            (Token::Colon, ":"),
            (Token::In, "in"),
            (Token::Lasting, "lasting"),
        ],
        RowKind::Transition => &[(Token::Arrow, "->"), (Token::When, "when")],
        RowKind::Event => &[(Token::When, "when"), (Token::Every, "when")],
        RowKind::Hold => &[(Token::When, "when")],
        RowKind::Part | RowKind::Setting => return vec![(row.from + 1, String::new())],
        RowKind::Item
        | RowKind::Sense
        | RowKind::States
        | RowKind::Body
        | RowKind::Bank
        | RowKind::String
        | RowKind::Action
        | RowKind::Table
        | RowKind::Noise => &[],
    };
    let mut cuts: Vec<(usize, String)> = Vec::new();
    let mut at = head.start + 1;
    for (sign, key) in signs {
        let Some(found) =
            (at..head.end).find(|i| pieces[*i].token == *sign && is_keyword(pieces, *i))
        else {
            continue;
        };
        // The type follows its colon.
        at = found + 1;
        cuts.push((
            if *sign == Token::Colon { at } else { found },
            (*key).to_string(),
        ));
    }
    if let (RowKind::Definition, Some((equals, _))) = (row.kind, cuts.first()) {
        let arguments = arguments(pieces, equals + 1, head.end);
        cuts.extend(arguments);
    }
    cuts
}

/// Whether a force says what it acts on: `on` is a value elsewhere.
fn is_on_a_sense(pieces: &[Piece], row: &Row) -> bool {
    let on = pieces[..row.to].get(row.from + 2);
    on.is_some_and(|piece| piece.token == Token::On)
}

/// Whether a word that is a keyword of some places only stands in one of them.
fn is_keyword(pieces: &[Piece], at: usize) -> bool {
    let token = pieces[at].token;
    token.name().is_none() || pieces[at - 1].token.ends_expression()
}

/// The named arguments of a call that is all of a value, from the second argument on.
fn arguments(pieces: &[Piece], from: usize, to: usize) -> Vec<(usize, String)> {
    let is_call = to > from + 2
        && pieces[from].token.name().is_some()
        && pieces[from + 1].token == Token::LeftParen;
    if !is_call || close(pieces, from + 1, to) != Some(to - 1) {
        return Vec::new();
    }
    let commas = commas(pieces, from + 2, to - 1);
    let named = |comma: &usize| {
        pieces
            .get(comma + 2)
            .is_some_and(|p| p.token == Token::Colon)
    };
    let key = |argument: usize| format!("{} {} {argument}", pieces[from].text, commas.len());
    let cuts = commas.iter().enumerate().filter(|(_, comma)| named(comma));
    cuts.map(|(n, comma)| (comma + 1, key(n))).collect()
}

/// The partner of the opening bracket at `open`.
pub(super) fn close(pieces: &[Piece], open: usize, to: usize) -> Option<usize> {
    let mut depth = 0usize;
    (open..to).find(|i| {
        depth = deeper(depth, pieces[*i].token);
        depth == 0
    })
}

/// How many brackets are open behind a token.
pub(super) fn deeper(depth: usize, token: Token) -> usize {
    match token {
        Token::LeftParen | Token::LeftBracket | Token::Open(_) => depth + 1,
        Token::RightParen | Token::RightBracket | Token::Close(_) => depth.saturating_sub(1),
        _ => depth,
    }
}

/// The commas outside of brackets.
pub(super) fn commas(pieces: &[Piece], from: usize, to: usize) -> Vec<usize> {
    let mut depth = 0;
    let outside = |i: &usize| {
        depth = deeper(depth, pieces[*i].token);
        depth == 0 && pieces[*i].token == Token::Comma
    };
    (from..to).filter(outside).collect()
}

/// The cells of a row, up to its block, cut at the first `most` places.
pub(super) fn cells(pieces: &[Piece], row: &Row, most: usize) -> Vec<Cell> {
    let end = row.block.as_ref().map_or(row.to, |b| b.open);
    let cuts = cuts(pieces, row);
    let starts = std::iter::once((row.from, String::new()))
        .chain(cuts)
        .take(most.saturating_add(1))
        .collect::<Vec<_>>();
    let ends = starts.iter().skip(1).map(|(at, _)| *at).chain([end]);
    let flat = |from, to| space::flat(pieces, row.from, from, to);
    starts
        .iter()
        .zip(ends)
        .map(|((from, key), to)| Cell::new(key, flat(*from, to)))
        .collect()
}

/// Gives cells of one column one width, as far as the rows around them have a cell behind them.
pub(super) fn align(rows: &mut [&mut Vec<Cell>], column: usize) {
    let key = |row: &Vec<Cell>| row.get(column + 1).map(|cell| cell.key.clone());
    for run in rows.chunk_by_mut(|a, b| key(a) == key(b)) {
        if key(run[0]).is_none() {
            continue;
        }
        let width = run.iter().map(|row| row[column].width).max().unwrap_or(0);
        run.iter_mut().for_each(|row| row[column].width = width);
        align(run, column + 1);
    }
}

/// The cells side by side; the last one without spaces behind it.
pub(super) fn join(cells: &[Cell]) -> String {
    // A name may be longer than what `format!` pads to.
    let padded = |cell: &Cell| {
        let room = cell.width.saturating_sub(cell.text.chars().count()) + 1;
        cell.text.clone() + &" ".repeat(room)
    };
    let text: String = cells.iter().map(padded).collect();
    text.trim_end().to_string()
}
