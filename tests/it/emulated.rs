//! The engine `emulated`: the whole image on the emulated board plays what the reference plays, bit
//! for bit.

use whippen_compiler::lower::LoweredEventKind;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{Engine, EngineKind};

use crate::common;

/// Shortly before the first event of a key that plays these words, or before it first moves.
fn interesting(compiled: &Compiled, words: &[u16]) -> usize {
    let mut engine =
        Engine::new(EngineKind::Jit, compiled, &Device::of(&compiled.model), 1).expect("an engine");
    engine.start(&words[..1]);
    let happens = words.iter().position(|word| {
        engine.tick(&[*word], &mut [0]);
        !engine.drain().is_empty()
    });
    let moves = words.iter().position(|word| *word != words[0]);
    happens.or(moves).unwrap_or(0).saturating_sub(1500)
}

/// Runs the reference, the compiled code and the board on the same words; all drive words and
/// events. Keys hear the motion so many words apart.
fn compare(
    compiled: &Compiled,
    board: BoardKind,
    words: &[u16],
    keys: usize,
    apart: usize,
    ticks: usize,
) {
    let start = interesting(compiled, words);
    let name = format!("{} on {}", compiled.model.name, board.name());
    let device = Device::of(&compiled.model);
    let mut engines = [
        EngineKind::Interp,
        EngineKind::Jit,
        EngineKind::Emulated(board),
    ]
    .map(|kind| {
        Engine::new(kind, compiled, &device, keys).unwrap_or_else(|e| panic!("{name}: {e}"))
    });
    let (mut says, mut happened) = (0, 0);
    for tick in 0..ticks {
        let row: Vec<u16> = (0..keys)
            .map(|key| words[(start + tick + key * apart) % words.len()])
            .collect();
        let outcomes = engines.each_mut().map(|engine| {
            let mut drive = vec![0_i16; keys];
            if tick == 0 {
                engine.start(&row);
            }
            engine.tick(&row, &mut drive);
            (drive, engine.drain())
        });
        let trouble = engines[2].board().and_then(|board| board.trouble());
        assert_eq!(trouble, None, "{name}: tick {tick}");
        assert_eq!(outcomes[1], outcomes[0], "{name}: jit, tick {tick}");
        assert_eq!(outcomes[2], outcomes[0], "{name}: emulated, tick {tick}");
        says += outcomes[0].0.iter().filter(|word| **word != 0).count();
        happened += outcomes[0].1.len();
    }
    let emits = compiled
        .lowered
        .events
        .iter()
        .any(|e| matches!(e.kind, LoweredEventKind::Emission(_)));
    assert!(says > 500, "{name}: {says} words say something");
    assert!(happened > 0 || !emits, "{name}: nothing happened");
    let load = engines[2].board().expect("a board").load();
    for core in load.cores {
        assert!(
            (core.missed, core.faults) == (0, 0) && core.frame_cycles_max < load.period_cycles,
            "{name}: {core:?}"
        );
    }
}

/// An instrument as `build` has it: nothing is observed.
fn built(file: &str) -> Compiled {
    let model = common::instruments(file, &[]).remove(0).model;
    let scales = Device::of(&model).scales();
    compile(model, scales, false).unwrap_or_else(|e| panic!("{file}: {e:?}"))
}

#[test]
fn on_the_bundled_gesture() {
    for file in ["hammond.whip", "grand-piano.whip"] {
        let compiled = built(file);
        let words = common::gesture_words(&compiled);
        // An odd number: the cores have different numbers of keys.
        compare(&compiled, BoardKind::Rp2350, &words, 3, 997, 5000);
    }
}

#[test]
fn a_single_key_has_a_board() {
    let compiled = built("virtual-spring.whip");
    let words = common::gesture_words(&compiled);
    compare(&compiled, BoardKind::Rp2350, &words, 1, 0, 4000);
}

/// The instruments of the README on the boards with other cores.
#[test]
fn other_boards_play_the_same() {
    for file in [
        "virtual-spring.whip",
        "baker.whip",
        "hammond.whip",
        "harpsichord.whip",
        "grand-piano.whip",
    ] {
        let compiled = built(file);
        let words = common::gesture_words(&compiled);
        compare(&compiled, BoardKind::Stm32f4, &words, 3, 997, 3000);
        compare(&compiled, BoardKind::Rp2040, &words, 2, 997, 3000);
    }
}
