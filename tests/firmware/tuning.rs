//! Sensors that are tuned on the board: the same integers as in Rust, and keys that play as with an
//! ideal sensor.

use whippen_compiler::budget::{Program as Bytes, cores};
use whippen_compiler::firmware::{
    CORES, Instrument, SensorTuning, Setup, TunedSensor, Watched, build_image, core_block,
};
use whippen_compiler::kernel::Kernel;
use whippen_compiler::keyboard::{InstrumentId, Layout, Program, ProgramId};
use whippen_compiler::modes::{Modes, specialize};
use whippen_emulator::BoardKind;
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::gesture::Gesture;
use whippen_runtime::motion::Calibration;
use whippen_runtime::motion::on_board::OnBoard;

use crate::rig::{KEYS, RATE_HZ, Rig, kernel, kernel_of, midi, setup};
use crate::switch::{begins, key_plays, played, ramp, set};

/// What the mailbox calls the tuning.
const TUNING: u32 = u32::MAX - 1;
/// Ticks in which keys rest, then go down and up, then rest.
const TUNED_TICKS: usize = 9000;
/// Where keys rest and where they are down (m).
const STOPS_M: [f64; 2] = [0.0, 10e-3];
/// Keys whose sensors read wrongly for two readings in a row.
const GLITCHING: [usize; 3] = [3, 43, 60];

/// A reflective sensor: four times as flat near rest as in the middle.
fn table() -> Calibration {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("table.csv");
    let rows = (0..=24).map(|n| {
        let y = f64::from(n) * 0.5;
        let (x, reading) = (y - 0.5, 0.3 * y + y * y * (18.0 - y) / 100.0);
        format!("{x},{reading}\n")
    });
    let text: String = ["key_mm,adc\n".to_string()]
        .into_iter()
        .chain(rows)
        .collect();
    std::fs::write(&path, text).expect("writable");
    Calibration::load(&path).expect("a table")
}

fn on_board() -> OnBoard {
    let device = Device::mikey();
    OnBoard::new(&table(), STOPS_M, device.port()).expect("a curve")
}

/// What the firmware knows of the table.
pub fn tuning() -> SensorTuning {
    on_board().tuning
}

/// What the sensor of a key reads: each has an offset and a gain of its own, every third the other
/// way round.
fn raw(table: &Calibration, key: usize, x: f64) -> u16 {
    let (low, high) = table.domain();
    let part = (table.reading(x) - low) / (high - low);
    let (offset, gain) = (3000.0 + 110.0 * key as f64, 36_000.0 + 150.0 * key as f64);
    let word = match key % 3 {
        0 => offset + gain * (1.0 - part),
        _ => offset + gain * part,
    };
    word.round() as u16
}

/// Where a key is while it is tuned: it rests, goes down and up, and rests.
fn tuned_place(tick: usize) -> f64 {
    let (from, way) = (2000.0, 6000.0);
    let phase = ((tick as f64 - from) / way).clamp(0.0, 1.0);
    let pressed = (1.5 - 1.5 * (std::f64::consts::TAU * phase).cos()).clamp(0.0, 1.0);
    STOPS_M[1] * pressed
}

fn rig(kernel: &Kernel, tuning: Option<SensorTuning>) -> Rig {
    rig_on(BoardKind::Rp2350, kernel, tuning)
}

fn rig_on(kind: BoardKind, kernel: &Kernel, tuning: Option<SensorTuning>) -> Rig {
    let setup = Setup { tuning, ..setup() };
    let (modes, midi) = (specialize(kernel, 4000), midi(kernel));
    let instrument = Instrument {
        modes: &modes,
        places: &[],
        midi: &midi,
        parts: None,
    };
    let all = Program::of_zones("all", [(KEYS as u32, InstrumentId(0))]);
    Rig::on(kind, vec![all], &[instrument], &setup)
}

/// Tunes all keys; what each sensor is found to be in Rust.
fn tune(rig: &mut Rig, table: &Calibration, tuning: &SensorTuning) -> Vec<TunedSensor> {
    let word = |tick: usize, key: usize| match GLITCHING.contains(&key) {
        true if (1500..1588).contains(&tick) => 0xfff0,
        true if (5000..5088).contains(&tick) => 3,
        _ => raw(table, key, tuned_place(tick)),
    };
    let all = (0..TUNED_TICKS).flat_map(|tick| (0..KEYS).map(move |key| (tick, key)));
    let words: Vec<u16> = all.map(|(tick, key)| word(tick, key)).collect();
    rig.play(words[..100 * KEYS].iter().copied());
    set(rig, 1, TUNING, 1);
    let drives = rig.play(words[100 * KEYS..].iter().copied());
    assert!(
        drives[4 * KEYS..].iter().all(|word| *word == 0),
        "forces are zero"
    );
    let mut found = Vec::new();
    for key in 0..KEYS {
        let (core, own) = (key / 44, key % 44);
        let (last, turn) = (
            rig.block(core, core_block::TICK),
            rig.block(core, core_block::TURN),
        );
        // The guard has its turn behind the keys; ticks are numbered from 1.
        let of = |tick: usize| {
            (turn as usize + 2 * TUNED_TICKS * 44 - 1 - (last as usize - 1 - tick)) % 44
        };
        let mut watched = Watched::default();
        let turns = (1000..last as usize).filter(|tick| of(*tick) == own);
        turns.for_each(|tick| watched.read(words[tick * KEYS + key]));
        found.push(watched.tuned(tuning).expect("it moved"));
    }
    found
}

/// The values of all keys in the board's memory.
fn values(rig: &Rig) -> Vec<TunedSensor> {
    let of_core = |core: usize| {
        let at = rig.symbol(["tuned0", "tuned1"][core]);
        (0..44).map(move |key| at + 8 * key)
    };
    let word = |at: u32| rig.word(at) as i32;
    let all = [0, 1].into_iter().flat_map(of_core);
    all.map(|at| TunedSensor {
        offset: word(at),
        gain: word(at + 4),
    })
    .collect()
}

/// Where all keys are in each tick: strokes, each at a time of its own.
fn places(ticks: usize) -> Vec<f64> {
    let stroke = Gesture::new()
        .stroke(0.02, 0.03, 0.08, 0.06, 9.4e-3)
        .hold(0.1);
    let motion = stroke.positions(RATE_HZ);
    let place = |tick: usize, key: usize| {
        let at = tick.saturating_sub(400 + 11 * key);
        motion[at.min(motion.len() - 1)]
    };
    let all = (0..ticks).flat_map(|tick| (0..KEYS).map(move |key| (tick, key)));
    all.map(|(tick, key)| place(tick, key)).collect()
}

#[test]
fn a_tuned_sensor_plays_as_an_ideal_one() {
    plays_as_an_ideal_one(BoardKind::Rp2350);
}

/// The same on a core with fewer instructions.
#[test]
fn a_tuned_sensor_plays_as_an_ideal_one_on_a_small_core() {
    plays_as_an_ideal_one(BoardKind::Rp2040);
}

fn plays_as_an_ideal_one(kind: BoardKind) {
    let (table, on_board) = (table(), on_board());
    let kernel = kernel("hammond.whip");
    let mut board = rig_on(kind, &kernel, Some(on_board.tuning.clone()));
    let found = tune(&mut board, &table, &on_board.tuning);
    assert_eq!(values(&board), found, "the same integers");
    // Before it was tuned, a sensor that reads the other way round played notes.
    board.sent();
    let before = played(&board, 0);
    set(&mut board, 2, TUNING, 0);
    let ticks = 5000;
    let places = places(ticks);
    let keyed = |at: usize| (at % KEYS, places[at]);
    let words: Vec<u16> = (0..places.len())
        .map(|at| raw(&table, keyed(at).0, keyed(at).1))
        .collect();
    let drives = board.play(words.iter().copied());
    // They begin with those of the tick before.
    let drives = &drives[KEYS..];
    // The program begins anew, and reads what Rust makes of the words, bit for bit.
    let linear: Vec<u16> = (0..places.len())
        .map(|at| found[at % KEYS].linearised(words[at], &on_board.tuning.curve))
        .collect();
    let begun = begins(&board, 0, before).map(|tick| tick - TUNED_TICKS);
    let whole = ramp(RATE_HZ)..ticks - 2;
    let compared: usize = (0..KEYS)
        .map(|key| {
            let begun = begun[key / 44] + key % 44;
            key_plays(&kernel, key, begun, &linear, drives, whole.clone())
        })
        .sum();
    assert!(compared > 10_000, "{compared} words say something");
    plays_as_ideal(&mut board, &kernel, &places, drives, &linear);
}

/// Words of the position, forces and notes against those of a sensor that is straight.
fn plays_as_ideal(
    board: &mut Rig,
    kernel: &Kernel,
    places: &[f64],
    drives: &[i16],
    linear: &[u16],
) {
    let device = Device::mikey();
    let ideal: Vec<u16> = places
        .iter()
        .map(|x| device.word_of_position(*x).0)
        .collect();
    let off_m = linear
        .iter()
        .zip(places)
        .map(|(word, x)| (device.position_of_word(*word) - x).abs());
    let off_m = off_m.fold(0.0, f64::max);
    println!("positions are at most {:.2} um off", 1e6 * off_m);
    assert!(off_m < 4e-6, "{off_m} m");
    let mut straight = rig(kernel, None);
    let wanted = straight.play(ideal);
    let whole = 2 * ramp(RATE_HZ) * KEYS;
    let off_n = drives[whole..].iter().zip(&wanted[whole..]);
    let off_n = off_n.map(|(a, b)| device.force_of_word(*a) - device.force_of_word(*b));
    let off_n: Vec<f64> = off_n.collect();
    let rms = (off_n.iter().map(|n| n * n).sum::<f64>() / off_n.len() as f64).sqrt();
    println!("forces differ by {:.2} mN rms", 1e3 * rms);
    let notes = |rig: &mut Rig| {
        let bytes = rig.sent();
        let mut keys: Vec<u8> = bytes
            .chunks(3)
            .filter(|m| m[0] == 0x90)
            .map(|m| m[1])
            .collect();
        keys.sort_unstable();
        keys
    };
    let (played, wanted) = (notes(board), notes(&mut straight));
    assert_eq!(played, wanted);
    assert_eq!(played.len(), KEYS, "each key sounds once");
    assert!(rms < 5e-3, "{rms} N");
}

#[test]
fn requests_are_answered_and_faults_found() {
    let (table, tuning) = (table(), tuning());
    let kernel = kernel("virtual-spring.whip");
    let mut board = rig(&kernel, Some(tuning));
    let rest: Vec<u16> = (0..KEYS).map(|key| raw(&table, key, 1e-3)).collect();
    let hold = |board: &mut Rig, ticks: usize| board.play((0..ticks).flat_map(|_| rest.clone()));
    hold(&mut board, 100);
    let mailbox = board.symbol("mailbox");
    set(&mut board, 1, TUNING, 2);
    hold(&mut board, 20);
    assert_eq!(board.word(mailbox + 16), 2, "neither begin nor end");
    // Keys that do not move keep what they have.
    set(&mut board, 2, TUNING, 1);
    hold(&mut board, 3000);
    assert_eq!((board.word(mailbox + 12), board.word(mailbox + 16)), (2, 0));
    assert_eq!(values(&board), vec![TunedSensor::default(); KEYS]);
    set(&mut board, 3, TUNING, 0);
    hold(&mut board, 1000);
    // A sensor that breaks is found behind its calibration.
    let broken = |row: &[u16]| {
        let mut row = row.to_vec();
        (row[5], row[50]) = (0, 65_535);
        row
    };
    let row = broken(&rest);
    board.play((0..400).flat_map(|_| row.clone()));
    for key in [5, 50] {
        assert_eq!(board.ceiling(key), 0, "key {key} is free");
    }
    assert_eq!(board.ceiling(6), 65_536);
    for core in [0, 1] {
        assert_eq!(board.block(core, core_block::MISSED), 0, "{}", CORES[core]);
    }
}

/// What was found once is built in: keys begin with tuned words, so nothing moves at the start.
#[test]
fn built_in_values_play_from_the_start() {
    const JUMPS: &str = "instrument jumps {
        sense x: length in -0.5 mm .. 10.5 mm over 1 ms
        states moves {
            still  -> thrown when abs(x') > 0.3 m/s { emit note(speed: x') }
            thrown -> still  when abs(x') < 0.1 m/s { emit release() }
        }
        force spring = 75 N/m * x
    }";
    let kernel = kernel_of("jumps.whip", JUMPS);
    let (table, mut tuning) = (table(), tuning());
    let rest: Vec<u16> = (0..KEYS).map(|key| raw(&table, key, 4e-3)).collect();
    let found = |key: usize| {
        let mut watched = Watched::default();
        let ends = STOPS_M.map(|x| raw(&table, key, x));
        let words = ends.map(|end| [end; 9]);
        words
            .as_flattened()
            .iter()
            .for_each(|word| watched.read(*word));
        watched.tuned(&tuning).expect("it moved")
    };
    tuning.tuned = (0..KEYS).map(found).collect();
    let mut board = rig(&kernel, Some(tuning.clone()));
    assert_eq!(
        values(&board),
        vec![TunedSensor { offset: 0, gain: 0 }; KEYS],
        "flash"
    );
    let drives = board.play((0..500).flat_map(|_| rest.clone()));
    assert_eq!(values(&board), tuning.tuned);
    assert_eq!(board.sent(), [0_u8; 0], "no key moves");
    let device = Device::mikey();
    for drive in &drives[400 * KEYS..] {
        let off_n = device.force_of_word(*drive) - 75.0 * 4e-3;
        assert!(off_n.abs() < 75.0 * 4e-6 + 1e-4, "{off_n} N");
    }
}

/// The budget has its cycles, of every board.
#[test]
fn it_is_charged() {
    let kernel = kernel("virtual-spring.whip");
    let (modes, midi) = (Modes::single(&kernel), midi(&kernel));
    let frames = |name: &str, keys: Vec<u32>, tuning: Option<SensorTuning>| {
        let board = board::bundled(name).expect("it is bundled");
        let layout = Layout::of_one_instrument("spring", keys.iter().sum(), 21);
        let setup = Setup {
            tuning,
            keys,
            ..setup()
        };
        let instrument = Instrument {
            modes: &modes,
            places: &[],
            midi: &midi,
            parts: None,
        };
        let whole = build_image(&layout, &[instrument], &setup, &board);
        let whole = whole.unwrap_or_else(|e| panic!("{e}"));
        let bounds = cores(&whole, &Bytes::of(&whole.image), &board, ProgramId(0));
        let bounds = bounds.unwrap_or_else(|e| panic!("{e}"));
        bounds[0].alone.handler.cycles_max
    };
    for (name, keys, each) in [
        ("rp2350", vec![44, 44], 20.0..30.0),
        ("stm32f4", vec![44], 20.0..40.0),
        ("rp2040", vec![44, 44], 30.0..50.0),
    ] {
        let with = frames(name, keys.clone(), Some(tuning()));
        let without = frames(name, keys.clone(), None);
        let more = (with - without) as f64 / f64::from(keys[0]);
        println!("{name}: {more:.1} cycles a key, {with} and {without} in all");
        assert!(each.contains(&more), "{name}: {more}");
    }
}
