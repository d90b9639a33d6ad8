//! Tracker organ, clavichord, celesta and upright piano: what their players would notice.

use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play_gesture};

fn played(name: &str, sets: &[(&str, &str)], gesture: &Gesture) -> Played {
    play_gesture(&common::instruments(name, sets)[0], gesture)
}

/// Down in two seconds and back.
fn slow() -> Gesture {
    Gesture::new().stroke(0.1, 2.0, 0.2, 2.0, 0.010).hold(0.1)
}

/// The force (N) where the key is first as deep as this, on its way down or, after `back_s`, up.
fn force_at(played: &Played, x_m: f64, back_s: Option<f64>) -> f64 {
    let from = back_s.map_or(0, |s| (s * f64::from(RATE_HZ)) as usize);
    let xs = &played.column("x_m")[from..];
    let at = xs.iter().position(|&x| match back_s {
        None => x >= x_m,
        Some(_) => x <= x_m,
    });
    played.column("force_n")[from + at.expect("the key comes by there")]
}

/// Strokes of several speeds strike once each, and a slow press not at all.
fn strikes_once(name: &str) {
    for rise_s in [0.012, 0.02, 0.04, 0.08] {
        let stroke = Gesture::new()
            .stroke(0.1, rise_s, 0.3, 0.1, 0.010)
            .hold(0.3);
        let played = played(name, &[], &stroke);
        assert_eq!(played.times("note").len(), 1, "{name}, {rise_s} s");
        assert_eq!(played.times("release").len(), 1, "{name}, {rise_s} s");
    }
    let silent = played(name, &[], &slow());
    assert_eq!(silent.times("note").len(), 0, "{name}, slowly");
}

#[test]
fn an_organs_pallet_plucks() {
    let organ = played("tracker-organ.whip", &[], &slow());
    let peak_n = organ.extremes("force_n", 0.0).1;
    // 335 gf before, 90 gf after, a tenth of friction included.
    assert!((3.1..3.5).contains(&peak_n), "{peak_n} N");
    let open_n = force_at(&organ, 0.004, None);
    assert!((0.8..1.0).contains(&open_n), "{open_n} N");
    // The wind draws the pallet shut later and with less than what it took to open it.
    let back = organ.column("force_n")[(2.4 * f64::from(RATE_HZ)) as usize..].iter();
    let shut_n = back.fold(0.0f64, |most, &f| most.max(f));
    assert!((1.8..peak_n - 0.3).contains(&shut_n), "{shut_n} N");
    assert_eq!(organ.times("note").len(), 1);
    assert_eq!(organ.times("release").len(), 1);
}

#[test]
fn without_wind_there_is_no_pluck_and_a_coupler_doubles_it() {
    let still = played("tracker-organ.whip", &[("wind", "0Pa")], &slow());
    let (peak_n, open_n) = (
        still.extremes("force_n", 0.0).1,
        force_at(&still, 0.004, None),
    );
    assert!(peak_n < open_n + 0.15, "{peak_n} N, then {open_n} N");
    let one = played("tracker-organ.whip", &[], &slow());
    let two = played("tracker-organ.whip", &[("manuals", "2")], &slow());
    let pull = |played: &Played| played.extremes("tracker_n", 0.0).1;
    assert!((pull(&two) / pull(&one) - 2.0).abs() < 1e-3);
    assert_eq!(two.times("note"), one.times("note"));
}

#[test]
fn a_fast_organ_key_meets_the_pallets_mass() {
    let fast = Gesture::new().stroke(0.1, 0.02, 0.3, 0.1, 0.010).hold(0.2);
    let fast = played("tracker-organ.whip", &[], &fast);
    let slow = played("tracker-organ.whip", &[], &slow());
    let peak = |played: &Played| played.extremes("force_n", 0.0).1;
    assert!(peak(&fast) > peak(&slow) + 1.0);
    assert_eq!(fast.times("note").len(), 1);
}

#[test]
fn a_clavichords_strings_are_what_its_formulas_say() {
    let strings = played("clavichord.whip", &[], &slow());
    let push = |x_m: f64| {
        let at = strings.column("x_m").iter().position(|&x| x >= x_m);
        strings.column("strings_n")[at.expect("as deep as that")]
    };
    let stiffness = (push(0.008) - push(0.005)) / 0.003;
    let expected = 2.0 * 50.0 * (1.0 / 0.52 + 1.0 / 0.15);
    // A slow press, but one that slows down: its damper changes by a thousandth of the force.
    assert!(
        (stiffness / expected - 1.0).abs() < 0.01,
        "{stiffness} N/m, not {expected}"
    );
    let (_, cents) = strings.extremes("sharp", 0.0);
    let tauter = 8.4e3 * 0.0065f64.powi(2) * (1.0 / 0.52 + 1.0 / 0.15) / (2.0 * 0.67);
    let expected = 600.0 / std::f64::consts::LN_2 * tauter / 50.0;
    assert!(
        (cents / expected - 1.0).abs() < 0.01,
        "{cents}, not {expected} cents"
    );
    assert!(strings.times("bend").len() > 20);
    for rise_s in [0.012, 0.05, 1.0] {
        let stroke = Gesture::new()
            .stroke(0.1, rise_s, 0.3, 0.1, 0.007)
            .hold(0.3);
        let played = played("clavichord.whip", &[], &stroke);
        assert_eq!(played.times("note").len(), 1, "{rise_s} s");
        assert_eq!(played.times("release").len(), 1, "{rise_s} s");
    }
}

/// The pitch near c' that is strongest in what sounds for half a second (Hz).
fn pitch_hz(played: &Played, from_s: f64) -> f64 {
    let from = (from_s * f64::from(RATE_HZ)) as usize;
    let voice = &played.column("voice")[from..from + RATE_HZ as usize / 2];
    let strength = |hz: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (i, v) in voice.iter().enumerate() {
            let turn = std::f64::consts::TAU * (i as f64 / voice.len() as f64);
            let window = 0.5 - 0.5 * turn.cos();
            let phase = std::f64::consts::TAU * hz * i as f64 / f64::from(RATE_HZ);
            re += window * v * phase.cos();
            im += window * v * phase.sin();
        }
        re * re + im * im
    };
    (0..400)
        .map(|i| 255.0 + 0.05 * f64::from(i))
        .max_by(|&a, &b| strength(a).total_cmp(&strength(b)))
        .expect("some pitch")
}

#[test]
fn a_finger_bends_what_a_clavichord_sounds() {
    let cents = |depth_m: f64| {
        let stroke = Gesture::new()
            .stroke(0.1, 0.03, 1.0, 0.1, depth_m)
            .hold(0.1);
        let played = played("clavichord-heard.whip", &[], &stroke);
        1200.0 * (pitch_hz(&played, 0.3) / 261.63).log2()
    };
    let (soft, hard) = (cents(0.004), cents(0.0075));
    assert!(soft.abs() < 1.0, "{soft} cents");
    // 4 mm above where the strings are met.
    assert!((13.0..17.0).contains(&hard), "{hard} cents");
}

#[test]
fn a_celestas_and_an_uprights_stroke_strikes_once() {
    strikes_once("celesta.whip");
    strikes_once("upright-piano.whip");
}

#[test]
fn a_stroke_from_half_way_strikes_on_a_grand_and_not_on_an_upright() {
    let from = |turn_m: f64| {
        Gesture::new()
            .to(0.010, 0.03)
            .hold(0.2)
            .to(turn_m, 0.05)
            .hold(0.2)
            .to(0.010, 0.02)
            .hold(0.2)
    };
    let notes = |name: &str, turn_m: f64| played(name, &[], &from(turn_m)).times("note").len();
    assert_eq!(notes("grand-piano.whip", 0.005), 2);
    assert_eq!(notes("upright-piano.whip", 0.005), 1);
    assert_eq!(notes("upright-piano.whip", 0.0), 2);
}

#[test]
fn an_upright_loses_motion_before_its_hammer() {
    let lost = |sets: &[(&str, &str)], x_m: f64| {
        force_at(&played("upright-piano.whip", sets, &slow()), x_m, None)
    };
    assert!(lost(&[], 0.0004) < 0.4);
    assert!(lost(&[], 0.002) > 0.5);
    assert!(lost(&[("lost_motion", "3mm")], 0.002) < 0.4);
}
