//! The engine `emulated`: the whole image on the emulated board plays what the reference plays, bit
//! for bit.

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::lower::LoweredEventKind;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::EmulatedBoard;
use whippen_runtime::engine::{Engine, EngineKind};
use whippen_runtime::session::run;

use crate::common;

/// Cycles of a second on an RP2350.
const CLOCK_HZ: u32 = 150_000_000;

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
        EngineKind::Emulated(board.into()),
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

/// What keys that have much to do when they are down take on the board, at some cycles a tick, if
/// no tick is missed.
fn longest_tick(period_cycles: u32) -> Result<u64, String> {
    let text = "instrument felt {
        sense x: length in 0 mm .. 10 mm
        states key { up -> down when x > 5 mm  down -> up when x < 4 mm }
        force felt = if key is down then 1 N * (x / 10 mm)^2.5 else 0 N
    }";
    let options = Options {
        rate_hz: Some(CLOCK_HZ / period_cycles),
        ..Options::default()
    };
    let mut map = SourceMap::default();
    map.add("felt.whip", text);
    let (program, diagnostics) = compile_front(&mut map, &options);
    let model = program
        .map(|mut program| program.instruments.remove(0))
        .unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let device = Device::of(&model);
    let compiled = compile(model, device.scales(), false).unwrap_or_else(|e| panic!("{e:?}"));
    let on = EmulatedBoard {
        kind: BoardKind::Rp2350,
        keys: 6,
    };
    let moves: Vec<f64> = (0..2000).map(|tick| 5e-6 * f64::from(tick)).collect();
    let run = run(&compiled, &device, EngineKind::Emulated(on), &moves, |_| ())
        .map_err(|e| e.to_string())?;
    let load = run.load.expect("a board has one");
    assert_eq!(load.cores.iter().map(|core| core.keys).sum::<u32>(), 6);
    let longest = load.cores.iter().map(|core| core.frame_cycles_max).max();
    Ok(longest.expect("cores"))
}

#[test]
fn a_tick_is_late_by_its_whole_frame() {
    let whole = longest_tick(3401).expect("is in time");
    let cycles = u32::try_from(whole).expect("a few hundred");
    // Which ticks have the firmware's rarer work depends on when the board was up.
    let in_time = longest_tick(cycles + 64).expect("is in time");
    assert!(in_time <= whole + 64, "{in_time} after {whole}");
    // Entry and exit of the interrupt alone are more than this, so its handler is in time.
    let error = longest_tick(cycles - 12).expect_err("is late");
    assert!(error.contains("a tick is missed"), "{error}");
    assert!(error.contains("3 and 3 keys take more than"), "{error}");
}
