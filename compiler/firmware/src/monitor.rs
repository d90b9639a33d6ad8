//! What an image with the monitor has besides its texts (`monitor.s`, `monitor_events.s`,
//! `capture.s`): the rate of its serial port, what it tells of itself, where captures have room,
//! and the number by which it is known.
//!
//! ```text
//!   monitor_facts      a word for each Fact, in their order: what `identify` answers
//!   monitor_captures   of each core: its block, its capture, begin and end of the memory for rows
//!   monitor_limits     of each word of a capture's setting: the most, and bits that must be 0
//!   monitor_memory     how many memories may be read, base and bytes of each
//! ```
//!
//! Not here: the client (the runtime).

use std::fmt::Write;

use whippen_arm::asm::Source;
use whippen_arm::image::Image;
use whippen_board::{Board, Memory, MemoryKind};
use whippen_isa::Arch;

use super::code::ProgramCode;
use super::image::has_helper;
use super::{CORES, FirmwareError, Instrument, Setup, Support, drive_offset_bytes};

/// MIDI both ways.
const MIDI: &[Source<'static>] = &[
    Source {
        name: "firmware/midi.s",
        text: include_str!("midi.s"),
    },
    Source {
        name: "firmware/midi_in.s",
        text: include_str!("midi_in.s"),
    },
];

/// The texts of what is at the serial port: the monitor, or MIDI.
pub(super) fn serial(monitored: bool) -> &'static [Source<'static>] {
    if monitored { TEXTS } else { MIDI }
}

/// Its texts, in place of MIDI's.
const TEXTS: &[Source<'static>] = &[
    Source {
        name: "firmware/monitor.s",
        text: include_str!("monitor.s"),
    },
    Source {
        name: "firmware/monitor_capture.s",
        text: include_str!("monitor_capture.s"),
    },
    Source {
        name: "firmware/monitor_events.s",
        text: include_str!("monitor_events.s"),
    },
];

/// Its captures, part of a tick.
pub(super) const CAPTURE: Source<'static> = Source {
    name: "firmware/capture.s",
    text: include_str!("capture.s"),
};

/// The version of what is spoken at the serial port.
pub const PROTOCOL: u32 = 1;
/// Keys of a core that are captured at once, and words of memory.
pub const CAPTURED_MAX: usize = 4;

/// Bytes of the longest row: its tick, a word for each key and of memory, and as many places again
/// that are written and not kept.
const ROW_BYTES_MAX: u32 = 4 * (1 + 2 * CAPTURED_MAX as u32) + 4 * CAPTURED_MAX as u32;
/// Words of a capture's setting.
const SETTING: u32 = 19;
/// Words of the instrument's name among the facts.
const NAME_WORDS: usize = 6;

/// Constants of the texts.
pub(super) const CONSTANTS: &[(&str, u32)] = &[
    ("CAPTURED", CAPTURED_MAX as u32),
    ("ROW_MAX", ROW_BYTES_MAX),
    ("SETTING", SETTING),
    ("FACTS", FACTS),
    ("WAITS", 0),
    ("WAITS_UNDER", 1),
    ("WAITS_OVER", 2),
    ("TRIGGERED", 3),
];

/// What is at the serial port in place of MIDI.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Monitor {
    /// Bits per second, each way.
    pub baud: u32,
}

/// What an image tells of itself: an index of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Fact {
    /// The version of the protocol.
    Protocol,
    /// The number by which the image is known, lower half.
    IdentityLow,
    /// Upper half.
    IdentityHigh,
    /// Where the status is.
    Status,
    /// Cycles per second.
    ClockHz,
    /// Ticks in so many seconds ([`Fact::RateSeconds`]).
    RateTicks,
    /// See there.
    RateSeconds,
    /// Cores that play.
    Cores,
    /// Keys of core 0.
    Keys0,
    /// Keys of core 1, or 0.
    Keys1,
    /// Where the table of live parameters is: how many of all programs, and then of each where it
    /// is on either core (0 for nowhere), its lowest and its highest value.
    Lives,
    /// Programs.
    Programs,
    /// Where the capture of core 0 is set and seen.
    Capture0,
    /// Of core 1, or 0.
    Capture1,
    /// Begin and end of the memory for the rows of core 0.
    Room0,
    /// See there.
    Room0End,
    /// Of core 1.
    Room1,
    /// See there.
    Room1End,
    /// Version of Whippen, a byte each: major, minor, patch.
    Version,
    /// The name of the first program's instrument, zeros behind it: six words.
    Name,
}

/// How many words there are.
const FACTS: u32 = Fact::Name as u32 + NAME_WORDS as u32;

impl Monitor {
    /// The dividers of the serial port.
    pub(super) fn serial_constants(
        &self,
        board: &Board,
    ) -> Result<[(String, i64); 2], FirmwareError> {
        let (clock, baud) = (u64::from(board.clock_hz), u64::from(self.baud.max(1)));
        // An STM32 has sixteenths of its own, which is half as fast.
        let step = if board.arch == Arch::V7EM { 8 } else { 1 };
        // 64ths of the divider of a sixteenth of the clock, to the nearest step.
        let divider = (8 * clock / step + baud) / (2 * baud) * step;
        // A receiver stands half a bit in ten, which both ends share: 2 % of a bit.
        let off = (4 * clock).abs_diff(divider * baud);
        let is_near = 50 * off < divider * baud;
        if !(64..0xffff * 64).contains(&divider) || !is_near {
            return Err(FirmwareError::Baud(self.baud, board.clock_hz / 16));
        }
        Ok([
            ("UART_DIVISOR".to_string(), (divider / 64) as i64),
            ("UART_FRACTION".to_string(), (divider % 64) as i64),
        ])
    }
}

/// The tables as assembly.
pub(super) fn tables_as_assembly(
    programs: &[ProgramCode],
    instruments: &[Instrument],
    setup: &Setup,
    support: &Support,
) -> String {
    let (board, cores) = (support.board, setup.keys.len());
    let helps = has_helper(programs);
    let mut text = String::from(
        "        .section .rodata.monitor, \"a\"\n        .balign 4\n        .global \
         monitor_facts, monitor_captures, monitor_limits, monitor_memory\n",
    );
    let rooms: Vec<[String; 2]> = (0..cores).map(|core| room(board, core)).collect();
    let facts = facts((programs, instruments), setup, board, &rooms).join(", ");
    let _ = writeln!(text, "monitor_facts: .word {facts}");
    let _ = writeln!(text, "monitor_captures:");
    for (core, [begin, end]) in rooms.iter().enumerate() {
        let block = CORES[core];
        let _ = writeln!(
            text,
            "        .word {block}, captured{core}, {begin}, {end}"
        );
    }
    let words = setup.keys.iter().map(|keys| setup.words_of(*keys));
    let distance = words.map(drive_offset_bytes).max().unwrap_or(2);
    let _ = writeln!(text, "monitor_limits:");
    for [most, zeros] in limits(distance) {
        let _ = writeln!(text, "        .word {most}, {zeros}");
    }
    let is_read = |memory: &&Memory| {
        let is_other = helps && is_of_core1(board, memory);
        memory.kind == MemoryKind::Ram && !is_other
    };
    let memories: Vec<&Memory> = board.memory.iter().filter(is_read).collect();
    let _ = writeln!(text, "monitor_memory: .word {}", memories.len());
    for memory in memories {
        let _ = writeln!(text, "        .word {}, {}", memory.base, memory.size);
    }
    text
}

/// Whether a memory is for what core 1 runs, which is not to be read while it only helps: nobody
/// charges that.
fn is_of_core1(board: &Board, memory: &Memory) -> bool {
    let own = [".text.core1", ".bss.core1", ".bss.near.core1"];
    let own = own.iter().filter_map(|name| board.memory_for(name));
    own.into_iter().any(|found| found.name == memory.name)
}

/// Begin and end of the memory for the rows of a core: what nothing else has of the memory of its
/// data, unless a stack is there too.
fn room(board: &Board, core: usize) -> [String; 2] {
    let none = || ["0".to_string(), "0".to_string()];
    let Some(memory) = board.memory_for(&format!(".bss.{}.captured", CORES[core])) else {
        return none();
    };
    let has_stack = (board.stacks.iter())
        .any(|stack| (memory.base + 1..=memory.base + memory.size).contains(stack));
    let name = &memory.name;
    match has_stack {
        true => none(),
        false => [format!("__{name}_free"), format!("__{name}_end")],
    }
}

/// A word for each [`Fact`].
fn facts(
    (programs, instruments): (&[ProgramCode], &[Instrument]),
    setup: &Setup,
    board: &Board,
    rooms: &[[String; 2]],
) -> Vec<String> {
    let none = ["0".to_string(), "0".to_string()];
    let room = |core: usize, end: usize| rooms.get(core).unwrap_or(&none)[end].clone();
    let keys = |core: usize| setup.keys.get(core).copied().unwrap_or(0).to_string();
    let [ticks, seconds] = setup.rate_hz.fraction();
    let capture = |core: usize| match core < rooms.len() {
        true => format!("captured{core}"),
        false => "0".to_string(),
    };
    let mut all = vec![
        PROTOCOL.to_string(),
        "0".to_string(),
        "0".to_string(),
        "status".to_string(),
        board.clock_hz.to_string(),
        ticks.to_string(),
        seconds.to_string(),
        setup.keys.len().to_string(),
        keys(0),
        keys(1),
        "lives".to_string(),
        programs.len().to_string(),
        capture(0),
        capture(1),
        room(0, 0),
        room(0, 1),
        room(1, 0),
        room(1, 1),
        version().to_string(),
    ];
    let first = programs.first().and_then(|program| {
        let zone = program.zones().next()?;
        instruments.get(program.instrument_of(zone).index())
    });
    let name = first.map_or("", |own| &own.modes.kernel.name);
    let mut bytes = name.as_bytes().to_vec();
    bytes.resize(4 * NAME_WORDS, 0);
    let words = bytes.chunks_exact(4);
    all.extend(
        words.map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]).to_string()),
    );
    all
}

/// The version of Whippen, a byte each.
fn version() -> u32 {
    let parts = env!("CARGO_PKG_VERSION").split('.');
    let parts = parts.map(|part| part.parse::<u32>().unwrap_or(0));
    parts.fold(0, |all, part| all << 8 | part & 0xff)
}

/// The most that each word of a capture's setting may be, and bits that must be 0 in it.
fn limits(distance: u32) -> Vec<[u32; 2]> {
    let any = [u32::MAX, 0];
    let key = [distance.saturating_sub(2), 1];
    let row = 4 * (1 + 2 * CAPTURED_MAX as u32);
    let mut all = vec![[row, 3], [4 * (1 + CAPTURED_MAX as u32), 3], [u32::MAX, 3]];
    all.extend([key; CAPTURED_MAX]);
    all.extend([[u32::MAX, 3]; CAPTURED_MAX]);
    // Mode, word, shift, flip, level, ticks behind it, event, group.
    all.extend([[3, 0], [row - 4, 3], [31, 0], any, any, any, any, any]);
    all
}

/// Writes the number by which an image is known into it: it depends on every byte of it.
pub(super) fn identify(image: &mut Image) {
    let Some(facts) = (image.symbols.iter()).find(|symbol| symbol.name == "monitor_facts") else {
        return;
    };
    let at = facts.address + 4 * Fact::IdentityLow as u32;
    let identity = image_identity(image).to_le_bytes();
    for section in &mut image.sections {
        let run = section.run;
        put(&mut section.bytes, run, at, &identity);
    }
    for segment in &mut image.segments {
        let run = segment.run;
        put(&mut segment.bytes, run, at, &identity);
    }
}

/// Puts bytes where they belong, if it is here.
fn put(bytes: &mut [u8], run: u32, at: u32, own: &[u8]) {
    let offset = at.checked_sub(run).map(|offset| offset as usize);
    let place = offset.and_then(|offset| bytes.get_mut(offset..offset + own.len()));
    if let Some(place) = place {
        place.copy_from_slice(own);
    }
}

/// The number that was written into an image, if it has the monitor.
pub fn monitor_identity(image: &Image) -> Option<u64> {
    let facts = (image.symbols.iter()).find(|symbol| symbol.name == "monitor_facts")?;
    let at = facts.address + 4 * Fact::IdentityLow as u32;
    image.segments.iter().find_map(|segment| {
        let offset = at.checked_sub(segment.run)? as usize;
        let bytes = segment.bytes.get(offset..offset + 8)?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?))
    })
}

/// FNV-1a of the bytes of all segments and of where they run, 64 bits, as it is before it is
/// written into them.
pub fn image_identity(image: &Image) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    for segment in &image.segments {
        add(&segment.run.to_le_bytes());
        add(&segment.bytes);
    }
    hash
}
