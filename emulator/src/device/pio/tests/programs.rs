//! Whole programs against models of what is on their pins: cycles in closed form.

use super::*;

/// A frame of 24 bits from a magnetic sensor; side-set clock and select on pins 2 and 3, data on 4;
/// a word starts it, one less than there are bits.
///
/// ```text
///      pull block      side 0b10
///      out x, 32       side 0b00 [7]
///      nop             side 0b00 [7]
/// bit: nop             side 0b01 [6]
///      nop             side 0b00 [3]
///      in pins, 1      side 0b00 [1]
///      jmp x-- bit     side 0b00
/// ```
const SENSOR: [u16; 7] = [0x90a0, 0x6720, 0xa742, 0xae42, 0xa342, 0x4101, 0x0043];

fn sensor() -> Bench {
    let mut bench = Bench::new(BoardKind::Rp2350);
    bench.program(&SENSOR);
    bench.write(EXECCTRL, 6 << 12);
    bench.write(SHIFTCTRL, 24 << 20 | 1 << 19 | 1 << 16);
    bench.write(PINCTRL, 2 << 29 | 2 << 26 | 4 << 15 | 2 << 10 | 2 << 5);
    bench.write(INSTR, 0xe083);
    bench.run(1);
    bench.write(PIO, 1);
    bench
}

/// The model puts its next bit on the data pin when the clock rises, as the sensor does.
fn frame(bench: &mut Bench, word: u32) -> (u64, u32) {
    bench.write(PIO + 0x10, 23);
    let (begun, mut clock, mut sent) = (bench.cycle, false, 0);
    for cycle in begun + 1..begun + 1000 {
        bench.run(cycle);
        if bench.machine0().rx.len() == 1 {
            return (cycle - begun, bench.read(PIO + 0x20));
        }
        let levels = bench.machine.bus.pins.levels();
        let was = std::mem::replace(&mut clock, levels >> 2 & 1 != 0);
        if clock && !was && sent < 24 {
            sent += 1;
            let bit = u64::from(word >> (24 - sent) & 1);
            let pins = &mut bench.machine.bus.pins;
            pins.set_outside(1 << 4, Some(bit << 4), cycle + 1);
            bench.machine.bus.give_notice(cycle);
        }
    }
    panic!("no word");
}

#[test]
fn a_word_of_a_sensor_is_there_351_cycles_after_it_is_asked_for() {
    let mut bench = sensor();
    for (number, word) in [0xabcdef, 0, 0xffffff, 0x800001, 0x123456]
        .into_iter()
        .enumerate()
    {
        bench.run(1000 * (1 + number as u64));
        let (cycles, found) = frame(&mut bench, word);
        // PULL, OUT and NOP with their delays, 23 bits of 14 cycles, and one up to its IN.
        assert_eq!((found, cycles), (word, 1 + 8 + 8 + 23 * 14 + 7 + 4 + 1));
    }
}

/// Left and right by turns, a bit clock and a word clock: 128 cycles of the machine a frame.
///
/// ```text
/// l:   out pins, 1     side 0b00
///      jmp x-- l       side 0b01
///      out pins, 1     side 0b10
///      set x, 30       side 0b11
/// r:   out pins, 1     side 0b10
///      jmp x-- r       side 0b11
///      out pins, 1     side 0b00
///      set x, 30       side 0b01
/// ```
const SOUND: [u16; 8] = [
    0x6001, 0x0840, 0x7001, 0xf83e, 0x7001, 0x1844, 0x6001, 0xe83e,
];

#[test]
fn a_frame_of_sound_is_exactly_3400_cycles() {
    let mut bench = Bench::new(BoardKind::Rp2350);
    bench.program(&SOUND);
    bench.write(EXECCTRL, 7 << 12);
    bench.write(SHIFTCTRL, 1 << 30 | 1 << 17);
    bench.write(
        PINCTRL,
        2 << 29 | 3 << 26 | 1 << 20 | 18 << 10 | 18 << 5 | 20,
    );
    bench.write(INSTR, 0xe087);
    bench.run(1);
    bench.write(CLKDIV, 26 << 16 | 144 << 8);
    bench.write(INSTR, 0x0007);
    bench.run(10);
    bench.write(PIO, 1 | 1 << 8);
    let samples: Vec<u32> = (0..12)
        .map(|i: u32| 0x9e37_79b9_u32.wrapping_mul(i + 1))
        .collect();
    let mut left = samples.iter().copied();
    for cycle in 11..22_000 {
        bench.run(cycle);
        if cycle % 100 == 0 && bench.machine0().tx.len() < 8 && left.len() > 0 {
            let word = left.next().expect("there is one");
            bench.write(PIO + 0x10, word);
        }
    }
    let changes = bench.machine.bus.pins.take_changes();
    let bit = |levels: u64, pin: u32| levels >> pin & 1 != 0;
    let (mut bits, mut starts) = (Vec::new(), Vec::new());
    for pair in changes.windows(2) {
        let (before, after) = (pair[0].levels, pair[1].levels);
        if bit(after, 19) && !bit(before, 19) {
            starts.push(pair[1].cycle);
        }
        if bit(after, 18) && !bit(before, 18) {
            bits.push(u32::from(bit(after, 20)));
        }
    }
    let frames: Vec<u64> = starts.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(
        frames.len() > 4 && frames.iter().all(|cycles| *cycles == 3400),
        "{frames:?}"
    );
    // The first edge of the clock is that of the entry, before the first bit.
    let word = |bits: &[u32]| bits.iter().fold(0, |word, bit| word << 1 | bit);
    let words: Vec<u32> = bits[1..].chunks(32).map(word).collect();
    assert_eq!(words[..8], samples[..8]);
}

/// A DMA feeds the machine and takes what it has read, at the pace of its requests: a word for each
/// store, none lost.
#[test]
fn a_dma_carries_words_to_a_machine_and_back() {
    const DMA: u32 = 0x5000_0000;
    const SOURCE: u32 = 0x2000_0000;
    const TARGET: u32 = 0x2000_0100;
    let mut bench = Bench::new(BoardKind::Rp2350);
    // out x, 32 [3]; mov isr, ~x; push
    bench.program(&[0x6320, 0xa0c9, 0x8020]);
    bench.write(EXECCTRL, 2 << 12);
    bench.write(SHIFTCTRL, 3 << 18 | 1 << 17);
    for i in 0..16 {
        bench
            .machine
            .bus
            .write(SOURCE + 4 * i, 4, 7 * i, 0)
            .expect("memory");
    }
    // EN, words; to the machine from memory, then the other way; each chained to itself.
    let [there, back] = [1 | 2 << 2 | 1 << 4, 1 | 2 << 2 | 1 << 6 | 1 << 13 | 4 << 17];
    for (channel, registers) in [
        (0, [SOURCE, PIO + 0x10, 16, there]),
        (1, [PIO + 0x20, TARGET, 16, back]),
    ] {
        for (at, value) in (0..).step_by(4).zip(registers) {
            bench.write(DMA + 0x40 * channel + at, value);
        }
    }
    bench.run(50);
    assert_eq!(bench.read(FLEVEL) & 0xf, 4, "until there is no room");
    bench.write(PIO, 1);
    // The first OUT finds nothing in 51; then six cycles a word, and the DMA a cycle behind.
    bench.run(51 + 16 * 6);
    assert_eq!(bench.read(DMA + 0x48), 1);
    bench.run(52 + 16 * 6);
    assert_eq!((bench.read(DMA + 8), bench.read(DMA + 0x48)), (0, 0));
    for i in 0..16 {
        let word = bench
            .machine
            .bus
            .read(TARGET + 4 * i, 4, 200)
            .expect("memory");
        assert_eq!(word, !(7 * i));
    }
}

const FLEVEL: u32 = PIO + 0xc;
