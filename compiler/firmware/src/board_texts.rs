//! The texts of boards: what a tick of each kind samples, drives and sounds, and how it is started.
//!
//! Not here: which board has which (`boards`).

use whippen_arm::asm::Source;
use whippen_board::Board;

/// What a tick samples and drives.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Parts {
    /// The converter of the emulator.
    Converter,
    /// Knobs on the chip's pins.
    Knob,
    /// A bench of keys on them.
    Bench,
    /// Columns of converters on them.
    Columns,
}

impl Parts {
    pub(super) fn of(board: &Board) -> Parts {
        match (&board.knob, &board.bench, &board.columns) {
            (Some(_), ..) => Parts::Knob,
            (_, Some(_), _) => Parts::Bench,
            (.., Some(_)) => Parts::Columns,
            (None, None, None) => Parts::Converter,
        }
    }
}

/// A tick with the converter of the emulator.
pub(super) const CONVERTER: Source<'static> = Source {
    name: "firmware/converter.s",
    text: include_str!("converter.s"),
};

/// How it is started.
pub(super) const CONVERTER_START: Source<'static> = Source {
    name: "firmware/converter_start.s",
    text: include_str!("converter_start.s"),
};

/// A tick with knobs on the chip's pins.
pub(super) const KNOB: Source<'static> = Source {
    name: "firmware/knob.s",
    text: include_str!("knob.s"),
};

/// How their parts are started, and their motors found.
pub(super) const KNOB_START: Source<'static> = Source {
    name: "firmware/knob_start.s",
    text: include_str!("knob_start.s"),
};

/// What of that is kept for the next start.
pub(super) const KNOB_STORE: Source<'static> = Source {
    name: "firmware/knob_store.s",
    text: include_str!("knob_store.s"),
};

/// How the pins of a knob, a bench or columns are started.
pub(super) const PINS_START: Source<'static> = Source {
    name: "firmware/pins_start.s",
    text: include_str!("pins_start.s"),
};

/// A tick with a bench of keys on the chip's pins.
pub(super) const BENCH: Source<'static> = Source {
    name: "firmware/bench.s",
    text: include_str!("bench.s"),
};

/// How its parts are started.
pub(super) const BENCH_START: Source<'static> = Source {
    name: "firmware/bench_start.s",
    text: include_str!("bench_start.s"),
};

/// A tick with columns of converters on them.
pub(super) const COLUMNS: Source<'static> = Source {
    name: "firmware/columns.s",
    text: include_str!("columns.s"),
};

/// How these are started.
pub(super) const COLUMNS_START: Source<'static> = Source {
    name: "firmware/columns_start.s",
    text: include_str!("columns_start.s"),
};

/// Samples that leave nowhere.
pub(super) const UNHEARD: Source<'static> = Source {
    name: "firmware/unheard.s",
    text: include_str!("unheard.s"),
};

/// Samples that leave on three wires.
pub(super) const I2S: Source<'static> = Source {
    name: "firmware/i2s.s",
    text: include_str!("i2s.s"),
};

/// How that is started.
pub(super) const I2S_START: Source<'static> = Source {
    name: "firmware/i2s_start.s",
    text: include_str!("i2s_start.s"),
};

/// Clocks of RP2350.
pub(super) const RP2350_START: Source<'static> = Source {
    name: "firmware/rp2350.s",
    text: include_str!("rp2350.s"),
};

/// What RP2350 and RP2040 have alike.
pub(super) const RP2: Source<'static> = Source {
    name: "firmware/rp2.s",
    text: include_str!("rp2.s"),
};
