//! Keys at columns of converters, whole: what a finger feels, words as jit's, when samples become
//! forces, how long ticks take.

use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_compiler::jit::{JitCode, Options};
use whippen_emulator::{ColumnErrors, ColumnKeyParts, Finger};

use crate::key_bench::{Built, Frames, PERIOD, build_keys};
use crate::key_columns::{COLUMN, ColumnBench, KEY_PARTS, START_MS, board_of, built};
use crate::keys_time::bound_of_handler;

/// That no part was asked for what its document forbids, and each DAC knew each word.
fn assert_allowed(bench: &ColumnBench) {
    assert_eq!(bench.all().errors(), ColumnErrors::default());
    for column in bench.all().columns() {
        assert_eq!(column.refused_and_short(), [0, 0]);
    }
}

/// Each key under another force is where the program's spring is as strong.
#[test]
fn fingers_feel_the_springs_of_a_keyboard() {
    // The last column has two keys, and no more is built for it. Core 0 has the first column.
    let built = built("virtual-spring.whip", 18, 2);
    let mut bench = ColumnBench::started(&built, KEY_PARTS);
    let force = |key: usize| 0.02 + 0.005 * key as f64;
    for key in 0..18 {
        bench.key(key).finger = Finger {
            force_n: force(key),
            damping: 5.0,
            ..Finger::default()
        };
    }
    bench.pass_ms(400);
    for key in 0..18 {
        let (place, wanted) = (bench.key(key).place_m(), force(key) / 100.0);
        // A step of the converter is 0.2 um.
        assert!((place - wanted).abs() < 2e-6, "key {key}: {place}");
    }
    // Channels without keys give no force.
    assert_eq!(bench.put_out()[18..], [0; 6]);
    assert_eq!(bench.faults(), 0);
    assert_allowed(&bench);
}

/// An amplifier that turns a voltage round, on a board that says so: codes are the other way,
/// forces are not.
#[test]
fn a_key_stands_where_it_stood_with_an_amplifier_turned_round() {
    let mut board = board_of(1, 1);
    board.columns.as_mut().expect("columns").pulls_down = true;
    let built = build_keys("virtual-spring.whip", 3, board, OwnTexts::default());
    let parts = ColumnKeyParts {
        full_a: -KEY_PARTS.full_a,
        ..KEY_PARTS
    };
    let mut bench = ColumnBench::started(&built, parts);
    for key in 0..3 {
        bench.key(key).finger = Finger {
            force_n: 0.08,
            damping: 5.0,
            ..Finger::default()
        };
    }
    bench.pass_ms(400);
    bench.between_ticks();
    let sent = bench.driven();
    bench.pass(PERIOD);
    let put_out = bench.put_out();
    for (key, word) in sent.into_iter().enumerate() {
        let place = bench.key(key).place_m();
        assert!((place - 0.8e-3).abs() < 2e-6, "key {key}: {place}");
        assert!(word > 5000 && put_out[key] == -i32::from(word), "{word}");
    }
    assert_eq!(bench.faults(), 0);
}

/// Strokes on all keys: how many ticks, when the first one begins, how many later each next one,
/// and how long each is.
struct Score {
    ticks: usize,
    first: usize,
    gap: usize,
    long: usize,
}

/// What was found of them.
struct Strokes {
    frames: Frames,
    events: usize,
    /// Words at full gain that were compared.
    full: usize,
    waited: [u64; 2],
}

/// Strokes on all keys, one after the other. In each tick the words are what the ADCs sampled
/// before, the drive words are jit's on these words where the key is neither hot nor coming up, and
/// what the DACs put out by the end of the next tick is those drive words.
fn strokes(built: &Built, score: &Score) -> Strokes {
    let mut bench = ColumnBench::new(built, KEY_PARTS);
    bench.machine.set_meets_fetches(true);
    bench.pass_ms(START_MS - 3);
    assert_eq!(bench.block(core_block::TICK), 0);
    let keys = bench.key_count();
    bench.between_ticks();
    bench.between_ticks();
    let rest = bench.sensed();
    let mut jit = JitCode::build(&built.kernel, keys, Options { probes: false }).expect("a kernel");
    let mut drives = vec![0; keys];
    jit.init(&rest);
    let so_far = |core: usize| bench.word(&format!("core{core}_state"), 12);
    let begun = so_far(0);
    assert!((1..4).contains(&begun), "{begun}");
    // All cores begin with one tick.
    assert!((0..bench.cores()).all(|core| so_far(core) == begun));
    (0..begun).for_each(|_| jit.tick(&rest, &mut drives));
    let mut found = Strokes {
        frames: Frames::default(),
        events: 0,
        full: 0,
        waited: [0; 2],
    };
    let before = bench.machine.waited_cycles();
    let mut sent = bench.driven();
    for tick in 0..score.ticks {
        for key in 0..keys {
            let from = score.first + score.gap * key;
            let is_down = (from..from + score.long).contains(&tick);
            bench.key(key).finger.force_n = if is_down { 2.0 } else { 0.0 };
        }
        let gains = bench.gains();
        bench.pass_observed(PERIOD, &mut found.frames);
        // All eight frames of the tick before are over.
        let put_out = bench.put_out();
        for (key, word) in sent.iter().enumerate() {
            assert_eq!(put_out[key], i32::from(*word), "tick {tick}, key {key}");
        }
        sent = bench.driven();
        jit.tick(&bench.sensed(), &mut drives);
        for (key, gain) in gains.iter().enumerate() {
            let (driven, drive) = (sent[key], drives[key]);
            let most = ((i32::from(drive.unsigned_abs()) * gain) >> 16) + 1;
            assert!(i32::from(driven.unsigned_abs()) <= most, "tick {tick}");
            if *gain == 1 << 16 {
                assert_eq!(driven, drive, "tick {tick}, key {key}");
                found.full += 1;
            }
        }
        found.events += jit.drain_events().len();
    }
    let after = bench.machine.waited_cycles();
    found.waited = [after[0] - before[0], after[1] - before[1]];
    assert_eq!(bench.faults() & !8, 0);
    assert_allowed(&bench);
    found
}

/// As many keys of an instrument on so many cores: no tick is missed, or longer than its bound.
fn are_in_time(file: &str, keys: usize, cores: usize, score: &Score) -> Strokes {
    let built = built(file, keys, cores);
    let found = strokes(&built, score);
    for core in 0..cores {
        let most = bound_of_handler(&built, core);
        let (longest, count) = (found.frames.longest[core], found.frames.count[core]);
        println!(
            "{keys} keys of {file}, core {core}: {longest} of {most} cycles from the handler on, \
             {} in all, {count} ticks",
            built.bounded[core].contended.cycles_max
        );
        assert_eq!(count, score.ticks as u64);
        assert!(longest <= most && longest > most / 2);
    }
    println!(
        "{} events, {} words at full gain, waited {:?}",
        found.events, found.full, found.waited
    );
    found
}

#[test]
fn grands_play_as_jit_and_no_tick_is_longer_than_its_bound() {
    for keys in [8, 24] {
        let score = Score {
            ticks: 4000 + 97 * keys,
            first: 1000,
            gap: 97,
            long: 2500,
        };
        let found = are_in_time("grand-piano.whip", keys, 1, &score);
        assert_eq!(found.events, keys);
        assert!(found.full > keys * score.ticks / 3);
        // Nothing at memory; the registers of the DMA are met now and then.
        assert_eq!(found.waited[0], 0);
    }
}

/// As many grands as fit, on both cores.
#[test]
fn grands_play_on_both_cores_as_jit_and_in_time() {
    let score = Score {
        ticks: 2700,
        first: 700,
        gap: 7,
        long: 1600,
    };
    let found = are_in_time("grand-piano.whip", 48, 2, &score);
    assert_eq!(found.events, 48);
    assert!(found.full > 48 * 600);
}

/// As many columns as the DMA has channels for, and each smaller number of them: words come later
/// with more, and are looked at later.
#[test]
fn columns_of_any_number_play_on_one_core_and_on_both() {
    let score = Score {
        ticks: 1800,
        first: 1000,
        gap: 7,
        long: 300,
    };
    for (columns, cores) in [(7, 1), (7, 2)] {
        let keys = columns * COLUMN;
        let found = are_in_time("virtual-spring.whip", keys, cores, &score);
        assert!(found.full > keys * 500);
    }
    for (columns, cores) in [
        (1, 1),
        (2, 1),
        (4, 1),
        (5, 1),
        (6, 1),
        (3, 2),
        (4, 2),
        (5, 2),
    ] {
        let built = built("virtual-spring.whip", columns * COLUMN, cores);
        let bench = ColumnBench::started(&built, KEY_PARTS);
        assert_allowed(&bench);
    }
}
