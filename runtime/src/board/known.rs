//! The bundled boards, and the keys of a board's file.

use crate::entries::Known;

/// The bundled boards: file and text.
pub(super) const BUNDLED: &[(&str, &str)] = &[
    (
        "rp2350.toml",
        include_str!("../../../instruments/hardware/rp2350.toml"),
    ),
    (
        "rp2040.toml",
        include_str!("../../../instruments/hardware/rp2040.toml"),
    ),
    (
        "pico2_knob.toml",
        include_str!("../../../instruments/hardware/pico2_knob.toml"),
    ),
    (
        "pico2_strings.toml",
        include_str!("../../../instruments/hardware/pico2_strings.toml"),
    ),
    (
        "rp2350b_bench.toml",
        include_str!("../../../instruments/hardware/rp2350b_bench.toml"),
    ),
    (
        "stm32f4.toml",
        include_str!("../../../instruments/hardware/stm32f4.toml"),
    ),
];

/// The keys of a board file, and an example of each.
pub(super) const KEYS: &[Known] = &[
    ("name", "rp2350"),
    ("core", "cortex-m33"),
    ("cores", "2"),
    ("clock", "150 MHz"),
    ("ports", "2"),
    ("start", "image definition"),
    ("uf2_family", "0xe48bff59"),
    ("stacks", "0x20081000 0x20082000"),
    ("memory.*.base", "0x20000000"),
    ("memory.*.size", "256 KiB"),
    ("memory.*.kind", "ram"),
    ("memory.*.access", "1 cycle"),
    ("memory.*.fetch", "1 cycle"),
    ("memory.*.banks", "SRAM0 SRAM1 SRAM2 SRAM3"),
    ("memory.*.stripe", "4 bytes"),
    ("bus.*.base", "0x40000000"),
    ("bus.*.size", "256 MiB"),
    ("bus.*.read", "3 cycles"),
    ("bus.*.write", "4 cycles"),
    ("device.*", "0x40070000"),
    ("interrupt.converter", "46"),
    ("place.*", "sram0"),
    ("knob.clock", "2"),
    ("knob.select", "3"),
    ("knob.data", "4"),
    ("knob.phases", "6 7 8"),
    ("knob.enable", "9"),
    ("knob.fault", "10"),
    ("knob.period", "3400 cycles"),
    ("knob.ahead", "1000 cycles"),
    ("knob.supply", "12000 mV"),
    ("knob.align", "2000 mV"),
    ("knob.pole_pairs", "7"),
    ("bench.sensors", "40 41 42 43 44 45 46 47"),
    ("bench.bridges", "16 18 20 22 24 26 28 30"),
    ("bench.sleep", "8"),
    ("bench.fault", "9"),
    ("bench.psram", "47"),
    ("bench.period", "3400 cycles"),
    ("bench.ahead", "1800 cycles"),
    ("bench.supply", "12 V"),
    ("i2s.clock", "18"),
    ("i2s.side", "19"),
    ("i2s.data", "20"),
];
