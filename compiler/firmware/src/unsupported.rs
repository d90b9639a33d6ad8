//! Why a board has no firmware, in words.

use std::fmt;

use super::own::{BOARD, BOARD_TICK};

/// Why a board has no firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unsupported {
    /// No texts are for such a core, so many of them, and such a start: the board's name.
    Start(String),
    /// The start sets another clock: the board's, and that (cycles per second).
    Clock(u32, u32),
    /// The board's file does not say where a device is.
    Device(&'static str),
}

impl fmt::Display for Unsupported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unsupported::Start(name) => write!(
                f,
                "there is no firmware for `{name}`: whole images are made for boards like rp2350 \
                 (two Cortex-M33, an image definition at the start), rp2040 (two Cortex-M0+, a \
                 second stage there) and stm32f4 (one Cortex-M4, vectors), and for others with \
                 texts of your own, `{BOARD}` and `{BOARD_TICK}` in a folder for --firmware"
            ),
            Unsupported::Clock(own, set) => {
                let [own, set] = [own, set].map(|hz| frequency(*hz));
                write!(
                    f,
                    "the board's clock is {own}, but the start of its firmware sets {set}: write \
                     `clock = \"{set}\"`, or give --firmware a text with another `board_clocks`"
                )
            }
            Unsupported::Device(name) => write!(
                f,
                "the firmware needs the device `{name}`, and the board's file does not say where it \
                 is: write its first address under [device], as in `{name} = \"0x40070000\"`"
            ),
        }
    }
}

/// Cycles per second as a board's file has them.
fn frequency(hz: u32) -> String {
    match hz % 1_000_000 {
        0 => format!("{} MHz", hz / 1_000_000),
        _ => format!("{hz} Hz"),
    }
}
