//! Ports of the keys of a keyboard: a key has one, which measures where it is or how far it is
//! turned. Only a keyboard without `keys`, which plays an instrument once, can have others.

use super::diags::Diags;
use super::keyboard::Board;
use super::types::Ty;
use crate::diag::{Code, Diagnostic};
use crate::model::{Model, Moves};

/// Reports the instruments whose ports no key has.
pub fn of_keys(boards: &[Board], models: &[Option<Model>], diags: &mut Diags) {
    for board in boards.iter().filter(|board| board.keys.is_some()) {
        let layout = &board.keyboard.layout;
        let plays = layout.instruments();
        let played = plays
            .into_iter()
            .filter_map(|id| models[id.index()].as_ref());
        for model in played {
            if let Some(diagnostic) = no_port(board, model) {
                diags.push(diagnostic);
            }
        }
    }
}

fn no_port(board: &Board, model: &Model) -> Option<Diagnostic> {
    let first = model.senses.first()?;
    let (span, message) = if first.moves == Moves::Not {
        let what = Ty::Real(first.dim).words();
        let message = format!(
            "`{}` senses {what}, and a key has no port for that",
            first.name
        );
        (first.span, message)
    } else {
        let second = model.senses.get(1)?;
        let message = format!(
            "`{}` is a second sense, and a key has one port",
            second.name
        );
        (second.span, message)
    };
    let keyboard = &board.ast.name.node;
    let keys = format!("`{keyboard}` plays `{}` on keys", model.name);
    Some(
        Diagnostic::new(Code::NoPort, span, message, "not on a key")
            .also(board.keys?, keys)
            .hint(format!(
                "take `keys` away: `{keyboard}` then plays `{}` once, with all its ports",
                model.name
            )),
    )
}
