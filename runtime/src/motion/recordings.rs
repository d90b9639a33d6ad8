//! The recordings of a Kawai grand beside the repository (`../shared/data/kawai-grand`).

use std::path::PathBuf;

use super::resample::resample;
use super::*;

const TICK_HZ: u32 = 44_100;

/// A file of the recordings; none where they are absent, and the test counts as skipped.
fn recording(name: &str) -> Option<PathBuf> {
    Some(whippen_need::recordings("kawai-grand")?.join(name))
}

/// The key of the long recording; `mapped` to a dip of 10 mm behind a 200 Hz low-pass.
fn key(mapped: bool) -> Option<Motion> {
    let path = recording("key_and_hammer_2kHz.txt")?;
    let calibration = Some(path.with_file_name("calibration_key.csv"));
    let options = MotionOptions {
        layout: Layout::Raw {
            rate_hz: 2000.0,
            column: 2,
            calibration,
        },
        stops: mapped.then_some(Stops {
            rest_m: 0.88e-3,
            full_m: 12.7e-3,
            dip_m: 10e-3,
        }),
        lowpass_hz: mapped.then_some(200.0),
        ..MotionOptions::default()
    };
    Some(load(&path, &options, TICK_HZ.into()).unwrap())
}

/// The times (s) at which positions rise through a level, those closer than `apart_s` to the one
/// before left out.
fn rises(positions_m: &[f64], rate_hz: f64, level_m: f64, apart_s: f64) -> Vec<f64> {
    let mut times: Vec<f64> = Vec::new();
    for (i, w) in positions_m.windows(2).enumerate() {
        let t_s = (i + 1) as f64 / rate_hz;
        if w[0] < level_m && w[1] >= level_m && times.last().is_none_or(|last| t_s - last > apart_s)
        {
            times.push(t_s);
        }
    }
    times
}

#[test]
fn the_key_rests_at_0_88_mm_and_reaches_the_end_of_the_table() {
    let Some(motion) = key(false) else { return };
    assert_eq!(motion.samples_read as f64 / 2000.0, motion.duration_s());
    assert!(
        (36.0..39.0).contains(&motion.duration_s()),
        "{} s",
        motion.duration_s()
    );
    let mut rest: Vec<f64> = motion.positions.to_vec()[..2 * TICK_HZ as usize].to_vec();
    let middle = rest.len() / 2;
    let rest_m = *rest.select_nth_unstable_by(middle, f64::total_cmp).1;
    assert!(
        (rest_m - 0.88e-3).abs() < 0.05e-3,
        "rest at {} mm",
        rest_m * 1e3
    );
    let deepest_m = motion
        .positions
        .to_vec()
        .iter()
        .copied()
        .fold(0.0, f64::max);
    assert!(
        (deepest_m - 11.906e-3).abs() < 0.05e-3,
        "deepest at {} mm",
        deepest_m * 1e3
    );
    assert!(
        motion.calibration_clipped > 1000 && motion.notes.is_empty(),
        "{:?}",
        motion.notes
    );
}

#[test]
fn five_strokes_reach_the_bottom_where_the_hammer_strikes() {
    let Some(motion) = key(true) else { return };
    let bottoms = rises(&motion.positions.to_vec(), f64::from(TICK_HZ), 9.0e-3, 0.2);
    println!("bottoms: {bottoms:?}");
    let strikes = [25.02, 27.79, 33.59, 34.95, 36.09];
    let fast: Vec<f64> = bottoms.iter().copied().filter(|t| *t > 20.0).collect();
    for (strike, bottom) in strikes.iter().zip(&fast) {
        assert!((strike - bottom).abs() < 0.015, "{bottom} s for {strike} s");
    }
    assert_eq!(fast.len(), strikes.len(), "{bottoms:?}");
}

#[test]
fn a_hammer_at_8_khz_survives_the_way_to_the_tick_rate_and_back() {
    for name in ["hammer_8kHz_fast.txt", "hammer_8kHz_slow.txt"] {
        let Some(path) = recording(name) else { return };
        let layout = Layout::Raw {
            rate_hz: 8000.0,
            column: 1,
            calibration: None,
        };
        // Counts of 24 bits; the stops scale them to 0 .. 1.
        let stops = Some(Stops {
            rest_m: 0.0,
            full_m: 8_388_608.0,
            dip_m: 1.0,
        });
        let options = MotionOptions {
            layout,
            stops,
            ..MotionOptions::default()
        };
        let own = load(&path, &options, 8000.into())
            .unwrap()
            .positions
            .to_vec();
        let fast = load(&path, &options, TICK_HZ.into())
            .unwrap()
            .positions
            .to_vec();
        assert_eq!(
            fast.len(),
            (own.len() as f64 * 44_100.0 / 8000.0).round() as usize
        );
        let back = resample(&fast, 44_100.0, 8000.0);
        assert_eq!(back.len(), own.len());
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        let power = |x: &[f64]| x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64;
        let difference: Vec<f64> = own.iter().zip(&back).map(|(a, b)| a - b + mean).collect();
        let (difference_db, energy) = (
            10.0 * (power(&difference) / power(&own)).log10(),
            power(&fast) / power(&own),
        );
        println!("{name}: {difference_db:.1} dB of difference, energy ratio {energy:.8}");
        assert!(difference_db < -80.0 && (energy - 1.0).abs() < 1e-4);
    }
}

#[test]
fn the_key_alone_is_read_too() {
    let Some(path) = recording("key_2kHz.txt") else {
        return;
    };
    let calibration = Some(path.with_file_name("calibration_key.csv"));
    let layout = Layout::Raw {
        rate_hz: 2000.0,
        column: 1,
        calibration,
    };
    let motion = load(
        &path,
        &MotionOptions {
            layout,
            ..MotionOptions::default()
        },
        TICK_HZ.into(),
    )
    .unwrap();
    assert!(
        (29.0..31.0).contains(&motion.duration_s()),
        "{} s",
        motion.duration_s()
    );
    let positions = motion.positions.to_vec();
    assert!(positions.iter().all(|x| (-1e-3..=13e-3).contains(x)));
    let presses = rises(&motion.positions.to_vec(), f64::from(TICK_HZ), 9e-3, 0.1);
    println!("presses: {presses:?}");
    assert!(presses.len() >= 5, "{presses:?}");
}
