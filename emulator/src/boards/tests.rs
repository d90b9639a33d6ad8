//! The boards as they are built: nothing overlaps, start-up polls end, cores meet at banks.

use super::*;
use crate::register::Register;
use crate::stop::Stop;

#[test]
fn every_board_can_be_built_and_nothing_overlaps() {
    for kind in BoardKind::ALL {
        let (machine, ports) = build(kind, kind.board(), ConverterSetup::default()).unwrap();
        assert_eq!(machine.cores(), kind.board().cores);
        assert_eq!(
            machine
                .bus
                .device::<Converter>(ports.converter)
                .map(Converter::keys),
            Some(88)
        );
        let Some(chip) = kind.chip() else { continue };
        let mut bases: Vec<u32> = chip.registers.iter().map(|(base, _)| *base).collect();
        bases.extend(chip.timers.iter().map(|(base, _)| *base));
        bases.extend(chip.uarts.iter().map(|(base, _)| *base));
        bases.extend([
            chip.io_bank.0,
            chip.pads.0,
            chip.clocks.0,
            chip.resets.0,
            chip.power.0,
            chip.watchdog.0,
            chip.converter.0,
            chip.busctrl,
            chip.pwm.base,
            chip.adc.base,
            DMA_BASE,
            SIO_BASE,
        ]);
        bases.extend(chip.bootram);
        bases.extend(chip.pios.iter().map(|pio| pio.base));
        bases.sort_unstable();
        assert!(
            bases.windows(2).all(|pair| pair[1] - pair[0] >= BLOCK),
            "{bases:x?}"
        );
    }
}

#[test]
fn core_1_waits_in_rom() {
    for kind in [BoardKind::Rp2350, BoardKind::Rp2040] {
        let chip = kind.chip().expect("a table");
        let start = chip.core1();
        assert_eq!(start.address & 1, 1);
        assert!((start.address as usize) < chip.rom.len());
        assert!(
            kind.board()
                .regions
                .iter()
                .any(|r| r.contains(start.stack - 4)),
            "{start:x?}"
        );
    }
}

/// What every start-up code does: take blocks out of reset, start the crystal, lock a PLL, switch
/// clocks over.
#[test]
fn polls_of_a_start_end_soon() {
    // Per board: (address, value) to write, or (address, mask, value) to find.
    enum Do {
        Write(u32, u32),
        Find(u32, u32, u32),
    }
    use Do::{Find, Write};
    let rp2350 = [
        Write(0x4002_3000, 1 << 14),
        Find(0x4002_0008, 1 << 14 | 1 << 25, 1 << 14),
        Find(0x4004_8004, 1 << 31, 0),
        Write(0x4004_8000, 0x00fa_baa0),
        Find(0x4004_8004, 1 << 31, 1 << 31),
        Find(0x4005_0000, 1 << 31, 0),
        Write(0x4005_3004, 0x21),
        Find(0x4005_0000, 1 << 31, 1 << 31),
        Find(0x4001_0044, u32::MAX, 2),
        Write(0x4001_303c, 1),
        Find(0x4001_0044, u32::MAX, 1),
        Write(0x4001_0030, 2),
        Find(0x4001_0038, u32::MAX, 4),
        Write(0x4001_303c, 7 << 5),
        Write(0x4001_203c, 1),
        Find(0x4001_0044, u32::MAX, 2),
        Write(0x4002_3000, 1 << 26),
        Find(0x4002_0008, 1 << 26, 0),
        Write(0x4001_0048, 1 << 11),
        Find(0x4001_0048, 1 << 28, 1 << 28),
        Find(0x4002_0008, 1 << 26, 1 << 26),
        Write(0x4010_8018, 1),
        Find(0x4010_8018, 3, 3),
    ];
    let rp2040 = [
        Write(0x4000_f000, 1 << 12),
        Find(0x4000_c008, 3 << 12, 1 << 12),
        Write(0x4002_4000, 0x00fa_baa0),
        Find(0x4002_4004, 1 << 31, 1 << 31),
        Write(0x4002_b004, 0x21),
        Find(0x4002_8000, 1 << 31, 1 << 31),
        Write(0x4000_8030, 2),
        Find(0x4000_8038, u32::MAX, 4),
        Write(0x4000_a03c, 1),
        Find(0x4000_8044, u32::MAX, 2),
        Write(0x4000_f000, 1 << 22),
        Find(0x4000_c008, 1 << 22, 0),
        Write(0x4000_8048, 1 << 11),
        Find(0x4000_c008, 1 << 22, 1 << 22),
    ];
    for (kind, steps) in [
        (BoardKind::Rp2350, &rp2350[..]),
        (BoardKind::Rp2040, &rp2040[..]),
    ] {
        let (mut machine, _) = build(kind, kind.board(), ConverterSetup::default()).unwrap();
        for (step, cycle) in steps.iter().zip((0..).step_by(100)) {
            match *step {
                Write(address, value) => machine.bus.write(address, 4, value, cycle).unwrap(),
                Find(address, mask, value) => {
                    let found = machine.bus.read(address, 4, cycle).unwrap();
                    assert_eq!(
                        found & mask,
                        value,
                        "{} at {address:#x}: {found:#x}",
                        kind.name()
                    );
                }
            }
        }
    }
}

fn machine(kind: BoardKind) -> Machine {
    build(kind, kind.board(), ConverterSetup::default())
        .expect("the board can be")
        .0
}

/// While a glitchless mux switches, nothing is selected; the auxiliary mux behind it may change
/// only when that is over.
#[test]
fn an_auxiliary_source_in_use_must_not_change() {
    const SYS: u32 = 0x4001_003c;
    let glitches = |writes: &[(u32, u32, u64)]| {
        let mut machine = machine(BoardKind::Rp2350);
        for (address, value, cycle) in writes {
            machine.bus.write(*address, 4, *value, *cycle).unwrap();
        }
        machine.bus.lines.glitch
    };
    let clear = 0x3000;
    assert_eq!(
        glitches(&[(SYS, 0, 0)]),
        Some("clk_sys"),
        "both muxes at once"
    );
    assert_eq!(
        glitches(&[(SYS + clear, 1, 0), (SYS, 0, 10)]),
        Some("clk_sys")
    );
    assert_eq!(glitches(&[(SYS + clear, 1, 0), (SYS, 0, 100)]), None);
    let back = [
        (SYS + clear, 1, 0),
        (SYS, 0, 100),
        (SYS, 1, 200),
        (SYS, 0x21, 500),
    ];
    assert_eq!(glitches(&back[..3]), None);
    assert_eq!(glitches(&back), Some("clk_sys"));
    let mut machine = machine(BoardKind::Rp2350);
    machine.bus.write(SYS + clear, 4, 1, 1000).unwrap();
    let mut selected = |cycle| machine.bus.read(0x4001_0044, 4, cycle).unwrap();
    assert_eq!([selected(1010), selected(1100)], [0, 1]);
}

/// The watchdog counts ticks of clk_ref and resets what PSM selects: with every of these writes a
/// bite after `us` microseconds, or none.
fn bites(kind: BoardKind, writes: &[(u32, u32)], us: Option<u64>) {
    let mut machine = machine(kind);
    for (address, value) in writes {
        machine.bus.write(*address, 4, *value, 0).unwrap();
    }
    let cycles = us.map(|us| us * u64::from(kind.board().clock_hz) / 1_000_000);
    let expires = Some(machine.bus.due()).filter(|due| *due != u64::MAX);
    if let Some(cycle) = expires {
        machine.bus.attend(cycle);
    }
    let found = expires.filter(|_| machine.bus.lines.reset);
    assert_eq!(found, cycles, "{} {writes:x?}", kind.name());
}

#[test]
fn a_bite_resets_what_is_selected() {
    // (clk_ref undivided and from the crystal; its ticks; WDSEL; 10 000 counts and go)
    let rp2350 = [
        (0x4001_0034, 1 << 16),
        (0x4001_0030, 2),
        (0x4010_8034, 12),
        (0x4010_8030, 1),
        (0x4001_8008, 0x01ff_fff3),
        (0x400d_8004, 10_000),
        (0x400d_8000, 1 << 30),
    ];
    let without = |left: &[usize]| -> Vec<(u32, u32)> {
        let kept = rp2350.iter().enumerate().filter(|(i, _)| !left.contains(i));
        kept.map(|(_, write)| *write).collect()
    };
    bites(BoardKind::Rp2350, &rp2350, Some(10_000));
    bites(BoardKind::Rp2350, &without(&[0]), Some(50_000));
    bites(BoardKind::Rp2350, &without(&[3]), None);
    bites(BoardKind::Rp2350, &without(&[4]), None);
    bites(BoardKind::Rp2350, &without(&[6]), None);
    let mut core1 = rp2350;
    core1[4].1 = 1 << 24;
    bites(BoardKind::Rp2350, &core1, None);
    let rp2040 = [
        (0x4000_8030, 2),
        (0x4005_802c, 1 << 9 | 12),
        (0x4001_0008, 0x0001_fffc),
        (0x4005_8004, 20_000),
        (0x4005_8000, 1 << 30),
    ];
    bites(BoardKind::Rp2040, &rp2040, Some(10_000));
    bites(BoardKind::Rp2040, &rp2040[3..], None);
}

/// Core 0 calls a function of eight loads from SRAM8 while core 1 loads from `other` all the time:
/// its cycles.
fn cycles_beside(other: Option<u32>, priority: u32) -> u64 {
    const CODE: [u32; 2] = [0x2000_0000, 0x2004_0000];
    let mut machine = machine(BoardKind::Rp2350);
    machine.bus.write(0x4006_8000, 4, priority, 0).unwrap();
    let loads: Vec<u8> = [0x6808_u16; 8]
        .iter()
        .chain(&[0x4770])
        .flat_map(|half| half.to_le_bytes())
        .collect();
    let spin: Vec<u8> = [0x6808_u16, 0xe7fd]
        .iter()
        .flat_map(|half| half.to_le_bytes())
        .collect();
    machine.bus.memory.write(CODE[0], &loads).unwrap();
    machine.bus.memory.write(CODE[1], &spin).unwrap();
    if let Some(address) = other {
        machine.start(
            1,
            Start {
                vector_table: 0,
                stack: 0x2008_2000,
                address: CODE[1] | 1,
            },
        );
        machine.cpu_mut(1).set(Register::core(1), address);
        // Core 0 stands still until core 1 is in its loop.
        machine.run(100);
    }
    let start = Start {
        vector_table: 0,
        stack: 0x2008_0000,
        address: CODE[0] | 1,
    };
    machine.start(0, start);
    machine.cpu_mut(0).set(Register::core(1), 0x2008_0000);
    let begun = machine.cycle(0);
    let stop = machine.call(CODE[0] | 1, [0, 0x2008_0000, 0, 0], 1000);
    assert!(matches!(stop, Stop::Returned { .. }), "{stop}");
    machine.cycle(0) - begun
}

#[test]
fn cores_wait_for_each_other_at_a_bank_and_only_there() {
    let alone = cycles_beside(None, 0);
    assert_eq!(
        cycles_beside(Some(0x2008_1000), 0),
        alone,
        "core 1 uses SRAM9"
    );
    let shared = cycles_beside(Some(0x2008_0000), 0);
    // Core 1 loads every third cycle: no more than every third of eight loads, and one that waits,
    // waits one cycle.
    assert!(
        (alone + 1..=alone + 4).contains(&shared),
        "{alone} alone, {shared} beside core 1"
    );
    assert_eq!(
        cycles_beside(Some(0x2008_0000), 1),
        alone,
        "core 0 has priority"
    );
}
