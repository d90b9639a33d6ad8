//! A plucked string, and the pick that plucks it.

use std::f64::consts::{PI, TAU};

use whippen_runtime::engine::EngineKind;

use super::{RATE_HZ, db, part_of, pedal, played};
use crate::common;
use crate::player::Player;

/// A string that is plucked at once, and what is heard of it.
fn plucked(pitch_hz: f64, place: f64, ring: f64, seconds: f64) -> Vec<f64> {
    let compiled = pedal(&format!(
        "let f = karplus({pitch_hz} Hz, hit: signal > 0.5, strength: 0.9, place: {place}, ring: {ring})
         sound out = f"
    ));
    let mut signal = vec![1.0; (seconds * RATE_HZ) as usize];
    signal[0] = 0.0;
    let (_, [heard]) = played(&compiled, EngineKind::Jit, &signal, ["f"]);
    heard
}

/// How much of a partial is in a tenth of a second.
fn partial(heard: &[f64], start_s: f64, f_hz: f64) -> f64 {
    let start = (start_s * RATE_HZ) as usize;
    let length = (0.1 * RATE_HZ) as usize;
    let window = |n: usize| 0.5 - 0.5 * (TAU * n as f64 / length as f64).cos();
    let part = heard[start..start + length].iter().enumerate();
    let part: Vec<f64> = part.map(|(n, v)| v * window(n)).collect();
    part_of(&part, f_hz).size()
}

#[test]
fn a_plucked_string_decays_as_its_ring_says() {
    for (pitch_hz, ring) in [(110.0, 0.99), (220.0, 0.997), (440.0, 0.98)] {
        let heard = plucked(pitch_hz, 0.13, ring, 1.0);
        for n in [1.0, 2.0, 5.0] {
            let f_hz = n * pitch_hz;
            let (first, second) = (partial(&heard, 0.1, f_hz), partial(&heard, 0.3, f_hz));
            // What a turn leaves: the ring, and the mean of two samples.
            let a_turn = ring * (PI * f_hz / RATE_HZ).cos();
            let (found_db, told_db) = (db(second / first), 0.2 * pitch_hz * db(a_turn));
            println!("{pitch_hz} Hz, {ring}, partial {n}: {found_db:.2} dB, {told_db:.2} dB");
            assert!((found_db - told_db).abs() < 0.01 * told_db.abs() + 0.1);
        }
    }
}

#[test]
fn where_a_string_is_plucked_partials_are_missing() {
    let heard = plucked(220.5, 0.5, 0.999, 0.5);
    let of = |n: f64| partial(&heard, 0.1, n * 220.5);
    for n in [1.0, 3.0, 5.0] {
        assert!(of(n + 1.0) < 0.02 * of(n), "{} {}", of(n + 1.0), of(n));
    }
}

#[test]
fn a_string_with_a_live_pitch_has_a_bound_of_its_error() {
    let compiled = pedal(
        "live param pitch = 220 Hz in 75 Hz .. 1400 Hz
         let f = karplus(pitch, hit: signal > 0.5, strength: 0.9, place: 0.13, ring: 0.997)
         sound out = f",
    );
    let player = Player::new(&compiled, EngineKind::Jit);
    assert!(player.error("f") < 1e-4, "{}", player.error("f"));
}

/// A pick that goes across a string in the middle of the travel and touches it, or not.
const PICK: &str = "instrument strum {
    sense x: length in -5 mm .. 15 mm over 1 ms
    live param lifted = off
    let f = pick(x - 5 mm, touches: not lifted, k: 300 N/m, give: 2 mm)
    let bend = if f.plucked then f.bend else 0
    event plucked when f.plucked { emit pluck(bend: bend) }
    force pull = f.pull
}";

#[test]
fn no_pick_is_too_fast_for_a_string() {
    let compiled = common::compiled("strum.whip", PICK, &[]).remove(0);
    for kind in [EngineKind::Jit, EngineKind::Interp] {
        for speed in [0.01, 0.1, 1.0, 10.0, 100.0] {
            let mut player = Player::new(&compiled, kind);
            let step_m = speed / RATE_HZ;
            let (mut place_m, mut plucks) = (0.0, 0);
            for stroke in 0..6 {
                let to_m = if stroke % 2 == 0 { 10e-3 } else { 0.0 };
                while place_m != to_m {
                    let way_m: f64 = to_m - place_m;
                    place_m = if way_m.abs() <= step_m {
                        to_m
                    } else {
                        place_m + way_m.signum() * step_m
                    };
                    player.tick(place_m);
                    let past_m = player.value("x") - 5e-3;
                    // It pulls back to its place, and never farther than it gives.
                    let pull_n = player.value("pull");
                    assert!(
                        pull_n * past_m >= 0.0 && pull_n.abs() <= 0.6 + 1e-6,
                        "{pull_n} N"
                    );
                    assert!(
                        pull_n == 0.0 || (pull_n - 300.0 * past_m.clamp(-2e-3, 2e-3)).abs() < 1e-5
                    );
                }
                for _ in 0..3 {
                    player.tick(place_m);
                }
                plucks += player.count("pluck");
            }
            assert_eq!(plucks, 6, "{kind}, {speed} m/s");
        }
    }
}
