//! Random programs: algebra, formats, rounding and error bounds against the model in f64, one tick
//! at a time.
//!
//! Everything is a plain number, so that any expression has a dimension; values are kept in reach
//! by clamps. Discontinuous pieces (comparisons, machines) are part of it: ticks in which a
//! comparison is nearly tied are left out, and counted. `WHIPPEN_PROGRAMS=20000 cargo test
//! --release --test it random_programs` tries so many instead of 800.

pub mod text;

use whippen_compiler::kernel::random::Rng;

use crate::common;
use crate::ideal::one_tick_at_a_time;
use text::program;

#[test]
fn every_value_of_random_programs_stays_within_its_bound() {
    let mut noise = Rng::new(7);
    // Strokes with noise on them, and jumps.
    let mut positions_m = common::gesture()[80_000..81_000].to_vec();
    positions_m.extend((0..200).map(|_| noise.below(11_000) as f64 * 1e-6 - 0.5e-3));
    let words = common::words(&positions_m);
    let (mut compared, mut ties) = (0, 0);
    let programs = whippen_need::count("WHIPPEN_PROGRAMS", 800_u64);
    for seed in 0..programs {
        let text = program(seed);
        let compiled = common::compiled(&format!("random {seed}"), &text, &[]).remove(0);
        let (values, tied) = one_tick_at_a_time(&compiled, &words, 1e-10);
        (compared, ties) = (compared + values, ties + tied);
    }
    println!(
        "{compared} values compared, {ties} of {} ticks tied",
        programs as usize * words.len()
    );
    assert!(compared > 1_000_000 && ties * 50 < programs as usize * words.len());
}

#[test]
fn differentiators_of_any_window_match_the_direct_sums() {
    let mut positions_m = common::gesture()[98_000..104_000].to_vec();
    let mut noise = Rng::new(11);
    positions_m.extend((0..4000).map(|_| noise.below(11_000) as f64 * 1e-6 - 0.5e-3));
    let words = common::words(&positions_m);
    // From 3 ticks, over windows whose sums need 64 bits, to 2205.
    for window_ms in ["0.01", "0.05", "0.1", "0.7", "1", "2.3", "10", "50"] {
        let text = format!(
            "instrument window {{
                sense x: length in -0.5 mm .. 10.5 mm over {window_ms} ms
                force viscous = clamp(0.4 N*s/m * x', -500 N, 500 N)
                force inertia = 1 g * x''
                let felt = (x / 1 mm + 0.6)^1.5
                let growth = felt' / 1 kHz
            }}"
        );
        let compiled = common::compiled("window", &text, &[]).remove(0);
        let (compared, _) = one_tick_at_a_time(&compiled, &words, 1e-10);
        assert!(compared > 20_000, "{window_ms} ms: {compared}");
    }
}
