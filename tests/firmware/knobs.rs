//! Several knobs on one Pico 2: whole images on the emulated chip, with models of all sensors,
//! drivers and motors on its pins, all in closed loops at once.

use std::f64::consts::TAU;

use whippen_compiler::firmware::core_block;
use whippen_emulator::{KnobParts, SensorFault};
use whippen_runtime::board;

use crate::knob_bench::{Bench, PARTS, START_MS, STIFFNESS, bundled_on, hand};

/// From a knob's motor that is found to the next one's.
const NEXT_MS: u64 = START_MS - 10;

/// Each with a magnet, a wiring and a place of its own.
fn parts_of(number: usize) -> KnobParts {
    let mut parts = PARTS;
    parts.angle_rad = 0.4 + 1.3 * number as f64;
    parts.motor.offset_rad = TAU * 0.381_966 * (number + 1) as f64;
    parts.motor.reversed = number % 2 == 1;
    parts
}

/// The knobs of a board, all found.
fn bench_on(name: &str) -> Bench {
    let board = board::bundled(name).expect("it is bundled");
    let wired = board.knob.expect("it has knobs");
    let shafts = wired.shafts.iter().enumerate();
    let knobs = shafts.map(|(number, shaft)| (board::knob_pins(&wired, shaft), parts_of(number)));
    let mut bench = Bench::of(bundled_on(name, None), knobs);
    // One after the other.
    bench.pass_ms(NEXT_MS * bench.count() as u64 + 10);
    bench
}

fn angles(bench: &mut Bench) -> Vec<f64> {
    let knobs = 0..bench.count();
    knobs
        .map(|number| bench.knob_at(number).motor().angle_rad())
        .collect()
}

/// Hands hold each knob somewhere within a pitch of its start, all at once; what each must hold it
/// with there (N*m).
fn held(bench: &mut Bench, from: &[f64], places: &[f64]) -> Vec<f64> {
    for step in 1..=40 {
        for (number, (from, place)) in from.iter().zip(places).enumerate() {
            bench.knob_at(number).hand = hand(from + place * f64::from(step) / 40.0);
        }
        bench.pass_ms(1);
    }
    bench.pass_ms(20);
    let angles = angles(bench);
    let hands = from.iter().zip(places).zip(&angles);
    hands
        .map(|((from, place), angle)| STIFFNESS * (from + place - angle))
        .collect()
}

/// All motors are found, each feels as the program says and as a knob that has the chip to itself,
/// whatever the others do; and what fails of one disables all.
fn all_play(name: &str) {
    let mut all = bench_on(name);
    let count = all.count();
    for number in 0..count {
        let error = all.electrical_error_at(number, &parts_of(number));
        let error = error.to_degrees();
        println!("{name}: knob {number} is found within {error:.2} electrical degrees");
        assert!(error.abs() < 5.0, "{number}: {error}");
    }
    assert_eq!(all.faults(), 0);
    all.pass_ms(30);
    let from = angles(&mut all);
    // Parts of a pitch of 15 degrees, another one of each.
    let parts = [0.25, -0.125, 0.125, -0.25];
    let places = parts.map(|part: f64| part * 15_f64.to_radians());
    let torques = held(&mut all, &from, &places[..count]);
    // 8 h u (1 - 2 |u|) at h = 12 mN*m; friction of program and bearing is 2.5 mN*m.
    for ((number, torque), part) in torques.iter().enumerate().zip(parts) {
        let wanted = 8.0 * 12e-3 * part * (1.0 - 2.0 * part.abs());
        println!("{name}: knob {number} at {part} of a pitch: {torque:.4} N*m, of {wanted:.4}");
        assert!((torque - wanted).abs() < 3.5e-3, "{number}: {torque}");
    }
    assert_eq!(all.word("core0", core_block::MISSED), 0);
    // The last one is the one that breaks.
    all.knob_at(count - 1)
        .set_sensor_fault(SensorFault::Field(1));
    all.pass_ms(1);
    assert_eq!(all.faults(), 64);
    assert!((0..count).all(|number| !all.knob_at(number).is_driven()));
}

#[test]
fn two_knobs_play_at_once() {
    all_play("pico2_two_knobs");
}

/// The image of four is proven to be in time; it plays with `WHIPPEN_KNOBS=4` alone, as two minutes
/// of a processor are much for every run.
#[test]
fn four_knobs_play_at_once() {
    if std::env::var("WHIPPEN_KNOBS").is_ok_and(|knobs| knobs == "4") {
        all_play("pico2_four_knobs");
        return;
    }
    let four = bundled_on("pico2_four_knobs", None);
    let bounded = four.bounded.as_ref().expect("it is proven");
    assert_eq!(bounded.alone.keys, 4);
}
