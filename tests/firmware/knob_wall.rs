//! How stiff a wall can be: the knob's loop at every tick, and with a torque that is held for a
//! millisecond as in a loop of 1 kHz, on the same parts.

use std::sync::Arc;

use whippen_emulator::Hand;

use crate::knob_bench::{Bench, build_knob};

/// A wall ten degrees from the start, whose torque is made anew in every tick, or every so often.
fn wall(stiffness: f64, every_ms: Option<f64>) -> String {
    let law = format!("{stiffness} N*m/rad * max(angle - 10 deg, 0 deg)");
    let (memory, torque) = match every_ms {
        Some(ms) => (
            format!(
                "state held: torque in -63 mN*m .. 63 mN*m
    event again every {ms} ms {{ held := clamp({law}, 0 mN*m, 60 mN*m) }}"
            ),
            "held".to_string(),
        ),
        None => (String::new(), format!("clamp({law}, 0 mN*m, 60 mN*m)")),
    };
    format!(
        "instrument wall {{
    sense angle: angle in -160 deg .. 160 deg over 2 ms
    {memory}
    torque push = {torque}
}}
"
    )
}

/// How far the knob still swings (degrees, from end to end) after a finger has pushed it into the
/// wall with 20 mN*m for 0.8 s.
fn swing_deg(text: &str) -> f64 {
    let mut bench = Bench::started_with(Arc::new(build_knob(text)));
    assert_eq!(bench.faults(), 0);
    bench.knob().hand = Hand {
        torque_n_m: 20e-3,
        ..Hand::default()
    };
    bench.pass_ms(800);
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for _ in 0..500 {
        bench.pass(15_000);
        let angle = bench.angle().to_degrees();
        ends = [ends[0].min(angle), ends[1].max(angle)];
    }
    ends[1] - ends[0]
}

/// What a knob that stands still may seem to swing by: less than half of a sensor's step.
const QUIET_DEG: f64 = 0.01;

/// With nothing but the bearing's damping (0.2 mN*m*s/rad) and friction (0.5 mN*m), a loop of 1 kHz
/// stands still up to 0.4 N*m/rad and one of every tick up to 16, forty times as stiff. Twice the
/// damping over a period is 0.4 N*m/rad at 1 kHz: what a sampled wall may have and be passive.
#[test]
fn a_wall_is_forty_times_as_stiff_as_in_a_loop_of_1_khz() {
    let swings = |stiffness: f64, every_ms| {
        let swing = swing_deg(&wall(stiffness, every_ms));
        println!("{stiffness} N*m/rad, every {every_ms:?} ms: {swing:.3} degrees");
        swing > QUIET_DEG
    };
    assert!(!swings(0.4, Some(1.0)));
    assert!(swings(0.45, Some(1.0)));
    assert!(!swings(16.0, None));
    assert!(swings(24.0, None));
}
