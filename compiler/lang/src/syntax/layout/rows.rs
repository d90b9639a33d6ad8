//! What stands on lines of its own, found with the help of the tree.

use super::pieces::Piece;
use crate::syntax::ast::{BodyPart, Decl, DeclKind, Item, Setting};
use crate::syntax::token::Token;

/// What a row is. Neighbours of one kind share columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowKind {
    Item,
    Sense,
    Param,
    /// `let`, `next`, `feed`, a result.
    Definition,
    States,
    State,
    Body,
    String,
    Bank,
    Event,
    /// `pulse`, `delay`.
    Pulse,
    Table,
    Hold,
    Noise,
    /// `force`, `torque`, `sound`.
    Force,
    Transition,
    Part,
    Action,
    Setting,
    PerKey,
}

/// Some pieces that begin a line: `pieces[from..to]`.
#[derive(Debug)]
pub(super) struct Row {
    pub kind: RowKind,
    pub from: usize,
    /// One past its last piece.
    pub to: usize,
    /// Its block in braces.
    pub block: Option<Block>,
}

/// `{`, rows, `}`
#[derive(Debug)]
pub(super) struct Block {
    /// Index of the `{`; the `}` is the last piece of the row.
    pub open: usize,
    pub rows: Vec<Row>,
}

/// Where a row begins, what it is, and the rows in its block.
type Start<'a> = (usize, RowKind, Inside<'a>);

/// What a block may hold.
enum Inside<'a> {
    Nothing,
    Decls(&'a [Decl]),
    Settings(&'a [Setting]),
    /// Rows of one kind without blocks in them, by their first bytes.
    Plain(RowKind, Vec<u32>),
    Transitions(Vec<(u32, Vec<u32>)>),
}

/// The rows of a file.
pub(super) fn items(pieces: &[Piece], items: &[Item]) -> Vec<Row> {
    rows(
        pieces,
        items.iter().map(|i| item(pieces, i)).collect(),
        pieces.len(),
    )
}

fn item<'a>(pieces: &[Piece], item: &'a Item) -> Start<'a> {
    let (span, inside) = match item {
        Item::Instrument(i) => (i.span, Inside::Decls(&i.decls)),
        Item::Term(t) => (t.span, Inside::Decls(&t.decls)),
        Item::Keyboard(k) => (k.span, Inside::Settings(&k.settings)),
    };
    (index(pieces, span.start), RowKind::Item, inside)
}

/// The piece that begins at a byte.
fn index(pieces: &[Piece], start: u32) -> usize {
    pieces.partition_point(|p| p.start < start)
}

/// Every row reaches to the next.
fn rows(pieces: &[Piece], starts: Vec<Start>, end: usize) -> Vec<Row> {
    let ends: Vec<usize> = starts
        .iter()
        .skip(1)
        .map(|(from, ..)| *from)
        .chain([end])
        .collect();
    starts
        .into_iter()
        .zip(ends)
        .map(|((from, kind, inside), to)| row(pieces, from, to, kind, inside))
        .collect()
}

fn row(pieces: &[Piece], from: usize, to: usize, kind: RowKind, inside: Inside) -> Row {
    let brace = pieces[from..to]
        .iter()
        .position(|p| matches!(p.token, Token::Open(_)));
    // The braces of a keyboard's line and of a table hold a list.
    let block = brace
        .filter(|_| !matches!(kind, RowKind::PerKey | RowKind::Setting | RowKind::Table))
        .map(|at| {
            let at_byte = |start: u32| index(pieces, start);
            let starts = match inside {
                Inside::Nothing => Vec::new(),
                Inside::Decls(decls) => decls.iter().map(|d| decl(pieces, d)).collect(),
                Inside::Settings(settings) => settings.iter().map(|s| setting(pieces, s)).collect(),
                Inside::Plain(kind, starts) => starts
                    .into_iter()
                    .map(|s| (at_byte(s), kind, Inside::Nothing))
                    .collect(),
                Inside::Transitions(all) => all
                    .into_iter()
                    .map(|(s, actions)| {
                        (
                            at_byte(s),
                            RowKind::Transition,
                            Inside::Plain(RowKind::Action, actions),
                        )
                    })
                    .collect(),
            };
            Block {
                open: from + at,
                rows: rows(pieces, starts, to - 1),
            }
        });
    Row {
        kind,
        from,
        to,
        block,
    }
}

fn decl<'a>(pieces: &[Piece], decl: &'a Decl) -> Start<'a> {
    let starts =
        |actions: &[crate::syntax::ast::Action]| actions.iter().map(|a| a.span.start).collect();
    let (kind, inside) = match &decl.kind {
        DeclKind::Sense { .. } => (RowKind::Sense, Inside::Nothing),
        DeclKind::Param { .. } => (RowKind::Param, Inside::Nothing),
        DeclKind::Let { .. }
        | DeclKind::Next { .. }
        | DeclKind::Feed { .. }
        | DeclKind::Result { .. } => (RowKind::Definition, Inside::Nothing),
        DeclKind::States { transitions, .. } => {
            let all = transitions
                .iter()
                .map(|t| (t.span.start, starts(&t.actions)))
                .collect();
            (RowKind::States, Inside::Transitions(all))
        }
        DeclKind::State { .. } => (RowKind::State, Inside::Nothing),
        DeclKind::Body { parts, .. } => (
            RowKind::Body,
            Inside::Plain(RowKind::Part, parts.iter().map(part_start).collect()),
        ),
        DeclKind::String { parts, .. } => {
            let all = parts.iter().map(|part| part.span().start).collect();
            (RowKind::String, Inside::Plain(RowKind::Part, all))
        }
        DeclKind::Event { actions, .. } => (
            RowKind::Event,
            Inside::Plain(RowKind::Action, starts(actions)),
        ),
        DeclKind::Pulse { .. } | DeclKind::Delay { .. } => (RowKind::Pulse, Inside::Nothing),
        DeclKind::Table { .. } => (RowKind::Table, Inside::Nothing),
        DeclKind::Noise { .. } => (RowKind::Noise, Inside::Nothing),
        DeclKind::Bank { decls, .. } => (RowKind::Bank, Inside::Decls(decls)),
        DeclKind::Hold { .. } => (RowKind::Hold, Inside::Nothing),
        DeclKind::Force { .. } | DeclKind::Sound { .. } => (RowKind::Force, Inside::Nothing),
    };
    (index(pieces, decl.span.start), kind, inside)
}

fn part_start(part: &BodyPart) -> u32 {
    match part {
        BodyPart::Coordinate { span, .. }
        | BodyPart::Inertia { span, .. }
        | BodyPart::Torque { span, .. }
        | BodyPart::Friction { span, .. } => span.start,
    }
}

/// A setting begins with its keyword, right before what the tree holds of it.
fn setting<'a>(pieces: &[Piece], setting: &Setting) -> Start<'a> {
    let first = match setting {
        Setting::PerKey { instrument, .. } => {
            return (
                index(pieces, instrument.span.start),
                RowKind::PerKey,
                Inside::Nothing,
            );
        }
        Setting::Board { name, .. }
        | Setting::Device(name)
        | Setting::DeviceFile(name)
        | Setting::Keys(name, _) => name.span.start,
        Setting::Rate(rate) => rate.span.start,
        Setting::Zones { name, .. } => name.span.start,
        Setting::Programs(names) => names.first().map_or(0, |n| n.span.start),
    };
    (
        index(pieces, first).saturating_sub(1),
        RowKind::Setting,
        Inside::Nothing,
    )
}
