//! Periods, edges, wraps and what is taken over at them, in closed form.

use crate::boards::{BoardKind, ConverterSetup, build};
use crate::machine::Machine;

const PWM: u32 = 0x400a_8000;
const EN: u32 = PWM + 0xf0;
const INTR: u32 = PWM + 0xf4;

/// RP2350 with the pins 6 and 7 (slice 3) and 32 (slice 8).
fn machine() -> Machine {
    let kind = BoardKind::Rp2350;
    let (mut machine, _) = build(kind, kind.board(), ConverterSetup::default()).expect("a board");
    for pin in [6, 7, 32] {
        write(&mut machine, 0x4002_8004 + 8 * pin, 4, 0);
        write(&mut machine, 0x4003_8004 + 4 * pin, 0x40, 0);
    }
    machine.bus.pins.record();
    machine
}

fn write(machine: &mut Machine, address: u32, value: u32, cycle: u64) {
    machine.bus.attend(cycle);
    let write = machine.bus.device_write(address, 4, value, 0, cycle);
    write.expect("a register");
}

fn read(machine: &mut Machine, address: u32, cycle: u64) -> u32 {
    machine.bus.attend(cycle);
    let read = machine.bus.device_read(address, 4, 0, cycle);
    read.expect("a register").0
}

/// CSR, DIV, CC, TOP of a slice.
fn set(machine: &mut Machine, slice: u32, [csr, div, cc, top]: [u32; 4]) {
    for (at, value) in [(0, csr), (4, div), (0xc, cc), (0x10, top)] {
        write(machine, PWM + 0x14 * slice + at, value, 0);
    }
}

/// Cycles at which a pin rises and falls, up to a cycle.
fn edges(machine: &mut Machine, pin: u32, until: u64) -> [Vec<u64>; 2] {
    machine.bus.attend(until);
    let changes = machine.bus.pins.take_changes();
    let mut edges = [Vec::new(), Vec::new()];
    for pair in changes.windows(2) {
        let [before, after] = [0, 1].map(|i| pair[i].levels >> pin & 1);
        if before != after {
            edges[usize::from(after == 0)].push(pair[1].cycle);
        }
    }
    edges
}

#[test]
fn a_period_is_top_and_one() {
    let mut machine = machine();
    set(&mut machine, 3, [0, 0x10, 400 << 16 | 1700, 3399]);
    write(&mut machine, EN, 1 << 3, 100);
    let [rises, falls] = edges(&mut machine, 6, 20_000);
    // Counts from 101 on, and the pin is a cycle behind.
    let expected: Vec<u64> = (1..6).map(|i| 102 + 3400 * i).collect();
    assert_eq!(rises[rises.len() - 5..], expected);
    assert_eq!(
        falls,
        (0..6).map(|i| 102 + 1700 + 3400 * i).collect::<Vec<_>>()
    );
    assert_eq!(
        read(&mut machine, PWM + 0x14 * 3 + 8, 20_001),
        (20_001 - 101) % 3400
    );
}

#[test]
fn phase_correct_counts_back() {
    let mut machine = machine();
    set(&mut machine, 3, [2, 0x10, 500 << 16, 1699]);
    write(&mut machine, EN, 1 << 3, 100);
    let [rises, falls] = edges(&mut machine, 7, 15_000);
    // High in the 500 counts before a wrap, and the 500 behind it.
    let rising: Vec<u64> = (1..5).map(|i| 102 + 3400 * i - 500).collect();
    assert_eq!(rises[rises.len() - 4..], rising);
    assert_eq!(
        falls[1..],
        (1..5).map(|i| 102 + 3400 * i + 500).collect::<Vec<_>>()
    );
    let mut counter = |cycle| read(&mut machine, PWM + 0x14 * 3 + 8, cycle);
    let begun = 101 + 5 * 3400;
    assert_eq!(
        [0, 1699, 1700, 3399, 3400].map(|p| counter(begun + p)),
        [0, 1699, 1699, 0, 0]
    );
}

#[test]
fn what_is_written_is_taken_over_at_the_wrap() {
    let mut machine = machine();
    set(&mut machine, 8, [0, 0x10, 10, 99]);
    write(&mut machine, EN, 1 << 8, 0);
    write(&mut machine, PWM + 0x14 * 8 + 0xc, 60, 130);
    write(&mut machine, PWM + 0x14 * 8 + 0x10, 199, 130);
    let [rises, falls] = edges(&mut machine, 32, 650);
    assert_eq!(falls[..4], [12, 112, 262, 462]);
    assert_eq!(rises[rises.len() - 4..], [102, 202, 402, 602]);
}

#[test]
fn fractions_of_the_divider_add_up() {
    let mut machine = machine();
    set(&mut machine, 3, [0, 0x28, 5, 9]);
    write(&mut machine, EN, 1 << 3, 0);
    let [rises, falls] = edges(&mut machine, 6, 1000);
    let rises = &rises[rises.len() - 30..];
    assert!(
        rises.windows(2).all(|pair| pair[1] - pair[0] == 25),
        "{rises:?}"
    );
    assert_eq!(falls[0], 2 + 13, "five counts of 2.5 cycles");
}

#[test]
fn slices_start_together_and_wraps_interrupt() {
    let mut machine = machine();
    set(&mut machine, 3, [0, 0x10, 0, 3399]);
    set(&mut machine, 8, [0, 0x10, 0, 3399]);
    write(&mut machine, PWM + 0x14 * 8 + 8, 825, 5);
    write(&mut machine, INTR + 4, 1 << 8, 5);
    write(&mut machine, INTR + 0x10, 1 << 3, 5);
    write(&mut machine, EN, 1 << 3 | 1 << 8, 10);
    let mut lines = |cycle| {
        machine.bus.attend(cycle);
        [8, 9].map(|line| machine.bus.lines.level(0, line))
    };
    assert_eq!(lines(11 + 3400 - 825 - 1), [false, false]);
    assert_eq!(
        lines(11 + 3400 - 825),
        [true, false],
        "825 cycles before the other"
    );
    assert_eq!(lines(11 + 3400 - 1), [true, false]);
    assert_eq!(lines(11 + 3400), [true, true]);
    write(&mut machine, INTR, 1 << 8, 4000);
    assert_eq!(read(&mut machine, INTR, 4000), 1 << 3);
}

#[test]
fn a_wrap_paces_a_dma_one_word_each() {
    const DMA: u32 = 0x5000_0000;
    let mut machine = machine();
    set(&mut machine, 8, [0, 0x10, 0, 3399]);
    machine
        .bus
        .write(0x2000_0000, 4, 0x1234, 0)
        .expect("memory");
    write(&mut machine, EN, 1 << 8, 0);
    // Wraps before the start do not count.
    machine.bus.attend(9000);
    let control = 1 | 2 << 2 | 1 << 6 | 40 << 17;
    for (at, value) in [(0, 0x2000_0000), (4, 0x2000_0100), (8, 4), (0xc, control)] {
        write(&mut machine, DMA + at, value, 9001);
    }
    let mut left = |cycle| read(&mut machine, DMA + 8, cycle);
    let found: Vec<u32> = (3..6)
        .flat_map(|i| [left(3400 * i + 1), left(3400 * i + 2)])
        .collect();
    assert_eq!(found, [4, 3, 3, 2, 2, 1]);
}
