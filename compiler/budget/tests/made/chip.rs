//! An RP2350, as the emulator has it, without devices and without places for sections.

use whippen_board::{
    AccessTime, Board, Bus, CONVERTER_RANGES, ColumnWires, Columns, Memory, MemoryKind, Start,
};
use whippen_isa::Arch;

/// RAM without waiting.
pub fn ram(name: &str, base: u32, size: u32, banks: &[u8]) -> Memory {
    Memory {
        name: name.into(),
        base,
        size,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        striped: banks.len() > 1,
        banks: banks.to_vec(),
    }
}

/// Two striped groups, a bank for each core, flash, a bus.
pub fn board() -> Board {
    let flash = Memory {
        kind: MemoryKind::Flash,
        access: AccessTime::NotBounded,
        fetch: AccessTime::NotBounded,
        ..ram("flash", 0x1000_0000, 0x1_0000, &[])
    };
    Board {
        name: "rp2350".into(),
        arch: Arch::V8M,
        cores: 2,
        clock_hz: 150_000_000,
        start: Start::ImageDef,
        uf2_family: None,
        fetches_apart: true,
        banks: (0..10).map(|bank| format!("SRAM{bank}")).collect(),
        memory: vec![
            flash,
            ram("sram0", 0x2000_0000, 256 << 10, &[0, 1, 2, 3]),
            ram("sram4", 0x2004_0000, 256 << 10, &[4, 5, 6, 7]),
            ram("sram8", 0x2008_0000, 4 << 10, &[8]),
            ram("sram9", 0x2008_1000, 4 << 10, &[9]),
        ],
        buses: vec![Bus {
            name: "apb".into(),
            base: 0x4000_0000,
            size: 256 << 20,
            read_cycles: 3,
            write_cycles: 4,
        }],
        devices: Vec::new(),
        converter_interrupt: 46,
        stacks: vec![0x2008_1000, 0x2008_2000],
        places: Vec::new(),
        knob: None,
        bench: None,
        columns: None,
        i2s: None,
    }
}

/// So many columns of keys.
pub fn columns(count: u32) -> Columns {
    let wires = |column: u32| ColumnWires {
        to_dac: 6 + 2 * column,
        from_adc: 7 + 2 * column,
    };
    Columns {
        clock: 2,
        select: 3,
        command: 4,
        enable: 5,
        fault: None,
        columns: (0..count).map(wires).collect(),
        range: CONVERTER_RANGES[0],
        pulls_down: false,
        period_cycles: 3400,
    }
}
