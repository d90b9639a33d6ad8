//! Reference curves: force against travel of a slow press and its return, as `instruments/reference/` keeps them.
//!
//! `WHIPPEN_BLESS=1 cargo test --test it reference` writes them anew.

use std::fmt::Write;
use std::path::Path;

use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::play;

/// Names of parameters and their values.
type Settings = &'static [(&'static str, &'static str)];

/// Curve, file of the instrument, settings.
const CURVES: &[(&str, &str, Settings)] = &[
    ("grand-piano", "grand-piano.whip", &[]),
    ("harpsichord-one", "harpsichord.whip", &[("back", "off")]),
    ("harpsichord-two", "harpsichord.whip", &[]),
    ("harpsichord-three", "harpsichord.whip", &[("four", "on")]),
    ("hammond", "hammond.whip", &[]),
];

/// A press to 10 mm in 1 s, a hold of 0.2 s, a return in 1 s: a row for every 0.1 mm, where the key first gets there.
fn curve(file: &str, sets: &[(&str, &str)]) -> String {
    let positions_m = Gesture::new().hold(0.2).to(0.010, 1.0).hold(0.2).to(0.0, 1.0).hold(0.3).positions(RATE_HZ);
    let played = play(&common::instruments(file, sets)[0], &positions_m);
    let drive_n = played.column("drive_n");
    let turn = (1.3 * f64::from(RATE_HZ)) as usize;
    let start = (0.2 * f64::from(RATE_HZ)) as usize;
    let mut table = String::from("x_mm,press_n,return_n\n");
    for step in 0..=100 {
        let x_m = f64::from(step) * 1e-4;
        let press = (start..turn).find(|&i| positions_m[i] >= x_m).expect("the key gets there");
        let back = (turn..positions_m.len()).find(|&i| positions_m[i] <= x_m).expect("the key comes back");
        let x_mm = f64::from(step) / 10.0;
        writeln!(table, "{x_mm:.1},{:.4},{:.4}", drive_n[press], drive_n[back]).expect("a string takes all");
    }
    table
}

#[test]
fn reference_curves_are_what_the_instruments_do() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments/reference");
    for (name, file, sets) in CURVES {
        let path = folder.join(format!("{name}.csv"));
        let now = curve(file, sets);
        if std::env::var_os("WHIPPEN_BLESS").is_some() {
            std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, &now)).expect("a writable folder");
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let differs = now.lines().zip(kept.lines()).find(|(a, b)| a != b);
        assert_eq!(differs, None, "{name}: now and kept");
        assert_eq!(now.lines().count(), kept.lines().count(), "{name}");
    }
}
