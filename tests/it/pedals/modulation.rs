//! What is late by a time that sways: flanger and chorus; and places between loudspeakers.

use std::f64::consts::TAU;

use whippen_runtime::engine::EngineKind;

use super::{Complex, RATE_HZ, TICK_S, burst, db, part_of, pedal, played};

/// What a signal was so many ticks ago, linear between two of them.
fn ago(signal: &[f64], tick: usize, ticks: f64) -> f64 {
    let of = |n: usize| tick.checked_sub(n).map_or(0.0, |then| signal[then]);
    let whole = ticks.floor();
    let (near, far) = (of(whole as usize), of(whole as usize + 1));
    near + (ticks - whole) * (far - near)
}

#[test]
fn a_flanger_that_stands_still_is_a_comb() {
    let compiled =
        pedal("let f = flanger(signal, pace: 0 Hz, depth: 2 ms, mix: 0.5) sound out = f");
    let (fed, [heard]) = played(&compiled, EngineKind::Jit, &burst(0.25, 0.1), ["f"]);
    // Half of the depth, and a tick.
    let late_s = 1e-3 + TICK_S;
    let response = |f_hz: f64| part_of(&heard, f_hz).over(part_of(&fed, f_hz));
    for k in 0..8 {
        let notch_hz = (f64::from(k) + 0.5) / late_s;
        let peak_hz = f64::from(k + 1) / late_s;
        let (notch, peak) = (response(notch_hz).size(), response(peak_hz).size());
        println!(
            "{notch_hz:.0} Hz: {:.1} dB, {peak_hz:.0} Hz: {:.3} dB",
            db(notch),
            db(peak)
        );
        assert!(db(notch) < -30.0 && db(peak).abs() < 0.25, "{notch} {peak}");
        // Beside the notch it is not as deep.
        assert!(response(notch_hz - 20.0).size() > 1.5 * notch);
        // Between two ticks lies a straight line, which is a little quieter.
        let fraction = (late_s * RATE_HZ).fract();
        let line = Complex(1.0 - fraction, 0.0)
            .add(Complex::turn(-peak_hz * TICK_S).scale(fraction))
            .mul(Complex::turn(-peak_hz * (late_s - fraction * TICK_S)));
        let told = Complex(0.5, 0.0).add(line.scale(0.5));
        assert!(response(peak_hz).add(told.scale(-1.0)).size() < 1e-4);
    }
}

#[test]
fn a_flanger_sweeps_over_its_depth() {
    let compiled =
        pedal("let f = flanger(signal, pace: 1.5 Hz, depth: 3 ms, mix: 0.3) sound out = f");
    for kind in [EngineKind::Jit, EngineKind::Interp] {
        let (fed, [heard]) = played(&compiled, kind, &burst(1.0, 0.1), ["f"]);
        for (tick, heard) in heard.iter().enumerate() {
            let swing = 0.5 + 0.5 * (TAU * 1.5 * tick as f64 * TICK_S).sin();
            let told = 0.7 * fed[tick] + 0.3 * ago(&fed, tick, 1.0 + 3e-3 * RATE_HZ * swing);
            assert!(
                (heard - told).abs() < 1e-3,
                "{kind}, tick {tick}: {heard}, not {told}"
            );
        }
    }
}

#[test]
fn the_voices_of_a_chorus_sway_by_its_depth() {
    let compiled = pedal(
        "let f = chorus(signal, pace: 0.8 Hz, late: 15 ms, depth: 5 ms, mix: 1)
         sound left on left = f.left
         sound right on right = f.right",
    );
    // A click every 25 ms.
    let click = |n: usize| f64::from(u8::from(n.is_multiple_of(1103)));
    let signal: Vec<f64> = (0..2 * RATE_HZ as usize).map(click).collect();
    let (_, sides) = played(&compiled, EngineKind::Jit, &signal, ["f.left", "f.right"]);
    for (side, ahead) in sides.iter().zip([0.0, 0.25]) {
        let (mut least_s, mut most_s) = (1.0_f64, 0.0_f64);
        for start in (0..signal.len() - 2206).step_by(1103) {
            // Where the click comes out, from its two samples.
            let window = &side[start..start + 1103];
            let sum: f64 = window.iter().sum();
            let place: f64 = window.iter().enumerate().map(|(n, v)| n as f64 * v).sum();
            let (late_s, at_s) = (place / sum * TICK_S, (start as f64 + place / sum) * TICK_S);
            let told_s = 15e-3 + 5e-3 * (TAU * (0.8 * at_s + ahead)).sin();
            assert!(
                (late_s - told_s).abs() < TICK_S,
                "{late_s} s, not {told_s} s"
            );
            (least_s, most_s) = (least_s.min(late_s), most_s.max(late_s));
        }
        println!("{ahead}: {least_s:.5} .. {most_s:.5} s");
        assert!((least_s - 10e-3).abs() < 1e-4 && (most_s - 20e-3).abs() < 1e-4);
    }
}

#[test]
fn a_place_between_loudspeakers_is_equally_loud_everywhere() {
    let compiled = pedal(
        "let f = pan(0.5, place: 2 * signal - 1)
         sound left on left = f.left
         sound right on right = f.right",
    );
    let names = ["f.left", "f.right"];
    let (fed, [left, right]) = played(&compiled, EngineKind::Jit, &burst(0.1, 0.1), names);
    for ((place, left), right) in fed.iter().zip(&left).zip(&right) {
        assert!((left.hypot(*right) - 0.5).abs() < 1e-6);
        assert!(
            (right.atan2(*left) - TAU / 4.0 * place).abs() < 1e-6,
            "{place}: {left} {right}"
        );
    }
}
