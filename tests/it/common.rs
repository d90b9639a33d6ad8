//! What the tests share: instruments compiled, recordings found, words made.

use std::path::Path;

use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture;
use whippen_runtime::motion::{Layout, MotionOptions, Stops, load};
use whippen_runtime::session::{self, Recording, Run};

/// Ticks per second.
pub const RATE_HZ: u32 = 44_100;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every instrument of a text, compiled for its device, with everything observed.
pub fn compiled(name: &str, text: &str, sets: &[(&str, &str)]) -> Vec<Compiled> {
    let mut map = SourceMap::default();
    map.add(name, text);
    let sets = sets
        .iter()
        .map(|(n, v)| (n.to_string(), v.to_string()))
        .collect();
    let (program, diagnostics) = compile_front(
        &mut map,
        &Options {
            sets,
            ..Options::default()
        },
    );
    let program = program.unwrap_or_else(|| panic!("{name}: {diagnostics:#?}"));
    let build = |model: Model| {
        let scales = Device::of(&model).scales();
        compile(model, scales, true).unwrap_or_else(|e| panic!("{name}: {e:?}"))
    };
    program.instruments.into_iter().map(build).collect()
}

/// Every instrument of a bundled file, compiled for its device, with everything observed.
pub fn instruments(file: &str, sets: &[(&str, &str)]) -> Vec<Compiled> {
    let path = root().join("instruments").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    compiled(file, &text, sets)
}

/// Every bundled instrument.
pub fn all() -> Vec<Compiled> {
    INSTRUMENTS
        .iter()
        .flat_map(|(file, _)| instruments(file, &[]))
        .collect()
}

/// Those that a key plays: what has several ports, or none that a key has, is played once.
pub fn of_keys() -> Vec<Compiled> {
    let mut all = all();
    all.retain(|compiled| compiled.model.is_of_key());
    all
}

/// The names of the others.
pub fn played_once() -> Vec<String> {
    let mut all = all();
    all.retain(|compiled| !compiled.model.is_of_key());
    all.into_iter()
        .map(|compiled| compiled.model.name)
        .collect()
}

/// Programs of what no bundled instrument has.
pub const PROGRAMS: [(&str, &str); 11] = [
    ("bank.whip", include_str!("../programs/bank.whip")),
    ("functions.whip", include_str!("../programs/functions.whip")),
    ("tables.whip", include_str!("../programs/tables.whip")),
    (
        "two-axis-spring.whip",
        include_str!("../programs/two-axis-spring.whip"),
    ),
    ("sound.whip", include_str!("../programs/sound.whip")),
    ("pedals.whip", include_str!("../programs/pedals.whip")),
    ("pad.whip", include_str!("../programs/pad.whip")),
    (
        "dial-and-lever.whip",
        include_str!("../programs/dial-and-lever.whip"),
    ),
    (
        "rubbed_mass.whip",
        include_str!("../programs/rubbed_mass.whip"),
    ),
    (
        "plucked_string.whip",
        include_str!("../programs/plucked_string.whip"),
    ),
    (
        "bowed_string.whip",
        include_str!("../programs/bowed_string.whip"),
    ),
];

/// Every bundled instrument, and those of [`PROGRAMS`].
pub fn all_and_programs() -> Vec<Compiled> {
    let programs = PROGRAMS.iter();
    let others = programs.flat_map(|(file, text)| compiled(file, text, &[]));
    all().into_iter().chain(others).collect()
}

/// Sensor words of a key's positions.
pub fn words(positions_m: &[f64]) -> Vec<u16> {
    words_on(&Device::mikey(), positions_m)
}

/// Sensor words of the bundled gesture of an instrument, on its device: those of all ports, tick
/// after tick.
pub fn gesture_words(compiled: &Compiled) -> Vec<u16> {
    let model = &compiled.model;
    let device = Device::of(model);
    let places = gestures_of(compiled);
    let ports = device.ports_of(model);
    let ticks = places.first().map_or(0, Vec::len);
    let row = |tick: usize| {
        let words = ports.iter().zip(&places);
        words.map(move |(port, places)| port.word(places[tick]).0)
    };
    (0..ticks).flat_map(row).collect()
}

fn words_on(device: &Device, positions_m: &[f64]) -> Vec<u16> {
    positions_m
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect()
}

/// The key of the Kawai recording, 37 s at the tick rate; none where the data is absent, and the
/// test counts as skipped.
pub fn recording() -> Option<Vec<f64>> {
    recording_with(0.0)
}

/// The same through a dead band of so many readings to either side.
pub fn recording_with(dead_band: f64) -> Option<Vec<f64>> {
    let folder = whippen_need::recordings("kawai-grand")?;
    let options = MotionOptions {
        layout: Layout::Raw {
            rate_hz: 2000.0,
            column: 2,
            calibration: Some(folder.join("calibration_key.csv")),
        },
        stops: Some(Stops {
            rest_m: 0.88e-3,
            full_m: 12.7e-3,
            dip_m: 10e-3,
        }),
        lowpass_hz: Some(200.0),
        dead_band,
        ..MotionOptions::default()
    };
    let motion = load(
        &folder.join("key_and_hammer_2kHz.txt"),
        &options,
        RATE_HZ.into(),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    Some(motion.positions.to_vec())
}

/// The bundled gestures of an instrument, a row for each port.
pub fn gestures_of(compiled: &Compiled) -> Vec<Vec<f64>> {
    let gestures = gesture::bundled_ports(&compiled.model);
    gestures.iter().map(|g| g.positions(RATE_HZ)).collect()
}

/// A run of any instrument on its bundled gesture, or so many seconds of it.
pub fn played(compiled: &Compiled, seconds: f64) -> Run {
    let places = gestures_of(compiled);
    let ticks = places[0].len().min((seconds * f64::from(RATE_HZ)) as usize);
    let move_to = |tick: usize, at: &mut [f64]| {
        at.iter_mut()
            .zip(&places)
            .for_each(|(at, place)| *at = place[tick]);
    };
    recorded(compiled, EngineKind::Jit, (ticks, move_to))
}

/// A run of so many ticks, each with the places of all ports.
pub fn recorded(
    compiled: &Compiled,
    kind: EngineKind,
    motion: (usize, impl FnMut(usize, &mut [f64])),
) -> Run {
    let device = Device::of(&compiled.model);
    let recording = Recording::everything(session::recorded(compiled, &device, kind, &[]));
    session::record(compiled, &device, kind, motion, recording, |_| ())
        .unwrap_or_else(|e| panic!("{}: {e}", compiled.model.name))
}

/// The bundled gesture of an instrument of a key.
pub fn gesture_of(compiled: &Compiled) -> Vec<f64> {
    gesture::bundled(&compiled.model).positions(RATE_HZ)
}

/// The bundled gesture of a key of 10 mm.
pub fn gesture() -> Vec<f64> {
    gesture::default_gesture().positions(RATE_HZ)
}
