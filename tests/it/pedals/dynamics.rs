//! What follows loudness, and what is slow: envelopes, the compressor, slow oscillations, curves.

use whippen_runtime::engine::EngineKind;

use super::{RATE_HZ, TICK_S, burst, pedal, played};

const ENGINES: [EngineKind; 2] = [EngineKind::Jit, EngineKind::Interp];

/// Levels of a signal, each for a while.
fn steps(levels: &[(f64, f64)]) -> Vec<f64> {
    let of = |(level, seconds): &(f64, f64)| vec![*level; (seconds * RATE_HZ) as usize];
    levels.iter().flat_map(of).collect()
}

/// One tick of the envelope follower, in f64.
fn follow(level: f64, size: f64, attack_s: f64, release_s: f64) -> f64 {
    let time_s = if size > level { attack_s } else { release_s };
    level + (size - level) * TICK_S / (TICK_S + time_s)
}

#[test]
fn a_follower_goes_by_its_time_constants() {
    let compiled = pedal("let f = follower(-signal, attack: 5 ms, release: 150 ms) sound out = f");
    let signal = steps(&[(0.0, 0.01), (0.8, 0.2), (0.1, 0.5), (0.0, 5.0)]);
    for kind in ENGINES {
        let (fed, [level]) = played(&compiled, kind, &signal, ["f"]);
        let mut told = 0.0;
        for (size, level) in fed.iter().zip(&level) {
            told = follow(told, *size, 5e-3, 0.15);
            assert!((level - told).abs() < 4e-5, "{kind}: {level}, not {told}");
        }
        // After one time constant 1/e is left of the way, half a tick later at most.
        let start = (0.01 * RATE_HZ) as usize;
        let reached = level[start..]
            .iter()
            .position(|l| *l > 0.8 * (1.0 - (-1.0_f64).exp()));
        let seconds = reached.expect("rises") as f64 * TICK_S;
        assert!((seconds - 5e-3).abs() < 1.5 * TICK_S, "{seconds} s");
        assert!(level.last().expect("ticks").abs() < 4e-5);
    }
}

#[test]
fn an_envelope_is_there_after_exactly_its_times() {
    let compiled =
        pedal("let f = envelope(signal > 0.5, attack: 10 ms, release: 100 ms) sound out = f");
    let signal = steps(&[(0.0, 0.1), (1.0, 0.1), (0.0, 0.2)]);
    for kind in ENGINES {
        let (_, [level]) = played(&compiled, kind, &signal, ["f"]);
        let full = level.iter().position(|l| *l >= 1.0 - 1e-9).expect("rises");
        let gone = level[full..].iter().position(|l| *l == 0.0).expect("falls") + full;
        assert_eq!((full, gone), (4410 + 440, 8820 + 4409), "{kind}");
        let half = level[4410 + 220];
        assert!((half - 221.0 / 441.0).abs() < 1e-6, "{kind}: {half}");
    }
}

#[test]
fn a_compressor_has_its_curve_and_its_times() {
    for (threshold, ratio) in [(0.25, 4.0), (0.05, 2.0), (0.1, 20.0)] {
        let compiled = pedal(&format!(
            "live param ratio = {ratio} in 1 .. 20
             let f = compressor(signal, threshold: {threshold}, ratio: {ratio}, attack: 5 ms, release: 150 ms)
             let g = compressor(signal, threshold: {threshold}, ratio: ratio, attack: 0 ms, release: 0 ms)
             sound out = f.out + g.out"
        ));
        let levels = [0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0];
        let signal = steps(&levels.map(|level| (level, 0.1)));
        let names = ["f.out", "f.gain", "g.out"];
        let (fed, [out, gain, at_once]) = played(&compiled, EngineKind::Jit, &signal, names);
        let (mut level, mut most) = (0.0, 0.0_f64);
        for (tick, size) in fed.iter().enumerate() {
            level = follow(level, *size, 5e-3, 0.15);
            let factor = |level: f64| (level / threshold).max(1.0).powf(1.0 / ratio - 1.0);
            assert!(
                (gain[tick] - factor(level)).abs() < 1e-4,
                "{} {}",
                gain[tick],
                factor(level)
            );
            assert!((out[tick] - size * factor(level)).abs() < 1e-4);
            assert!((at_once[tick] - size * factor(*size)).abs() < 1e-4);
            most = most.max((out[tick] - size * factor(level)).abs());
            // Settled: above the threshold the output rises with the root of the input.
            if tick % 4410 == 4409 && *size > threshold {
                let curve = threshold * (size / threshold).powf(1.0 / ratio);
                assert!(
                    (out[tick] / curve - 1.0).abs() < 1e-3,
                    "{} {curve}",
                    out[tick]
                );
            }
        }
        println!("{threshold}, {ratio}: {most:.1e}");
    }
}

#[test]
fn a_slow_oscillation_has_its_frequency_and_its_shapes() {
    for (pace, pace_hz) in [
        ("0.1 Hz", 0.1),
        ("0.8 Hz", 0.8),
        ("7.3 Hz", 7.3),
        ("live_pace", 2.0),
    ] {
        let compiled = pedal(&format!(
            "live param live_pace = 2 Hz in 0 Hz .. 20 Hz
             let f = lfo({pace})
             sound out = 0.1 * f.sine + 0.1 * f.triangle + signal"
        ));
        let signal = vec![0.0; (30.0 * RATE_HZ) as usize];
        let names = ["f.sine", "f.triangle", "f.phase"];
        let (_, [sine, triangle, phase]) = played(&compiled, EngineKind::Jit, &signal, names);
        let (mut turns, mut last) = (0.0, 0.0);
        for (tick, now) in phase.iter().enumerate() {
            turns += if *now < last { 1.0 } else { 0.0 };
            last = *now;
            let told = pace_hz * tick as f64 * TICK_S;
            // A ten-thousandth of a hertz, and what a turn rounds.
            assert!(
                (turns + now - told).abs() <= 1e-4 * tick as f64 * TICK_S + 1e-7,
                "{pace}"
            );
            let (s, t) = (sine[tick], triangle[tick]);
            assert!(
                (s - (std::f64::consts::TAU * now).sin()).abs() < 1e-6,
                "{pace}: {now}"
            );
            let ramp = 1.0 - 4.0 * ((now + 0.25).fract() - 0.5).abs();
            assert!((t - ramp).abs() < 1e-6, "{pace}: {now}: {t}, not {ramp}");
        }
        let off_hz = (turns + last) / 30.0 - pace_hz;
        println!("{pace}: {off_hz:.1e} Hz off");
        assert!(turns >= (30.0 * pace_hz).floor() - 1.0);
    }
}

#[test]
fn distortion_is_a_hyperbolic_tangent() {
    for drive in [0.5, 3.0, 20.0] {
        let compiled = pedal(&format!(
            "live param turned = {drive} in 0.5 .. 20
             let f = distortion(2 * signal - 1, drive: {drive})
             let g = distortion(2 * signal - 1, drive: turned)
             sound out = f + g"
        ));
        let (fed, [out, live]) = played(&compiled, EngineKind::Jit, &burst(0.2, 0.0), ["f", "g"]);
        for ((size, out), live) in fed.iter().zip(&out).zip(&live) {
            let told = (drive * (2.0 * size - 1.0)).tanh();
            assert!((out - told).abs() < 1e-6, "{drive}: {out}, not {told}");
            assert!((live - told).abs() < 1e-5, "{drive}: {live}, not {told}");
        }
    }
}
