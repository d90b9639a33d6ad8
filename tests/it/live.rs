//! Live values that change while a run plays: the same on every engine, in tune, and on a board as
//! its mailbox takes them.

use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;
use whippen_runtime::automation::{Automation, Change, finger};
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::midi::{Note, Performance};
use whippen_runtime::session::{self, Recording, Run};

use crate::arm::{cents, column, loudest};
use crate::cli::{Shell, bundled};
use crate::common;

/// A run of so many ticks in which live values change.
fn played(
    compiled: &Compiled,
    kind: EngineKind,
    automation: &Automation,
    motion: (usize, impl FnMut(usize, &mut [f64])),
) -> Run {
    let device = Device::of(&compiled.model);
    let recording = Recording::everything(session::recorded(compiled, &device, kind, &[]));
    let recording = recording.changing(automation.clone());
    session::record(compiled, &device, kind, motion, recording, |_| ())
        .unwrap_or_else(|e| panic!("{}: {e}", compiled.model.name))
}

/// Over all strings after 0.1 s.
fn strum(tick: usize, places: &mut [f64]) {
    let t_s = tick as f64 / f64::from(common::RATE_HZ);
    places.copy_from_slice(&[0.0, -0.035 + (10.0 * (t_s - 0.1)).clamp(0.0, 0.07), -0.003]);
}

/// C major as a guitarist holds it, but that the lowest string is left out: C3, E3, G3, C4, E4.
fn chord() -> Performance {
    let note = |key| Note {
        key,
        on_s: 0.02,
        off_s: 10.0,
        velocity: 64,
        release: 64,
    };
    Performance {
        notes: [48, 52, 55, 60, 64].map(note).to_vec(),
        ..Performance::default()
    }
}

#[test]
fn a_chord_of_the_left_hand_is_heard() {
    let compiled = common::instruments("keytar.whip", &[]).remove(0);
    let fingered = finger(&chord(), &compiled.model, "strings.pitch").expect("pitches");
    assert_eq!(fingered.unplayed, 0);
    let run = played(
        &compiled,
        EngineKind::Jit,
        &fingered.automation,
        (33_000, strum),
    );
    let expected = [82.4069, 130.8128, 164.8138, 195.9977, 261.6256, 329.6276];
    for (string, pitch_hz) in expected.into_iter().enumerate() {
        let heard = column(&run, &format!("strings[{string}].voice"));
        let found_hz = loudest(&heard[9000..], pitch_hz, 60);
        let off = cents(found_hz, pitch_hz);
        assert!(
            off.abs() <= 1.0,
            "string {string}: {found_hz:.2} Hz, {off:.1} cents off"
        );
    }
}

#[test]
fn engines_change_values_in_the_same_tick() {
    let compiled = common::instruments("keytar.whip", &[]).remove(0);
    let fingered = finger(&chord(), &compiled.model, "strings.pitch").expect("pitches");
    let volume = compiled
        .model
        .lives
        .iter()
        .position(|live| live.name == "volume");
    let louder = Automation::new(vec![Change {
        t_s: 0.15,
        live: volume.expect("a volume"),
        value: 0.9,
    }]);
    let automation = fingered.automation.and(louder);
    let of = |kind| {
        let run = played(&compiled, kind, &automation, (9000, strum));
        let columns = run.trace.columns.into_iter();
        columns.map(|c| c.values().to_vec()).collect::<Vec<_>>()
    };
    let jit = of(EngineKind::Jit);
    assert!(jit == of(EngineKind::Interp));
    let without = played(
        &compiled,
        EngineKind::Jit,
        &Automation::default(),
        (9000, strum),
    );
    let silent = without.trace.columns.iter().map(|c| c.values().to_vec());
    assert!(jit != silent.collect::<Vec<_>>(), "is heard");
}

/// Two values that are felt as they are.
const LEVELS: &str = "instrument levels {
    sense x: length in 0 mm .. 10 mm
    live param low  = 1 N   in 0 N .. 2 N
    live param high = 0.1 N in 0 N .. 0.2 N
    force both on x = low + high
}";

#[test]
fn a_board_takes_values_from_its_mailbox() {
    let compiled = common::compiled("levels.whip", LEVELS, &[]).remove(0);
    let changes = (0..40_u32).map(|step| Change {
        t_s: 0.001 * f64::from(step / 2 + 1),
        live: (step % 2) as usize,
        value: if step % 2 == 0 { 0.05 } else { 0.004 } * f64::from(step / 2 + 1),
    });
    let automation = Automation::new(changes.collect());
    let of = |kind| {
        let run = played(
            &compiled,
            kind,
            &automation,
            (1200, |_, places| places.fill(0.0)),
        );
        column(&run, "drive")
    };
    let expected = of(EngineKind::Interp);
    for (board, late_max) in [
        (BoardKind::Rp2350, 6),
        (BoardKind::Rp2040, 6),
        (BoardKind::Stm32f4, 3),
    ] {
        let found = of(EngineKind::Emulated(board.into()));
        let late = |tick: usize| {
            let is_settled = |ticks: usize| found[tick] == expected[tick - ticks];
            (0..=late_max.min(tick)).any(is_settled)
        };
        // Of two that change together the first comes first.
        let settled = (0..expected.len()).filter(|tick| late(*tick)).count();
        println!("{board:?}: {settled} of {} ticks", expected.len());
        let between = 20 * late_max;
        assert!(settled + between >= expected.len(), "{board:?}: {settled}");
        assert_eq!(found.last(), expected.last(), "{board:?}");
    }
}

#[test]
fn the_command_says_what_it_plays_and_what_is_wrong() {
    let keytar = bundled("keytar.whip");
    let table = "t_s,volume,strings[0].pitch_hz\n0,0.1,\n0.1,0.9,98\n";
    let shell = Shell::new()
        .with("live.csv", table)
        .with("wrong.csv", "t_s,loudness\n0,1\n");
    let (told, _) = shell.ends(
        0,
        &["run", &keytar, "--live", "live.csv", "--seconds", "0.2"],
    );
    assert!(
        told.contains("live.csv: live values change 3 times"),
        "{told}"
    );
    let refused = [
        (
            ["--live", "wrong.csv"],
            "wrong.csv, line 1: `loudness` is no live parameter of `keytar`",
        ),
        (["--live", "none.csv"], "none.csv"),
        (["--notes", "strings.pitch"], "such as pitch=riff.mid"),
        (["--notes", "strings.pitch=live.csv"], "is not a MIDI file"),
    ];
    for ([option, value], message) in refused {
        shell.refuses(
            2,
            &["run", &keytar, option, value, "--out", "trace.csv"],
            &[message],
        );
    }
}
