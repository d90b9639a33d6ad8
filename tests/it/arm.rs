//! The instruments of an arm: what is rubbed, plucked and bowed sounds as it should, and the hand
//! feels it.

use std::f64::consts::{PI, TAU};

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::session::Run;

use crate::common;

const RATE_HZ: f64 = 44_100.0;

fn instrument(file: &str) -> Compiled {
    common::instruments(file, &[]).remove(0)
}

/// A run of so long on a motion that is told by the time (s).
fn moved(
    compiled: &Compiled,
    kind: EngineKind,
    seconds: f64,
    motion: impl Fn(f64) -> Vec<f64>,
) -> Run {
    let move_to = |tick: usize, places: &mut [f64]| {
        places.copy_from_slice(&motion(tick as f64 / RATE_HZ));
    };
    common::recorded(compiled, kind, ((seconds * RATE_HZ) as usize, move_to))
}

/// The values of a column.
pub fn column(run: &Run, name: &str) -> Vec<f64> {
    let columns = run.trace.columns.iter();
    let found = columns.clone().find(|c| c.heading.name == name);
    let names = || columns.map(|c| c.heading.name.clone()).collect::<Vec<_>>();
    let values = found.unwrap_or_else(|| panic!("no `{name}` in {:?}", names()));
    values.values().to_vec()
}

fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|v| v * v).sum::<f64>() / signal.len() as f64).sqrt()
}

fn mean(signal: &[f64]) -> f64 {
    signal.iter().sum::<f64>() / signal.len() as f64
}

/// A partial in a Hann window over all: its size, and its phase (rad) at the beginning.
fn partial(signal: &[f64], f_hz: f64) -> (f64, f64) {
    let (mut re, mut im) = (0.0, 0.0);
    for (i, value) in signal.iter().enumerate() {
        let window = 1.0 - (TAU * i as f64 / signal.len() as f64).cos();
        let angle = TAU * f_hz * i as f64 / RATE_HZ;
        re += window * value * angle.cos();
        im -= window * value * angle.sin();
    }
    (2.0 * re.hypot(im) / signal.len() as f64, im.atan2(re))
}

/// The frequency within so many cents of a pitch at which most is heard.
pub fn loudest(signal: &[f64], pitch_hz: f64, cents: i32) -> f64 {
    let all = (-cents..=cents).map(|step| pitch_hz * (f64::from(step) / 1200.0).exp2());
    let louder = |a: &f64, b: &f64| partial(signal, *a).0.total_cmp(&partial(signal, *b).0);
    all.max_by(louder).unwrap_or(pitch_hz)
}

pub fn cents(a_hz: f64, b_hz: f64) -> f64 {
    1200.0 * (a_hz / b_hz).log2()
}

// The rubbed bank

/// Rubs a mass evenly, at 0.3 m/s and pressed with 36 N.
fn rub(compiled: &Compiled, mass: usize) -> Run {
    let along = -0.035 + 0.007 * mass as f64;
    moved(compiled, EngineKind::Jit, 1.0, |t_s| {
        vec![-0.075 + 0.15 * t_s, -0.0004, along]
    })
}

#[test]
fn each_mass_sounds_at_its_pitch_and_alone() {
    let compiled = instrument("rubbed-bank.whip");
    for mass in [0, 4, 10] {
        let run = rub(&compiled, mass);
        let pitch_hz = 55.0 + 27.5 * mass as f64;
        for other in 0..11 {
            let heard = column(&run, &format!("masses[{other}].moves"));
            let late = &heard[22_050..];
            if other == mass {
                let found_hz = loudest(late, pitch_hz, 60);
                println!("mass {mass}: {:.2} m/s at {found_hz:.1} Hz", rms(late));
                assert!(cents(found_hz, pitch_hz).abs() < 50.0 && rms(late) > 0.1);
            } else {
                assert!(rms(late) < 1e-4, "mass {other} beside {mass}");
            }
        }
        // It goes on and off, and brakes the hand all in all.
        let brakes = column(&run, "friction.x");
        assert!(mean(&brakes[22_050..]) > 0.01, "{}", mean(&brakes));
    }
}

#[test]
fn slippery_masses_are_silent() {
    let compiled = common::instruments("rubbed-bank.whip", &[("grip", "0.3")]).remove(0);
    let heard = column(&rub(&compiled, 4), "masses[4].moves");
    assert!(rms(&heard[22_050..]) < 1e-3, "{}", rms(&heard[22_050..]));
}

#[test]
fn a_pad_and_a_mouse_rub_the_same_masses() {
    let evenly = |compiled: &Compiled, from: &[f64], to: &[f64]| {
        let run = moved(compiled, EngineKind::Jit, 1.0, |t_s| {
            let between = from.iter().zip(to);
            between.map(|(from, to)| from + t_s * (to - from)).collect()
        });
        let late = &column(&run, "masses[4].moves")[22_050..];
        assert!(rms(late) > 0.1);
        assert!(rms(&column(&run, "masses[5].moves")) < 1e-4);
        loudest(late, 165.0, 60)
    };
    let pad = instrument("rubbed-pad.whip");
    let pad_hz = evenly(&pad, &[0.05, 0.056, 0.72], &[0.2, 0.056, 0.72]);
    let mouse = instrument("rubbed-mouse.whip");
    let mouse_hz = evenly(&mouse, &[0.2, 0.4], &[0.8, 0.4]);
    println!("pad {pad_hz:.1} Hz, mouse {mouse_hz:.1} Hz");
    assert!(cents(pad_hz, 165.0).abs() < 50.0 && cents(mouse_hz, 165.0).abs() < 50.0);
}

// The keytar

/// Over all strings after 0.1 s and back after 0.9 s, at a speed (m/s) and a height (m).
fn strum(compiled: &Compiled, seconds: f64, speed: f64, z: f64) -> Run {
    moved(compiled, EngineKind::Jit, seconds, |t_s| {
        let gone = |since_s: f64| (speed * (t_s - since_s)).clamp(0.0, 0.07);
        vec![0.0, -0.035 + gone(0.1) - gone(0.9), z]
    })
}

/// Which strings were plucked between two times.
fn plucked(run: &Run, from_s: f64, to_s: f64) -> Vec<i32> {
    let member = |args: &[(String, f64)]| {
        let found = args.iter().find(|(title, _)| title == "member");
        found.map_or(-1, |(_, value)| *value as i32)
    };
    let events = run.trace.events.iter().filter(|e| e.event == "pluck");
    let meant = events.filter(|e| (from_s..to_s).contains(&e.t_s));
    let mut members: Vec<i32> = meant.map(|e| member(&e.args)).collect();
    members.sort_unstable();
    members
}

#[test]
fn no_plectrum_is_too_fast_for_a_string() {
    let compiled = instrument("keytar.whip");
    for speed in [0.1, 1.0, 10.0, 100.0] {
        let run = strum(&compiled, 1.7, speed, -0.003);
        for (from_s, to_s) in [(0.1, 0.9), (0.9, 1.7)] {
            let strings = plucked(&run, from_s, to_s);
            assert_eq!(strings, [0, 1, 2, 3, 4, 5], "{speed} m/s from {from_s} s");
        }
        let above = strum(&compiled, 1.7, speed, 0.003);
        assert_eq!(plucked(&above, 0.0, 1.7), [0; 0], "{speed} m/s above");
    }
}

#[test]
fn plucked_strings_are_in_tune_and_fade_as_told() {
    let compiled = instrument("keytar.whip");
    let run = strum(&compiled, 0.6, 10.0, -0.003);
    let pitches = [82.4069, 110.0, 146.8324, 195.9977, 246.9417, 329.6276];
    for (string, pitch_hz) in pitches.into_iter().enumerate() {
        let heard = column(&run, &format!("strings[{string}].voice"));
        let part = |from_s: f64| {
            let from = (from_s * RATE_HZ) as usize;
            partial(&heard[from..from + 8820], pitch_hz)
        };
        let ((first, phase), (second, later)) = (part(0.15), part(0.35));
        // The phase that the pitch does not account for, a fraction of a turn in 0.2 s.
        let from = |s: f64| (s * RATE_HZ).floor() / RATE_HZ;
        let seconds = from(0.35) - from(0.15);
        let turned = (later - phase - TAU * pitch_hz * seconds).rem_euclid(TAU);
        let turned = if turned > PI { turned - TAU } else { turned };
        let found_cents = cents(pitch_hz + turned / TAU / seconds, pitch_hz);
        // 60 dB in 4 s, and what the mean of two samples takes.
        let a_turn = (1.0 - 6.9 / (pitch_hz * 4.0)) * (PI * pitch_hz / RATE_HZ).cos();
        let (fell, told) = (second / first, a_turn.powf(pitch_hz * seconds));
        println!("{pitch_hz} Hz: {found_cents:.3} cents, falls to {fell:.4}, told {told:.4}");
        assert!(found_cents.abs() < 0.1 && (fell / told - 1.0).abs() < 0.01);
    }
}

// The bowed violin

/// Where the strings are (m).
const STRINGS: [(f64, f64); 4] = [
    (-0.075, -0.01),
    (-0.025, 0.025),
    (0.025, 0.025),
    (0.075, -0.01),
];
const PITCHES: [f64; 4] = [195.9977, 293.6648, 440.0, 659.2551];

/// How the bow leans to play each string alone (degrees).
const TILTS: [f64; 4] = [50.0, 16.0, -16.0, -50.0];

/// Lays the bow on a string, as deep as told (m), and draws it: within 0.2 s as fast as makes
/// 0.2 m/s at the string, and evenly from then on.
fn draw(compiled: &Compiled, kind: EngineKind, string: usize, deep: f64) -> Run {
    let tilt = TILTS[string] * PI / 180.0;
    let (sin, cos) = tilt.sin_cos();
    let (x, y) = STRINGS[string];
    moved(compiled, kind, 1.2, |t_s| {
        let (moves_s, rises_s) = (f64::max(t_s - 0.05, 0.0), 0.2);
        let rising = moves_s.min(rises_s);
        let even_s = moves_s - rising;
        let drawn = -0.05 + 0.2 / 2.2 * (rising * rising / rises_s / 2.0 + even_s);
        let deep = deep * (t_s / 0.05).min(1.0);
        vec![
            x + drawn * cos + deep * sin,
            y + drawn * sin - deep * cos,
            -0.064,
            tilt,
        ]
    })
}

#[test]
fn each_string_sounds_under_its_own_stroke() {
    let compiled = instrument("bowed-violin.whip");
    for (string, pitch_hz) in PITCHES.into_iter().enumerate() {
        let run = draw(&compiled, EngineKind::Jit, string, 0.01);
        for other in 0..4 {
            let heard = column(&run, &format!("strings[{other}].bridge"));
            let late = &heard[26_460..];
            if other == string {
                let found_hz = loudest(late, pitch_hz, 40);
                let off = cents(found_hz, pitch_hz);
                let force = rms(late);
                println!("{pitch_hz} Hz: {off:.0} cents, {force:.3} N at the bridge");
                assert!(off.abs() < 30.0 && force > 0.1);
            } else {
                assert!(rms(late) < 1e-4, "string {other} beside {string}");
            }
        }
        // Along the bow, against its motion.
        let tilt = TILTS[string] * PI / 180.0;
        let felt = ["friction.x", "friction.y"].map(|name| mean(&column(&run, name)[26_460..]));
        assert!(
            felt[0] * tilt.cos() + felt[1] * tilt.sin() > 0.01,
            "{felt:?}"
        );
    }
}

/// The same motion in both.
#[test]
fn integers_bow_as_real_numbers_do() {
    let compiled = instrument("bowed-violin.whip");
    let regime = |kind: EngineKind| {
        let run = draw(&compiled, kind, 1, 0.008);
        let late = &column(&run, "strings[1].bridge")[26_460..];
        let found_hz = loudest(late, PITCHES[1], 40);
        let harmonics = [1.0, 2.0, 3.0, 4.0].map(|n| partial(late, n * found_hz).0);
        (found_hz, rms(late), harmonics)
    };
    let (integers, ideal) = (regime(EngineKind::Jit), regime(EngineKind::Ideal));
    println!("{integers:?} {ideal:?}");
    assert!(cents(integers.0, ideal.0).abs() <= 3.0);
    assert!((integers.1 / ideal.1 - 1.0).abs() < 0.02);
    for (a, b) in integers.2.into_iter().zip(ideal.2) {
        assert!((a / b - 1.0).abs() < 0.08, "{a} N, {b} N");
    }
}

#[test]
fn the_hand_feels_the_slope_of_the_strings_energy() {
    let compiled = instrument("bowed-violin.whip");
    // What the four springs hold (J), by their distance from the line of the bow.
    let energy = |x: f64, y: f64, tilt: f64| -> f64 {
        let (sin, cos) = tilt.sin_cos();
        let springs = STRINGS.iter().map(|(at_x, at_y)| {
            let deep = ((at_y - y) * cos - (at_x - x) * sin).max(0.0);
            0.5 * 250.0 * deep * deep
        });
        springs.sum()
    };
    for (x, y, degrees) in [
        (0.0, 0.02, 0.0),
        (0.01, 0.015, 20.0),
        (-0.03, 0.01, -15.0),
        (-0.08, -0.02, 60.0),
        (0.06, -0.01, -45.0),
    ] {
        let tilt = degrees * PI / 180.0;
        let run = moved(&compiled, EngineKind::Jit, 0.01, |_| vec![x, y, 0.0, tilt]);
        let step = 1e-6;
        let along_x = (energy(x + step, y, tilt) - energy(x - step, y, tilt)) / (2.0 * step);
        let along_y = (energy(x, y + step, tilt) - energy(x, y - step, tilt)) / (2.0 * step);
        for (name, told_n) in [("strings.x", along_x), ("strings.y", along_y)] {
            let felt = column(&run, name);
            let felt_n = felt[felt.len() - 1];
            // The arm tells steps of 0.055 mm.
            assert!(
                (felt_n - told_n).abs() < 0.06,
                "{name}: {felt_n} N, {told_n} N"
            );
        }
    }
}
