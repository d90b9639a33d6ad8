//! `run --midi`: performances on whole keyboards, the same on any number of threads.

use std::path::Path;
use std::process::Command;

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::keyboard::{InstrumentId, KeyRange, Program, Zone};
use whippen_compiler::model::Model;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::DIP_M;
use whippen_runtime::keyboard::{
    KeyLog, Outcome, PlayedProgram, PlayingKey, Playtime, model_of_keys, play,
};
use whippen_runtime::midi::{self, Note};
use whippen_runtime::stroke::{Stroke, strokes};
use whippen_runtime::struck::velocity;

use crate::cli::{Shell, bundled};
use crate::report::browser;

/// A keyboard of 88 keys, and what it plays.
const FILES: [&str; 2] = ["tests/it/whole-piano.whip", "instruments/grand-piano.whip"];

fn instruments() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    [
        FILES[0],
        FILES[1],
        "instruments/harpsichord.whip",
        "instruments/hammond.whip",
    ]
    .map(|file| folder.join(file).display().to_string())
    .to_vec()
}

/// A file of one track, 480 ticks a beat at 120: notes as on (beats), off, key, velocity.
fn file(notes: &[(f64, f64, u8, u8)]) -> Vec<u8> {
    let mut events: Vec<(u32, [u8; 3])> = Vec::new();
    for &(on, off, key, velocity) in notes {
        events.push(((on * 480.0) as u32, [0x90, key, velocity]));
        events.push(((off * 480.0) as u32, [0x80, key, 64]));
    }
    events.sort();
    let (mut body, mut now) = (Vec::new(), 0);
    for (tick, message) in events {
        let delta = tick - now;
        now = tick;
        body.extend([
            (delta >> 14) as u8 | 0x80,
            (delta >> 7) as u8 | 0x80,
            delta as u8 & 0x7f,
        ]);
        body.extend(message);
    }
    body.extend([0, 0xff, 0x2f, 0]);
    [
        b"MThd\0\0\0\x06\0\0\0\x01\x01\xe0MTrk",
        &(body.len() as u32).to_be_bytes()[..],
        &body,
    ]
    .concat()
}

/// Scale over many keys, a trill, a chord, and one note too soft to strike.
fn music() -> Vec<(f64, f64, u8, u8)> {
    let mut notes: Vec<(f64, f64, u8, u8)> = (0..24)
        .map(|i| {
            (
                f64::from(i) * 0.1,
                f64::from(i) * 0.1 + 0.3,
                40 + 2 * i,
                40 + 3 * i,
            )
        })
        .collect();
    notes.extend((0..12).map(|i| (2.0 + f64::from(i) * 0.2, 2.15 + f64::from(i) * 0.2, 60, 80)));
    notes.extend([48, 52, 55].map(|key| (4.8, 5.5, key, 100)));
    notes.push((5.0, 6.0, 30, 1));
    notes
}

fn command(args: &[&str], folder: &Path) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(args)
        .current_dir(folder)
        .output()
        .expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (
        output.status.code().unwrap_or(-1),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn a_performance_strikes_what_it_should_and_says_what_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut notes = music();
    notes.push((1.0, 1.5, 110, 80));
    std::fs::write(folder.path().join("song.mid"), file(&notes)).expect("writable");
    let files = instruments();
    let run = |more: &[&str]| {
        let words: Vec<&str> = ["run"]
            .into_iter()
            .chain(files.iter().map(String::as_str))
            .collect();
        command(
            &[&words[..], &["--midi", "song.mid"], more].concat(),
            folder.path(),
        )
    };
    // Strings further away than they should be: the softest note does not reach them.
    let far = ["--set", "grand_piano.phi_string=0.38 rad"];
    let outputs = [
        "--events", "e.csv", "--report", "r.html", "--key", "C4", "--out", "c4.csv", "--every",
        "100",
    ];
    let (code, out, err) = run(&[&far[..], &outputs].concat());
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.contains("41 notes on 26 of 88 keys"), "{out}");
    assert!(
        out.contains("1 notes lie outside of A0 .. C8 and are not played: D8"),
        "{out}"
    );
    assert!(
        out.contains("mikey, grand_piano: ") && out.contains("40 notes: 39 struck, 1 did not"),
        "{out}"
    );
    assert!(out.contains("F#1  velocity   1  too soft"), "{out}");
    let events = std::fs::read_to_string(folder.path().join("e.csv")).expect("events");
    assert!(
        events.starts_with("t_s,key,name,event,speed_m_per_s\n"),
        "{events}"
    );
    assert_eq!(
        events
            .lines()
            .filter(|l| l.contains(",39,C4,note,"))
            .count(),
        13,
        "the trill and one of the scale"
    );
    assert!(
        std::fs::read_to_string(folder.path().join("c4.csv"))
            .expect("a trace")
            .starts_with("t_s,drive_n,x_m,x_dot_m_per_s,")
    );
    let page = std::fs::read_to_string(folder.path().join("r.html")).expect("a page");
    crate::report::check_tags(&page);
    assert!(page.contains("id=\"key-c4\"") && page.contains("too soft"));
    looked_at(&page);
    // Other programs of the keyboard, other engines.
    let (_, out, _) = run(&[
        "--program",
        "harpsichord",
        "--engine",
        "interp",
        "--seconds",
        "1.5",
    ]);
    assert!(
        out.contains("mikey, harpsichord: 1.50 s on engine interp")
            && out.contains("2 strikes a note are usual"),
        "{out}"
    );
}

/// The page of a performance in a browser.
fn looked_at(page: &str) {
    let script = "
        await after(300);
        const canvases = document.querySelectorAll('canvas').length;
        const before = document.querySelector('.toolbar output').textContent;
        [...document.querySelectorAll('.toolbar button')].find((b) => b.textContent.startsWith('fault')).click();
        await after(200);
        const fault = document.querySelector('.toolbar output').textContent;
        location.hash = '#key-c4';
        await after(500);
        done({ canvases, before, fault, all: document.querySelectorAll('canvas').length });";
    let Some(result) = browser::play(page, script) else {
        return;
    };
    assert_eq!(result["errors"], serde_json::json!([]), "{result}");
    assert_eq!(
        (&result["canvases"], &result["all"]),
        (&3.into(), &11.into()),
        "roll and two scatters; then the key's own"
    );
    // The missed note is at 3 s; two seconds to either side are shown, as far as there is anything.
    assert_eq!(
        (&result["before"], &result["fault"]),
        (&"0.0000 – 4.5746 s".into(), &"0.5746 – 4.5746 s".into())
    );
}

#[test]
fn wrong_performances_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("song.mid"), file(&music())).expect("writable");
    std::fs::write(folder.path().join("high.mid"), file(&[(0.0, 1.0, 120, 64)])).expect("writable");
    std::fs::write(folder.path().join("noise.mid"), b"no midi at all").expect("writable");
    let files = instruments();
    let grand = files[1].as_str();
    let cases: &[(&[&str], &str)] = &[
        (
            &[grand, "--midi", "absent.mid"],
            "absent.mid: there is no such file",
        ),
        (
            &[grand, "--midi", "noise.mid"],
            "noise.mid: is not a MIDI file",
        ),
        (
            &[grand, "--midi", "high.mid"],
            "no note is on the keys A0 .. C8",
        ),
        (
            &[grand, "--midi", "song.mid", "--out", "t.csv"],
            "such as `--key C4`",
        ),
        (
            &[grand, "--midi", "song.mid", "--key", "C9"],
            "the keys A0 .. C8, and not C9",
        ),
        (
            &[grand, "--midi", "song.mid", "--key", "H3"],
            "such as C4, F#3 or Bb5",
        ),
        (
            &[grand, "--midi", "song.mid", "--program", "organ"],
            "there is no instrument `organ`",
        ),
        (
            &[grand, "--midi", "song.mid", "--motion", "m.csv"],
            "cannot be used with",
        ),
        (&[grand, "--program", "grand_piano"], "--midi"),
    ];
    for (args, says) in cases {
        let (code, out, err) = command(&[&["run"], *args].concat(), folder.path());
        assert_eq!((code, out.as_str()), (2, ""), "{args:?}: {err}");
        assert!(err.contains(says), "{args:?}: {err}");
    }
}

/// The grand on the keyboard `mikey`, whose weight differs from key to key.
fn grand() -> whippen_compiler::model::Model {
    let mut map = SourceMap::default();
    for file in FILES
        .iter()
        .chain(&["instruments/harpsichord.whip", "instruments/hammond.whip"])
    {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        map.add(*file, std::fs::read_to_string(path).expect("is there"));
    }
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    let program = program.unwrap_or_else(|| panic!("{diagnostics:?}"));
    program
        .instruments
        .into_iter()
        .find(|m| m.name == "grand_piano")
        .expect("the grand")
}

/// One instrument on all keys.
fn all() -> Program {
    Program::of_zones("all", [(88, InstrumentId(0))])
}

/// The keys of notes from A0 on, and their strokes.
fn laid_out(notes: &[Note]) -> (Vec<PlayingKey>, Vec<Vec<Stroke>>) {
    let mut out = (Vec::new(), Vec::new());
    for key in 21..=108 {
        let own: Vec<(usize, Note)> = notes
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, n)| n.key == key)
            .collect();
        if !own.is_empty() {
            let (moves, made) = strokes(&own, 0.5, DIP_M);
            out.0.push(PlayingKey {
                index: usize::from(key - 21),
                moves,
            });
            out.1.push(made);
        }
    }
    out
}

#[test]
fn any_number_of_threads_and_any_company_give_the_same_bits() {
    let (model, device) = (grand(), Device::mikey());
    assert!(!model.keyed.is_empty(), "the weight is per key");
    let notes = midi::read(&file(&music())).expect("notes").notes;
    let (keys, _) = laid_out(&notes);
    let ticks = 2 * 44_100;
    let program = all();
    let played = PlayedProgram {
        program: &program,
        instruments: std::slice::from_ref(&model),
    };
    let run = |keys: &[PlayingKey], threads| {
        play(
            &played,
            &device,
            EngineKind::Jit,
            keys,
            Playtime::of(ticks),
            threads,
            |_| (),
        )
        .expect("it plays")
        .logs
    };
    let together = run(&keys, 1);
    assert!(
        together == run(&keys, 2) && together == run(&keys, 7),
        "threads do not matter"
    );
    let alone: Vec<KeyLog> = keys
        .iter()
        .flat_map(|key| run(std::slice::from_ref(key), 1))
        .collect();
    assert!(together == alone, "nor does what else plays");
    assert_ne!(
        together[0].peak, together[20].peak,
        "keys differ by their weight and strokes"
    );
    // Every key has its own values of what is set per key.
    let own = model_of_keys(&model, &[0, 87]);
    assert_eq!(
        own.keyed[0].values,
        [model.keyed[0].values[0], model.keyed[0].values[87]]
    );
}

/// A program of a bundled keyboard, and its instruments.
pub fn split() -> (Vec<Model>, Program) {
    let mut map = SourceMap::default();
    for file in ["split.whip", "grand-piano.whip", "hammond.whip"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("instruments")
            .join(file);
        map.add(file, std::fs::read_to_string(path).expect("bundled"));
    }
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    let program = program.unwrap_or_else(|| panic!("{diagnostics:?}"));
    let split = program.keyboards[0]
        .layout
        .program_named("split")
        .expect("zones")
        .clone();
    (program.instruments, split)
}

#[test]
fn zones_play_what_their_instruments_play_alone() {
    let ((models, split), device) = (split(), Device::mikey());
    let zones: Vec<KeyRange> = split.zones.iter().map(|zone| zone.keys).collect();
    assert_eq!(zones, [KeyRange::new(0, 24), KeyRange::new(24, 49)]);
    let notes = midi::read(&file(&music())).expect("notes").notes;
    let (mut keys, mut strokes) = laid_out(&notes);
    let inside = |key: &PlayingKey| (15..64).contains(&key.index);
    (keys, strokes) = keys
        .into_iter()
        .zip(strokes)
        .filter(|(key, _)| inside(key))
        .unzip();
    keys.iter_mut().for_each(|key| key.index -= 15);
    let run = |program: &Program, threads| {
        let played = PlayedProgram {
            program,
            instruments: &models,
        };
        play(
            &played,
            &device,
            EngineKind::Jit,
            &keys,
            Playtime::of(3 * 44_100),
            threads,
            |_| (),
        )
        .expect("it plays")
        .logs
    };
    let logs = run(&split, 1);
    assert_eq!(logs, run(&split, 5));
    assert_eq!(
        logs.iter().map(|log| log.index).collect::<Vec<_>>(),
        keys.iter().map(|key| key.index).collect::<Vec<_>>()
    );
    for zone in &split.zones {
        let everywhere = Zone {
            keys: KeyRange::new(0, 49),
            ..*zone
        };
        let alone = Program {
            zones: vec![everywhere].into(),
            ..split.clone()
        };
        let (alone, name) = (run(&alone, 1), &models[zone.instrument.index()].name);
        let own = |logs: &[KeyLog]| -> Vec<KeyLog> {
            logs.iter()
                .filter(|log| zone.keys.contains(log.index as u32))
                .cloned()
                .collect()
        };
        assert!(own(&logs).len() > 5, "keys of {name} play");
        assert_eq!(own(&logs), own(&alone), "{name}");
    }
    // Which event is a strike depends on the key: a key that has none has no notes to be compared.
    let strike = |key: usize| (key < 24).then_some(0);
    let outcome = Outcome::new(&notes, &logs, &strokes, strike, 44_100.into());
    assert!(
        !outcome.notes.is_empty() && outcome.notes.iter().all(|n| n.note.key < 60),
        "{outcome:?}"
    );
}

#[test]
fn zones_are_played_by_name_and_key() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("song.mid"), file(&music())).expect("writable");
    let bundled = |file: &str| {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("instruments")
            .join(file)
            .display()
            .to_string()
    };
    let files = ["split.whip", "grand-piano.whip", "hammond.whip"].map(bundled);
    let run = |more: &[&str]| {
        let words: Vec<&str> = ["run"]
            .into_iter()
            .chain(files.iter().map(String::as_str))
            .collect();
        command(&[&words[..], more].concat(), folder.path())
    };
    let outputs = [
        "--events", "e.csv", "--report", "r.html", "--key", "C5", "--out", "c5.csv", "--every",
        "100",
    ];
    let (code, out, err) = run(&[&["--midi", "song.mid", "--seconds", "3"], &outputs[..]].concat());
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(
        out.contains("stage, split: ") && out.contains(" struck, "),
        "{out}"
    );
    let page = std::fs::read_to_string(folder.path().join("r.html")).expect("a page");
    assert!(
        page.contains("C2 .. B3: hammond, C4 .. C6: grand piano") && page.contains("id=\"key-c5\"")
    );
    let c5 = std::fs::read_to_string(folder.path().join("c5.csv")).expect("a trace");
    assert!(
        c5.lines().next().expect("titles").contains("phi"),
        "the grand's hammer: {c5:.200}"
    );
    // One key: of the zones, or of an instrument with that key's values.
    let (code, out, _) = run(&["split", "--key", "C3"]);
    assert!(code == 0 && out.contains("hammond: "), "{out}");
    let (code, out, _) = run(&["split", "--key", "F4"]);
    assert!(code == 0 && out.contains("grand_piano: "), "{out}");
    let cases: &[(&[&str], &str)] = &[
        (
            &["split"],
            "`split` are zones: name a key, such as --key C2, or one of the instruments: hammond, grand_piano",
        ),
        (
            &["split", "--key", "C8"],
            "the keyboard has the keys C2 .. C6, and not C8",
        ),
        (
            &["--midi", "song.mid", "--program", "grand_piano"],
            "its programs are: split, hammond",
        ),
    ];
    for (more, says) in cases {
        let (code, _, err) = run(more);
        assert!(code == 2 && err.contains(says), "{more:?}: {err}");
    }
    let (code, _, err) = command(
        &["dump", &files[0], &files[1], &files[2], "split"],
        folder.path(),
    );
    assert!(
        code == 2
            && err
                .contains("`split` are zones with several instruments; name one of them: hammond"),
        "{err}"
    );
    let (code, out, _) = command(&["check", &files[0], &files[1], &files[2]], folder.path());
    assert!(
        code == 0 && out.contains("stage: ok (49 keys at 44100 Hz)"),
        "{out}"
    );
}

#[test]
fn every_recorded_performance_is_read_and_played() {
    let Some(folder) = whippen_need::recordings("midi") else {
        return;
    };
    let model = grand();
    let (mut files, mut played) = (0, 0);
    let folders = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    for path in folders
        .flat_map(|f| std::fs::read_dir(f.path()).into_iter().flatten().flatten())
        .map(|e| e.path())
    {
        if path.extension().is_none_or(|e| e != "mid") {
            continue;
        }
        files += 1;
        let performance = midi::load(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(
            performance
                .notes
                .iter()
                .all(|n| n.off_s >= n.on_s && n.velocity > 0),
            "{}",
            path.display()
        );
        let first_s = performance.notes[0].on_s;
        let some: Vec<Note> = performance
            .notes
            .iter()
            .filter(|n| n.on_s < first_s + 0.5)
            .copied()
            .collect();
        let early: Vec<Note> = some
            .iter()
            .map(|n| Note {
                on_s: n.on_s - first_s,
                off_s: n.off_s - first_s,
                ..*n
            })
            .collect();
        let (keys, strokes) = laid_out(&early);
        let program = all();
        let whole = PlayedProgram {
            program: &program,
            instruments: std::slice::from_ref(&model),
        };
        let logs = play(
            &whole,
            &Device::mikey(),
            EngineKind::Jit,
            &keys,
            Playtime::of(44_100 + 22_050),
            2,
            |_| (),
        )
        .expect("it plays")
        .logs;
        let outcome = Outcome::new(&early, &logs, &strokes, |_| Some(0), model.rate_hz);
        assert!(
            logs.iter().all(|log| log.sense_clamped == 0),
            "{}",
            path.display()
        );
        assert_eq!(
            outcome.notes.len(),
            early.iter().filter(|n| (21..=108).contains(&n.key)).count()
        );
        played += outcome.notes.len();
    }
    println!("{files} files, {played} notes played");
    assert!(files > 0 && played > files, "{files} files, {played} notes");
}

/// `--midi-out` of a run and of a performance, beside their tables of events.
#[test]
fn what_was_struck_is_a_midi_file() {
    let shell = Shell::new();
    std::fs::write(shell.path("in.mid"), file(&music())).expect("writable");
    let grand = bundled("grand-piano.whip");
    let written = "--events events.csv --midi-out notes.mid";
    for (words, first_key) in [("", None), ("--midi in.mid --seconds 3", Some(40))] {
        let args: Vec<&str> = ["run", grand.as_str()]
            .into_iter()
            .chain(words.split_whitespace())
            .chain(written.split(' '))
            .collect();
        shell.ends(0, &args);
        let table = std::fs::read_to_string(shell.path("events.csv")).expect("a table");
        let titles: Vec<&str> = table.lines().next().expect("titles").split(',').collect();
        let at = |title: &str| titles.iter().position(|t| *t == title).expect("a column");
        let (time, event, speed) = (at("t_s"), at("event"), at("speed_m_per_s"));
        let struck: Vec<(f64, f64)> = (table.lines().skip(1))
            .map(|line| line.split(',').collect::<Vec<_>>())
            .filter(|cells| cells[event] == "note")
            .map(|cells| [time, speed].map(|at| cells[at].parse().expect("a number")))
            .map(|[t_s, speed]| (t_s, speed))
            .collect();
        let notes = midi::load(&shell.path("notes.mid"))
            .expect("a MIDI file")
            .notes;
        assert!(!struck.is_empty() && notes.len() == struck.len(), "{words}");
        assert_eq!(notes[0].key, first_key.unwrap_or(60));
        let mut times: Vec<f64> = notes.iter().map(|note| note.on_s).collect();
        times.sort_by(f64::total_cmp);
        for (one, (t_s, _)) in times.iter().zip(&struck) {
            assert!((one - t_s).abs() < 1.0 / 44_100.0, "{one} and {t_s} s");
        }
        let [mut found, mut wanted] = [
            notes.iter().map(|note| note.velocity).collect::<Vec<u8>>(),
            (struck
                .iter()
                .map(|(_, speed)| (velocity(*speed) >> 7) as u8))
            .collect(),
        ];
        found.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(found, wanted, "{words}");
    }
    let spring = bundled("virtual-spring.whip");
    let (_, refused) = shell.ends(2, &["run", spring.as_str(), "--midi-out", "none.mid"]);
    assert!(refused.contains("emits no `note`"), "{refused}");
    assert!(!shell.path("none.mid").exists());
}
