//! Faults are put in, and the firmware does what it promises.

use crate::rig::{KEYS, NEWTON, Rig, guarded, setup};
use whippen_compiler::firmware::core_block;
use whippen_compiler::firmware::{Motor, Setup};
use whippen_compiler::kernel::{Kernel, parse};

const MISSED: u32 = 1;
const RAIL: u32 = 2;
const FROZEN: u32 = 4;
const HOT: u32 = 8;

/// A spring under keys that move a little, so that no sensor is constant but those that `word`
/// gives.
fn play(rig: &mut Rig, ticks: usize, word: impl Fn(usize, usize) -> Option<u16>) -> Vec<i16> {
    let noise = |tick: usize, key: usize| 50_000 + ((tick * 7 + key) % 16) as u16;
    let words = (0..ticks).flat_map(|tick| (0..KEYS).map(move |key| (tick, key)));
    let words: Vec<u16> = words
        .map(|(tick, key)| word(tick, key).unwrap_or_else(|| noise(tick, key)))
        .collect();
    rig.play(words)
}

/// Drive follows the sensor: the word less 32768.
fn direct() -> Kernel {
    let text = "kernel direct @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [-32768..32767] = sub v0 v1
    out f v2
  }
}
";
    parse(text).unwrap_or_else(|error| panic!("{error:?}"))
}

/// The same with a record of many cells.
fn large() -> Kernel {
    let cells: String = (0..70)
        .map(|at| format!("  cell c{at}: i32 [0..9] = 0\n"))
        .collect();
    let text = direct().to_string();
    let with_cells = text.replacen("  tick {", &format!("{cells}  tick {{"), 1);
    parse(&with_cells).unwrap_or_else(|error| panic!("{error:?}\n{with_cells}"))
}

fn spring() -> Rig {
    Rig::new(&direct(), 0)
}

#[test]
fn force_comes_up_over_20_ms() {
    let mut rig = spring();
    let drives = play(&mut rig, 1000, |_, _| Some(50_000));
    let key: Vec<i16> = drives.iter().skip(3).step_by(KEYS).copied().collect();
    let full = f64::from(*key.last().expect("some"));
    assert!(full.abs() > 1000.0, "{full}");
    let share = |tick: usize| f64::from(key[tick]) / full;
    let begin = key.iter().position(|word| *word != 0).expect("force");
    assert!(begin < 200, "{begin}");
    for (ms, low, high) in [
        (5, 0.2, 0.4),
        (10, 0.45, 0.6),
        (15, 0.7, 0.85),
        (21, 1.0, 1.0),
    ] {
        let at = begin + ms * 11_025 / 1000;
        assert!((low..=high).contains(&share(at)), "{ms} ms: {}", share(at));
    }
    assert!(
        key.windows(2)
            .all(|pair| (f64::from(pair[1]) / full) >= (f64::from(pair[0]) / full)),
        "it only rises"
    );
}

#[test]
fn a_sensor_at_a_rail_frees_its_key() {
    let mut rig = spring();
    play(&mut rig, 500, |_, _| None);
    for (key, rail) in [(5, 65_535), (50, 0)] {
        play(&mut rig, 100, |_, k| (k == key).then_some(rail));
        assert_eq!(rig.ceiling(key), 65_536, "not before 10 ms");
        let drives = play(&mut rig, 120, |_, k| (k == key).then_some(rail));
        assert_eq!(
            (rig.ceiling(key), rig.block(key / 44, core_block::FAULTS)),
            (0, RAIL)
        );
        assert_eq!(rig.block(key / 44, core_block::FAULTY) as usize, key % 44);
        assert_eq!(drives[drives.len() - KEYS + key], 0);
        assert_ne!(drives[drives.len() - KEYS + key + 1], 0, "others play on");
    }
}

/// Twice the number of a tick is no longer a word from 2^31 on, after 13.5 hours at 44.1 kHz.
#[test]
fn a_sensor_is_judged_after_10_ms_on_the_second_day_too() {
    let mut rig = spring();
    play(&mut rig, 500, |_, _| None);
    rig.converter().ticks_before = (1 << 31) - 2000;
    play(&mut rig, 2000, |_, _| None);
    assert!(rig.block(0, core_block::TICK) > 1 << 31);
    for (key, rail) in [(5, 65_535), (50, 0)] {
        play(&mut rig, 100, |_, k| (k == key).then_some(rail));
        assert_eq!(rig.ceiling(key), 65_536, "not before 10 ms");
        play(&mut rig, 120, |_, k| (k == key).then_some(rail));
        assert_eq!(rig.ceiling(key), 0);
    }
}

/// The drive moves because a parameter does: the fault is that the sensor does not see the key
/// move.
#[test]
fn a_frozen_sensor_frees_its_key_only_when_the_drive_moves() {
    let mut rig = spring();
    play(&mut rig, 500, |_, key| (key == 7).then_some(30_000));
    play(&mut rig, 2000, |_, key| (key == 7).then_some(30_000));
    assert_eq!(
        (rig.ceiling(7), rig.block(0, core_block::FAULTS)),
        (65_536, 0),
        "a constant word alone is no fault"
    );
    // What drives the key is changed behind the firmware's back: the gain of that key, as a fault
    // of the drive would.
    let gain = rig.block(0, core_block::GAINS) + 7 * record(&rig);
    for _ in 0..80 {
        rig.set(gain, 0);
        play(&mut rig, 20, |_, key| (key == 7).then_some(30_000));
    }
    assert_eq!(
        (rig.ceiling(7), rig.block(0, core_block::FAULTS)),
        (0, FROZEN)
    );
    assert_eq!(rig.ceiling(8), 65_536);
}

fn record(rig: &Rig) -> u32 {
    rig.layout(0, 0).record(1) - rig.layout(0, 0).record(0)
}

#[test]
fn a_hot_motor_is_held_at_its_rated_current() {
    const RATED: i64 = 2048;
    let kernel = direct();
    let motor = Motor {
        rated: RATED as u32,
        peak_ms: 4,
        newton: NEWTON,
    };
    let mut rig = Rig::with(
        &[&kernel],
        0,
        &Setup {
            ports: vec![guarded(motor)],
            ..setup()
        },
    );
    let deep = |tick: usize| 62_000 + (tick % 8) as u16;
    play(&mut rig, 500, |_, key| (key == 30).then_some(32_768));
    let drives = play(&mut rig, 2500, |tick, key| {
        (key == 30).then_some(deep(tick))
    });
    let key: Vec<i64> = drives
        .iter()
        .skip(30)
        .step_by(KEYS)
        .map(|word| i64::from(*word))
        .collect();
    let largest = key.iter().map(|word| word.abs()).max().expect("some");
    assert!(largest > 3 * RATED, "{largest}");
    let mut heat = 0;
    let heats: Vec<i64> = key
        .iter()
        .map(|word| {
            heat = (heat + word * word - RATED * RATED).max(0);
            heat
        })
        .collect();
    // The motor stands so much for two turns of 16 ticks; the limit acts within 44 ticks and the
    // turn of the key.
    let limit = (32_767 * 32_767 - RATED * RATED) * 32;
    let late = (largest * largest - RATED * RATED) * (44 + 16 + 16);
    let hottest = *heats.iter().max().expect("some");
    assert!(
        (limit..limit + late).contains(&hottest),
        "{hottest}, limit {limit} + {late}"
    );
    assert_eq!(rig.block(0, core_block::FAULTS), HOT);
    let last = key[key.len() - 10].abs();
    assert!(last <= RATED && last > RATED / 4, "{last}");
    // Without load it recovers.
    play(&mut rig, 12_000, |tick, key| {
        (key == 30).then_some(32_760 + (tick % 8) as u16)
    });
    assert_eq!(rig.ceiling(30), 65_536);
}

/// The core is held up for longer than a tick, as by a bug: its next tick is missed.
#[test]
fn a_missed_tick_takes_all_force_away() {
    missed_tick(&mut spring());
}

/// As before, where the distance of two records is more than the constant of an addition.
#[test]
fn a_missed_tick_takes_all_force_away_from_large_records() {
    let mut rig = Rig::new(&large(), 0);
    assert!(record(&rig) > 255);
    missed_tick(&mut rig);
}

fn missed_tick(rig: &mut Rig) {
    play(rig, 500, |_, _| None);
    let tick = rig.symbol("core0") + core_block::TICK;
    // As if the last tick seen were one earlier.
    let seen = rig.word(tick);
    rig.set(tick, seen - 1);
    let drives = play(rig, 30, |_, _| None);
    assert_eq!(
        (
            rig.block(0, core_block::MISSED),
            rig.block(0, core_block::FAULTS)
        ),
        (1, MISSED)
    );
    assert_eq!(rig.block(1, core_block::MISSED), 0);
    for (core, from) in [(0, 4), (1, 6)] {
        for (tick, row) in drives
            .chunks(KEYS)
            .enumerate()
            .filter(|(tick, _)| (from..12).contains(tick))
        {
            let largest = row[44 * core..][..44].iter().map(|word| word.abs()).max();
            assert!(
                largest < Some(1400),
                "core {core}, tick {tick}: {largest:?}"
            );
        }
    }
    let drives = play(rig, 400, |_, _| None);
    assert!(
        drives[drives.len() - KEYS..]
            .iter()
            .all(|word| word.abs() > 1000),
        "force comes back"
    );
}

/// Core 1 stops: nobody feeds the watchdog.
#[test]
fn the_watchdog_bites_when_a_core_stops() {
    let mut rig = spring();
    play(&mut rig, 400, |_, _| None);
    rig.machine.halt(1);
    rig.converter().samples.clear();
    let from = rig.machine.cycle(0);
    let mut stop = rig.step();
    while matches!(stop, whippen_emulator::Stop::Limit) && rig.machine.cycle(0) < from + 10_000_000
    {
        stop = rig.step();
    }
    let ms = (rig.machine.cycle(0) - from) / 150_000;
    assert!(
        matches!(stop, whippen_emulator::Stop::Reset) && (8..=13).contains(&ms),
        "{stop:?} after {ms} ms"
    );
}
