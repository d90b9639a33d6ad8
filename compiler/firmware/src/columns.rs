//! Constants and tables of the firmware for columns of converters: which machine of PIO and which
//! channels of the DMA a column has, and when slices of PWM wrap.
//!
//! ```text
//!   pace:  frame 0 .. frame 7, an eighth of a period apart
//!   ticks: a wrap when the words of frame 7 lie in memory, shortly before the next frame 0
//! ```
//!
//! Not here: the texts (`columns.s`, `columns_start.s`).

use std::fmt::Write;

use whippen_board::{Columns, PACE_SLICE, TICK_SLICE};

use super::{FirmwareError, Setup, Support};

/// A ring of words has 2^13 bytes, which are 512 ticks: more than the watchdog waits, so ticks are
/// counted through whatever is missed.
const RING_BITS: u32 = 13;
/// Both cores before the DMA at memory (RP2350 datasheet 12.15.4): bits 0 and 4.
const BUS_PRIORITIES: u32 = 0x11;
/// How long words may be missing before the amplifiers are switched off.
const WRONG_MS: u64 = 10;
/// How long words are looked at before they are switched on, and after.
const LOOK_MS: u64 = 100;
const SETTLE_MS: u64 = 5;
/// What a DAC gets that shall change nothing: update channel 0 with what its input register has. An
/// all-zero word would write that register, and where the load pin is held low a part may take it
/// over at once: the full force down.
const IDLE: u32 = 0x0100_0000;
/// No force on any channel: write and update all of them with mid-scale.
const FREE: u32 = 0x03f8_0000;
/// Cycles from the wrap of the ticks to the select's fall of the next frame 0, less those that the
/// DMA needs to bring the first word of every column there, so late may a tick begin to send.
const LATE: u32 = 60;

/// How many keys there are, where setup and board can go together.
fn checked(setup: &Setup, board: &Support, columns: &Columns) -> Result<u32, FirmwareError> {
    let keys: u32 = setup.keys.iter().sum();
    if keys > columns.keys() {
        return Err(FirmwareError::ColumnsKeys(keys, columns.keys()));
    }
    if setup.ports.len() != 1 {
        return Err(FirmwareError::BenchPorts);
    }
    let [ticks, seconds] = setup.rate_hz.fraction().map(u64::from);
    if ticks * u64::from(columns.period_cycles) != u64::from(board.board.clock_hz) * seconds {
        return Err(FirmwareError::Period(columns.period_cycles, setup.rate_hz));
    }
    Ok(keys)
}

/// The constants of the texts, where the board has columns.
pub(super) fn constants(
    setup: &Setup,
    board: &Support,
) -> Result<Vec<(String, i64)>, FirmwareError> {
    let Some(columns) = &board.board.columns else {
        return Ok(Vec::new());
    };
    let keys = checked(setup, board, columns)?;
    let ticks_in = |ms: u64| setup.rate_hz.ticks_in(ms) as i64;
    let used = Columns::columns_of(keys);
    let senders = (0..used).fold(0_i64, |mask, column| mask | 1 << sender(column));
    let all = 0..columns.columns.len() as u32;
    let machines = |block: u32| {
        let own = all.clone().map(Columns::machine);
        let first = i64::from(block == 0);
        own.filter(|[of, _]| *of == block)
            .fold(first, |mask, [_, number]| mask | 1 << number)
    };
    // Both queues of machines that have keys: eight bits each.
    let levels = |block: u32| {
        let own = (0..used).map(Columns::machine);
        own.filter(|[of, _]| *of == block)
            .fold(0_i64, |mask, [_, number]| mask | 0xff << (8 * number))
    };
    let all = [
        ("LEVELS0", levels(0)),
        ("LEVELS2", levels(2)),
        ("PIN_CLOCK", columns.clock.into()),
        ("PIN_SELECT", columns.select.into()),
        ("PIN_COMMAND", columns.command.into()),
        ("PIN_ENABLE", columns.enable.into()),
        ("COLUMNS_USED", used.into()),
        ("MACHINES0", machines(0)),
        ("MACHINES2", machines(2)),
        ("SENDERS", senders),
        ("RANGE", columns.range.code.into()),
        ("PULLS_DOWN", columns.pulls_down.into()),
        ("PERIOD", columns.period_cycles.into()),
        ("FRAME_CYCLES", columns.frame_cycles().into()),
        ("WORDS_STORED", Columns::stored_cycles().into()),
        ("LATE", LATE.into()),
        ("TICK_SLICE", TICK_SLICE.into()),
        ("PACE_SLICE", PACE_SLICE.into()),
        ("RING_BITS", RING_BITS.into()),
        ("BUS_PRIORITIES", BUS_PRIORITIES.into()),
        ("IDLE", IDLE.into()),
        ("FREE", FREE.into()),
        ("AGE_WRONG", ticks_in(WRONG_MS)),
        ("LOOK", ticks_in(LOOK_MS)),
        ("SETTLE", ticks_in(SETTLE_MS)),
    ];
    let owned = |(name, value): (&str, i64)| (name.to_string(), value);
    Ok(all.into_iter().map(owned).collect())
}

/// The channels of the DMA that take a column's words and send them.
fn taker(column: u32) -> u32 {
    1 + 2 * column
}

/// See [`taker`].
fn sender(column: u32) -> u32 {
    2 + 2 * column
}

/// Each column's machine and channels, and what pins are, as assembly.
pub(super) fn tables_as_assembly(columns: &Columns) -> String {
    let mut text = String::from(
        "        .section .text.start, \"ax\"\n        .balign 4\n        .global machines, machines_end, pins, pins_end\nmachines:\n",
    );
    for (column, pins) in (0..).zip(&columns.columns) {
        let [block, number] = Columns::machine(column);
        // SET and OUT one pin, IN from the other.
        let led = 1 << 26 | 1 << 20 | pins.from_adc << 15 | pins.to_dac << 5 | pins.to_dac;
        let request = 8 * block + number;
        // Quiet, enabled, chained to nobody: halfwords into a ring, words from one of two halves.
        let shared = |channel: u32, request: u32| 1 << 23 | request << 17 | channel << 13 | 1;
        let taken = shared(taker(column), request + 4) | 1 << 12 | RING_BITS << 8 | 1 << 6 | 1 << 2;
        let sent = shared(sender(column), request) | 6 << 8 | 1 << 4 | 2 << 2;
        let _ = writeln!(
            text,
            "        .word   PIO{block} + 0xc8 + 0x18 * {number}, PIO{block} + 0x10 + 4 * {number}, {led}, {taken}, {sent}"
        );
    }
    text.push_str("machines_end:\npins:\n");
    // Pads of outputs are read too, as machines follow the select; what comes in is pulled down.
    let mut pins = vec![(columns.enable, 5)];
    pins.extend([columns.clock, columns.select, columns.command].map(|pin| (pin, 6)));
    for (column, own) in (0..).zip(&columns.columns) {
        let [block, _] = Columns::machine(column);
        pins.extend([own.to_dac, own.from_adc].map(|pin| (pin, 6 + block)));
    }
    for (pin, function) in pins {
        let _ = writeln!(text, "        .byte   {pin}, 0x56, {function}, 0");
    }
    text.push_str("pins_end:\n");
    text
}
