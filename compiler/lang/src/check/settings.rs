//! What keyboard and caller decide about one instrument.

use std::collections::BTreeMap;
use whippen_rate::Rate;

use super::Options;
use super::bank;
use super::diags::Diags;
use super::items::Items;
use super::keyboard::{Board, instrument_id};
use super::per_key::PerKey;
use super::sets::Set;
use crate::diag::{Code, Diagnostic};
use crate::syntax::ast::{Decl, DeclKind};
use crate::units::Quantity;
use whippen_source::Span;

/// A value set by the caller.
#[derive(Debug, Clone, Copy)]
pub struct SetValue {
    /// The value.
    pub value: Quantity,
    /// Whether a plain number is in SI.
    pub in_si: bool,
    /// Where it is set.
    pub span: Span,
}

/// The settings of one instrument.
pub struct Settings<'a> {
    /// Ticks per second.
    pub rate_hz: Rate,
    /// Whether a keyboard lists it.
    pub is_keyboard: bool,
    /// MIDI numbers of the lowest and highest key.
    pub keys: (u8, u8),
    /// Parameters set per key.
    pub per_key: BTreeMap<&'a str, PerKey<'a>>,
    /// Parameters set by the caller; they win over the keyboard.
    pub sets: BTreeMap<String, SetValue>,
}

impl Settings<'_> {
    /// No keyboard and nothing set.
    pub fn bare(options: &Options) -> Settings<'static> {
        let (per_key, sets) = (BTreeMap::new(), BTreeMap::new());
        Settings {
            rate_hz: options.usual_rate_hz(),
            is_keyboard: false,
            keys: (21, 108),
            per_key,
            sets,
        }
    }
}

/// The settings of an instrument: those of the first keyboard that lists it, and what the caller
/// sets in it.
pub fn of<'a>(
    instrument: usize,
    items: &Items<'a>,
    boards: &[Board<'a>],
    sets: &mut [Set],
    options: &Options,
    diags: &mut Diags,
) -> Settings<'a> {
    let mut settings = Settings::bare(options);
    let id = instrument_id(instrument);
    let mut listing = boards
        .iter()
        .filter(|b| b.keyboard.layout.instruments().contains(&id));
    if let Some(board) = listing.next() {
        settings.rate_hz = board.keyboard.rate_hz;
        settings.is_keyboard = true;
        let layout = &board.keyboard.layout;
        settings.keys = (layout.first_note, layout.last_note());
        let own = board.per_key.iter().filter(|p| p.instrument == id);
        settings.per_key = own.map(|p| (p.param.node.as_str(), p.clone())).collect();
        for other in listing {
            let name = &items.instruments[instrument].name.node;
            let message =
                format!("`{name}` is a program of two keyboards: it is checked for the first");
            diags.push(
                Diagnostic::new(
                    Code::TwoKeyboards,
                    other.ast.name.span,
                    message,
                    "not this one",
                )
                .also(board.ast.name.span, "this one")
                .hint("check the keyboards in separate files if their rates or settings differ"),
            );
        }
    }
    let ast = items.instruments[instrument];
    for set in sets
        .iter_mut()
        .filter(|s| s.instrument.as_ref().is_none_or(|i| *i == ast.name.node))
    {
        let names = param_names(&ast.decls).into_iter();
        for name in names.filter(|name| *name == set.name) {
            set.used = true;
            if let Some(value) = set.set_value() {
                settings.sets.insert(name, value);
            }
        }
    }
    settings
}

/// The names of parameters, those of the members of banks included.
pub fn param_names(decls: &[Decl]) -> Vec<String> {
    let mut names = Vec::new();
    for decl in decls {
        match &decl.kind {
            DeclKind::Param { name, .. } => names.push(name.node.clone()),
            DeclKind::Bank {
                name, range, decls, ..
            } => {
                for number in 0..bank::count(range).unwrap_or(0) {
                    let of_member = param_names(decls).into_iter();
                    names.extend(of_member.map(|own| format!("{}[{number}].{own}", name.node)));
                }
            }
            _ => {}
        }
    }
    names
}
