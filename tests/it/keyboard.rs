//! The bundled keyboard: it checks as it stands, and every key has its own weight.

use whippen_compiler::check::{DeviceName, Options, Program};
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{Engine, EngineKind};

fn mikey() -> Program {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/instruments"));
    let mut map = SourceMap::default();
    for file in [
        "mikey.whip",
        "grand-piano.whip",
        "harpsichord.whip",
        "hammond.whip",
    ] {
        map.add(
            file,
            std::fs::read_to_string(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}")),
        );
    }
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    program.unwrap_or_else(|| panic!("{diagnostics:#?}"))
}

#[test]
fn mikey_has_49_keys_and_three_programs() {
    let program = mikey();
    let [keyboard] = program.keyboards.as_slice() else {
        panic!("one keyboard")
    };
    assert_eq!(
        (
            keyboard.name.as_str(),
            &keyboard.device,
            keyboard.layout.keys
        ),
        ("mikey", &DeviceName::Bundled("mikey".to_string()), 49)
    );
    let names: Vec<&str> = keyboard
        .layout
        .programs
        .iter()
        .map(|p| p.name.as_str())
        .collect();
    assert_eq!(names, ["grand_piano", "harpsichord", "hammond"]);
    assert_eq!(keyboard.rate_hz, 44_100.into());
}

#[test]
fn bass_keys_of_the_grand_are_heavier_than_treble_keys() {
    let program = mikey();
    let model = program
        .instruments
        .into_iter()
        .find(|m| m.name == "grand_piano")
        .expect("the grand");
    let (device, keys) = (Device::mikey(), 49);
    let grand = compile(model, device.scales(), true).unwrap_or_else(|e| panic!("{e:?}"));
    for kind in [EngineKind::Jit, EngineKind::Interp, EngineKind::Ideal] {
        let mut engine = Engine::new(kind, &grand, &device, keys).unwrap_or_else(|e| panic!("{e}"));
        let words = vec![device.word_of_position(0.0).0; keys];
        let mut drive = vec![0; keys];
        engine.start(&words);
        (0..44_100).for_each(|_| engine.tick(&words, &mut drive));
        let force_n: Vec<f64> = drive.iter().map(|&w| device.force_of_word(w)).collect();
        // The hammer's own weight at the key front, and G from -0.10 N at A0 to -0.16 N at C8.
        let hammer_n = 11.74e-3 * 0.103 * 9.80665 * (160.0 / 218.0) / 17.8e-3;
        for (key, force_n) in force_n.iter().enumerate() {
            // The lowest key, C2, is the 16th of a piano.
            let expected_n = hammer_n - 0.10 - 0.06 * (key + 15) as f64 / 87.0;
            assert!(
                (force_n - expected_n).abs() < 2e-3,
                "{kind}, key {key}: {force_n} N, not {expected_n} N"
            );
        }
    }
}
