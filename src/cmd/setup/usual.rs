//! Keys where nobody says how many there are.

use whippen_compiler::board::Board;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::model::Model;

/// The MIDI number of the first key where no keyboard says otherwise: A0.
pub const FIRST_NOTE: u8 = 21;

/// How many keys there are where nobody says otherwise.
pub const KEYS: u32 = 88;

/// As many keys, or one: what is no instrument of a key is played once.
pub fn usual_keys(model: &Model) -> u32 {
    if model.is_of_key() { KEYS } else { 1 }
}

/// How many keys a board has where nobody says: those that are wired, or the keyboard's.
pub(super) fn keys_of(board: &Board, layout: &Layout, chips: u32) -> u32 {
    match (&board.knob, &board.bench, &board.columns) {
        (Some(knob), ..) => chips * knob.count(),
        (_, Some(bench), _) => chips * bench.keys(),
        (.., Some(columns)) => chips * columns.keys(),
        (None, None, None) => layout.keys,
    }
}
