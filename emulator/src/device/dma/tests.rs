//! Transfers, chains, pacing, requests and errors of a DMA.

use super::*;
use crate::board::{Board, CoreKind};
use crate::boards::{BoardKind, ConverterSetup, build};
use crate::bus::Waits;

const SOURCE: u32 = 0x2000_0000;
const TARGET: u32 = 0x2000_0100;

/// EN, words, both addresses step, no pace; chained to itself (channel 0 unless added).
const COPY: u32 = 1 | 2 << 2 | 1 << 4 | 1 << 6 | ALWAYS << 17;

fn dma() -> (Dma, Bus) {
    let mut bus = Bus::new(&Board::generic(CoreKind::CortexM33)).unwrap();
    let uarts = [33, 34].map(|i| {
        bus.attach(
            0x4007_0000 + 0x8000 * (i - 33),
            0x4000,
            Waits::default(),
            Box::new(Uart::new(i as usize)),
        )
    });
    (0..16).for_each(|i| bus.write(SOURCE + 4 * i, 4, 0x1111 * (i + 1), 0).unwrap());
    let requesters = Requesters {
        uarts,
        pios: Vec::new(),
        // Nothing here: no ADC is asked.
        adc: uarts[0],
    };
    (Dma::new(RP2350, requesters), bus)
}

fn write(dma: &mut (Dma, Bus), offset: u32, value: u32) {
    dma.0
        .write(
            Access {
                offset,
                size: 4,
                core: 0,
                cycle: 10,
            },
            value,
            &mut dma.1,
        )
        .unwrap();
}

fn words(dma: &mut (Dma, Bus), address: u32, count: u32) -> Vec<u32> {
    (0..count)
        .map(|i| dma.1.read(address + 4 * i, 4, 0).unwrap())
        .collect()
}

#[test]
fn one_transfer_a_cycle_then_an_interrupt() {
    let mut dma = dma();
    write(&mut dma, 0x404, 1);
    [(0, SOURCE), (4, TARGET), (8, 3), (0xc, COPY)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    assert_eq!(dma.0.due(), 11);
    dma.0.attend(12, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 3), [0x1111, 0x2222, 0]);
    assert!(!dma.1.lines.level(0, 10) && dma.0.channels[0].busy);
    dma.0.attend(13, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 4), [0x1111, 0x2222, 0x3333, 0]);
    assert!(dma.1.lines.level(0, 10) && dma.0.due() == u64::MAX);
    write(&mut dma, 0x40c, 1);
    assert!(!dma.1.lines.level(0, 10));
}

#[test]
fn a_channel_without_its_enable_pauses_and_goes_on() {
    let mut dma = dma();
    [(0, SOURCE), (4, TARGET), (8, 4), (0xc, COPY)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    dma.0.attend(12, &mut dma.1);
    // CTRL, without a start: it stays busy.
    write(&mut dma, 0x10, COPY & !1);
    dma.0.attend(100, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 3), [0x1111, 0x2222, 0]);
    assert!(dma.0.channels[0].busy);
    write(&mut dma, 0x10, COPY);
    dma.0.attend(200, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 4), [0x1111, 0x2222, 0x3333, 0x4444]);
    assert!(!dma.0.channels[0].busy);
}

#[test]
fn chains_rings_and_swaps() {
    let mut dma = dma();
    // Channel 1: halfwords, swapped, from a ring of four bytes; it waits to be started by channel
    // 0.
    let ring = 1 | 1 << 2 | 1 << 4 | 1 << 6 | 2 << 8 | 1 << 13 | ALWAYS << 17 | 1 << 24;
    [
        (0x40, SOURCE),
        (0x44, TARGET + 0x40),
        (0x48, 4),
        (0x50, ring),
    ]
    .iter()
    .for_each(|(at, value)| write(&mut dma, *at, *value));
    [(0, SOURCE), (4, TARGET), (8, 1), (0xc, COPY | 1 << 13)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    dma.0.attend(100, &mut dma.1);
    assert_eq!(
        words(&mut dma, TARGET + 0x40, 2),
        [0x0000_1111, 0x0000_1111]
    );
    assert_eq!(dma.0.raised, 0b11);
}

#[test]
fn a_timer_paces() {
    let mut dma = dma();
    write(&mut dma, 0x440, 1 << 16 | 50);
    let paced = COPY & !(ALWAYS << 17) | TIMER_REQUEST << 17;
    [(0, SOURCE), (4, TARGET), (8, 3), (0xc, paced)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    dma.0.attend(110, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 3), [0x1111, 0x2222, 0]);
    dma.0.attend(111, &mut dma.1);
    assert_eq!(words(&mut dma, TARGET, 3), [0x1111, 0x2222, 0x3333]);
}

#[test]
fn a_serial_port_requests() {
    let mut dma = dma();
    for (at, value) in [
        (0x24, 81),
        (0x28, 24),
        (0x2c, 0x60),
        (0x30, 0x301),
        (0x48, 2),
    ] {
        dma.1.write(0x4007_0000 + at, 4, value, 10).unwrap();
    }
    let bytes = 1 | 1 << 4 | 28 << 17;
    [(0, SOURCE), (4, 0x4007_0000), (8, 2), (0xc, bytes)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    dma.0.attend(13_000, &mut dma.1);
    assert_eq!(
        dma.0.channels[0].read(2),
        1,
        "the second byte waits for the first: without FIFO there is room for one"
    );
    dma.1.attend(14_000);
    dma.0.attend(14_100, &mut dma.1);
    assert_eq!(dma.0.channels[0].read(2), 0);
}

#[test]
fn errors_stop_a_channel_and_are_told() {
    let mut dma = dma();
    [(0, 0x7000_0000), (4, TARGET), (8, 3), (0xc, COPY)]
        .iter()
        .for_each(|(at, value)| write(&mut dma, *at, *value));
    dma.0.attend(100, &mut dma.1);
    assert_eq!(
        dma.0.channels[0].read(3) >> 24,
        0xc0 | (COPY >> 24),
        "AHB_ERROR, READ_ERROR, not busy"
    );
    write(&mut dma, 0x10, READ_CLEARS);
    assert_eq!(dma.0.channels[0].read(3) & 0xe000_0000, 0);
}

/// Writing the error bits clears them.
const READ_CLEARS: u32 = 3 << 29;

/// Words that the wraps of two slices of PWM have let channels 0 and 1 copy by cycle 300: both
/// count 100 cycles, the second one so many cycles behind the first. Channel 2 copies so many words
/// from a cycle on.
fn copied_by_wraps(behind: u32, others: u32, from: u64) -> [u32; 2] {
    let until = 300;
    let kind = BoardKind::Rp2350;
    let (mut machine, _) = build(kind, kind.board(), ConverterSetup::default()).expect("a board");
    let (bus, dma, pwm) = (&mut machine.bus, 0x5000_0000, 0x400a_8000);
    let write = |bus: &mut Bus, address: u32, value: u32, cycle: u64| {
        bus.attend(cycle);
        let written = bus.device_write(address, 4, value, 0, cycle);
        written.expect("a register");
    };
    for channel in 0..3 {
        let request = if channel < 2 { 32 + channel } else { ALWAYS };
        let (count, start) = if channel < 2 {
            (100, 0xc)
        } else {
            (others, 0x10)
        };
        let ctrl = COPY & !(ALWAYS << 17) | request << 17 | channel << 13;
        for (at, value) in [(0, SOURCE), (4, TARGET), (8, count), (start, ctrl)] {
            write(bus, dma + 0x40 * channel + at, value, 10);
        }
    }
    for slice in 0..2 {
        write(bus, pwm + 0x14 * slice + 8, (1 - slice) * behind, 20);
        write(bus, pwm + 0x14 * slice + 0x10, 99, 20);
    }
    write(bus, pwm + 0xf0, 3, 50);
    if others > 0 {
        write(bus, dma + RP2350.timers + 0x10, 1 << 2, from);
    }
    bus.attend(until);
    let left = |bus: &mut Bus, at: u32| bus.device_read(dma + at + 8, 4, 0, until);
    [0, 0x40].map(|at| 100 - left(bus, at).expect("a count").0)
}

/// Each wrap is a word, whatever else the DMA is asked for at that time, and when another slice
/// wraps.
#[test]
fn no_pulse_is_lost() {
    for behind in [1, 2, 40] {
        for (others, from) in (0..4).flat_map(|others| (200..260).map(move |from| (others, from))) {
            let copied = copied_by_wraps(behind, others, from);
            assert_eq!(copied, [2, 2], "{behind} behind, {others} from {from}");
        }
    }
}
