//! A knob that is turned on and on: its angle is counted exactly over the seam of its sensor, and
//! beyond half a turn the program sees the end of its range, however far that is.

use std::f64::consts::TAU;

use whippen_compiler::firmware::knob_block;
use whippen_emulator::Hand;

use crate::knob_bench::Bench;

/// Steps of the sensor in a turn.
const TURN: i32 = 16_384;

/// A stiff hand turns the knob so far, 100 turns a second at most.
fn turn(bench: &mut Bench, by_rad: f64) {
    let from = bench.knob().hand.place_rad;
    let steps = 40;
    for step in 1..=steps {
        bench.knob().hand = Hand {
            torque_n_m: 0.0,
            stiffness: 20.0,
            damping: 30e-3,
            place_rad: from + by_rad * f64::from(step) / f64::from(steps),
        };
        bench.pass_ms(1);
    }
    bench.pass_ms(10);
}

fn held() -> Bench {
    let mut bench = Bench::started();
    bench.knob().hand.place_rad = bench.angle();
    turn(&mut bench, 0.0);
    bench
}

fn position(bench: &Bench) -> i32 {
    bench.word("knob", knob_block::POSITION)
}

/// The sensor word of the key.
fn word(bench: &Bench) -> u32 {
    bench.word("words0", 0) as u32 & 0xffff
}

#[test]
fn turns_are_counted_exactly() {
    let mut bench = held();
    let (from, start) = (bench.angle(), position(&bench));
    for _ in 0..3 {
        turn(&mut bench, TAU);
        assert_eq!(word(&bench), 0xffff);
    }
    let counted = f64::from(position(&bench) - start);
    let turned = (bench.angle() - from) / TAU * f64::from(TURN);
    println!("{counted} steps counted, {turned} turned");
    assert!(turned > 2.9 * f64::from(TURN) && (counted - turned).abs() < 1.5);
    for _ in 0..3 {
        turn(&mut bench, -TAU);
    }
    // Where it was, to a step: nothing is lost on the way.
    let back = (bench.angle() - from) / TAU * f64::from(TURN);
    assert!((f64::from(position(&bench) - start) - back).abs() < 1.5);
    assert!(word(&bench) < 0xc000 && word(&bench) > 0x4000);
    assert_eq!(bench.word("knob", knob_block::WRONG), 0);
}

/// As if it had been turned so far already.
#[test]
fn after_many_turns_the_program_still_sees_the_end() {
    for many in [i32::MAX / 4, i32::MAX / 2, i32::MAX] {
        for sign in [1, -1] {
            let mut bench = held();
            let near = sign * (many - TURN / 2);
            bench.set_word("knob", knob_block::POSITION, near);
            let end = if sign > 0 { 0xffff } else { 0 };
            for _ in 0..10 {
                let from = bench.knob().hand.place_rad;
                let step = f64::from(sign) * TAU / 10.0;
                bench.knob().hand.place_rad = from + step;
                bench.pass_ms(5);
                assert_eq!(word(&bench), end, "{many}, {sign}");
            }
            let counted = i64::from(position(&bench)) - i64::from(near);
            let moved = counted.abs();
            // At the end of the count it stays there.
            let most = i64::from(i32::MAX) - i64::from(near.abs()) + 1;
            assert!(moved > i64::from(TURN) * 4 / 10 && moved <= most, "{moved}");
        }
    }
}
