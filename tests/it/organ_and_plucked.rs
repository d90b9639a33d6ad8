//! Harpsichord and Hammond organ: every row plucks once and in order, stops act, the organ is a
//! spring.

use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::{Played, play, play_gesture};

const ROWS: [&str; 3] = ["pluck_front", "pluck_back", "pluck_four"];

/// Plucks of each row in a run with some rows on.
fn harpsichord(on: [bool; 3], gesture: &Gesture) -> Played {
    let value = |row: bool| if row { "on" } else { "off" };
    let sets = [
        ("front", value(on[0])),
        ("back", value(on[1])),
        ("four", value(on[2])),
    ];
    play_gesture(&common::instruments("harpsichord.whip", &sets)[0], gesture)
}

fn slow() -> Gesture {
    Gesture::new().stroke(0.1, 1.0, 0.2, 1.0, 0.010).hold(0.1)
}

#[test]
fn every_row_that_is_on_plucks_once_per_stroke_and_in_order() {
    for pattern in 0..8_u8 {
        let on = [pattern & 1 != 0, pattern & 2 != 0, pattern & 4 != 0];
        for rise_s in [0.012, 0.03, 0.1, 1.0] {
            let gesture = Gesture::new()
                .stroke(0.1, rise_s, 0.1, 0.15, 0.010)
                .hold(0.2);
            let played = harpsichord(
                on,
                &gesture
                    .stroke(0.8 + rise_s, rise_s, 0.1, 0.15, 0.010)
                    .hold(0.1),
            );
            let plucks: Vec<Vec<f64>> = ROWS.iter().map(|row| played.times(row)).collect();
            for (row, times) in plucks.iter().enumerate() {
                assert_eq!(
                    times.len(),
                    if on[row] { 2 } else { 0 },
                    "{}, {on:?}, {rise_s} s",
                    ROWS[row]
                );
            }
            let first: Vec<f64> = plucks
                .iter()
                .filter_map(|times| times.first().copied())
                .collect();
            assert!(
                first.windows(2).all(|w| w[0] < w[1]),
                "{on:?}, {rise_s} s: {first:?}"
            );
            assert_eq!(
                played.times("note").len(),
                plucks.iter().map(Vec::len).sum::<usize>()
            );
            assert_eq!(played.times("release").len(), 2, "{on:?}, {rise_s} s");
            assert_eq!(played.0.counts.drive_clipped, 0);
        }
    }
}

#[test]
fn a_stop_takes_its_row_out_of_the_force() {
    let peak = |on| harpsichord(on, &slow()).extremes("force_n", 0.0).1;
    for (on, height_n) in [
        ([true, false, false], 0.9),
        ([false, true, false], 0.8),
        ([false, false, true], 0.6),
    ] {
        let (low, high) = (peak(on), height_n + 0.02);
        assert!((height_n - 0.01..high).contains(&low), "{on:?}: {low} N");
    }
    let played = harpsichord([false, false, false], &slow());
    // Only friction is left: 0.6 N*s/m at 18.75 mm/s.
    assert!(played.extremes("force_n", 0.0).1 < 0.012);
}

#[test]
fn a_row_is_silent_on_the_way_back_and_plucks_again_only_below_its_string() {
    let played = harpsichord([true, false, false], &slow());
    let back_s = 1.3 + 0.05;
    assert_eq!(
        played.extremes("front_n", back_s),
        (0.0, 0.0),
        "the tongue slips by"
    );
    // 3.0 mm is where the plectrum touches: back to 3.5 mm is not far enough, 2.5 mm is.
    for (back_mm, plucks) in [(3.5, 1), (2.5, 2)] {
        let twice = Gesture::new()
            .hold(0.1)
            .to(0.006, 0.1)
            .to(back_mm * 1e-3, 0.1)
            .to(0.006, 0.1)
            .hold(0.1);
        assert_eq!(
            harpsichord([true, false, false], &twice)
                .times("pluck_front")
                .len(),
            plucks,
            "back to {back_mm} mm"
        );
    }
}

#[test]
fn the_bundled_gesture_plucks_every_stroke() {
    // Seven full strokes and one of 7 mm, which stops before the four-foot row at 7.2 mm.
    let played = play(
        &common::instruments("harpsichord.whip", &[("four", "on")])[0],
        &common::gesture(),
    );
    assert_eq!(ROWS.map(|row| played.times(row).len()), [8, 8, 7]);
    assert_eq!(played.times("release").len(), 8);
    let organ = play(
        &common::instruments("hammond.whip", &[])[0],
        &common::gesture(),
    );
    assert_eq!(
        (organ.times("note").len(), organ.times("release").len()),
        (8, 8)
    );
}

#[test]
fn the_organ_is_a_preloaded_spring() {
    let organ = common::instruments("hammond.whip", &[]).remove(0);
    for step in 0..=20 {
        let x_m = 0.5e-3 * f64::from(step);
        let played = play(&organ, &vec![x_m; RATE_HZ as usize / 10]);
        let force_n = *played.column("drive_n").last().expect("ticks");
        assert!(
            (force_n - (75.0 * x_m + 0.4)).abs() < 2e-3,
            "{x_m} m: {force_n} N"
        );
    }
    let stiff = common::instruments(
        "hammond.whip",
        &[("k", "100N/m"), ("preload", "0.2N"), ("dG", "0.1N")],
    )
    .remove(0);
    let force_n = *play(&stiff, &vec![0.008; 4410])
        .column("drive_n")
        .last()
        .expect("ticks");
    assert!(
        (force_n - 0.9).abs() < 2e-3,
        "100 N/m at 8 mm, 0.2 N of preload, 0.1 N taken away: {force_n} N"
    );
}

#[test]
fn the_organ_contact_closes_lower_than_it_opens() {
    let organ = common::instruments("hammond.whip", &[]).remove(0);
    let played = play_gesture(&organ, &slow());
    let x_at = |t_s: f64| played.column("x_m")[(t_s * f64::from(RATE_HZ)).round() as usize];
    let (closed, opened) = (played.times("note"), played.times("release"));
    assert_eq!((closed.len(), opened.len()), (1, 1));
    assert!(
        (x_at(closed[0]) - 3.0e-3).abs() < 2e-6,
        "closes at {}",
        x_at(closed[0])
    );
    assert!(
        (x_at(opened[0]) - 2.5e-3).abs() < 2e-6,
        "opens at {}",
        x_at(opened[0])
    );
    // Trembling between the two thresholds changes nothing.
    let mut trembling = Gesture::new().hold(0.1).to(0.0035, 0.1);
    for _ in 0..20 {
        trembling = trembling.to(0.0026, 0.02).to(0.0034, 0.02);
    }
    assert_eq!(
        play_gesture(&organ, &trembling.to(0.0, 0.1).hold(0.1))
            .times("note")
            .len(),
        1
    );
}
