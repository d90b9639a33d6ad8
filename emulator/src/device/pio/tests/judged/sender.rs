//! The program that sends sound, as the firmware has it: what it puts on its pins by
//! `rp2040-pio-emulator` and here, read as a DAC reads it.

use super::*;

const TEXT: &str = include_str!("../../../../../../compiler/firmware/src/i2s_start.s");
const CLOCK: u32 = 18;
const SIDE: u32 = 19;
const DATA: u32 = 20;
/// Bits of the right word that come first.
const FIRST: u32 = 22;
const PERIOD: u32 = 3400;

/// The instructions of the text.
fn sender() -> Vec<u32> {
    let words = TEXT
        .lines()
        .filter_map(|line| line.split_once(".short  0x"));
    let words = words.map(|(_, rest)| &rest[..4]);
    let words: Vec<u32> = words
        .map(|word| u32::from_str_radix(word, 16).expect("a number"))
        .collect();
    assert_eq!(words.len(), 10);
    words
}

fn words() -> Vec<u32> {
    (1..=10).map(|n| 0x9e37_79b9_u32.wrapping_mul(n)).collect()
}

/// Words with their sides, of levels that begin at a time each; and when the side changed.
fn read(levels: impl Iterator<Item = (u64, u64)>) -> (Vec<(u64, u32)>, Vec<u64>) {
    let (mut words, mut times) = (Vec::new(), Vec::new());
    let (mut before, mut side, mut word, mut bits) = (0, 0, 0, 0);
    for (time, levels) in levels {
        let is = |levels: u64, pin: u32| levels >> pin & 1;
        if is(levels, SIDE) != is(before, SIDE) {
            times.push(time);
        }
        if is(levels, CLOCK) > is(before, CLOCK) {
            word = word << 1 | is(levels, DATA) as u32;
            bits += 1;
            if is(levels, SIDE) != side {
                // The first one has other bits.
                if bits == 32 {
                    words.push((side, word));
                }
                (side, bits) = (is(levels, SIDE), 0);
            }
        }
        before = levels;
    }
    (words, times)
}

/// Each word once, by turns from the left on; zeros behind them.
fn is_right(found: &[(u64, u32)], first_side: u64) {
    let sent = words();
    assert!(found.len() > sent.len() + 2, "{}", found.len());
    for (at, (side, word)) in found.iter().enumerate() {
        assert_eq!(*side, (first_side + at as u64) % 2);
        assert_eq!(*word, sent.get(at).copied().unwrap_or(0), "word {at}");
    }
}

#[test]
fn sound_is_sent_as_pioemu_says() {
    let case = format!(
        "{{\"cycles\": 2200, \"program\": {:?}, \"words\": {:?}, \"directions\": {}, \"settings\": \
         {{\"auto_push\": false, \"auto_pull\": false, \"shift_osr_right\": false, \"out_base\": {DATA}, \
         \"out_count\": 1, \"side_set_base\": {CLOCK}, \"side_set_count\": 2}}}}\n",
        sender(),
        words(),
        7 << CLOCK,
    );
    let Some(theirs) = asked("pioemu", "pio_pioemu.py", &case) else {
        return;
    };
    let mut clock = 0;
    let steps = theirs[0].split_whitespace().map(|step| {
        let mut numbers = step.split(',').map(|n| u64::from_str_radix(n, 16));
        let mut number = || numbers.next().and_then(Result::ok).expect("a number");
        let began = std::mem::replace(&mut clock, number());
        (began, number())
    });
    let (found, times) = read(steps);
    // The first word goes right, behind two bits of the left one.
    is_right(&found, 1);
    let periods: Vec<u64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(
        periods[1..].iter().all(|cycles| *cycles == 128),
        "{periods:?}"
    );
}

/// The same here, set up as the start does, with a divider that makes a period of a frame.
#[test]
fn a_frame_of_sound_is_a_period() {
    let mut bench = Bench::new(BoardKind::Rp2350);
    let program: Vec<u16> = sender().iter().map(|word| *word as u16).collect();
    bench.program(&program);
    bench.write(EXECCTRL, 9 << 12);
    bench.write(SHIFTCTRL, 0);
    let pins =
        |sets: u32, from: u32| 2 << 29 | sets << 26 | 1 << 20 | CLOCK << 10 | from << 5 | DATA;
    let set_up = [
        (CLKDIV, 1 << 16),
        (PINCTRL, pins(2, CLOCK)),
        (INSTR, 0xe083),
        (PINCTRL, pins(1, DATA)),
        (INSTR, 0xe081),
        (INSTR, 0xe000),
        (INSTR, 0xe020),
        (INSTR, 0xe040 | (FIRST - 2)),
        (INSTR, 5),
        (CLKDIV, PERIOD << 8),
    ];
    for (number, (register, value)) in (1..).zip(set_up) {
        bench.write(register, value);
        bench.run(number * 20);
    }
    let begun = bench.cycle;
    bench.write(PIO, 1);
    let sent = words();
    let mut left = sent.iter();
    for cycle in begun + 1..begun + 30_000 {
        bench.run(cycle);
        let is_time = (cycle - begun) % 1000 == 500 && bench.machine0().tx.len() < 4;
        if let Some(word) = is_time.then(|| left.next()).flatten() {
            bench.write(PIO + 0x10, *word);
        }
    }
    let changes = bench.machine.bus.pins.take_changes();
    let (found, times) = read(changes.iter().map(|change| (change.cycle, change.levels)));
    is_right(&found, 0);
    // Left is taken so many bits behind the beginning, within a cycle of the divided clock.
    let first = times
        .iter()
        .find(|time| **time > begun + 14)
        .expect("a change")
        - begun;
    let wanted = u64::from((FIRST - 1) * PERIOD / 64);
    assert!(first.abs_diff(wanted) < 60, "{first}, not {wanted}");
    let frames: Vec<u64> = times.iter().copied().skip(2).step_by(2).collect();
    let lengths: Vec<u64> = frames.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(
        lengths.len() > 5 && lengths.iter().all(|own| *own == 3400),
        "{lengths:?}"
    );
}
