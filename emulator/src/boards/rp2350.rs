//! RP2350: what lies where (datasheet 2.2), and its blocks of plain registers (chapters 7 to 9,
//! 12).

use super::ChipTable;
use crate::board::CoreKind;
use crate::bus::Waits;
use crate::device::adc::AdcLayout;
use crate::device::clocks;
use crate::device::dma;
use crate::device::pio::PioLayout;
use crate::device::power::Stages;
use crate::device::pwm::PwmLayout;
use crate::device::registers::{Reads, Row, held, status, times, words};
use crate::device::sio::Chip;
use crate::fabric::{Banks, Bridge};
use crate::pins::PinLayout;

pub(super) const CHIP: ChipTable = ChipTable {
    core: CoreKind::CortexM33,
    clock_hz: 150_000_000,
    interrupts: 52,
    rom: include_bytes!("../rom/rp2350.bin"),
    vectors: 0x1000_0000,
    regions: &[
        ("rom", 0, 0x8000, false),
        ("flash", 0x1000_0000, 4 << 20, false),
        ("sram0-7", 0x2000_0000, 512 << 10, true),
        ("sram8", 0x2008_0000, 4 << 10, true),
        ("sram9", 0x2008_1000, 4 << 10, true),
    ],
    banks: &[
        Banks {
            base: 0x2000_0000,
            bytes: 256 << 10,
            first_port: 0,
            ports: 4,
        },
        Banks {
            base: 0x2004_0000,
            bytes: 256 << 10,
            first_port: 4,
            ports: 4,
        },
        Banks {
            base: 0x2008_0000,
            bytes: 4 << 10,
            first_port: 8,
            ports: 1,
        },
        Banks {
            base: 0x2008_1000,
            bytes: 4 << 10,
            first_port: 9,
            ports: 1,
        },
        Banks {
            base: 0x1000_0000,
            bytes: 4 << 20,
            first_port: 10,
            ports: 1,
        },
        Banks {
            base: 0,
            bytes: 0x8000,
            first_port: 11,
            ports: 1,
        },
    ],
    bridges: BRIDGES,
    registers: &[
        (0x4000_0000, SYSINFO),
        (0x4000_8000, &[words(0, 8)]),
        (0x4003_0000, IO_QSPI),
        (0x4004_0000, PADS),
        (0x4004_8000, XOSC),
        (0x4005_0000, PLL),
        (0x4005_8000, PLL),
        (0x4006_0000, &[words(0, 64)]),
        (0x400c_8000, &[words(0, 16)]),
        (0x400e_8000, ROSC),
        (0x4010_0000, &[words(0, 64)]),
        (0x4010_8000, TICKS),
        (0x4016_0000, TBMAN),
    ],
    clocks: (
        0x4001_0000,
        clocks::ClockLayout {
            rows: CLOCKS,
            rosc_hz: 11_000_000,
            divider_shift: 16,
            divider_zero: 256,
        },
    ),
    // On clk_peri: SPI0 and 1, UART0 and 1.
    resets: (0x4002_0000, RESETS, 3 << 18 | 3 << 26),
    io_bank: (0x4002_8000, IO_BANK0),
    pads: (0x4003_8000, PADS),
    pins: PinLayout {
        count: 48,
        blocks: 3,
        overrides: [12, 14, 16],
        pad_reset: 0x116,
    },
    sio: Chip::Rp2350,
    sio_waits: Waits { read: 0, write: 0 },
    timers: &[(0x400b_0000, 0), (0x400b_8000, 4)],
    timer_intr: 0x3c,
    uarts: [(0x4007_0000, 33), (0x4007_8000, 34)],
    power: (
        0x4001_8000,
        Stages {
            core1: 1 << 24,
            mask: 0x01ff_ffff,
            peripherals: 0x1f,
        },
    ),
    watchdog: (0x400d_8000, 1),
    watchdog_ticks: Some((0x4010_8000, 0x30)),
    adc: AdcLayout {
        base: 0x400a_0000,
        interrupt: 35,
        inputs: 8,
        first_pin: 40,
        room: 8,
    },
    pwm: PwmLayout {
        base: 0x400a_8000,
        slices: 12,
        interrupt: 8,
        lines: 2,
        request: 32,
    },
    pios: &[
        PioLayout {
            base: 0x5020_0000,
            interrupt: 15,
            version: 1,
        },
        PioLayout {
            base: 0x5030_0000,
            interrupt: 17,
            version: 1,
        },
        PioLayout {
            base: 0x5040_0000,
            interrupt: 19,
            version: 1,
        },
    ],
    dma: dma::RP2350,
    converter: (0x4017_0000, 46),
    busctrl: 0x4006_8000,
    qmi: Some((0x400d_0000, 4 << 20)),
    bootram: Some(0x400e_0000),
};

/// The APB, and the fast peripherals (datasheet 2.1.4, 2.2.5). What crossing to the ADC's clock
/// costs is not documented: 16 cycles are an estimate from above.
const BRIDGES: &[Bridge] = &[
    Bridge {
        base: 0x400a_0000,
        bytes: 0x8000,
        number: 0,
        read: 16,
        write: 16,
    },
    Bridge {
        base: 0x4000_0000,
        bytes: 0x1000_0000,
        number: 0,
        read: 3,
        write: 4,
    },
    Bridge {
        base: 0x5000_0000,
        bytes: 0x1000_0000,
        number: 1,
        read: 2,
        write: 2,
    },
];

/// CHIP_ID of stepping A2, PACKAGE_SEL, PLATFORM (a chip), GITREF.
const SYSINFO: &[Row] = &[
    held(0, 0x2000_4927, 0),
    held(4, 0, 0),
    held(8, 2, 0),
    held(0x14, 0, 0),
];

/// PLATFORM: a chip.
const TBMAN: &[Row] = &[held(0, 1, 0)];

const BLOCKS: u32 = 0x1fff_ffff;

const RESETS: &[Row] = &[
    held(0, BLOCKS, BLOCKS),
    held(4, 0, BLOCKS),
    status(
        8,
        Reads::Not {
            of: 0,
            mask: BLOCKS,
        },
    ),
];

const ENABLE: u32 = 1 << 11;

/// CTRL, DIV and SELECTED of ten clocks, of which only clk_ref and clk_sys switch without a glitch
/// and say what they selected (`clocks`); the rest of the block. The frequency counter always finds
/// clk_sys.
///
/// Steppings A3 and A4 come up with clk_sys on its auxiliary source, the ring oscillator, and their
/// ROM leaves clk_ref divided by 5 (appendix C).
const CLOCKS: &[Row] = &[
    held(0x34, 5 << 16, 0x00ff_0000),
    held(0x3c, 0x41, 0xe1),
    times(
        10,
        12,
        Row {
            reads: Reads::When {
                of: 0,
                mask: ENABLE,
                value: ENABLE,
                bits: 1 << 28,
            },
            ..held(0, 0, 0x0013_1fff)
        },
    ),
    times(10, 12, held(4, 0x1_0000, u32::MAX)),
    times(4, 12, held(0x08, 1, 0)),
    times(2, 12, held(0x38, 0, 0)),
    times(4, 12, held(0x50, 1, 0)),
    words(0x78, 3),
    held(0x84, 0xff, 0x1_11ff),
    held(0x88, 0, 0),
    words(0x8c, 6),
    held(0xa4, 0x11, 0),
    held(0xa8, 150_000 << 5, 0),
    times(4, 4, held(0xac, u32::MAX, u32::MAX)),
    times(2, 4, held(0xbc, u32::MAX, 0)),
    words(0xc4, 4),
];

/// Stable as soon as it is enabled; its delay counter is always down.
const XOSC: &[Row] = &[
    held(0, 0, 0x00ff_ffff),
    status(
        4,
        Reads::When {
            of: 0,
            mask: 0x00ff_f000,
            value: 0x00fa_b000,
            bits: 0x8000_1000,
        },
    ),
    words(8, 2),
    held(0x10, 0, 0),
];

/// Locked as soon as it and its VCO have power.
const PLL: &[Row] = &[
    Row {
        reads: Reads::When {
            of: 4,
            mask: 0x21,
            value: 0,
            bits: 1 << 31,
        },
        ..held(0, 1, 0x13f)
    },
    held(4, 0x2d, 0x2d),
    held(8, 0, 0xfff),
    held(0xc, 0x7_7000, 0x7_7000),
    words(0x10, 4),
];

/// Enabled and stable from reset.
const ROSC: &[Row] = &[
    held(0, 0xaa0, 0x00ff_ffff),
    words(4, 5),
    held(0x18, 8, 0xfff),
    held(0x1c, 0x8001_1000, 0),
    held(0x20, 1, 0),
    words(0x24, 1),
];

/// Six generators (of core 0, core 1, timer 0, timer 1, the watchdog, RISC-V): CTRL, CYCLES, COUNT.
const TICKS: &[Row] = &[
    times(
        6,
        12,
        Row {
            reads: Reads::When {
                of: 0,
                mask: 1,
                value: 1,
                bits: 2,
            },
            ..held(0, 0, 1)
        },
    ),
    times(6, 12, held(4, 0, 0x1ff)),
    times(6, 12, held(8, 0, 0)),
];

/// STATUS and CTRL (no function) of 48 pins, then the interrupts of pins.
const IO_BANK0: &[Row] = &[
    times(48, 8, held(0, 0, 0)),
    times(48, 8, held(4, 0x1f, u32::MAX)),
    words(0x180, 160),
];

const IO_QSPI: &[Row] = &[
    times(8, 8, held(0, 0, 0)),
    times(8, 8, held(4, 0x1f, u32::MAX)),
    words(0x200, 32),
];

/// The voltage, then a word a pin.
const PADS: &[Row] = &[held(0, 0, 1), times(50, 4, held(4, 0x116, 0x1ff))];
