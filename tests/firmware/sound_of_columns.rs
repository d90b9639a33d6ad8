//! What keys at columns of converters sound, as a DAC hears it: sample for sample what the
//! interpreter makes of the words that the board had, of one core and of two.

use whippen_compiler::firmware::core_block;
use whippen_compiler::kernel::Interp;
use whippen_emulator::HeardFrame;

use crate::key_bench::PERIOD;
use crate::key_columns::{ColumnBench, KEY_PARTS, START_MS, built};
use crate::sound_out::{assert_given_in_time, attach_dac, both_sides, take_frames};

/// Plays so many keys on so many cores, and says how many samples were loud.
fn is_heard(keys: usize, cores: usize, ticks: usize) -> usize {
    let built = built("clavichord-heard.whip", keys, cores);
    let mut bench = ColumnBench::new(&built, KEY_PARTS);
    let port = built.board.i2s.expect("a sound output");
    let dac = attach_dac(&mut bench.machine, port);
    bench.pass_ms(START_MS - 3);
    assert_eq!(bench.block(core_block::TICK), 0);
    bench.between_ticks();
    bench.between_ticks();
    let rest = bench.sensed();
    let mut interp = Interp::new(&built.kernel, keys).expect("it verifies");
    interp.init(&rest);
    let mut drives = vec![0; keys];
    let begun = bench.word("core0_state", 12);
    assert!((1..4).contains(&begun), "{begun}");
    (0..begun).for_each(|_| interp.tick(&rest, &mut drives));
    let mut play = |bench: &mut ColumnBench, ticks: usize| -> Vec<[i32; 2]> {
        let tick = |tick: usize| {
            for key in 0..keys {
                let is_down = (tick + 700 * key) % 3000 > 1500;
                bench.key(key).finger.force_n = if is_down { 1.0 } else { 0.0 };
            }
            bench.pass(PERIOD);
            interp.tick(&bench.sensed(), &mut drives);
            both_sides(&interp, &built.kernel, keys)
        };
        (0..ticks).map(tick).collect()
    };
    // The machine starts when ticks are on time for certain.
    play(&mut bench, 80);
    take_frames(&mut bench.machine, dac);
    let wanted = play(&mut bench, ticks);
    bench.pass(6 * PERIOD);
    let heard = take_frames(&mut bench.machine, dac);
    assert!(heard.len() > ticks + 4, "{}", heard.len());
    let other = |from: usize| {
        let pairs = wanted.iter().zip(&heard[from..]);
        let other = pairs.filter(|(both, frame)| both.map(|side| side << 1) != frame.words);
        other.count()
    };
    let from = (0..5).find(|from| other(*from) == 0);
    let from = from.unwrap_or_else(|| panic!("{:?}", [0, 1, 2, 3, 4].map(other)));
    let since = |frame: &HeardFrame| frame.cycle - heard[0].cycle;
    let apart = (0..)
        .zip(&heard)
        .map(|(n, frame)| since(frame).abs_diff(n * PERIOD));
    assert!(apart.max() <= Some(1));
    assert_eq!(
        (bench.faults() & !8, bench.block(core_block::MISSED)),
        (0, 0)
    );
    println!("{keys} keys, {cores} cores: sample {from} frames behind");
    wanted.iter().filter(|both| both[0].abs() > 1 << 20).count()
}

#[test]
fn columns_of_one_core_are_heard_sample_for_sample() {
    assert!(is_heard(8, 1, 4000) > 500);
}

#[test]
fn columns_of_both_cores_are_heard_sample_for_sample() {
    assert!(is_heard(16, 2, 4000) > 500);
}

#[test]
fn samples_of_columns_are_given_in_time() {
    for (keys, cores) in [(8, 1), (16, 2)] {
        let built = built("clavichord-heard.whip", keys, cores);
        assert_given_in_time(&format!("{keys} keys, {cores} cores"), &built.bounded[0]);
    }
}
