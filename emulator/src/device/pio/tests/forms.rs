//! What no judge is asked, by hand: what the datasheets say of it.

use super::*;

/// SM_ENABLE of machine 0 and of all.
const RUN: u32 = 1;
const ALL: u32 = 0xf;
const TXF: u32 = PIO + 0x10;
const RXF: u32 = PIO + 0x20;
const FLEVEL: u32 = PIO + 0xc;
const FLAGS: u32 = PIO + 0x30;

/// `.side_set 1`: SET pins and a delay of 3, SET pins back and a delay of 2.
const SQUARE: [u16; 2] = [0xe001 | 0x1300, 0xe000 | 0x0200];

#[test]
fn a_square_wave_with_delays_and_side_set() {
    let mut bench = Bench::new(BoardKind::Rp2040);
    bench.program(&SQUARE);
    bench.write(EXECCTRL, 1 << 12);
    for pin in [2, 5] {
        bench.write(PINCTRL, 1 << 29 | 1 << 26 | 2 << 10 | pin << 5);
        bench.write(INSTR, 0xe081);
        bench.run(bench.cycle + 10);
    }
    bench.write(PIO, RUN);
    bench.run(40);
    // Enabled in 20: SET is executed in 21, its pins high from 22 on; four cycles, then three.
    let expected = [
        (0, 0),
        (22, 0x24),
        (26, 0),
        (29, 0x24),
        (33, 0),
        (36, 0x24),
        (40, 0),
    ];
    assert_eq!(bench.changes(0x24), expected);
}

/// A machine that raises pin 0 and waits for it: out of the chip's way after four cycles, two
/// without synchronizers.
#[test]
fn a_machine_sees_its_own_pin_after_four_cycles_or_two() {
    for (bypass, cycles) in [(0, 4), (1, 2)] {
        let mut bench = Bench::new(BoardKind::Rp2350);
        // set pins, 1; wait 1 gpio 0; set x, 1; jmp self
        bench.program(&[0xe001, 0x2080, 0xe021, 0x0003]);
        bench.write(PIO + 0x38, bypass);
        bench.write(PINCTRL, 1 << 26);
        bench.write(INSTR, 0xe081);
        bench.run(10);
        bench.write(PIO, RUN);
        // SET in 11; WAIT is over in 11 + cycles, so that X is set in the cycle after.
        bench.run(11 + cycles);
        assert_eq!(bench.machine0().x, 0);
        bench.run(11 + cycles + 1);
        assert_eq!(bench.machine0().x, 1);
    }
}

#[test]
fn an_input_from_outside_is_seen_three_cycles_later() {
    let mut bench = Bench::new(BoardKind::Rp2350);
    // wait 1 pin 3; in pins, 4; push; jmp self
    bench.program(&[0x20a3, 0x4004, 0x8020, 0x0003]);
    bench.write(PINCTRL, 5 << 15);
    bench.write(SHIFTCTRL, 1 << 19 | 4);
    bench.write(PIO, RUN);
    bench.run(100);
    bench
        .machine
        .bus
        .pins
        .set_outside(1 << 8, Some(1 << 8), 101);
    bench.machine.bus.give_notice(100);
    bench.run(103);
    assert_eq!(bench.machine0().pc, 0);
    bench.run(104);
    assert_eq!(bench.machine0().pc, 1);
    bench.run(106);
    assert_eq!(bench.read(RXF), 8);
}

#[test]
fn exec_runs_in_the_next_cycle_without_the_delay_of_its_own() {
    let mut bench = Bench::new(BoardKind::Rp2040);
    // out exec, 16 [7]; jmp 0
    bench.program(&[0x67f0, 0x0000]);
    bench.write(SHIFTCTRL, 3 << 18 | 1 << 17);
    // set x, 9 [2]; then mov pc, x
    bench.write(TXF, 0xa0a1 << 16 | 0xe229);
    bench.run(20);
    bench.write(PIO, RUN);
    let mut trace = Vec::new();
    for cycle in 21..32 {
        bench.run(cycle);
        let machine = bench.machine0();
        trace.push((machine.pc, machine.x));
    }
    // The OSR is filled in 21 and used in 22; SET in 23 and two cycles of delay; JMP in 26; OUT in
    // 27, which leaves the OSR empty; MOV PC in 28.
    let expected = [0, 1, 1, 1, 1, 0, 1, 9]
        .into_iter()
        .zip([0, 0, 9, 9, 9, 9, 9, 9]);
    assert_eq!(trace[..8], expected.collect::<Vec<_>>());
}

#[test]
fn the_host_forces_instructions_whatever_the_divider_says() {
    let mut bench = Bench::new(BoardKind::Rp2040);
    bench.program(&[0x0000, 0x0001]);
    bench.write(CLKDIV, 1000 << 16);
    bench.write(INSTR, 0xe02a);
    bench.run(1);
    assert_eq!(bench.machine0().x, 10);
    // A blocking pull stalls, is told so, and ends with a word, though nothing is enabled.
    bench.write(INSTR, 0x80a0);
    bench.run(3);
    assert_eq!(bench.read(EXECCTRL) >> 31, 1);
    bench.write(TXF, 77);
    bench.run(5);
    assert_eq!((bench.read(EXECCTRL) >> 31, bench.machine0().osr), (0, 77));
    bench.write(PIO, RUN);
    bench.run(8);
    bench.write(INSTR, 0x0001);
    bench.run(9);
    assert_eq!(bench.read(PIO + 0xd4), 1);
}

#[test]
fn joined_queues_hold_eight_words_one_way() {
    let mut bench = Bench::new(BoardKind::Rp2040);
    (0..5).for_each(|word| bench.write(TXF, word));
    assert_eq!((bench.read(FLEVEL), bench.read(PIO + 8)), (4, 1 << 16));
    bench.write(SHIFTCTRL, 1 << 30);
    assert_eq!(bench.read(FLEVEL), 0, "joining empties them");
    (0..8).for_each(|word| bench.write(TXF, word));
    assert_eq!(
        bench.read(PIO + 4) & 0x0111_0101,
        0x0001_0101,
        "and none to receive"
    );
    bench.write(SHIFTCTRL, 1 << 31);
    assert_eq!(bench.read(PIO + 4) & 0x0111_0101, 0x0101_0100);
    // A read of nothing.
    assert_eq!((bench.read(RXF), bench.read(PIO + 8) >> 8 & 1), (0, 1));
}

#[test]
fn an_empty_register_is_filled_beside_other_instructions() {
    let mut bench = Bench::new(BoardKind::Rp2350);
    // nop [31]; out x, 32
    bench.program(&[0xbf42, 0x6020]);
    bench.write(SHIFTCTRL, 3 << 18 | 1 << 17);
    bench.write(PIO, RUN);
    bench.run(10);
    bench.write(TXF, 5);
    bench.run(11);
    assert_eq!((bench.read(FLEVEL), bench.machine0().osr), (0, 5));
    bench.run(33);
    assert_eq!(bench.machine0().x, 5, "so that OUT does not stall");
}

#[test]
fn interrupts_are_queues_and_flags() {
    for (kind, intr, first) in [
        (BoardKind::Rp2040, 0x128, 7),
        (BoardKind::Rp2350, 0x16c, 15),
    ] {
        let mut bench = Bench::new(kind);
        // irq 1; irq wait 2; jmp self
        bench.program(&[0xc001, 0xc022, 0x0002]);
        bench.write(PIO + intr + 4, 1 << 10);
        bench.write(PIO + intr + 0x10, 1 << 9 | 1);
        bench.write(PIO, RUN);
        assert_eq!(bench.read(PIO + intr), 0xf0);
        let level =
            |bench: &Bench| [0, 1].map(|line| bench.machine.bus.lines.level(0, first + line));
        bench.run(1);
        assert_eq!(level(&bench), [false, true]);
        bench.run(2);
        assert_eq!((level(&bench), bench.read(FLAGS)), ([true, true], 6));
        bench.run(9);
        bench.write(FLAGS, 4);
        assert_eq!(level(&bench), [false, true]);
        bench.run(11);
        assert_eq!(bench.machine0().pc, 2);
        bench.write(PIO + intr + 8, 1);
        assert_eq!(
            (level(&bench), bench.read(PIO + intr + 0xc)),
            ([true, true], 1)
        );
    }
}

#[test]
fn of_two_machines_the_later_wins_and_what_sticks_stays() {
    let mut bench = Bench::new(BoardKind::Rp2040);
    // 0: set pins, 1; set pins, 0    2: set pins, 0 [3]; set pins, 1 [3]
    bench.program(&[0xe001, 0xe000, 0xe300, 0xe301]);
    for (machine, exec) in [(0, 1 << 12), (1, 3 << 12 | 2 << 7)] {
        bench.write(EXECCTRL + STRIDE * machine, exec);
        bench.write(PINCTRL + STRIDE * machine, 1 << 26);
    }
    bench.write(INSTR, 0xe081);
    bench.write(INSTR + STRIDE, 0x0002);
    bench.run(10);
    bench.write(PIO, 3);
    bench.run(18);
    // The first writes 1 in 11, 13, .., which only the second one, low in 11, keeps from the pin.
    assert_eq!(bench.changes(1)[..4], [(0, 0), (14, 1), (15, 0), (16, 1)]);
    bench.write(EXECCTRL + STRIDE, 1 << 17 | 3 << 12 | 2 << 7);
    bench.run(40);
    bench.changes(1);
    bench.run(60);
    let lengths: Vec<u64> = bench
        .changes(1)
        .windows(2)
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    assert!(
        lengths[1..].iter().all(|cycles| *cycles == 4),
        "{lengths:?}"
    );
}

#[test]
fn version_1_has_registers_more_pins_and_directions() {
    let mut bench = Bench::new(BoardKind::Rp2350);
    assert_eq!(bench.read(PIO + 0x44), 1 << 28 | 0x20_0404);
    // mov rxfifo[2], isr; mov osr, rxfifo[y]; mov pindirs, ~null; wait 1 jmppin 1; in pins, 32
    bench.program(&[0x801a, 0x8090, 0xa06b, 0x20e1, 0x4000, 0x0005]);
    bench.write(PIO + 0x168, 16);
    bench.write(EXECCTRL, 0x1f << 12 | 20 << 24);
    bench.write(PINCTRL, 3 << 20 | 24 << 15 | 1);
    // Both: the machine's own; then what it puts is read by the system.
    bench.write(SHIFTCTRL, 3 << 14 | 3 << 18 | 5);
    bench.write(INSTR, 0xe042);
    bench.run(1);
    bench.write(INSTR, 0xa0ca);
    bench.run(2);
    bench.write(PIO, RUN);
    bench.run(5);
    assert_eq!((bench.machine0().osr, bench.read(PIO + 0x40)), (!2, 0xe));
    assert_eq!(bench.read(PIO + 0x130), 0, "out of the system's reach");
    assert_eq!(bench.machine.bus.pins.pad_signals(17), [false, true, false]);
    bench
        .machine
        .bus
        .pins
        .set_outside(1 << 37, Some(1 << 37), 30);
    bench.run(30);
    assert_eq!(
        bench.machine0().pc,
        3,
        "pin 37 is no GPIO that this block has been given"
    );
    for pin in [37, 40, 45] {
        bench.write(0x4003_8004 + 4 * pin, 0x46);
    }
    let both = 1 << 37 | 1 << 40 | 1 << 45;
    bench.machine.bus.pins.set_outside(both, Some(both), 31);
    bench.machine.bus.give_notice(30);
    bench.run(40);
    let machine = bench.machine0();
    assert_eq!((machine.pc, machine.isr), (5, 1), "five pins from 40 on");
}

#[test]
fn flags_and_clocks_reach_the_blocks_beside() {
    const NEXT: u32 = 0x10_0000;
    let mut bench = Bench::new(BoardKind::Rp2350);
    // irq next 3, from here to the second block; wait 1 irq prev 3 is there seen as its own 3.
    bench.program(&[0xc01b, 0x0001]);
    bench.write(PIO + NEXT + 0x48, 0x20c3);
    bench.write(PIO + NEXT + 0x4c, 0xe021);
    bench.write(PIO + NEXT + 0x50, 0x0002);
    // Machine 0 here and machine 0 there, in one write.
    bench.run(10);
    bench.write(PIO, RUN | 1 << 20 | 1 << 24);
    bench.run(11);
    assert_eq!(bench.read(PIO + NEXT), 1);
    bench.run(12);
    assert_eq!(bench.read(PIO + NEXT + 0xd4), 1, "seen in the cycle after");
    bench.run(13);
    bench.write(PIO, ALL | 1 << 20 | 1 << 25);
    assert_eq!((bench.read(PIO), bench.read(PIO + NEXT)), (0xf, 0));
}
