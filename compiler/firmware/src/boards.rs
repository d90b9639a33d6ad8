//! The texts of the firmware, and those that the start of each kind of board adds to them.

use whippen_arm::asm::Source;
use whippen_board::{Board, Start};
use whippen_isa::Arch;

use super::board_texts::{
    BENCH, BENCH_START, COLUMNS, COLUMNS_START, CONVERTER, CONVERTER_START, I2S, I2S_START, KNOB,
    KNOB_START, KNOB_STORE, PINS_START, Parts, RP2, RP2350_START, UNHEARD,
};
use super::monitor;
use super::own::{BOARD, BOARD_TICK, OwnTexts};
use super::ports::Guards;
use super::unsupported::Unsupported;

/// The firmware of a board: texts for its start, and the board that they are assembled for.
#[derive(Debug, Clone, Copy)]
pub struct Support<'a> {
    /// `board_begin` and `board_end`, assembled for each core.
    pub tick: Source<'a>,
    /// `board_sound`, where `tick` has none.
    pub heard: Option<Source<'a>>,
    /// Everything else, but for what is the user's own.
    pub rest: &'a [Source<'a>],
    /// What takes the place of bundled texts.
    pub own: &'a OwnTexts,
    /// Constants of these texts besides the board's facts.
    pub constants: &'a [(&'a str, i64)],
    /// What is known of the chip and its board.
    pub board: &'a Board,
}

/// The texts for boards that start in one way.
struct Texts {
    arch: Arch,
    cores: u32,
    start: Start,
    /// What a tick samples and drives.
    parts: Parts,
    /// The clock that the start sets (cycles per second).
    clock_hz: u32,
    tick: Source<'static>,
    rest: &'static [Source<'static>],
    constants: &'static [(&'static str, i64)],
    /// Devices that the texts reach; each is a constant of its name in capitals.
    devices: &'static [&'static str],
}

/// Constants of its texts.
const RP2350: &[(&str, i64)] = &[
    ("WATCHDOG_LOAD", 10_000),
    ("PSM", 0x4001_8000),
    // Without ROSC and XOSC, bits 2 and 3.
    ("PSM_STAGES", 0x01ff_fff3),
    ("RESETS", 0x4002_0000),
    ("PADS_BANK", 0x4003_8000),
    ("RESET_UART", 1 << 26),
];

/// Devices of the texts for chips of Raspberry Pi.
const RP2_DEVICES: &[&str] = &["converter", "uart", "io_bank0", "watchdog"];

/// Devices of the texts for knobs.
const KNOB_DEVICES: &[&str] = &["uart", "io_bank0", "pads_bank0", "watchdog", "pwm", "pio0"];

/// The texts for columns that so many cores play.
const fn columns_of_cores(cores: u32) -> Texts {
    Texts {
        arch: Arch::V8M,
        cores,
        start: Start::ImageDef,
        parts: Parts::Columns,
        clock_hz: 150_000_000,
        tick: COLUMNS,
        rest: &[RP2350_START, RP2, COLUMNS_START, PINS_START],
        constants: RP2350,
        devices: &[
            "uart",
            "io_bank0",
            "pads_bank0",
            "watchdog",
            "pwm",
            "pio0",
            "pio2",
            "dma",
            "busctrl",
        ],
    }
}

/// All of them.
const TEXTS: &[Texts] = &[
    Texts {
        arch: Arch::V8M,
        cores: 2,
        start: Start::ImageDef,
        parts: Parts::Converter,
        clock_hz: 150_000_000,
        tick: CONVERTER,
        rest: &[RP2350_START, RP2, CONVERTER_START],
        constants: RP2350,
        devices: RP2_DEVICES,
    },
    Texts {
        arch: Arch::V8M,
        cores: 1,
        start: Start::ImageDef,
        parts: Parts::Knob,
        clock_hz: 150_000_000,
        tick: KNOB,
        rest: &[RP2350_START, RP2, KNOB_START, KNOB_STORE, PINS_START],
        constants: RP2350,
        devices: KNOB_DEVICES,
    },
    Texts {
        arch: Arch::V8M,
        cores: 1,
        start: Start::ImageDef,
        parts: Parts::Bench,
        clock_hz: 150_000_000,
        tick: BENCH,
        rest: &[RP2350_START, RP2, BENCH_START, PINS_START],
        constants: RP2350,
        devices: &[
            "uart",
            "io_bank0",
            "pads_bank0",
            "watchdog",
            "pwm",
            "adc",
            "dma",
            "busctrl",
        ],
    },
    columns_of_cores(1),
    columns_of_cores(2),
    Texts {
        arch: Arch::V6M,
        cores: 2,
        start: Start::Boot2,
        parts: Parts::Converter,
        clock_hz: 133_000_000,
        tick: CONVERTER,
        rest: &[
            Source {
                name: "firmware/rp2040.s",
                text: include_str!("rp2040.s"),
            },
            RP2,
            CONVERTER_START,
        ],
        constants: &[
            // It counts twice a microsecond (datasheet, erratum RP2040-E1).
            ("WATCHDOG_LOAD", 2 * 10_000),
            ("PSM", 0x4001_0000),
            // Without ROSC and XOSC, bits 0 and 1.
            ("PSM_STAGES", 0x0001_fffc),
            ("RESETS", 0x4000_c000),
            ("PADS_BANK", 0x4001_c000),
            ("RESET_UART", 1 << 22),
        ],
        devices: RP2_DEVICES,
    },
    Texts {
        arch: Arch::V7EM,
        cores: 1,
        start: Start::Vectors,
        parts: Parts::Converter,
        clock_hz: 168_000_000,
        tick: CONVERTER,
        rest: &[
            Source {
                name: "firmware/stm32f4.s",
                text: include_str!("stm32f4.s"),
            },
            CONVERTER_START,
        ],
        constants: &[],
        devices: &["converter"],
    },
];

/// The firmware of a board.
///
/// # Errors
/// There is none, or the board contradicts it.
pub fn support(board: &Board) -> Result<Support<'_>, Unsupported> {
    support_with(board, OwnTexts::NONE)
}

/// As [`support`], with texts in place of bundled ones.
///
/// # Errors
/// There is none, or the board contradicts it.
pub fn support_with<'a>(board: &'a Board, own: &'a OwnTexts) -> Result<Support<'a>, Unsupported> {
    let of_board = |texts: &&Texts| {
        (texts.arch, texts.cores, texts.start, texts.parts)
            == (board.arch, board.cores, board.start, Parts::of(board))
    };
    let found = TEXTS.iter().find(of_board);
    let own_tick = own.named(BOARD_TICK);
    let has_all = own_tick.is_some() && own.named(BOARD).is_some();
    let texts = found
        .or(has_all.then_some(&NO_TEXTS))
        .ok_or_else(|| Unsupported::Start(board.name.clone()))?;
    let heard = match (texts.parts, board.i2s) {
        _ if own_tick.is_some() => None,
        (Parts::Converter, _) => None,
        (_, None) => Some(UNHEARD),
        (_, Some(_)) => Some(I2S),
    };
    let support = Support {
        tick: own_tick.unwrap_or_else(|| own.instead_of(texts.tick)),
        heard: heard.map(|source| own.instead_of(source)),
        rest: texts.rest,
        own,
        constants: texts.constants,
        board,
    };
    let mut sources = support.rest();
    sources.push(support.tick);
    sources.extend(support.heard);
    let sets_clocks = |source: &&Source| source.text.contains("\nboard_clocks:");
    let bundled = texts.rest.iter().find(sets_clocks);
    let is_bundled = |source: &Source| bundled.is_some_and(|own| own.name == source.name);
    if texts.clock_hz != board.clock_hz && sources.iter().any(is_bundled) {
        return Err(Unsupported::Clock(board.clock_hz, texts.clock_hz));
    }
    let is_needed = |name: &str| {
        let constant = name.to_uppercase();
        sources.iter().any(|source| source.text.contains(&constant))
    };
    let missing = |name: &&&str| board.device(name).is_none() && is_needed(name);
    if let Some(name) = texts.devices.iter().chain(SOUND_DEVICES).find(missing) {
        return Err(Unsupported::Device(name));
    }
    Ok(support)
}

/// Devices of a sound output.
const SOUND_DEVICES: &[&str] = &["pio1"];

/// Of a board that has none: all are the user's.
const NO_TEXTS: Texts = Texts {
    arch: Arch::V8M,
    cores: 1,
    start: Start::Vectors,
    parts: Parts::Converter,
    clock_hz: 0,
    tick: CONVERTER,
    rest: &[],
    constants: &[],
    devices: &[],
};

/// Bits per second of MIDI.
const MIDI_BAUD: u32 = 31_250;

impl<'a> Support<'a> {
    /// The texts outside of a tick.
    pub(super) fn rest(&self) -> Vec<Source<'a>> {
        let (own, rest) = (self.own, self.rest);
        match own.named(BOARD) {
            Some(all) => vec![all],
            None => {
                let heard = self.board.i2s.map(|_| &I2S_START);
                let rest = rest.iter().chain(heard);
                rest.map(|source| own.instead_of(*source)).collect()
            }
        }
    }
}

impl Support<'_> {
    /// Whether the start lets the cores go before the DMA at memory: the bundled text does.
    pub(super) fn yields_dma(&self) -> bool {
        let starts = self.rest();
        let yielding = [BENCH_START.text, COLUMNS_START.text];
        starts.iter().any(|source| yielding.contains(&source.text))
    }

    /// The constants that the board gives the texts.
    pub(super) fn numbers(&self) -> Vec<(String, i64)> {
        let board = self.board;
        let devices = board.devices.iter();
        let mut numbers: Vec<(String, i64)> = devices
            .map(|(name, at)| (name.to_uppercase(), i64::from(*at)))
            .collect();
        let divisor = board.clock_hz / 16 / MIDI_BAUD;
        numbers.push(("UART_DIVISOR".into(), divisor.into()));
        numbers.push(("UART_FRACTION".into(), 0));
        numbers.push(("CONVERTER_IRQ".into(), board.converter_interrupt.into()));
        let fixed = self.constants.iter();
        numbers.extend(fixed.map(|(name, value)| (name.to_string(), *value)));
        numbers
    }
}

/// The start of core 1, of boards that have one.
const CORE1: Source<'static> = Source {
    name: "firmware/core1.s",
    text: include_str!("core1.s"),
};

/// Contents of RAM, at the start.
pub(super) const FILL: Source<'static> = Source {
    name: "firmware/fill.s",
    text: include_str!("fill.s"),
};

const SHARED: &[Source<'static>] = &[
    Source {
        name: "firmware/vectors.s",
        text: include_str!("vectors.s"),
    },
    Source {
        name: "firmware/boot.s",
        text: include_str!("boot.s"),
    },
    FILL,
    Source {
        name: "firmware/cores.s",
        text: include_str!("cores.s"),
    },
    Source {
        name: "firmware/idle.s",
        text: include_str!("idle.s"),
    },
    Source {
        name: "firmware/mailbox.s",
        text: include_str!("mailbox.s"),
    },
];

/// Behind what is at the serial port.
const SILENCE: Source<'static> = Source {
    name: "firmware/silence.s",
    text: include_str!("silence.s"),
};

/// Where the exceptions of a core go.
const EXCEPTIONS: Source<'static> = Source {
    name: "firmware/exceptions.s",
    text: include_str!("exceptions.s"),
};

/// The converter's interrupt.
const TICK: Source<'static> = Source {
    name: "firmware/tick.s",
    text: include_str!("tick.s"),
};

/// The same in the instructions of ARMv6-M.
const SMALL_TICK: Source<'static> = Source {
    name: "firmware/v6m/tick.s",
    text: include_str!("v6m/tick.s"),
};

/// What is guarded of ports, in instructions that all cores have.
const PORTS: Source<'static> = Source {
    name: "firmware/ports.s",
    text: include_str!("ports.s"),
};

/// Live values that two cores have in one tick.
const LATCH: Source<'static> = Source {
    name: "firmware/latch.s",
    text: include_str!("latch.s"),
};

/// What is heard.
const SOUND: Source<'static> = Source {
    name: "firmware/sound.s",
    text: include_str!("sound.s"),
};

/// Sensors: calibration and tuning.
const TUNING: Source<'static> = Source {
    name: "firmware/tuning.s",
    text: include_str!("tuning.s"),
};

/// What frames of all cores have.
const ALARM: Source<'static> = Source {
    name: "firmware/alarm.s",
    text: include_str!("alarm.s"),
};

const EMPTYING: Source<'static> = Source {
    name: "firmware/emptying.s",
    text: include_str!("emptying.s"),
};

/// Of a core, one after the other.
const FRAME: &[Source<'static>] = &[
    EXCEPTIONS,
    TICK,
    LATCH,
    ALARM,
    EMPTYING,
    SOUND,
    TUNING,
    Source {
        name: "firmware/service.s",
        text: include_str!("service.s"),
    },
    Source {
        name: "firmware/passivity.s",
        text: include_str!("passivity.s"),
    },
    Source {
        name: "firmware/guard.s",
        text: include_str!("guard.s"),
    },
];

/// The texts that are assembled once, where so many cores play; with the monitor in place of MIDI,
/// or without.
pub(super) fn shared<'a>(
    board: &Support<'a>,
    cores: usize,
    monitored: bool,
) -> impl Iterator<Item = Source<'a>> + use<'a> {
    let core1 = (cores > 1).then_some(CORE1);
    let own = board.own;
    let serial = monitor::serial(monitored).iter().chain([&SILENCE]);
    let shared = SHARED.iter().chain(serial).copied().chain(core1);
    shared
        .map(|source| own.instead_of(source))
        .chain(board.rest())
}

/// Every bundled text of a firmware, some several times.
pub(super) fn bundled_texts() -> impl Iterator<Item = Source<'static>> {
    let of_boards = TEXTS
        .iter()
        .flat_map(|texts| texts.rest.iter().chain([&texts.tick]));
    let frames = FRAME.iter().chain(SMALL_FRAME);
    let frames = frames.chain([&PORTS, &CORE1, &monitor::CAPTURE]);
    let frames = frames.chain([&UNHEARD, &I2S, &I2S_START]);
    let mut all: Vec<Source> = SHARED
        .iter()
        .chain(monitor::serial(false))
        .chain(monitor::serial(true))
        .chain([&SILENCE])
        .chain(frames)
        .chain(of_boards)
        .copied()
        .collect();
    all.sort_by_key(|source| source.name);
    all.dedup_by_key(|source| source.name);
    all.into_iter()
}

/// The frame of a core, one text after the other: of keys, or of an instrument with ports; with the
/// monitor's captures, or without.
pub(super) fn frame<'a>(board: &Support<'a>, guards: Guards, monitored: bool) -> Vec<Source<'a>> {
    let own = match (guards, board.board.arch) {
        (Guards::Keys, Arch::V6M) => SMALL_FRAME,
        (Guards::Keys, _) => FRAME,
        (Guards::Ports, Arch::V6M) => {
            &[EXCEPTIONS, SMALL_TICK, LATCH, ALARM, EMPTYING, SOUND, PORTS]
        }
        (Guards::Ports, _) => &[EXCEPTIONS, TICK, LATCH, ALARM, EMPTYING, SOUND, PORTS],
    };
    let texts = board.own;
    let own = own.iter().map(|source| texts.instead_of(*source));
    let capture = monitored.then_some(texts.instead_of(monitor::CAPTURE));
    let board = board.heard.into_iter().chain([board.tick]);
    own.chain(capture).chain(board).collect()
}

/// What guards keys, from the service on.
pub(super) fn safety_texts(arch: Arch) -> impl Iterator<Item = Source<'static>> {
    let frame = match arch {
        Arch::V6M => SMALL_FRAME,
        _ => FRAME,
    };
    let is_before = |source: &&Source| !source.name.ends_with("service.s");
    frame.iter().skip_while(is_before).copied()
}

/// The frame in the instructions of ARMv6-M.
const SMALL_FRAME: &[Source<'static>] = &[
    EXCEPTIONS,
    SMALL_TICK,
    LATCH,
    ALARM,
    EMPTYING,
    SOUND,
    TUNING,
    Source {
        name: "firmware/v6m/service.s",
        text: include_str!("v6m/service.s"),
    },
    Source {
        name: "firmware/v6m/guard.s",
        text: include_str!("v6m/guard.s"),
    },
];
