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

use whippen_board::{Board, COLUMN_KEYS, Columns, PACE_SLICE, TICK_SLICE};

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
/// A tick sends what the one before has made where it reads no more cycles than these from the
/// counter of ticks: those to the select's fall of the next frame 0, less those that the DMA needs
/// to bring the first word of every column there. Words of seven columns are a frame late from 123
/// on, on the emulated chip.
pub const SEND_CYCLES_MAX: u32 = 116;
/// The symbol behind the instruction that reads the counter.
pub const TIMED: &str = "board_timed";
/// The symbol of the instruction that looks how far words of the ADCs have come.
pub const LOOKS: &str = "board_looks";
/// The slice of PWM that counts ticks for core 1, and its interrupt (PWM_IRQ_WRAP_1): what one core
/// clears in a slice is gone for both.
const TICK_SLICE1: u32 = 10;
/// See [`TICK_SLICE1`].
const INTERRUPT1: u32 = 9;
/// Ticks in a row that send nothing, after which the amplifiers are switched off.
const UNSENT_TICKS: i64 = 8;
/// Words of a row of the table of machines, in bytes.
const ROW_BYTES: i64 = 28;

/// How many keys there are, where setup and board can go together.
fn checked(setup: &Setup, board: &Support, columns: &Columns) -> Result<u32, FirmwareError> {
    let keys: u32 = setup.keys.iter().sum();
    if keys > columns.keys() {
        return Err(FirmwareError::ColumnsKeys(keys, columns.keys()));
    }
    if setup.ports.len() != 1 {
        return Err(FirmwareError::BenchPorts);
    }
    if setup.keys.len() > 1 && !setup.keys[0].is_multiple_of(COLUMN_KEYS) {
        return Err(FirmwareError::ColumnsDivided(setup.keys[0]));
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
    let age_wrong = ticks_in(WRONG_MS);
    let senders = (0..used).fold(0_i64, |mask, column| mask | 1 << sender(column));
    let all = [
        ("PIN_CLOCK", columns.clock.into()),
        ("PIN_SELECT", columns.select.into()),
        ("PIN_COMMAND", columns.command.into()),
        ("PIN_ENABLE", columns.enable.into()),
        ("FAULT_WIRED", columns.fault.is_some().into()),
        ("PIN_FAULT", columns.fault.unwrap_or(0).into()),
        ("CORE", 0),
        ("START", 1),
        ("COLUMNS_USED", used.into()),
        ("COLUMNS0", Columns::columns_of(setup.keys[0]).into()),
        ("ROW", ROW_BYTES),
        ("SENDERS", senders),
        ("RANGE", columns.range.code.into()),
        ("PULLS_DOWN", columns.pulls_down.into()),
        ("PERIOD", columns.period_cycles.into()),
        ("FRAME_CYCLES", columns.frame_cycles().into()),
        ("LAST_FRAME", Columns::whole_frame_cycles().into()),
        ("LATE", SEND_CYCLES_MAX.into()),
        ("TICK_SLICE1", TICK_SLICE1.into()),
        ("INTERRUPT1", INTERRUPT1.into()),
        ("TICK_SLICE", TICK_SLICE.into()),
        ("PACE_SLICE", PACE_SLICE.into()),
        ("RING_BITS", RING_BITS.into()),
        ("BUS_PRIORITIES", BUS_PRIORITIES.into()),
        ("IDLE", IDLE.into()),
        ("FREE", FREE.into()),
        ("AGE_WRONG", age_wrong),
        ("AGE_UNSENT", 1 + age_wrong / UNSENT_TICKS),
        ("BEHIND", UNSENT_TICKS),
        ("LOOK", ticks_in(LOOK_MS)),
        ("SETTLE", ticks_in(SETTLE_MS)),
    ];
    let owned = |(name, value): (&str, i64)| (name.to_string(), value);
    let masks = masks(columns, used);
    Ok(all.into_iter().chain(masks).map(owned).collect())
}

/// Of both blocks of PIO, the machines at work, and what of FLEVEL waits to be sent by those of so
/// many columns that have keys: the lower four of eight bits each.
fn masks(columns: &Columns, used: u32) -> [(&'static str, i64); 4] {
    let all = columns.columns.len() as u32;
    let of = |columns: u32, block: u32, bits: &dyn Fn(u32) -> i64| {
        let own = (0..columns).map(Columns::machine);
        let own = own.filter(|[of, _]| *of == block);
        own.fold(0, |mask, [_, number]| mask | bits(number))
    };
    let machine = |number: u32| 1_i64 << number;
    let level = |number: u32| 0xf_i64 << (8 * number);
    [
        // The first machine of block 0 makes the frames.
        ("MACHINES0", 1 | of(all, 0, &machine)),
        ("MACHINES2", of(all, 2, &machine)),
        ("LEVELS0", of(used, 0, &level)),
        ("LEVELS2", of(used, 2, &level)),
    ]
}

/// Those of a core's frame: its texts are not those of the start, and core 1 has an interrupt of
/// its own.
pub(super) fn frame_constants(board: &Board, core: usize) -> Vec<(&'static str, u32)> {
    match (&board.columns, core) {
        (None, _) => Vec::new(),
        (Some(_), 0) => vec![("START", 0)],
        (Some(_), _) => vec![("START", 0), ("CONVERTER_IRQ", INTERRUPT1)],
    }
}

/// The channels of the DMA that take a column's words and send them.
fn taker(column: u32) -> u32 {
    1 + 2 * column
}

/// See [`taker`].
fn sender(column: u32) -> u32 {
    2 + 2 * column
}

/// Each column's machine and channels, its memory, and what pins are, as assembly.
pub(super) fn tables_as_assembly(columns: &Columns, keys: &[u32]) -> String {
    let used = Columns::columns_of(keys.iter().sum());
    let of_core0 = Columns::columns_of(keys[0]);
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
        let memory = match column {
            _ if column >= used => "0, 0".to_string(),
            _ if column >= of_core0 => {
                let own = column - of_core0;
                format!("samples1 + ({own} << {RING_BITS}), codes1 + 64 * {own}")
            }
            _ => format!("samples + ({column} << {RING_BITS}), codes + 64 * {column}"),
        };
        let _ = writeln!(
            text,
            "        .word   PIO{block} + 0xc8 + 0x18 * {number}, PIO{block} + 0x10 + 4 * {number}, {led}, {taken}, {sent}, {memory}"
        );
    }
    text.push_str("machines_end:\npins:\n");
    // Pads of outputs are read too, as machines follow the select; what comes in is pulled down,
    // but for a line of faults, which is low where there is one.
    let (down, up) = (0x56, 0x5a);
    let mut pins = vec![(columns.enable, down, 5)];
    pins.extend(columns.fault.map(|pin| (pin, up, 5)));
    pins.extend([columns.clock, columns.select, columns.command].map(|pin| (pin, down, 6)));
    for (column, own) in (0..).zip(&columns.columns) {
        let [block, _] = Columns::machine(column);
        pins.extend([own.to_dac, own.from_adc].map(|pin| (pin, down, 6 + block)));
    }
    for (pin, pad, function) in pins {
        let _ = writeln!(text, "        .byte   {pin}, {pad}, {function}, 0");
    }
    text.push_str("pins_end:\n");
    text
}
