//! The grand piano under hundreds of strokes: it strikes once, lands softly, repeats, and is silent
//! at rest.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play, play_gesture};

/// Rise times from a bang to a press that does not strike (ms).
const RISES_MS: &[f64] = &[
    12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 120.0, 150.0, 200.0, 250.0, 300.0,
    400.0, 500.0, 600.0, 800.0, 1000.0, 1250.0, 1500.0,
];

fn grand() -> Compiled {
    common::instruments("grand-piano.whip", &[]).remove(0)
}

fn held(depth_m: f64, rise_s: f64, hold_s: f64) -> Vec<f64> {
    Gesture::new()
        .hold(0.1)
        .to(depth_m, rise_s)
        .hold(hold_s)
        .positions(RATE_HZ)
}

/// Push is never negative, so contact never pulls.
fn never_pulls(played: &Played) -> bool {
    played.extremes("contact_n", 0.0).0 >= 0.0
}

#[test]
fn the_recorded_strokes_are_struck_as_measured() {
    let Some(positions_m) = common::recording() else {
        return;
    };
    let measured = [
        (25.02, 1.04),
        (27.79, 2.27),
        (33.59, 2.17),
        (34.95, 2.20),
        (36.09, 2.14),
    ];
    let played = play(&grand(), &positions_m);
    let (times, speeds) = (played.times("note"), played.speeds());
    assert_eq!(times.len(), measured.len(), "struck at {times:?}");
    for ((t, v), (t_measured, v_measured)) in times.iter().zip(&speeds).zip(measured) {
        println!(
            "{t:.4} s: {v:.3} m/s, measured {v_measured} m/s, {:+.1} %",
            (v / v_measured - 1.0) * 100.0
        );
        assert!(
            (t - t_measured).abs() < 0.02 && (v / v_measured - 1.0).abs() < 0.1,
            "{t} s: {v} m/s"
        );
    }
    assert!(never_pulls(&played));
    println!("5 cases");
}

#[test]
fn a_full_stroke_strikes_once_and_is_caught_or_is_too_slow() {
    let grand = grand();
    // Depth (mm), the slowest rise that must strike, the fastest that must not (ms).
    for (depth_mm, strikes_ms, silent_ms) in [
        (9.0, 200.0, 250.0),
        (9.5, 250.0, 400.0),
        (10.0, 300.0, 400.0),
    ] {
        for &rise_ms in RISES_MS {
            let case = format!("{depth_mm} mm in {rise_ms} ms");
            let played = play(&grand, &held(depth_mm * 1e-3, rise_ms * 1e-3, 0.5));
            let strikes = played.times("note").len();
            assert!(strikes <= 1, "{case}: {strikes} strikes");
            assert!(strikes == 1 || rise_ms > strikes_ms, "{case}: no strike");
            assert!(strikes == 0 || rise_ms < silent_ms, "{case}: a strike");
            if strikes == 1 {
                assert_eq!(played.times("check: free -> caught").len(), 1, "{case}");
                assert_eq!(
                    played.column("phi_dot_rad_per_s").last(),
                    Some(&0.0),
                    "{case}: held by the check"
                );
            }
            assert!(never_pulls(&played), "{case}");
            if rise_ms >= 20.0 {
                assert_eq!(played.0.counts.drive_clipped, 0, "{case}");
            }
        }
    }
}

#[test]
fn a_faster_key_throws_a_faster_hammer() {
    let grand = grand();
    let speed = |&ms: &f64| play(&grand, &held(0.010, ms * 1e-3, 0.3)).speeds()[0];
    let speeds: Vec<f64> = RISES_MS
        .iter()
        .filter(|&&ms| ms <= 300.0)
        .map(speed)
        .collect();
    assert!(speeds.windows(2).all(|w| w[0] > w[1]), "{speeds:?}");
    assert!(
        speeds[0] > 4.5 && speeds[speeds.len() - 1] < 0.3,
        "from bang to breath: {speeds:?}"
    );
}

#[test]
fn a_half_held_stroke_strikes_at_most_once_and_comes_to_rest() {
    let grand = grand();
    let mut landings = [0; 4];
    for step in 0..=25 {
        let depth_mm = 4.0 + 0.2 * f64::from(step);
        for &rise_ms in RISES_MS {
            let case = format!("{depth_mm:.1} mm in {rise_ms} ms");
            let played = play(&grand, &held(depth_mm * 1e-3, rise_ms * 1e-3, 1.0));
            let still_s = 0.1 + rise_ms * 1e-3;
            assert!(
                played.times("note").len() <= 1,
                "{case}: struck at {:?}",
                played.times("note")
            );
            assert!(
                played.landings().len() <= 2,
                "{case}: landed at {:?}",
                played.landings()
            );
            assert_eq!(
                played.contact_changes_after(still_s + 0.5),
                0,
                "{case}: chatters"
            );
            let (low, high) = played.extremes("phi_dot_rad_per_s", still_s + 0.9);
            assert!(
                low > -0.01 && high < 0.01,
                "{case}: the hammer still moves at {low} .. {high} rad/s"
            );
            assert!(never_pulls(&played), "{case}");
            landings[played.landings().len()] += 1;
        }
    }
    println!(
        "landings: {} strokes with none, {} with one, {} with two",
        landings[0], landings[1], landings[2]
    );
    assert!(
        landings[1] > 100 && landings[2] > 100,
        "a thrown hammer comes back: {landings:?}"
    );
}

#[test]
fn a_hammer_let_fall_on_the_whippen_rebounds_lower_and_rests() {
    // Fig. 12: from the string's height on a key held half down.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");
    let text = std::fs::read_to_string(path).expect("the bundled grand");
    let raised = text.replace("= 0 deg, rate", "= 20.5 deg, rate");
    assert_ne!(raised, text);
    let grand = common::compiled("raised.whip", &raised, &[]).remove(0);
    let played = play(&grand, &vec![0.004; RATE_HZ as usize]);
    let phi = played.column("phi_rad");
    let rest = *phi.last().expect("a second of ticks");
    let landings = played.landings();
    assert!((1..=2).contains(&landings.len()), "{landings:?}");
    assert!(
        (0.03..0.10).contains(&landings[0]),
        "a free fall of 0.2 rad: {landings:?}"
    );
    let after = &phi[(landings[0] * f64::from(RATE_HZ)) as usize + 2..];
    let rebound = after.iter().copied().fold(f64::NEG_INFINITY, f64::max) - rest;
    println!(
        "lands at {landings:?} s, rebounds by {rebound:.4} rad of {:.4}",
        phi[0] - rest
    );
    assert!(
        rebound > 0.0 && rebound < 0.25 * (phi[0] - rest),
        "{rebound}"
    );
    assert!(played.extremes("thump_n", 0.0).1 > 0.1, "the blow is felt");
    let landing = (landings[0] * f64::from(RATE_HZ)).round() as usize;
    assert_eq!(
        played.column("contact_n")[landing],
        0.0,
        "and felt once: not through the damper too"
    );
}

#[test]
fn repeated_strokes_each_strike_once() {
    let grand = grand();
    for rate_hz in 2..=12 {
        for depth_m in [0.0095, 0.010] {
            let played = play_gesture(
                &grand,
                &Gesture::new()
                    .repeated(0.1, f64::from(rate_hz), 10, depth_m)
                    .hold(0.3),
            );
            assert_eq!(
                played.times("note").len(),
                10,
                "{rate_hz} Hz to {depth_m} m"
            );
        }
    }
    // The repetition lever: the key need not come back all the way.
    for rate_hz in [4.0, 6.0, 8.0, 10.0, 12.0] {
        let again = |g: Gesture, _| {
            g.hold(0.1 / rate_hz)
                .to(0.004, 0.45 / rate_hz)
                .to(0.010, 0.45 / rate_hz)
        };
        let gesture = (0..9)
            .fold(Gesture::new().hold(0.1).to(0.010, 0.45 / rate_hz), again)
            .hold(0.2);
        assert_eq!(
            play_gesture(&grand, &gesture).times("note").len(),
            10,
            "{rate_hz} Hz from 4 mm"
        );
    }
}

/// A still key; each reading up to one word beside the truth.
fn noisy(depth_m: f64, words: f64) -> Vec<f64> {
    let mut seed = 0x2545_f491_4f6c_dd1d_u64;
    let lsb_m = 11e-3 / 65535.0;
    let next = |_| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        depth_m + words * lsb_m * ((seed >> 40) % 3) as f64 - words * lsb_m
    };
    (0..10 * RATE_HZ as usize).map(next).collect()
}

#[test]
fn a_still_key_is_silent() {
    let grand = grand();
    for depth_m in [0.0, 0.003, 0.005, 0.006] {
        // The hammer's weight less G, and the friction of a key that was pressed.
        let rest_n = if depth_m > 0.0 { 0.489 } else { 0.359 };
        // Noise of a word is 2.3 mN of contact (standard deviation), and no friction; its extremes
        // over 10 s are near 5 of them.
        for (words, spread_n) in [(0.0, 0.003), (1.0, 0.030)] {
            let played = play(&grand, &noisy(depth_m, words));
            assert_eq!(
                played.contact_changes_after(0.5),
                0,
                "{depth_m} m, noise of {words} words"
            );
            // A key that is down when the instrument starts throws the hammer, which starts at
            // rest; only later all is still.
            assert!(
                played.times("note").iter().all(|&t| t < 0.5),
                "{depth_m} m, noise of {words} words"
            );
            let (low, high) = played.extremes("drive_n", 1.0);
            assert!(
                high - low <= spread_n,
                "{depth_m} m, noise of {words} words: {low} .. {high} N"
            );
            assert!(
                low < rest_n + 0.002 && high > rest_n - 0.002,
                "{depth_m} m: {low} .. {high} N"
            );
        }
    }
}

#[test]
fn a_released_key_rebounds_at_the_rest_felt_at_most_twice() {
    let grand = grand();
    for fall_s in [0.03, 0.06, 0.1, 0.15, 0.3] {
        let gesture = Gesture::new()
            .stroke(0.1, 0.05, 0.2, fall_s, 0.010)
            .hold(1.5);
        let played = play_gesture(&grand, &gesture);
        let up_s = 0.35 + fall_s;
        let at_rest = played.landings().iter().filter(|&&t| t > up_s).count();
        assert!(at_rest <= 2, "{fall_s} s: {:?}", played.landings());
        assert_eq!(played.contact_changes_after(up_s + 0.3), 0, "{fall_s} s");
        assert_eq!(
            played.extremes("nudge_n", up_s + 0.4),
            (0.0, 0.0),
            "{fall_s} s"
        );
        assert_eq!(played.times("release").len(), 1, "{fall_s} s");
    }
}
