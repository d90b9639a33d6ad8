//! A split through every engine: a key of a zone plays, bit for bit, what its instrument plays
//! alone.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use whippen_compiler::keyboard::{InstrumentId, Layout, Program, Zone};
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::Emulated;
use whippen_runtime::engine::{Engine, EngineKind, Happened};
use whippen_runtime::gesture::default_gesture;
use whippen_runtime::keyboard::model_of_keys;

use crate::midi::split;

/// Keys of the split that are played, by their index on the keyboard: five below the border and
/// four above.
const KEYS: [usize; 9] = [2, 3, 5, 8, 23, 24, 30, 41, 48];
/// How many of them are below the border.
const BELOW: usize = 5;

/// The instruments of the split's zones, with the values of the keys that `of_zone` gives.
fn instruments(observe: bool, of_zone: [&[usize]; 2]) -> Vec<Compiled> {
    let (models, split) = split();
    let scales = Device::mikey().scales();
    let compiled = |(zone, keys): (&Zone, &[usize])| {
        let model: Model = model_of_keys(&models[zone.instrument.index()], keys);
        compile(model, scales.clone(), observe).unwrap_or_else(|e| panic!("{e:?}"))
    };
    split.zones.iter().zip(of_zone).map(compiled).collect()
}

/// The instruments as the keys of their zones have them.
fn parts(observe: bool) -> Vec<Compiled> {
    instruments(observe, [&KEYS[..BELOW], &KEYS[BELOW..]])
}

/// A keyboard with zones of so many keys, each an instrument of its own.
fn layout(keys: &[u32]) -> Layout {
    let zones = (0..).map(InstrumentId).zip(keys);
    Layout {
        first_note: 21,
        keys: keys.iter().sum(),
        programs: vec![Program::of_zones(
            "zones",
            zones.map(|(id, keys)| (*keys, id)),
        )]
        .into(),
    }
}

/// Words of a tick: every key plays the gesture at a time of its own.
fn words(gesture: &[u16], tick: usize) -> Vec<u16> {
    (0..KEYS.len())
        .map(|key| gesture[(tick * 5 + key * 4001) % gesture.len()])
        .collect()
}

type Told = Vec<(usize, u32, Vec<f64>)>;

/// Drive words and what is emitted on an engine, part by part.
fn alone(
    kind: EngineKind,
    parts: &[Compiled],
    gesture: &[u16],
    ticks: usize,
) -> (Vec<Vec<i16>>, Told) {
    let device = Device::mikey();
    let (mut drives, mut told) = (vec![Vec::new(); ticks], Vec::new());
    for (compiled, from, keys) in [
        (&parts[0], 0, BELOW),
        (&parts[1], BELOW, KEYS.len() - BELOW),
    ] {
        let mut engine =
            Engine::new(kind, compiled, &device, keys).unwrap_or_else(|e| panic!("{e}"));
        let mut drive = vec![0; keys];
        for (tick, row) in drives.iter_mut().enumerate() {
            let words = &words(gesture, tick)[from..from + keys];
            if tick == 0 {
                engine.start(words);
            }
            engine.tick(words, &mut drive);
            row.extend(&drive);
            let of = |happened: Happened| (tick, happened.key + from as u32, happened.args);
            told.extend(engine.drain().into_iter().map(of));
        }
    }
    told.sort_by_key(|(tick, key, _)| (*tick, *key));
    (drives, told)
}

fn gesture() -> Vec<u16> {
    let device = Device::mikey();
    default_gesture()
        .positions(44_100)
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect()
}

#[test]
fn every_engine_plays_a_split_as_its_instruments_alone() {
    let (gesture, ticks) = (gesture(), 4000);
    let observed = parts(true);
    let reference = alone(EngineKind::Interp, &observed, &gesture, ticks);
    assert!(!reference.1.is_empty(), "notes of both");
    assert!(
        reference == alone(EngineKind::Jit, &observed, &gesture, ticks),
        "compiled and interpreted"
    );
    let (parts, device) = (parts(false), Device::mikey());
    let layout = layout(&[BELOW as u32, (KEYS.len() - BELOW) as u32]);
    let on_board = instruments(false, [&KEYS, &KEYS]);
    let on_board: Vec<&Compiled> = on_board.iter().collect();
    for kind in BoardKind::ALL {
        // What a Cortex-M0+ can do in time is tested at a rate of its own elsewhere.
        if kind == BoardKind::Rp2040 {
            continue;
        }
        let mut board = Emulated::of_layout(&layout, &on_board, &device, kind.into())
            .unwrap_or_else(|e| panic!("{e}"));
        let (mut drive, mut told) = (vec![0; KEYS.len()], 0);
        for (tick, row) in reference.0.iter().enumerate() {
            let words = words(&gesture, tick);
            if tick == 0 {
                board.start(&words);
            }
            board.tick(&words, &mut drive);
            assert_eq!(board.trouble(), None);
            assert_eq!(&drive, row, "{}: tick {tick}", kind.name());
            for happened in board.drain() {
                assert!(
                    reference
                        .1
                        .iter()
                        .any(|(at, key, _)| (*at, *key) == (tick, happened.key)),
                    "{happened:?}"
                );
                told += 1;
            }
        }
        let emitted = alone(EngineKind::Interp, &parts, &gesture, ticks).1.len();
        assert_eq!(told, emitted, "{}", kind.name());
        let load = board.load();
        assert!(
            load.cores
                .iter()
                .all(|core| core.missed == 0 && core.faults == 0),
            "{load:?}"
        );
    }
}

/// On a core without long products, at a rate that it keeps.
#[test]
fn a_cortex_m0_plus_plays_a_split_too() {
    let (models, device) = (crate::common::of_keys(), Device::mikey());
    let of = |name: &str| {
        models
            .iter()
            .find(|compiled| compiled.model.name == name)
            .expect("bundled")
            .model
            .clone()
    };
    let slow = |name: &str| {
        let model = Model {
            rate_hz: 8000.into(),
            ..of(name)
        };
        compile(model, device.scales(), false).unwrap_or_else(|e| panic!("{e:?}"))
    };
    let parts = ["hammond", "virtual_spring", "baker"].map(slow);
    let of_parts = [(2, &parts[0]), (1, &parts[1]), (4, &parts[2])];
    let mut board = Emulated::of_layout(
        &layout(&[2, 1, 4]),
        &parts.each_ref(),
        &device,
        BoardKind::Rp2040.into(),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let mut engines: Vec<(Engine, usize)> = Vec::new();
    for (keys, compiled) in of_parts {
        engines.push((
            Engine::new(EngineKind::Interp, compiled, &device, keys).expect("an engine"),
            keys,
        ));
    }
    let gesture = gesture();
    let (mut drive, mut moved) = (vec![0; 7], 0);
    for tick in 0..2000 {
        let words: Vec<u16> = words(&gesture, tick)[..7].to_vec();
        if tick == 0 {
            board.start(&words);
        }
        board.tick(&words, &mut drive);
        assert_eq!(board.trouble(), None);
        let mut from = 0;
        for (engine, keys) in &mut engines {
            let own = from..from + *keys;
            if tick == 0 {
                engine.start(&words[own.clone()]);
            }
            let mut want = vec![0; *keys];
            engine.tick(&words[own.clone()], &mut want);
            assert_eq!(&drive[own.clone()], want, "tick {tick}, keys {own:?}");
            moved += want.iter().filter(|word| **word != 0).count();
            from = own.end;
        }
    }
    assert!(moved > 5000, "{moved} words say something");
}

fn whippen(args: &[&str]) -> (i32, String, String) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments");
    let output = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(args)
        .current_dir(folder)
        .output();
    let output = output.expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (
        output.status.code().unwrap_or(-1),
        text(output.stdout),
        text(output.stderr),
    )
}

/// The bundled split: its keys are divided by what they cost, and its budget says who has which.
#[test]
fn the_budget_of_a_split_says_which_core_has_what() {
    let files = ["split.whip", "grand-piano.whip", "hammond.whip"];
    let budget = |more: &[&str]| whippen(&[&["budget"][..], &files, more].concat());
    let (code, out, err) = budget(&["--json"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let programs: Vec<Value> = out
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let [split, hammond] = &programs[..] else {
        panic!("{} programs", programs.len())
    };
    assert_eq!(
        (&split["instrument"], &hammond["instrument"]),
        (&"split".into(), &"hammond".into())
    );
    let number = |value: &Value| value.as_u64().expect("a number");
    let cores = split["cores"].as_array().expect("cores");
    let keys: Vec<u64> = cores.iter().map(|core| number(&core["keys"])).collect();
    assert!(
        keys.iter().sum::<u64>() == 49 && keys[0] > 26,
        "not half and half: {keys:?}"
    );
    for core in cores {
        let zones = core["zones"].as_array().expect("zones");
        assert_eq!(
            zones.iter().map(|zone| number(&zone["keys"])).sum::<u64>(),
            number(&core["keys"])
        );
    }
    // The other program has the same division: a key's converter words go to one core.
    let other: Vec<u64> = hammond["cores"]
        .as_array()
        .expect("cores")
        .iter()
        .map(|core| number(&core["keys"]))
        .collect();
    assert_eq!((other, &hammond["zones"]), (keys, &Value::Null));
    // With a key more or less on core 0 the slowest core would be slower.
    let zones = split["zones"].as_array().expect("zones");
    let key = |zone: usize| number(&zones[zone]["key"]["contended_cycles_max"]);
    let most = |core: usize| number(&cores[core]["cycles_max"]);
    assert!(
        most(0).abs_diff(most(1)) <= 2 * key(1),
        "{} and {}",
        most(0),
        most(1)
    );
    assert_eq!(
        (&zones[0]["notes"], &zones[1]["notes"]),
        (&"C2 .. B3".into(), &"C4 .. C6".into())
    );
    assert!(
        key(1) > key(0)
            && zones[1]["stability"]["verdict"].is_string()
                == zones[0]["stability"]["verdict"].is_string()
    );
    let refused = [
        (
            &["--most-keys"][..],
            "`split`: zones are for the keys of their keyboard",
        ),
        (
            &["--keys", "48"],
            "`split` are zones for the 49 keys of their keyboard, not for 48: leave --keys away",
        ),
    ];
    for (more, says) in refused {
        let (code, out, err) = budget(more);
        assert!(
            code == 2 && out.is_empty() && err.contains(says),
            "{more:?}: {err}"
        );
    }
    // One program by its name, and one instrument.
    let (code, out, _) = budget(&["split", "--json"]);
    assert_eq!((code, out.lines().count()), (0, 1));
    let (code, out, _) = budget(&["grand_piano", "--keys", "10"]);
    assert!(
        code == 0 && out.starts_with("grand_piano on rp2350: 10 keys"),
        "{out}"
    );
}
