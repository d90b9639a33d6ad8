//! Every bundled instrument of a key, as one mode and specialized, on its gesture and on noise.

use crate::target::{CORES, Target};
use std::path::Path;
use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::kernel::{Interp, Kernel, without_probes};
use whippen_compiler::model::Model;
use whippen_compiler::modes::{Modes, specialize};
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_emulator::CoreKind;
use whippen_runtime::device::Device;
use whippen_runtime::gesture;

/// Keys, each behind the one before it.
const KEYS: usize = 3;
/// Ticks of each kind of words.
const TICKS: usize = 6000;
/// Instructions that modes may have.
const INSTRUCTIONS: usize = 4000;

/// The kernel of every bundled instrument of a key and some more, without observation, and the
/// words of its gesture.
fn all() -> Vec<(Kernel, Vec<u16>)> {
    let mut kernels = Vec::new();
    let bundled = INSTRUMENTS.iter().map(|(file, _)| ("instruments", *file));
    // What no bundled instrument has.
    let others = [
        "bank.whip",
        "functions.whip",
        "tables.whip",
        "sound.whip",
        "pedals.whip",
        "two-axis-spring.whip",
        "pad.whip",
        "dial-and-lever.whip",
        "rubbed_mass.whip",
        "plucked_string.whip",
        "bowed_string.whip",
    ];
    // What is played once fits on no core, and what it is made of is below.
    for (folder, file) in bundled.chain(others.map(|file| ("tests/programs", file))) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(folder)
            .join(file);
        let mut map = SourceMap::default();
        map.add(
            file,
            std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{file}: {e}")),
        );
        let (program, diagnostics) = compile_front(&mut map, &Options::default());
        let program = program.unwrap_or_else(|| panic!("{file}: {diagnostics:#?}"));
        let is_meant = |model: &Model| folder != "instruments" || model.is_of_key();
        for model in program.instruments.into_iter().filter(is_meant) {
            let device = Device::of(&model);
            let gestures = match model.senses.len() {
                1 => vec![gesture::bundled(&model)],
                _ => gesture::bundled_ports(&model),
            };
            let places: Vec<Vec<f64>> = gestures.iter().map(|g| g.positions(44_100)).collect();
            let row = |tick: usize| {
                let ports = device.ports_of(&model).into_iter().zip(&places);
                let words = ports.map(|(port, places)| port.word(places[tick]).0);
                words.collect::<Vec<u16>>()
            };
            let words = (0..places[0].len()).flat_map(row).collect();
            let compiled =
                compile(model, device.scales(), false).unwrap_or_else(|e| panic!("{file}: {e:?}"));
            kernels.push((without_probes(&compiled.lowered.kernel), words));
        }
    }
    kernels
}

/// Runs both and compares drive words and events in every tick, and what the modes leave in memory
/// at the end.
fn compare(modes: &Modes, core: CoreKind, words: impl Fn(usize, usize, usize) -> u16) {
    let kernel = &modes.kernel;
    let mut interp = Interp::new(kernel, KEYS).expect("verifies");
    let mut target = Target::new(modes, KEYS as u32, core);
    let mut drive = vec![0; KEYS * kernel.outputs.len()];
    for tick in 0..TICKS {
        let places =
            (0..KEYS).flat_map(|key| (0..kernel.inputs.len()).map(move |port| (key, port)));
        let words: Vec<u16> = places.map(|(key, port)| words(tick, key, port)).collect();
        if tick == 0 {
            interp.init(&words);
            target.init(&words);
        }
        interp.tick(&words, &mut drive);
        assert_eq!(
            target.tick(&words),
            drive,
            "{} on {}: drive words of tick {tick}",
            kernel.name,
            core.name()
        );
        let (events, lost) = target.drain_events();
        assert_eq!(
            (events, lost),
            (interp.drain_events(), 0),
            "{} on {}: events of tick {tick}",
            kernel.name,
            core.name()
        );
    }
    let stored = |cell: &usize| modes.modes.iter().all(|mode| !mode.known[*cell]);
    for key in 0..KEYS {
        for cell in (0..kernel.cells.len()).filter(stored) {
            let want = interp.cell(key, cell, 0).expect("a cell");
            assert_eq!(
                target.cell(key as u32, cell, 0),
                want,
                "{}: `{}`",
                kernel.name,
                kernel.cells[cell].name
            );
        }
    }
}

/// The word of a tick, a key and a port, by the rows of a gesture's words.
fn both(words: impl Fn(&[&[u16]], usize, usize, usize) -> u16) {
    for (kernel, gesture) in all() {
        let rows: Vec<&[u16]> = gesture.chunks(kernel.inputs.len()).collect();
        for modes in [Modes::single(&kernel), specialize(&kernel, INSTRUCTIONS)] {
            for core in CORES {
                compare(&modes, core, |tick, key, port| {
                    words(&rows, tick, key, port)
                });
            }
        }
    }
}

#[test]
fn on_the_bundled_gesture() {
    // Every seventh word: a stroke seven times as fast meets every transition in fewer ticks.
    both(|rows, tick, key, port| rows[(7 * tick + 997 * key) % rows.len()][port]);
}

/// So far apart is the noise of ports.
const APART: usize = 61;

#[test]
fn on_noise() {
    let mut random = Rng::new(3);
    let noise: Vec<u16> = (0..TICKS + KEYS + 3 * APART)
        .map(|tick| {
            if tick / 40 % 3 == 0 {
                [0, u16::MAX][tick / 120 % 2]
            } else {
                random.next() as u16
            }
        })
        .collect();
    both(|_, tick, key, port| noise[tick + key + port * APART]);
}
