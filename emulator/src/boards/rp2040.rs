//! RP2040: what lies where (datasheet 2.2), and its blocks of plain registers (chapters 2 and 4).

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
use crate::fabric::Banks;
use crate::pins::PinLayout;

pub(super) const CHIP: ChipTable = ChipTable {
    core: CoreKind::CortexM0Plus,
    clock_hz: 133_000_000,
    interrupts: 32,
    rom: include_bytes!("../rom/rp2040.bin"),
    vectors: 0x1000_0100,
    regions: &[
        ("rom", 0, 0x4000, false),
        ("flash", 0x1000_0000, 2 << 20, false),
        ("sram0-3", 0x2000_0000, 256 << 10, true),
        // The same banks one after the other; here what is stored in one view is not seen in the
        // other.
        ("sram0", 0x2100_0000, 64 << 10, true),
        ("sram1", 0x2101_0000, 64 << 10, true),
        ("sram2", 0x2102_0000, 64 << 10, true),
        ("sram3", 0x2103_0000, 64 << 10, true),
        ("sram4", 0x2004_0000, 4 << 10, true),
        ("sram5", 0x2004_1000, 4 << 10, true),
    ],
    banks: &[
        Banks {
            base: 0x2000_0000,
            bytes: 256 << 10,
            first_port: 0,
            ports: 4,
        },
        Banks {
            base: 0x2100_0000,
            bytes: 64 << 10,
            first_port: 0,
            ports: 1,
        },
        Banks {
            base: 0x2101_0000,
            bytes: 64 << 10,
            first_port: 1,
            ports: 1,
        },
        Banks {
            base: 0x2102_0000,
            bytes: 64 << 10,
            first_port: 2,
            ports: 1,
        },
        Banks {
            base: 0x2103_0000,
            bytes: 64 << 10,
            first_port: 3,
            ports: 1,
        },
        Banks {
            base: 0x2004_0000,
            bytes: 4 << 10,
            first_port: 4,
            ports: 1,
        },
        Banks {
            base: 0x2004_1000,
            bytes: 4 << 10,
            first_port: 5,
            ports: 1,
        },
        Banks {
            base: 0x1000_0000,
            bytes: 2 << 20,
            first_port: 6,
            ports: 1,
        },
        Banks {
            base: 0,
            bytes: 0x4000,
            first_port: 7,
            ports: 1,
        },
    ],
    bridges: &[],
    registers: &[
        (0x1400_0000, XIP_CTRL),
        (0x4000_0000, SYSINFO),
        (0x4000_4000, &[words(0, 7)]),
        (0x4001_8000, IO_QSPI),
        (0x4002_0000, PADS),
        (0x4002_4000, XOSC),
        (0x4002_8000, PLL),
        (0x4002_c000, PLL),
        (0x4006_0000, ROSC),
        (0x4006_4000, &[words(0, 3)]),
        (0x4006_c000, TBMAN),
    ],
    clocks: (
        0x4000_8000,
        clocks::ClockLayout {
            rows: CLOCKS,
            rosc_hz: 6_500_000,
            divider_shift: 8,
            divider_zero: 1 << 16,
        },
    ),
    // On clk_peri: SPI0 and 1, UART0 and 1.
    resets: (0x4000_c000, RESETS, 3 << 16 | 3 << 22),
    io_bank: (0x4001_4000, IO_BANK0),
    pads: (0x4001_c000, PADS),
    pins: PinLayout {
        count: 30,
        blocks: 2,
        overrides: [8, 12, 16],
        pad_reset: 0x56,
    },
    sio: Chip::Rp2040,
    // The single-cycle port of the Cortex-M0+: one cycle instead of two.
    sio_waits: Waits {
        read: -1,
        write: -1,
    },
    timers: &[(0x4005_4000, 0)],
    timer_intr: 0x34,
    uarts: [(0x4003_4000, 20), (0x4003_8000, 21)],
    power: (
        0x4001_0000,
        Stages {
            core1: 1 << 16,
            mask: 0x0001_ffff,
            peripherals: 0xf,
        },
    ),
    watchdog: (0x4005_8000, 2),
    watchdog_ticks: None,
    adc: AdcLayout {
        base: 0x4004_c000,
        interrupt: 22,
        inputs: 4,
        first_pin: 26,
        room: 4,
    },
    pwm: PwmLayout {
        base: 0x4005_0000,
        slices: 8,
        interrupt: 4,
        lines: 1,
        request: 24,
    },
    pios: &[
        PioLayout {
            base: 0x5020_0000,
            interrupt: 7,
            version: 0,
        },
        PioLayout {
            base: 0x5030_0000,
            interrupt: 9,
            version: 0,
        },
    ],
    dma: dma::RP2040,
    converter: (0x4007_0000, 31),
    busctrl: 0x4003_0000,
    qmi: None,
    bootram: None,
};

/// CHIP_ID of stepping B2, PLATFORM (a chip), GITREF.
const SYSINFO: &[Row] = &[held(0, 0x2000_2927, 0), held(4, 2, 0), held(0x40, 0, 0)];

/// PLATFORM: a chip.
const TBMAN: &[Row] = &[held(0, 1, 0)];

/// CTRL (cache enabled), FLUSH, STAT (flushed, FIFO empty), counters.
const XIP_CTRL: &[Row] = &[held(0, 3, 0xb), held(4, 0, 0), held(8, 3, 0), words(0xc, 2)];

const BLOCKS: u32 = 0x01ff_ffff;

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

/// CTRL, DIV and SELECTED of ten clocks, of which only clk_ref and clk_sys switch without a glitch
/// and say what they selected (`clocks`); the rest of the block. The frequency counter always finds
/// clk_sys.
const CLOCKS: &[Row] = &[
    times(10, 12, held(0, 0, 0x0013_1fff)),
    times(10, 12, held(4, 0x100, u32::MAX)),
    times(4, 12, held(0x08, 1, 0)),
    times(2, 12, held(0x38, 0, 0)),
    times(4, 12, held(0x50, 1, 0)),
    held(0x78, 0xff, 0x1_11ff),
    held(0x7c, 0, 0),
    words(0x80, 6),
    held(0x98, 0x11, 0),
    held(0x9c, 133_000 << 5, 0),
    times(4, 4, held(0xa0, u32::MAX, u32::MAX)),
    times(2, 4, held(0xb0, u32::MAX, 0)),
    words(0xb8, 4),
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
    held(0x1c, 0, 0),
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
];

/// Enabled and stable from reset.
const ROSC: &[Row] = &[
    held(0, 0xaa0, 0x00ff_ffff),
    words(4, 4),
    held(0x14, 8, 0xfff),
    held(0x18, 0x8001_1000, 0),
    held(0x1c, 1, 0),
    words(0x20, 1),
];

/// STATUS and CTRL (no function) of 30 pins, then the interrupts of pins.
const IO_BANK0: &[Row] = &[
    times(30, 8, held(0, 0, 0)),
    times(30, 8, held(4, 0x1f, u32::MAX)),
    words(0xf0, 52),
];

const IO_QSPI: &[Row] = &[
    times(6, 8, held(0, 0, 0)),
    times(6, 8, held(4, 0x1f, u32::MAX)),
    words(0x30, 10),
];

/// The voltage, then a word a pin.
const PADS: &[Row] = &[held(0, 0, 1), times(32, 4, held(4, 0x56, 0xff))];
