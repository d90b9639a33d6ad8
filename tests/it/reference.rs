//! Reference curves: force against travel of a slow press and its return, as
//! `instruments/reference/` keeps them.
//!
//! `WHIPPEN_BLESS=1 cargo test --test it reference` writes them anew.

use std::fmt::Write;
use std::path::Path;

use whippen_runtime::gesture::Gesture;

use crate::common::{self, RATE_HZ};
use crate::played::play;

/// Names of parameters and their values.
type Settings = &'static [(&'static str, &'static str)];

/// What to press, how, and in which units to write it down.
struct Curve {
    name: &'static str,
    file: &'static str,
    sets: Settings,
    /// How far (m or rad).
    end: f64,
    /// How long a press, and a return, takes (s).
    seconds: f64,
    titles: &'static str,
    /// The table's unit of position per SI unit.
    unit: f64,
    /// Decimals of the force.
    digits: usize,
}

/// A key pressed by 10 mm in 1 s.
const fn key(name: &'static str, file: &'static str, sets: Settings) -> Curve {
    Curve {
        name,
        file,
        sets,
        end: 0.010,
        seconds: 1.0,
        titles: "x_mm,press_n,return_n",
        unit: 1e3,
        digits: 4,
    }
}

const CURVES: &[Curve] = &[
    key("virtual-spring", "virtual-spring.whip", &[]),
    // What it does shows only in motion.
    Curve {
        seconds: 0.15,
        ..key("baker", "baker.whip", &[])
    },
    key("two-body", "two-body.whip", &[]),
    Curve {
        end: 0.0036,
        ..key("snap-dome", "snap-dome.whip", &[])
    },
    Curve {
        end: 150.0 * std::f64::consts::PI / 180.0,
        titles: "angle_deg,right_n_m,left_n_m",
        unit: 180.0 / std::f64::consts::PI,
        digits: 6,
        ..key("knob", "knob.whip", &[])
    },
    key("grand-piano", "grand-piano.whip", &[]),
    key("harpsichord-one", "harpsichord.whip", &[("back", "off")]),
    key("harpsichord-two", "harpsichord.whip", &[]),
    key("harpsichord-three", "harpsichord.whip", &[("four", "on")]),
    key("hammond", "hammond.whip", &[]),
];

/// A press, a hold of 0.2 s, a return: a row for every hundredth of the way, where the key first
/// gets there.
fn table(curve: &Curve) -> String {
    let Curve {
        end,
        seconds,
        digits,
        ..
    } = *curve;
    let gesture = Gesture::new()
        .hold(0.2)
        .to(end, seconds)
        .hold(0.2)
        .to(0.0, seconds)
        .hold(0.3);
    let positions = gesture.positions(RATE_HZ);
    let played = play(&common::instruments(curve.file, curve.sets)[0], &positions);
    let drive = played.0.trace.columns[0].values();
    let turn = ((0.3 + seconds) * f64::from(RATE_HZ)) as usize;
    let start = (0.2 * f64::from(RATE_HZ)) as usize;
    let mut table = format!("{}\n", curve.titles);
    for step in 0..=100 {
        let at = f64::from(step) / 100.0 * end;
        let press = (start..turn)
            .find(|&i| positions[i] >= at)
            .expect("the key gets there");
        let back = (turn..positions.len())
            .find(|&i| positions[i] <= at)
            .expect("the key comes back");
        let shown = at * curve.unit;
        let decimals = if curve.end < 0.005 { 3 } else { 1 };
        let (press, back) = (drive[press], drive[back]);
        writeln!(table, "{shown:.decimals$},{press:.digits$},{back:.digits$}")
            .expect("a string takes all");
    }
    table
}

#[test]
fn reference_curves_are_what_the_instruments_do() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments/reference");
    for curve in CURVES {
        let (name, now) = (curve.name, table(curve));
        let path = folder.join(format!("{name}.csv"));
        if std::env::var_os("WHIPPEN_BLESS").is_some() {
            std::fs::create_dir_all(&folder)
                .and_then(|()| std::fs::write(&path, &now))
                .expect("a writable folder");
        }
        let kept =
            std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let differs = now.lines().zip(kept.lines()).find(|(a, b)| a != b);
        assert_eq!(differs, None, "{name}: now and kept");
        assert_eq!(now.lines().count(), kept.lines().count(), "{name}");
    }
}
