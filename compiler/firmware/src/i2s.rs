//! Constants of a sound output's texts (`i2s.s`, `i2s_start.s`): its pins, and where in a tick its
//! words are taken.

use whippen_board::{Board, SoundPort};

/// Ticks after which they are on time: the first one is served when the start is over, wherever in
/// its period that is, and each leaves some of the lateness behind.
const UNSENT_AT_START: u32 = 64;

/// The constants: `I2S` is 0 where the board has no sound output.
pub(super) fn constants(board: &Board) -> Vec<(String, i64)> {
    let Some(port) = board.i2s else {
        return vec![("I2S".into(), 0)];
    };
    let all = [
        ("I2S", 1),
        ("PIN_SOUND_CLOCK", port.clock),
        ("PIN_SOUND_SIDE", port.side),
        ("PIN_SOUND_DATA", port.data),
        ("SOUND_BITS", SoundPort::first_bits()),
        ("UNSENT_AT_START", UNSENT_AT_START),
        ("PERIOD", SoundPort::period_cycles(board)),
    ];
    all.map(|(name, value)| (name.to_string(), value.into()))
        .into()
}
