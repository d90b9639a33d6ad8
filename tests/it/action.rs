//! The full action: it lets off, strikes once, is caught, repeats, and rebounds little.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play, play_gesture};

fn action() -> Compiled {
    common::instruments("grand-action.whip", &[]).remove(0)
}

fn held(action: &Compiled, depth_mm: f64, rise_ms: f64) -> Played {
    let gesture = Gesture::new()
        .hold(0.1)
        .to(depth_mm * 1e-3, rise_ms * 1e-3)
        .hold(0.6);
    play(action, &gesture.positions(RATE_HZ))
}

#[test]
fn a_full_stroke_strikes_once_the_faster_the_harder_and_is_caught() {
    let action = action();
    let mut before = f64::INFINITY;
    for rise_ms in [
        12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 120.0, 150.0,
    ] {
        let played = held(&action, 10.0, rise_ms);
        let speeds = played.speeds();
        assert_eq!(speeds.len(), 1, "{rise_ms} ms: {speeds:?}");
        // The check holds what falls far enough.
        let caught = played.times("check: free -> caught").len();
        assert_eq!(caught, usize::from(rise_ms <= 120.0), "{rise_ms}");
        assert!(
            speeds[0] < before,
            "{rise_ms} ms: {speeds:?} after {before}"
        );
        assert!(speeds[0] > 5.0 || rise_ms > 12.0, "{speeds:?}");
        before = speeds[0];
    }
    for rise_ms in [400.0, 800.0, 1500.0] {
        assert!(held(&action, 10.0, rise_ms).speeds().is_empty());
    }
}

/// `WHIPPEN_STROKES=all cargo test --test it half_held_action -- --nocapture` plays all 572.
#[test]
fn a_half_held_action_rebounds_little() {
    let action = action();
    let all = std::env::var("WHIPPEN_STROKES").is_ok();
    let (step_mm, rises_ms): (f64, &[f64]) = match all {
        true => (
            0.2,
            &[
                12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 120.0, 150.0, 200.0,
                250.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1250.0, 1500.0,
            ],
        ),
        false => (1.0, &[15.0, 30.0, 60.0]),
    };
    let steps = (5.0 / step_mm).round() as usize;
    let (mut restitutions, mut twice, mut strokes) = (Vec::new(), Vec::new(), 0);
    for depth_mm in (0..=steps).map(|step| 4.0 + step_mm * step as f64) {
        for &rise_ms in rises_ms {
            let played = held(&action, depth_mm, rise_ms);
            strokes += 1;
            let notes = played.times("note");
            if notes.len() > 1 {
                twice.push((depth_mm, rise_ms));
            }
            let (low, high) = played.extremes("phi_dot_rad_per_s", 0.65 + rise_ms * 1e-3);
            assert!(
                low > -0.3 && high < 0.3,
                "{depth_mm} mm in {rise_ms} ms moves"
            );
            // What falls back on the whippen, and is not caught.
            if let (Some(struck_s), true) = (notes.first(), depth_mm < 7.0) {
                let after = &played.column("phi_dot_rad_per_s")
                    [(struck_s * f64::from(RATE_HZ)) as usize + 2..];
                let (mut fall, mut rise) = (0.0_f64, 0.0_f64);
                for rate in after {
                    if *rate < fall {
                        (fall, rise) = (*rate, 0.0);
                    }
                    rise = rise.max(*rate);
                }
                restitutions.push(-rise / fall);
            }
        }
    }
    restitutions.sort_by(f64::total_cmp);
    let (middle, most) = (
        restitutions[restitutions.len() / 2],
        restitutions[restitutions.len() - 1],
    );
    println!(
        "{strokes} strokes, {} struck twice: {twice:?}; restitution {middle:.2}, at most {most:.2}",
        twice.len()
    );
    assert!(
        (0.05..0.3).contains(&middle) && most < 0.31,
        "{restitutions:?}"
    );
    assert!(twice.is_empty(), "{twice:?}");
}

#[test]
fn the_action_repeats_from_the_bottom_and_from_half_held() {
    let action = action();
    for rate_hz in [2.0, 4.0, 8.0, 12.0] {
        for up_m in [0.0, 0.004] {
            // Slower ones from half held do not reach the string at all.
            if up_m > 0.0 && rate_hz < 4.0 {
                continue;
            }
            let again = |g: Gesture, _| {
                g.to(0.010, 0.45 / rate_hz)
                    .hold(0.1 / rate_hz)
                    .to(up_m, 0.45 / rate_hz)
            };
            let start = Gesture::new().hold(0.1).to(up_m, 0.2).hold(0.2);
            let played = play_gesture(&action, &(0..10).fold(start, again).hold(0.2));
            let notes = played.times("note").len();
            assert_eq!(notes, 10, "{rate_hz} Hz from {up_m} m");
        }
    }
}

/// The jack slips away under a slow press, and the lever holds the hammer a little lower.
#[test]
fn a_slow_press_lets_off_and_drops() {
    let slow = Gesture::new().hold(0.1).to(0.010, 2.0).hold(0.5);
    let played = play_gesture(&action(), &slow);
    assert!(played.speeds().is_empty());
    assert_eq!(played.times("jack: under -> out").len(), 1);
    let phi = played.column("phi_rad");
    let most = phi.iter().copied().fold(0.0, f64::max);
    let rest = *phi.last().expect("ticks");
    assert!((0.30..0.36).contains(&most) && rest < most, "{most} {rest}");
}
