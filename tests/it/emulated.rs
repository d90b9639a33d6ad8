//! The engine `emulated`: the whole image on the emulated board plays what the reference plays, bit
//! for bit.

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::lower::LoweredEventKind;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_emulator::BoardKind;
use whippen_runtime::device::{Device, Stands};
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
        rate_hz: Rate::new(CLOCK_HZ, period_cycles),
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
    assert_eq!(
        load.period_cycles,
        u64::from(period_cycles),
        "no fraction is lost"
    );
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

/// A program with several ports as `build` has it, and its device with motors that stand most of
/// their force.
fn with_ports(file: &str) -> (Compiled, Device) {
    let (_, text) = common::PROGRAMS
        .into_iter()
        .find(|(name, _)| *name == file)
        .expect("a program");
    let model = common::compiled(file, text, &[]).remove(0).model;
    let mut device = Device::of(&model);
    for port in &mut device.ports {
        port.stands = port.drive.map(|drive| Stands {
            rated: 0.9 * drive.full_scale,
            peak_s: 1.0,
        });
    }
    let compiled = compile(model, device.scales(), false).unwrap_or_else(|e| panic!("{e:?}"));
    (compiled, device)
}

#[test]
fn several_ports_play_the_same_on_every_board() {
    for (file, driven) in [
        ("two-axis-spring.whip", 2),
        ("pad.whip", 0),
        ("dial-and-lever.whip", 2),
    ] {
        let (compiled, device) = with_ports(file);
        for board in BoardKind::ALL {
            let name = format!("{file} on {}", board.name());
            let ports = compiled.model.senses.len();
            let kinds = [EngineKind::Interp, EngineKind::Emulated(board.into())];
            let mut engines = kinds.map(|kind| {
                Engine::new(kind, &compiled, &device, 1).unwrap_or_else(|e| panic!("{name}: {e}"))
            });
            let (mut rng, mut says, mut happened) = (Rng::new(7), vec![0; driven], 0);
            let mut row = vec![0x8000_u16; ports];
            row[ports - 1] = 0;
            for tick in 0..3000 {
                // Each port holds for some ticks, moves a little, or jumps.
                for word in &mut row {
                    match rng.below(24) {
                        0 => *word = rng.below(1 << 16) as u16,
                        1..6 => *word = word.saturating_add(rng.below(400) as u16),
                        6..11 => *word = word.saturating_sub(rng.below(400) as u16),
                        _ => {}
                    }
                }
                let outcomes = engines.each_mut().map(|engine| {
                    let mut drive = vec![0_i16; driven];
                    if tick == 0 {
                        engine.start(&row);
                    }
                    engine.tick(&row, &mut drive);
                    (drive, engine.drain())
                });
                let trouble = engines[1].board().and_then(|board| board.trouble());
                assert_eq!(trouble, None, "{name}: tick {tick}");
                assert_eq!(outcomes[1], outcomes[0], "{name}: tick {tick}");
                for (count, word) in says.iter_mut().zip(&outcomes[0].0) {
                    *count += usize::from(*word != 0);
                }
                happened += outcomes[0].1.len();
            }
            assert!(says.iter().all(|count| *count > 1000), "{name}: {says:?}");
            let emits = !compiled.lowered.events.is_empty();
            assert!(happened > 0 || !emits, "{name}: nothing happened");
            let load = engines[1].board().expect("a board").load();
            assert_eq!(load.cores.len(), 1, "{name}");
            let core = load.cores[0];
            assert_eq!((core.missed, core.faults), (0, 0), "{name}");
        }
    }
}

/// The drive words after so many ticks of these words, and the faults of the board by then.
fn after(compiled: &Compiled, device: &Device, row: &[u16], ticks: usize) -> (Vec<i16>, u32) {
    let kind = EngineKind::Emulated(BoardKind::Rp2350.into());
    let mut engine = Engine::new(kind, compiled, device, 1).expect("an engine");
    let mut drive = vec![0; 2];
    engine.start(row);
    for _ in 0..ticks {
        engine.tick(row, &mut drive);
    }
    let board = engine.board().expect("a board");
    assert_eq!(board.trouble(), None);
    (drive, board.load().cores[0].faults)
}

#[test]
fn a_port_at_a_rail_frees_the_instrument_where_nothing_is_sensed_there() {
    let (compiled, mut device) = with_ports("dial-and-lever.whip");
    let row = [0x9000, 0xffff, 0xffff];
    // As the program senses up to there, it is a place like any other.
    let (drive, faults) = after(&compiled, &device, &row, 1000);
    assert!(drive.iter().all(|word| *word != 0) && faults == 0);
    device.ports[1].sensor.high = 0.021;
    let fit = compile(compiled.model.clone(), device.scales(), false).expect("it lowers");
    let (drive, faults) = after(&fit, &device, &row, 400);
    assert!(drive.iter().all(|word| *word != 0) && faults == 0);
    assert_eq!(after(&fit, &device, &row, 520), (vec![0; 2], 2));
    // A sensor that is read every 20 ms has four updates.
    device.ports[1].sensor.update_hz = Some(50.0);
    let fit = compile(compiled.model, device.scales(), false).expect("it lowers");
    assert_eq!(after(&fit, &device, &row, 520).1, 0);
    assert_eq!(after(&fit, &device, &row, 3700), (vec![0; 2], 2));
}

/// The motor of one port stands little: its heat holds the whole instrument back until half of it
/// is gone, and the other port, which is driven as well, never gets warm.
#[test]
fn a_hot_motor_of_one_port_holds_all_back() {
    const RATED: i64 = 4096;
    let (compiled, mut device) = with_ports("two-axis-spring.whip");
    let full_scale = device.ports[1].drive().full_scale;
    device.ports[1].stands = Some(Stands {
        rated: full_scale / 8.0,
        peak_s: 0.004,
    });
    let kinds = [
        EngineKind::Interp,
        EngineKind::Emulated(BoardKind::Rp2350.into()),
    ];
    let mut engines =
        kinds.map(|kind| Engine::new(kind, &compiled, &device, 1).expect("an engine"));
    // The bead in the middle, in the wall, in the middle; both sensors never rest.
    let row = |tick: usize| {
        let shakes = (tick % 2) as u16;
        let y = if (200..1500).contains(&tick) {
            0x0400
        } else {
            0x8000
        };
        [0x9000 + shakes, y + shakes]
    };
    let (mut heat, mut hot, mut back) = (0, None, None);
    for tick in 0..10_000 {
        let [full, held] = engines.each_mut().map(|engine| {
            let mut drive = [0_i16; 2];
            if tick == 0 {
                engine.start(&row(0));
            }
            engine.tick(&row(tick), &mut drive);
            drive.map(i64::from)
        });
        let board = engines[1].board().expect("a board");
        assert_eq!(board.trouble(), None);
        // What the motor stands for 4 ms.
        heat = (heat + full[1] * full[1] - RATED * RATED).max(0);
        let limit = (32_767 * 32_767 - RATED * RATED) * 176;
        if hot.is_none() && board.load().cores[0].faults != 0 {
            assert_eq!(board.load().cores[0].faults, 8);
            // Its turn comes in every other tick.
            let late = 4 * (full[1] * full[1] - RATED * RATED);
            let limit = limit - late / 4;
            assert!(
                (limit..limit + late).contains(&heat),
                "{heat}, limit {limit}"
            );
            hot = Some(tick);
        }
        match hot {
            None => assert_eq!(held, full, "tick {tick}"),
            Some(from) if tick > from + 2 && tick < 1500 => {
                assert!(held[1].abs() <= RATED, "{held:?}");
                let parts = [0, 1].map(|port| 8 * held[port] - full[port]);
                assert!(
                    parts.iter().all(|part| part.abs() <= 8),
                    "{held:?} of {full:?}"
                );
            }
            Some(_) => back = back.or((held == full && tick >= 1500).then_some(tick)),
        }
    }
    assert!(hot.is_some(), "it gets hot");
    let back = back.expect("force comes back");
    assert!((6000..9500).contains(&back), "{back}");
    assert_eq!(
        engines[1].board().expect("a board").load().cores[0].faults,
        8
    );
}

/// Converters of fewer bits are no matter of an image: words have 16 bits, and a sensor at the end
/// of its converter reads as a rail, where a broken wire is found.
#[test]
fn an_image_plays_converters_of_fewer_bits() {
    let compiled = built("hammond.whip");
    let mut device = Device::mikey();
    device.ports[0].sensor.bits = 12;
    let drive = device.ports[0].drive.as_mut().expect("a key is driven");
    drive.bits = 10;
    let step = drive.full_scale / 512.0;
    let moves: Vec<f64> = (0..600).map(|tick| 1e-3 + 2e-6 * f64::from(tick)).collect();
    let traces = [
        EngineKind::Jit,
        EngineKind::Emulated(BoardKind::Rp2350.into()),
    ]
    .map(|kind| {
        run(&compiled, &device, kind, &moves, |_| ())
            .expect("an engine")
            .trace
    });
    let [jit, board] = traces.each_ref().map(|trace| {
        let column = trace.column("drive_n").expect("the drive");
        column.values().to_vec()
    });
    assert_eq!(jit, board);
    assert!(jit.iter().all(|force| (force / step).fract() == 0.0));
    let mut forces = jit.clone();
    forces.dedup();
    assert!(forces.len() >= 3, "{forces:?}");
    // What the coil pushes is told too, a sample later.
    let coil = traces[0].column("coil_force_n").expect("the coil");
    let follows = coil.values().last().zip(jit.last()).expect("ticks");
    assert!((follows.0 - follows.1).abs() <= step);
    assert_eq!(device.word_of_position(10.5e-3).0, u16::MAX);
}
