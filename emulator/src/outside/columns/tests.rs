//! Columns on a chip whose cores stand still: slices of PWM, DMA and state machines do it all.
//!
//! ```text
//!   slice 8, eight times a tick --DMA--> master --select, clock, command--> columns
//!   words of a tick --DMA--> column --> DAC;   ADC --> column --DMA--> ring of two ticks
//! ```

mod chip;

use chip::{BLOCK, Bench, IDLE, PACE, PARTS, PIO, PWM, TICK, TO_SELECT, TO_UPDATE, machine_of};

use super::super::{ColumnKeyParts, KeyParts};
use super::*;

/// As many columns as the DMA has channels for.
const MOST: usize = 7;

fn mixed(tick: u64, column: usize, key: usize) -> u32 {
    let seed = tick as u32 * 1000 + column as u32 * 10 + key as u32 + 1;
    seed.wrapping_mul(0x9e37_79b9)
}

fn driven(tick: u64, column: usize, key: usize) -> u16 {
    (mixed(tick, column, key) >> 16) as u16
}

/// A code of the ADC, and the voltage in its middle.
fn sensed(tick: u64, column: usize, key: usize) -> (u16, f64) {
    let code = mixed(tick, column, key) as u16;
    (code, (f64::from(code) - 32768.0) * 20.48 / 65536.0)
}

fn set_sensors(bench: &mut Bench, tick: u64, columns: usize) {
    for column in 0..columns {
        bench.column(column).volts = std::array::from_fn(|key| sensed(tick, column, key).1);
    }
}

fn wanted(tick: u64, column: usize) -> [u16; 8] {
    std::array::from_fn(|key| sensed(tick, column, key).0)
}

/// Each tick every word of every key is right in both directions, with as many columns as the DMA
/// has channels for, and at its cycle.
#[test]
fn words_of_seven_columns_arrive_when_they_should() {
    for columns in [1, 2, 3, MOST] {
        let mut bench = Bench::new(columns, PARTS);
        // The last frame of tick 0 begins the sequence.
        for tick in 1..5 {
            bench.run_to_tick(tick);
            set_sensors(&mut bench, tick, columns);
            bench.send(tick, 0..columns);
            for column in 0..columns {
                bench.column(column).take_updates();
            }
            bench.run_to_tick(tick + 1);
            for column in 0..columns {
                let found = bench.received(column, tick);
                assert_eq!(found, wanted(tick, column), "tick {tick}, column {column}");
                assert_eq!(bench.ring_at(column), 16 * ((tick as u32 + 1) % 2));
                let updates = bench.column(column).take_updates();
                for (key, update) in updates.iter().enumerate() {
                    let frame = bench.begun + PACE * (1 + 8 * tick + key as u64);
                    // A command may wait for the other channels of the DMA, one transfer each.
                    let late = update.cycle - frame - TO_SELECT - TO_UPDATE;
                    assert!(late <= 2 * columns as u64, "{late} cycles");
                    assert_eq!(update.outputs[key], driven(tick, column, key));
                }
                assert_eq!(updates.len(), 8);
                assert_eq!(bench.column(column).refused_and_short(), [0, 0]);
            }
        }
        assert_eq!(bench.errors(), ColumnErrors::default());
    }
}

/// Data of the ADC may come up to seven cycles after the edge of the clock: 46 ns.
#[test]
fn data_of_an_adc_may_be_late_by_seven_cycles() {
    let right = |delay| {
        let parts = ColumnParts {
            data_delay_cycles: delay,
            ..PARTS
        };
        let mut bench = Bench::new(1, parts);
        bench.run_to_tick(1);
        set_sensors(&mut bench, 1, 1);
        bench.run_to_tick(2);
        bench.received(0, 1) == wanted(1, 0)
    };
    let latest = (1..9).filter(|delay| right(*delay)).max();
    assert_eq!(latest, Some(7));
    assert!((1..=7).all(right));
}

/// A tick without words leaves forces and what is received as they were, whatever a load pin that
/// is held low does; a word that writes an input register would not.
#[test]
fn a_tick_without_words_changes_nothing() {
    for loads_at_once in [false, true] {
        let parts = ColumnParts {
            loads_at_once,
            ..PARTS
        };
        let mut bench = Bench::new(2, parts);
        bench.run_to_tick(1);
        bench.send(1, 0..2);
        bench.run_to_tick(2);
        set_sensors(&mut bench, 2, 2);
        // The second column's words alone.
        bench.send(2, 1..2);
        bench.run_to_tick(3);
        let codes = |tick, column| std::array::from_fn(|key| driven(tick, column, key));
        assert_eq!(bench.column(0).outputs(), codes(1, 0));
        assert_eq!(bench.column(1).outputs(), codes(2, 1));
        assert_eq!(
            [0, 1].map(|c| bench.received(c, 2)),
            [0, 1].map(|c| wanted(2, c))
        );
    }
}

/// What each failure leaves in the ring, and that the other column has nothing of it.
#[test]
fn failures_show_in_their_column_and_are_over_in_the_next_tick() {
    type Failure<'a> = (&'a str, &'a dyn Fn(&mut Column), [u16; 8], [u16; 8]);
    let right = |tick| wanted(tick, 0);
    let slipped = |tick| {
        let right = wanted(tick, 0);
        std::array::from_fn(|key| right[(key + 1) % 8])
    };
    let mut late = right(2);
    late[0] >>= 1;
    let failures: [Failure<'_>; 4] = [
        // Nobody drives the line, which the pad pulls down.
        (
            "silent",
            &|c| c.set_fault(ScanFault::Silent),
            [0; 8],
            [0; 8],
        ),
        (
            "high",
            &|c| c.set_fault(ScanFault::Stuck(true)),
            [0xffff; 8],
            [0xffff; 8],
        ),
        // The command in the last frame begins the sequence anew.
        ("slipped", &|c| c.slip(), slipped(2), right(3)),
        ("a clock lost", &|c| c.lost_pulses = 1, late, right(3)),
    ];
    for (name, fail, first, second) in failures {
        let mut bench = Bench::new(2, PARTS);
        bench.run_to_tick(2);
        fail(bench.column(0));
        for (tick, wanted_of_it) in [(2, first), (3, second)] {
            set_sensors(&mut bench, tick, 2);
            bench.send(tick, 0..2);
            bench.run_to_tick(tick + 1);
            assert_eq!(bench.received(0, tick), wanted_of_it, "{name}, tick {tick}");
            assert_eq!(bench.received(1, tick), wanted(tick, 1), "{name}");
        }
        // A word that lost a clock is cancelled: the channel keeps its code for a tick.
        let short = u32::from(name == "a clock lost");
        assert_eq!(bench.column(0).refused_and_short(), [0, short], "{name}");
    }
}

/// A lost clock in the frame that begins the sequence anew: the rest of its command would read a
/// register that is not there, and is told as 0; the sequence goes on by itself.
#[test]
fn a_lost_command_is_not_missed() {
    let mut bench = Bench::new(1, PARTS);
    bench.run_to_tick(2);
    set_sensors(&mut bench, 2, 1);
    bench.run(7 * PACE);
    bench.column(0).lost_pulses = 1;
    bench.run_to_tick(3);
    let mut late = wanted(2, 0);
    late[7] = 0;
    assert_eq!(bench.received(0, 2), late);
    set_sensors(&mut bench, 3, 1);
    bench.run_to_tick(4);
    assert_eq!(bench.received(0, 3), wanted(3, 0));
}

/// The start sends single frames: ADCs are reset, given a range, and begin their sequence; DACs get
/// their reference, and no force.
#[test]
fn frames_by_hand_set_the_parts_up() {
    let range = |channel: u32| (5 + channel) << 9 | 1 << 8 | 6;
    let mut frames = vec![(0x8500, 0x0800_0001), (0, 0x03f8_0000)];
    frames.extend((0..8).map(|channel| (range(channel), IDLE)));
    frames.push((0xa000, 0x0317_7770));
    let mut bench = Bench::without_pace(2, PARTS);
    for column in 0..2 {
        bench.column(column).volts = [0.16; 8];
    }
    let [block, number] = machine_of(1);
    for (command, word) in &frames {
        bench.write(PIO + BLOCK * block + 0x10 + 4 * number, *word);
        bench.write(PIO + 0x10, command << 16);
        bench.run(PACE);
    }
    let all = bench.column(1).clone();
    assert!(all.has_reference() && !bench.column(0).has_reference());
    assert_eq!(all.outputs()[..3], [0x8000, 0x7777, 0x8000]);
    assert_eq!(all.refused_and_short(), [0, 0]);
    // Of 5.12 V, in the first frame of the sequence: the queue has what the last frames brought.
    bench.write(PIO + 0x10, 0);
    let queue = PIO + 0x20 + 4;
    (0..4).for_each(|_| {
        bench.read(queue);
    });
    bench.run(PACE);
    assert_eq!(bench.read(queue) as u16, 2048);
    assert_eq!(bench.errors(), ColumnErrors::default());
}

/// The loop closed by hand, as cores would close it: words of a tick become forces in the one after
/// the next, a spring of 1000 N/m with a damper, and keys stand where it is as strong as a finger.
#[test]
fn keys_stand_where_a_spring_in_words_is_as_strong_as_a_finger() {
    let mut bench = Bench::new(1, PARTS);
    let at = bench.cycle;
    bench.column(0).keys = Some(ColumnKeys::new(KEYS, at));
    for key in 0..8 {
        let keys = bench.column(0).keys.as_mut().expect("there are keys");
        keys.keys[key].finger.force_n = 0.1 * (1 + key) as f64;
    }
    // Metres of a word, and words of a newton.
    let [low, high] = KEYS.key.sensed_m;
    let metre = |word: u16| low + (f64::from(word) - 32768.0) / 32768.0 * (high - low);
    let newton = 32768.0 / (KEYS.full_a * KEYS.key.force_n_per_a);
    let mut before: [f64; 8] = [0.0; 8];
    bench.reference();
    for tick in 1..1100 {
        bench.run_to_tick(tick);
        let places = bench.received(0, tick - 1).map(metre);
        let codes = std::array::from_fn(|key| {
            let speed = (places[key] - before[key]) / (TICK as f64 / 150e6);
            let force = 1000.0 * places[key] + 4.5 * speed;
            (32768.0 + (force * newton).clamp(-32768.0, 32767.0)) as u16
        });
        before = places;
        if tick > 2 {
            bench.send_codes(0, codes);
        }
    }
    let keys = bench.column(0).keys.clone().expect("there are keys");
    for (key, own) in keys.keys.iter().enumerate() {
        let wanted = 0.0001 * (1 + key) as f64;
        assert!(
            (own.place_m() - wanted).abs() < 1e-6,
            "{key}: {}",
            own.place_m()
        );
    }
}

const KEYS: ColumnKeyParts = ColumnKeyParts {
    key: KeyParts {
        mass_kg: 0.006,
        ..super::super::keys::tests::PARTS
    },
    full_a: 4.0,
    lag_s: 20e-6,
    sensed_v: [0.0, 10.24],
};

/// Without frames nothing is received: the ring stands still, and forces stay as they were. Keys
/// move all the same.
#[test]
fn without_a_pace_the_ring_stands_still() {
    let mut bench = Bench::new(1, PARTS);
    let now = bench.cycle;
    bench.column(0).keys = Some(ColumnKeys::new(KEYS, now));
    bench.run_to_tick(1);
    bench.send(1, 0..1);
    bench.run_to_tick(2);
    bench.write(PWM + 20 * 8, 0);
    let keys = bench.column(0).keys.as_mut().expect("keys");
    keys.keys[5].finger.force_n = 0.5;
    let (at, outputs) = (bench.ring_at(0), bench.column(0).outputs());
    bench.run(10 * TICK);
    assert_eq!((bench.ring_at(0), bench.column(0).outputs()), (at, outputs));
    // Half a newton at 6 g for 0.227 ms, in steps.
    let place = bench.column(0).keys.as_ref().expect("keys").keys[5].place_m();
    assert!((2.1e-6..2.2e-6).contains(&place), "{place}");
}

/// A pace that is too fast for the ADC is counted.
#[test]
fn what_is_forbidden_is_counted() {
    let mut bench = Bench::new(1, PARTS);
    bench.run_to_tick(1);
    assert_eq!(bench.errors(), ColumnErrors::default());
    // A clock of the machine's own pace, without delays: 3 cycles a bit.
    for (at, word) in [(1, 0xe03f), (2, 0x6801), (3, 0xa042)] {
        bench.write(PIO + 0x48 + 4 * at, word);
    }
    bench.write(PWM + 20 * 8 + 0x10, 199);
    bench.run(4 * TICK);
    let errors = bench.errors();
    assert!(
        errors.hurried > 10 && errors.clock > 1000 && errors.early > 10,
        "{errors:?}"
    );
}
