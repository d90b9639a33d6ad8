//! The texts of the firmware, and what each board adds to them.

use whippen_isa::Arch;

use whippen_arm::asm::Source;

/// What a board says: its core, its texts, and where its cores have their stacks.
#[derive(Debug, Clone, Copy)]
pub struct Support<'a> {
    /// `board_begin` and `board_end`, assembled for each core.
    pub tick: Source<'a>,
    /// Everything else.
    pub rest: &'a [Source<'a>],
    /// Numbers that its texts are told.
    pub constants: &'a [(&'a str, i64)],
    /// Ends of the stacks, by core.
    pub stacks: &'a [u32],
    /// What its texts make of the clock.
    pub clock_hz: u32,
    /// Number of the converter's interrupt.
    pub interrupt: u32,
    /// The architecture of its cores.
    pub arch: Arch,
}

/// A tick with the converter of the emulator.
const CONVERTER: Source<'static> = Source {
    name: "firmware/converter.s",
    text: include_str!("converter.s"),
};

/// How it is started.
const CONVERTER_START: Source<'static> = Source {
    name: "firmware/converter_start.s",
    text: include_str!("converter_start.s"),
};

/// What RP2350 and RP2040 have alike.
const RP2: Source<'static> = Source {
    name: "firmware/rp2.s",
    text: include_str!("rp2.s"),
};

/// The board RP2350 with the converter of the emulator.
pub const RP2350: Support<'static> = Support {
    tick: CONVERTER,
    rest: &[
        Source {
            name: "firmware/rp2350.s",
            text: include_str!("rp2350.s"),
        },
        RP2,
        CONVERTER_START,
    ],
    constants: &[
        ("CONVERTER", 0x4017_0000),
        ("UART", 0x4007_0000),
        ("UART_DIVISOR", 300), // 150 MHz / 16 / 31250
        ("IO_BANK0", 0x4002_8000),
        ("WATCHDOG", 0x400d_8000),
        ("WATCHDOG_LOAD", 10_000),
    ],
    stacks: &[0x2008_1000, 0x2008_2000],
    clock_hz: 150_000_000,
    interrupt: 46,
    arch: Arch::V8M,
};

/// A board with an STM32F407, with the converter of the emulator.
pub const STM32F4: Support<'static> = Support {
    tick: CONVERTER,
    rest: &[
        Source {
            name: "firmware/stm32f4.s",
            text: include_str!("stm32f4.s"),
        },
        CONVERTER_START,
    ],
    constants: &[("CONVERTER", 0x4003_0000)],
    stacks: &[0x2002_0000],
    clock_hz: 168_000_000,
    interrupt: 56,
    arch: Arch::V7EM,
};

/// The board RP2040 with the converter of the emulator.
pub const RP2040: Support<'static> = Support {
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
        ("CONVERTER", 0x4007_0000),
        ("UART", 0x4003_4000),
        ("UART_DIVISOR", 266), // 133 MHz / 16 / 31250
        ("IO_BANK0", 0x4001_4000),
        ("WATCHDOG", 0x4005_8000),
        ("WATCHDOG_LOAD", 2 * 10_000), // it counts twice a microsecond (datasheet, erratum RP2040-E1)
    ],
    stacks: &[0x2004_1000, 0x2004_2000],
    clock_hz: 133_000_000,
    interrupt: 31,
    arch: Arch::V6M,
};

/// The start of core 1, of boards that have one.
const CORE1: Source<'static> = Source {
    name: "firmware/core1.s",
    text: include_str!("core1.s"),
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
    Source {
        name: "firmware/midi.s",
        text: include_str!("midi.s"),
    },
    Source {
        name: "firmware/silence.s",
        text: include_str!("silence.s"),
    },
];

/// What frames of all cores have.
const ALARM: Source<'static> = Source {
    name: "firmware/alarm.s",
    text: include_str!("alarm.s"),
};

/// Of a core, one after the other.
const FRAME: &[Source<'static>] = &[
    Source {
        name: "firmware/exceptions.s",
        text: include_str!("exceptions.s"),
    },
    Source {
        name: "firmware/tick.s",
        text: include_str!("tick.s"),
    },
    ALARM,
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

/// The texts that are assembled once.
pub(super) fn shared<'a>(board: &Support<'a>) -> impl Iterator<Item = Source<'a>> {
    let core1 = (board.stacks.len() > 1).then_some(CORE1);
    SHARED
        .iter()
        .copied()
        .chain(core1)
        .chain(board.rest.iter().copied())
}

/// The frame of a core, one text after the other.
pub(super) fn frame<'a>(board: &Support<'a>) -> Vec<Source<'a>> {
    let own = if board.arch == Arch::V6M {
        SMALL_FRAME
    } else {
        FRAME
    };
    own.iter().copied().chain([board.tick]).collect()
}

/// The frame in the instructions of ARMv6-M.
const SMALL_FRAME: &[Source<'static>] = &[
    Source {
        name: "firmware/exceptions.s",
        text: include_str!("exceptions.s"),
    },
    Source {
        name: "firmware/v6m/tick.s",
        text: include_str!("v6m/tick.s"),
    },
    ALARM,
    Source {
        name: "firmware/v6m/service.s",
        text: include_str!("v6m/service.s"),
    },
    Source {
        name: "firmware/v6m/guard.s",
        text: include_str!("v6m/guard.s"),
    },
];
