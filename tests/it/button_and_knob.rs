//! What is no piano: the snap dome's curve and clicks, the knob's detents, friction and stops.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::Gesture;
use whippen_runtime::motion::{self, MotionOptions};

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play, play_gesture};
use crate::player::Player;

const ENGINES: [EngineKind; 2] = [EngineKind::Jit, EngineKind::Interp];

fn dome() -> Compiled {
    common::instruments("snap-dome.whip", &[]).remove(0)
}

/// Forces of a slow stroke to 3.3 mm and back at every micrometre: going down, coming back.
fn slow_stroke(kind: EngineKind, compiled: &Compiled) -> (Vec<f64>, Vec<f64>) {
    let mut player = Player::new(compiled, kind);
    let total = player.index("force");
    let mut force_at = |micrometres: u32| {
        player.tick(f64::from(micrometres) * 1e-6);
        player.value_at(total)
    };
    (
        (0..=3300).map(&mut force_at).collect(),
        (0..=3300).rev().map(&mut force_at).collect(),
    )
}

#[test]
fn the_dome_rises_to_its_peak_drops_to_its_valley_and_returns_below() {
    for kind in ENGINES {
        let (press, mut back) = slow_stroke(kind, &dome());
        back.reverse();
        let highest = press
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .expect("a stroke");
        assert!(
            (highest.0 as f64 - 1500.0).abs() < 20.0 && (highest.1 - 0.60).abs() < 1e-3,
            "{highest:?}"
        );
        assert!(
            (press[2500] - 0.32).abs() < 1e-3 && (press[3300] - 0.32).abs() < 1e-3,
            "the valley"
        );
        assert!(
            press[..1450].windows(2).all(|w| w[1] > w[0] - 1e-4),
            "rises all the way"
        );
        assert!(
            press[1550..2450].windows(2).all(|w| w[1] < w[0] + 1e-4),
            "and gives way"
        );
        assert!(press[0].abs() < 1e-3 && back[0].abs() < 1e-3);
        // Away from the turning points the way back has (1 - 0.18)/(1 + 0.18) of the force.
        for x_um in (100..2650).step_by(50) {
            assert!(
                (back[x_um] / press[x_um] - 0.695).abs() < 0.01 || x_um < 650,
                "at {x_um} um"
            );
        }
        assert!(
            press
                .iter()
                .zip(&back)
                .skip(650)
                .take(2000)
                .all(|(p, b)| b < p),
            "softer on the way back"
        );
    }
}

#[test]
fn a_dome_that_is_turned_half_way_does_not_jump() {
    let compiled = dome();
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let total = player.index("force");
        let turns = [1.0, 0.6, 1.4, 1.2, 2.0, 1.6, 2.4, 0.9, 3.0, 2.9, 3.3, 0.0];
        let (mut last_mm, mut last_n, mut ticks) = (0.0f64, None::<f64>, 0);
        for to_mm in turns {
            let steps = ((to_mm - last_mm).abs() / 1e-3).round() as u32;
            for step in 1..=steps {
                player.tick(
                    (last_mm + (to_mm - last_mm) * f64::from(step) / f64::from(steps)) * 1e-3,
                );
                let force_n = player.value_at(total);
                // A micrometre of the steepest part of the bristle: 2 * 0.18 * 0.6 N / 1.18 / 0.6
                // mm, and the dome itself.
                assert!(
                    last_n.is_none_or(|last_n| (force_n - last_n).abs() < 2e-3),
                    "{kind}: {last_n:?} to {force_n} N"
                );
                (last_n, ticks) = (Some(force_n), ticks + 1);
            }
            last_mm = to_mm;
        }
        assert!(ticks > 5_000);
    }
}

#[test]
fn a_press_clicks_once_and_a_half_one_does_not() {
    let compiled = dome();
    for rise_s in [0.008, 0.02, 0.05, 0.1, 0.5] {
        let pressed = play_gesture(
            &compiled,
            &Gesture::new()
                .stroke(0.05, rise_s, 0.1, rise_s, 0.0035)
                .hold(0.1),
        );
        assert_eq!(
            (pressed.times("click").len(), pressed.times("release").len()),
            (1, 1),
            "{rise_s} s"
        );
        let half = play_gesture(
            &compiled,
            &Gesture::new()
                .stroke(0.05, rise_s, 0.1, rise_s, 0.0021)
                .hold(0.1),
        );
        assert_eq!(
            (half.times("click").len(), half.times("release").len()),
            (0, 0),
            "{rise_s} s"
        );
    }
    // Trembling between the thresholds is one press.
    let mut trembling = Gesture::new().hold(0.05).to(0.0023, 0.1);
    for _ in 0..20 {
        trembling = trembling.to(0.0019, 0.01).to(0.0023, 0.01);
    }
    assert_eq!(
        play_gesture(&compiled, &trembling.to(0.0, 0.05).hold(0.05))
            .times("click")
            .len(),
        1
    );
    // The contact closes past the peak: what clicks under the finger is what counts.
    let slow = play_gesture(
        &compiled,
        &Gesture::new().hold(0.05).to(0.0035, 1.0).hold(0.05),
    );
    let closed = (slow.times("click")[0] * f64::from(RATE_HZ)).round() as usize;
    let peak = slow
        .column("force_n")
        .iter()
        .enumerate()
        .take(closed)
        .max_by(|a, b| a.1.total_cmp(b.1));
    assert!(peak.is_some_and(|(tick, _)| tick < closed && closed - tick > 1000));
}

fn knob(sets: &[(&str, &str)]) -> Compiled {
    common::instruments("knob.whip", sets).remove(0)
}

fn degrees(values: &[f64]) -> Vec<f64> {
    values.iter().map(|deg| deg.to_radians()).collect()
}

/// Angles (rad) of a knob that is turned from one angle to the next (deg), each in the given time.
fn turned(path: &[(f64, f64)]) -> Vec<f64> {
    let to = |g: Gesture, (deg, seconds): &(f64, f64)| g.to(deg.to_radians(), *seconds).hold(0.05);
    path.iter()
        .fold(Gesture::new().hold(0.05), to)
        .positions(RATE_HZ)
}

/// The places that were entered, counted from the one at 0.
fn steps(played: &Played) -> Vec<f64> {
    let steps = played.0.trace.events.iter().filter(|e| e.event == "step");
    steps.map(|e| e.args[0].1).collect()
}

#[test]
fn angles_are_sensed_in_radians_and_torques_driven_in_newton_metres() {
    let played = play(&knob(&[]), &degrees(&[30.0; 4410]));
    let titles: Vec<String> = played.0.trace.columns.iter().map(|c| c.title()).collect();
    for title in [
        "drive_n_m",
        "angle_rad",
        "torque_n_m",
        "detents_n_m",
        "friction_n_m",
    ] {
        assert!(titles.iter().any(|t| t == title), "{title} in {titles:?}");
    }
    let angle = played.column("angle_rad");
    assert!(
        (angle[4409] - 30f64.to_radians()).abs() < 1e-4,
        "{}",
        angle[4409]
    );
}

#[test]
fn every_detent_pulls_to_its_middle() {
    let compiled = knob(&[("rubs", "0N*m")]);
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let total = player.index("torque");
        // Slowly enough for the bearing's viscosity to be nothing.
        for step in 0..60_000 {
            let deg = f64::from(step) * 0.002;
            player.tick(deg.to_radians());
            let from_middle = (deg / 15.0 + 0.5).rem_euclid(1.0) - 0.5;
            let expected_n_m = 8.0 * 0.012 * from_middle * (1.0 - 2.0 * from_middle.abs());
            let felt_n_m = player.value_at(total) - 2e-5 * (0.002f64 * 44_100.0).to_radians();
            // At the borders the next detent takes over a hundredth of a pitch late.
            assert!(
                (felt_n_m - expected_n_m).abs() < 3e-4,
                "{kind}: {felt_n_m} N*m, not {expected_n_m} N*m at {deg} deg"
            );
        }
    }
}

#[test]
fn a_step_for_every_place_and_no_more() {
    let compiled = knob(&[]);
    let there = play(&compiled, &turned(&[(60.0, 1.0), (0.0, 0.5)]));
    assert_eq!(steps(&there), [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0]);
    let flick = play(&compiled, &turned(&[(-120.0, 0.06)]));
    assert_eq!(
        steps(&flick),
        [-1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -7.0, -8.0]
    );
    // Trembling on the border between two places is one step at the most.
    let mut path = vec![(7.5, 0.2)];
    path.extend([(7.4, 0.01), (7.6, 0.01)].repeat(20));
    assert!(steps(&play(&compiled, &turned(&path))).len() <= 1);
}

#[test]
fn friction_holds_a_knob_that_is_let_go_and_opposes_one_that_turns() {
    let played = play(
        &knob(&[("height", "0N*m")]),
        &turned(&[(40.0, 0.5), (-40.0, 0.5)]),
    );
    let at = |t_s: f64| played.column("friction_n_m")[(t_s * f64::from(RATE_HZ)) as usize];
    assert!(
        (at(0.3) - 0.002).abs() < 1e-5 && (at(0.57) - 0.002).abs() < 1e-5,
        "turns right, then holds"
    );
    assert!(
        (at(0.9) + 0.002).abs() < 1e-5 && (at(1.12) + 0.002).abs() < 1e-5,
        "turns left, then holds"
    );
    let (low, high) = played.extremes("friction_n_m", 0.0);
    assert!(low >= -0.002 - 1e-7 && high <= 0.002 + 1e-7);
}

#[test]
fn the_stops_push_back_on_both_sides_and_never_pull() {
    let played = play(
        &knob(&[]),
        &turned(&[(150.0, 0.3), (-150.0, 0.3), (0.0, 0.03)]),
    );
    // 7.5 deg beyond the stop at 0.5 N*m/rad.
    let (_, right) = played.extremes("right_n_m", 0.0);
    let (left, none) = played.extremes("left_n_m", 0.0);
    assert!(
        (0.065..0.075).contains(&right) && (-0.075..-0.065).contains(&left),
        "{left} .. {right} N*m"
    );
    assert!(none <= 0.0 && played.extremes("right_n_m", 0.0).0 >= 0.0);
    assert_eq!(played.0.counts.drive_clipped, 0);
    let free = play(&knob(&[]), &turned(&[(140.0, 0.3), (-140.0, 0.3)]));
    assert_eq!(
        (
            free.extremes("right_n_m", 0.0),
            free.extremes("left_n_m", 0.0)
        ),
        ((0.0, 0.0), (0.0, 0.0))
    );
}

#[test]
fn a_recorded_turn_is_read_in_degrees() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let load = |text: &str| {
        let path = folder.path().join("turn.csv");
        std::fs::write(&path, text).expect("writable");
        motion::load(
            &path,
            &MotionOptions {
                turns: true,
                ..MotionOptions::default()
            },
            RATE_HZ.into(),
        )
    };
    let turn = load("t_s,angle_deg\n0,0\n0.1,-30\n0.2,-90\n").unwrap_or_else(|e| panic!("{e}"));
    let last = turn.positions.to_vec().last().copied().expect("positions");
    // Between the last two rows, as ticks end before the last.
    assert!((last + 90f64.to_radians()).abs() < 0.05, "{last} rad");
    let error = load("t_s,x_mm\n0,0\n0.1,3\n")
        .expect_err("a knob has no length")
        .to_string();
    assert!(
        error.contains("a title must name an angle with its unit, such as `angle_rad`"),
        "{error}"
    );
}

#[test]
fn an_instrument_needs_a_device_that_moves_as_it_does() {
    let (key, turning) = (dome().model, knob(&[]).model);
    let (mikey, dial) = (Device::of(&key), Device::of(&turning));
    assert_eq!((mikey.name.as_str(), dial.name.as_str()), ("mikey", "knob"));
    assert!(mikey.fits(&key).is_ok() && dial.fits(&turning).is_ok());
    assert_eq!(
        mikey.fits(&turning),
        Err("the device `mikey` measures lengths, but `knob` senses an angle".into())
    );
    assert_eq!(
        dial.fits(&key),
        Err("the device `knob` measures angles, but `snap_dome` senses a length".into())
    );
}
