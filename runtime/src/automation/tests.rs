//! Tables and notes that set live values, and what is wrong with them.

use super::*;
use crate::midi::{Note, Performance};
use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::source::SourceMap;

const PROGRAM: &str = "instrument two_strings {
    sense x: length in 0 mm .. 10 mm
    live param gain = 0.5 in 0 .. 1
    live param loud = on
    live param stiffness = 1 N/mm in 0.5 N/mm .. 2 N/mm
    live param low = 110 Hz in 100 Hz .. 1 kHz
    bank strings over i in 0 .. 1 {
        live param pitch = each(110 Hz, 220 Hz) in 100 Hz .. 500 Hz
        let half = if loud then gain * pitch * 1 s else 0
    }
    force spring on x = stiffness * x + 1e-6 N * sum(strings.half) + 1e-6 N*s * low
}";

fn model() -> Model {
    let mut map = SourceMap::default();
    map.add("two.whip", PROGRAM);
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    program
        .unwrap_or_else(|| panic!("{diagnostics:#?}"))
        .instruments
        .remove(0)
}

fn load(text: &str) -> Result<Automation, String> {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("live.csv");
    std::fs::write(&path, text).expect("written");
    let shown = path.display().to_string();
    Automation::load(&path, &model()).map_err(|e| e.to_string().replace(&shown, "live.csv"))
}

/// Names and values by tick, at 1000 ticks a second.
fn told(automation: &Automation, start_s: f64) -> Vec<(usize, String, f64)> {
    let model = model();
    let changes = automation.by_tick(start_s, 1000.into());
    changes
        .map(|(tick, of)| (tick, model.lives[of.live].name.clone(), of.value))
        .collect()
}

fn change(tick: usize, name: &str, value: f64) -> (usize, String, f64) {
    (tick, name.to_string(), value)
}

#[test]
fn a_table_sets_values_at_its_times() {
    let table = "t_ms,stiffness_n_per_mm,gain,strings[1].pitch_hz,loud\n0,,0.25,,\n1.5,2,,,0\n4,1,0.5,230,1\n";
    let automation = load(table).expect("a table");
    let expected = [
        change(0, "gain", 0.25),
        // The first tick that is not before its time.
        change(2, "stiffness", 2000.0),
        change(2, "loud", 0.0),
        change(4, "stiffness", 1000.0),
        change(4, "gain", 0.5),
        change(4, "strings[1].pitch", 230.0),
        change(4, "loud", 1.0),
    ];
    assert_eq!(told(&automation, 0.0), expected);
    let later = told(&automation, 0.003);
    assert_eq!(later[6], change(1, "loud", 1.0), "a run that begins later");
    assert_eq!(later[0], change(0, "gain", 0.25), "what was before holds");
}

#[test]
fn every_tick_of_any_rate_is_hit_by_its_own_time() {
    for rate in [44_100, 48_000, 7_919] {
        let changes = (0..3000).map(|tick| Change {
            t_s: tick as f64 / f64::from(rate),
            live: 0,
            value: 0.0,
        });
        let automation = Automation::new(changes.collect());
        let ticks = automation.by_tick(0.0, rate.into()).map(|(tick, _)| tick);
        assert!(ticks.eq(0..3000), "{rate}");
    }
}

#[test]
fn what_is_wrong_with_a_table_is_told_where_it_is() {
    let wrong = |text| load(text).expect_err("an error");
    let titles = "titles may be `t_s`, `gain`, `loud`, `stiffness_n_per_m`, `low_hz`, `strings[0].pitch_hz`, `strings[1].pitch_hz`";
    let cases = [
        (
            "gain\n1\n",
            "live.csv, line 1: a title must name the time with its unit, such as `t_s`".to_string(),
        ),
        (
            "t_s\n1\n",
            format!("live.csv, line 1: there is no column but the time; {titles}"),
        ),
        (
            "t_s,volume\n0,1\n",
            format!(
                "live.csv, line 1: `volume` is no live parameter of `two_strings` with its unit; {titles}"
            ),
        ),
        (
            "t_s,stiffness\n0,1\n",
            format!(
                "live.csv, line 1: `stiffness` is no live parameter of `two_strings` with its unit; {titles}"
            ),
        ),
        (
            "t_s,gain\n0,1.5\n",
            "live.csv, line 2, column 2: `gain` is in 0 .. 1, not 1.5".to_string(),
        ),
        (
            "t_s,loud\n0,2\n",
            "live.csv, line 2, column 2: `loud` is 0 or 1".to_string(),
        ),
        (
            "t_s,gain\n1,1\n0.5,1\n",
            "live.csv, line 3, column 1: time goes back: 0.5 s follows 1 s".to_string(),
        ),
        (
            "t_s,gain\n1,loud\n",
            "live.csv, line 2, column 2: `loud` is not a number".to_string(),
        ),
    ];
    for (text, message) in cases {
        assert_eq!(wrong(text), message);
    }
}

/// Notes as key, begin and end.
fn notes(all: &[(u8, f64, f64)]) -> Performance {
    let note = |&(key, on_s, off_s): &(u8, f64, f64)| Note {
        key,
        on_s,
        off_s,
        velocity: 64,
        release: 64,
    };
    Performance {
        notes: all.iter().map(note).collect(),
        ..Performance::default()
    }
}

/// Rounded to whole hertz.
fn fingered(name: &str, all: &[(u8, f64, f64)]) -> (Vec<(usize, String, f64)>, usize) {
    let fingered = finger(&notes(all), &model(), name).expect("a pitch");
    let rounded = told(&fingered.automation, 0.0).into_iter();
    let rounded = rounded.map(|(tick, name, hz)| (tick, name, hz.round()));
    (rounded.collect(), fingered.unplayed)
}

#[test]
fn a_note_is_stopped_on_the_highest_free_string_below_it() {
    // A chord: A3 (220 Hz) on the upper string, C3 (131 Hz) on the lower; then a third has none.
    let chord = [(48, 1.0, 2.0), (57, 1.0, 1.5), (60, 1.2, 1.4)];
    let expected = [
        change(1000, "strings[1].pitch", 220.0),
        change(1000, "strings[0].pitch", 131.0),
        change(1500, "strings[1].pitch", 220.0),
        change(2000, "strings[0].pitch", 110.0),
    ];
    assert_eq!(fingered("strings.pitch", &chord), (expected.to_vec(), 1));
    // Too low, too high, and without a length.
    let none = [(40, 0.0, 1.0), (100, 0.0, 1.0), (57, 1.0, 1.0)];
    assert_eq!(fingered("strings.pitch", &none), (Vec::new(), 2));
}

#[test]
fn one_pitch_follows_the_last_note_that_is_held() {
    let legato = [(57, 0.0, 3.0), (60, 1.0, 2.0)];
    let expected = [
        change(0, "low", 220.0),
        change(1000, "low", 262.0),
        change(2000, "low", 220.0),
        change(3000, "low", 110.0),
    ];
    assert_eq!(fingered("low", &legato), (expected.to_vec(), 0));
    assert_eq!(
        fingered("strings[1].pitch", &[(60, 0.0, 1.0)]).0,
        [
            change(0, "strings[1].pitch", 262.0),
            change(1000, "strings[1].pitch", 220.0)
        ]
    );
}

#[test]
fn what_is_no_pitch_is_refused() {
    let refused = |name| finger(&notes(&[]), &model(), name).expect_err("an error");
    assert_eq!(refused("gain"), "`gain` is no frequency");
    assert_eq!(
        refused("pitch"),
        "`pitch` is no live pitch of `two_strings`, but `low`, `strings.pitch`"
    );
}
