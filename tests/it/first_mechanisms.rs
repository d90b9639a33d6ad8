//! The simplest instruments against physics: the virtual spring, Baker's inertia and viscosity,
//! Gillespie's two bodies.

use std::f64::consts::TAU;

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play, play_gesture};
use crate::player::Player;

const G_M_PER_S2: f64 = 9.80665;

#[test]
fn the_virtual_spring_is_within_its_error_bound() {
    let b_of = |sets: &[(&str, &str)]| if sets.is_empty() { 0.5 } else { 0.0 };
    for (sets, k) in [
        (&[][..], 100.0),
        (&[("k", "640N/m"), ("B", "0N*s/m")][..], 640.0),
    ] {
        let spring = common::instruments("virtual-spring.whip", sets).remove(0);
        for kind in [EngineKind::Jit, EngineKind::Interp] {
            let mut player = Player::new(&spring, kind);
            let bound_n = player.error("force");
            assert!(bound_n < 1e-6, "{bound_n} N");
            let mut readings_m = Vec::new();
            for (tick, position_m) in common::gesture().into_iter().enumerate().take(100_000) {
                player.tick(position_m);
                readings_m.push(player.value("x"));
                let expected_n = k * readings_m[tick] + b_of(sets) * slope(&readings_m);
                let found_n = player.value("force");
                assert!(
                    (found_n - expected_n).abs() <= bound_n + 1e-9,
                    "{kind}: tick {tick}: {found_n} N, {expected_n} N"
                );
            }
        }
    }
}

/// The slope (m/s) of the line that fits the last 45 readings best, the first one standing for all
/// before it.
fn slope(readings_m: &[f64]) -> f64 {
    let at = |back: usize| readings_m[readings_m.len().saturating_sub(back + 1)];
    let moment: f64 = (0..45).map(|back| (22.0 - back as f64) * at(back)).sum();
    let spread: f64 = (0..45).map(|back| (22.0 - f64::from(back)).powi(2)).sum();
    moment / spread * f64::from(RATE_HZ)
}

#[test]
fn the_virtual_spring_pushes_with_k_times_x_at_rest() {
    let spring = common::instruments("virtual-spring.whip", &[]).remove(0);
    for step in 0..=20 {
        let x_m = 0.5e-3 * f64::from(step);
        let played = play(&spring, &vec![x_m; 4410]);
        let force_n = *played.column("drive_n").last().expect("ticks");
        assert!((force_n - 100.0 * x_m).abs() < 2e-3, "{x_m} m: {force_n} N");
    }
}

/// Position, speed and acceleration of a minimum-jerk move of 10 mm in `rise_s` that begins at
/// `start_s`.
fn minimum_jerk(t_s: f64, start_s: f64, rise_s: f64) -> (f64, f64) {
    let u = ((t_s - start_s) / rise_s).clamp(0.0, 1.0);
    let speed = 0.010 / rise_s * u * u * (30.0 - 60.0 * u + 30.0 * u * u);
    let acceleration = 0.010 / (rise_s * rise_s) * u * (60.0 - 180.0 * u + 120.0 * u * u);
    (speed, acceleration)
}

#[test]
fn bakers_force_is_mass_times_acceleration_and_viscosity_times_speed() {
    for (sets, m_kg, b) in [
        (&[("B", "0N*s/m")][..], 0.040, 0.0),
        (&[("m", "0g")][..], 0.0, 2.0),
        (&[("m", "120g"), ("B", "5N*s/m")][..], 0.120, 5.0),
    ] {
        let baker = common::instruments("baker.whip", sets).remove(0);
        // Differentiators of 103 samples are 51 late.
        let late_s = 51.0 / f64::from(RATE_HZ);
        for rise_s in [0.1, 0.2, 0.3] {
            let played = play_gesture(
                &baker,
                &Gesture::new().hold(0.1).to(0.010, rise_s).hold(0.1),
            );
            let force_n = played.column("force_n");
            let (mut worst_n, mut most_n) = (0.0f64, 0.0f64);
            for (tick, found_n) in force_n.iter().enumerate() {
                let (speed, acceleration) =
                    minimum_jerk(tick as f64 / f64::from(RATE_HZ) - late_s, 0.1, rise_s);
                let expected_n = m_kg * acceleration + b * speed;
                worst_n = worst_n.max((found_n - expected_n).abs());
                most_n = most_n.max(expected_n.abs());
            }
            println!(
                "{m_kg} kg, {b} N*s/m, {rise_s} s: off by {:.1} mN of {:.1} mN",
                1e3 * worst_n,
                1e3 * most_n
            );
            // A word of the sensor is 0.17 um: up to 0.15 m/s^2 in x''. The rest is what the window
            // rounds off.
            assert!(
                worst_n < 0.2 * m_kg + 2e-3 * b + 0.015 * most_n + 1e-4,
                "{worst_n} N of {most_n} N"
            );
        }
    }
}

const REACH: f64 = 160.0 / 218.0;
const L3_M: f64 = 17.8e-3;
const L4_M: f64 = 103e-3;
const M_KG: f64 = 11.74e-3;
const INERTIA: f64 = M_KG * L4_M * L4_M;
const K_N_PER_M: f64 = 8e3;

fn two_body(changes: &[(&str, &str)]) -> Compiled {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/two-body.whip");
    let text = std::fs::read_to_string(path).expect("the bundled two-body action");
    let changed = changes.iter().fold(text.clone(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    common::compiled("two-body.whip", &changed, &[]).remove(0)
}

#[test]
fn a_hammer_at_rest_weighs_on_the_key_and_stays() {
    let played = play(&two_body(&[]), &vec![0.0; RATE_HZ as usize]);
    let weight_n = M_KG * G_M_PER_S2 * L4_M / L3_M * REACH;
    let (low_n, high_n) = played.extremes("force_n", 0.0);
    assert!((weight_n - 0.4890).abs() < 1e-3);
    // The key rests half a word from 0 at the most, which swings on a spring without loss: 8 kN/m *
    // 0.1 um * 2.
    assert!(
        low_n > weight_n - 2e-3 && high_n < weight_n + 2e-3,
        "{low_n} .. {high_n} N"
    );
    assert_eq!(played.contact_changes_after(0.0), 0);
}

/// Times (s) at which a column rises through a level, between samples by a straight line.
fn rises(played: &Played, title: &str, level: f64) -> Vec<f64> {
    let crosses = |(tick, w): (usize, &[f64])| {
        (w[0] < level && w[1] >= level)
            .then(|| (tick as f64 + (level - w[0]) / (w[1] - w[0])) / f64::from(RATE_HZ))
    };
    played
        .column(title)
        .windows(2)
        .enumerate()
        .filter_map(crosses)
        .collect()
}

#[test]
fn a_hammer_on_its_spring_swings_with_the_period_of_the_equation() {
    let played = play(
        &two_body(&[("= rest, rate", "= rest + 0.002 rad, rate")]),
        &vec![0.0; 2 * RATE_HZ as usize],
    );
    let rest_rad = -M_KG * L4_M * G_M_PER_S2 / (K_N_PER_M * L3_M * L3_M);
    let times = rises(&played, "phi_rad", rest_rad);
    let period_s = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let expected_s = TAU * (INERTIA / (K_N_PER_M * L3_M * L3_M)).sqrt();
    println!(
        "{:.3} ms, by the equation {:.3} ms",
        period_s * 1e3,
        expected_s * 1e3
    );
    assert!(
        (period_s / expected_s - 1.0).abs() < 1e-3,
        "{period_s} s, not {expected_s} s"
    );
    // No loss: two seconds later it swings as far as at the start.
    let (low, high) = played.extremes("phi_rad", 1.9);
    assert!(
        ((high - low) / 0.004 - 1.0).abs() < 0.01,
        "{low} .. {high} rad"
    );
    assert_eq!(
        played.contact_changes_after(0.0),
        0,
        "within the spring's reach"
    );
}

#[test]
fn a_thrown_hammer_leaves_flies_a_parabola_and_comes_back_as_fast() {
    let played = play_gesture(
        &two_body(&[]),
        &Gesture::new().hold(0.05).to(0.006, 0.1).hold(0.8),
    );
    let times = |name: &str| played.times(name);
    let (left, landed) = (
        times("contact: touching -> flying"),
        times("contact: flying -> touching"),
    );
    let flight = left
        .iter()
        .zip(landed.iter())
        .find(|(from, to)| **from > 0.15 && *to - *from > 0.02);
    let (from_s, to_s) = flight.expect("a flight over a key that stands still");
    let tick = |t_s: f64| (t_s * f64::from(RATE_HZ)).round() as usize;
    let (from, to) = (tick(*from_s) + 2, tick(*to_s) - 2);
    let (phi, rate, force_n) = (
        played.column("phi_rad"),
        played.column("phi_dot_rad_per_s"),
        played.column("force_n"),
    );
    assert!(
        force_n[from..to].iter().all(|&n| n == 0.0),
        "nothing is felt in flight"
    );
    // Falls with g/l4, whatever the mass.
    let seconds = (to - from) as f64 / f64::from(RATE_HZ);
    let fall = (rate[to] - rate[from]) / seconds;
    assert!(
        (fall + G_M_PER_S2 / L4_M).abs() < 0.1,
        "{fall} rad/s^2, not {}",
        -G_M_PER_S2 / L4_M
    );
    let parabola = phi[from] + rate[from] * seconds - 0.5 * G_M_PER_S2 / L4_M * seconds * seconds;
    assert!(
        (phi[to] - parabola).abs() < 1e-3,
        "{} rad, not {parabola} rad",
        phi[to]
    );
    // The landing loses nothing: the hammer leaves as fast as it came.
    let again = tick(*left.iter().find(|&&t| t > *to_s).expect("it leaves again")) + 1;
    println!(
        "flies {:.1} ms, lands at {:.2} rad/s, leaves at {:.2} rad/s",
        seconds * 1e3,
        rate[to],
        rate[again]
    );
    assert!(
        (rate[again] / -rate[to] - 1.0).abs() < 0.03,
        "{} after {}",
        rate[again],
        rate[to]
    );
    let compared = common::instruments("two-body.whip", &[]).remove(0);
    let exact = whippen_runtime::compare::compare(
        &compared,
        &whippen_runtime::device::Device::mikey(),
        EngineKind::Jit,
        &[Gesture::new()
            .hold(0.05)
            .to(0.006, 0.1)
            .hold(0.05)
            .positions(RATE_HZ)
            .into()],
        |_| (),
    );
    let exact = exact.unwrap_or_else(|e| panic!("{e}"));
    assert!(
        exact.events_together >= 2 && exact.events_apart == 0,
        "{:?}",
        exact.first_apart
    );
}
