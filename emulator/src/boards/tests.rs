use super::*;

#[test]
fn every_board_can_be_built_and_nothing_overlaps() {
    for kind in BoardKind::ALL {
        let (machine, ports) = build(kind, kind.board(), ConverterSetup::default()).unwrap();
        assert_eq!(machine.cores(), 2);
        assert_eq!(machine.bus.device::<Converter>(ports.converter).map(Converter::keys), Some(88));
        let chip = kind.chip();
        let mut bases: Vec<u32> = chip.registers.iter().map(|(base, _)| *base).collect();
        bases.extend(chip.timers.iter().map(|(base, _)| *base));
        bases.extend(chip.uarts.iter().map(|(base, _)| *base));
        bases.extend([chip.power.0, chip.watchdog.0, chip.converter.0, DMA_BASE, SIO_BASE]);
        bases.extend(chip.bootram);
        bases.sort_unstable();
        assert!(bases.windows(2).all(|pair| pair[1] - pair[0] >= BLOCK), "{bases:x?}");
    }
}

#[test]
fn core_1_waits_in_rom() {
    for kind in BoardKind::ALL {
        let start = kind.chip().core1();
        assert_eq!(start.address & 1, 1);
        assert!((start.address as usize) < kind.chip().rom.len());
        assert!(kind.board().regions.iter().any(|r| r.contains(start.stack - 4)), "{start:x?}");
    }
}

/// What every start-up code does: take blocks out of reset, start the crystal, lock a PLL, switch clocks over.
#[test]
fn polls_of_a_start_end_at_their_first_look() {
    // Per board: (address, value) to write, or (address, mask, value) to find.
    enum Do {
        Write(u32, u32),
        Find(u32, u32, u32),
    }
    use Do::{Find, Write};
    let rp2350 = [
        Write(0x4002_3000, 1 << 14 | 1 << 26),
        Find(0x4002_0008, 1 << 14 | 1 << 26 | 1 << 25, 1 << 14 | 1 << 26),
        Find(0x4004_8004, 1 << 31, 0),
        Write(0x4004_8000, 0x00fa_baa0),
        Find(0x4004_8004, 1 << 31, 1 << 31),
        Find(0x4005_0000, 1 << 31, 0),
        Write(0x4005_3004, 0x21),
        Find(0x4005_0000, 1 << 31, 1 << 31),
        Write(0x4001_0030, 2),
        Find(0x4001_0038, u32::MAX, 4),
        Write(0x4001_203c, 1),
        Find(0x4001_0044, u32::MAX, 2),
        Write(0x4001_0048, 1 << 11),
        Find(0x4001_0048, 1 << 28, 1 << 28),
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
    ];
    for (kind, steps) in [(BoardKind::Rp2350, &rp2350[..]), (BoardKind::Rp2040, &rp2040[..])] {
        let (mut machine, _) = build(kind, kind.board(), ConverterSetup::default()).unwrap();
        for step in steps {
            match *step {
                Write(address, value) => machine.bus.write(address, 4, value, 0).unwrap(),
                Find(address, mask, value) => {
                    let found = machine.bus.read(address, 4, 0).unwrap();
                    assert_eq!(found & mask, value, "{} at {address:#x}: {found:#x}", kind.name());
                }
            }
        }
    }
}
