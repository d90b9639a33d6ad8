//! Safety that another project links: the words of a relocatable file and of C text are those of
//! the whole image's firmware, on strokes and on faults that are put in.

mod object;
mod text;

use crate::rig::{KEYS, NEWTON, RATE_HZ, Rig, guarded, midi, setup};
use object::Linked;
use text::of_c;
use whippen_compiler::firmware::{Instrument, Motor, Passivity, Setup, core_block};
use whippen_compiler::front::compile_front;
use whippen_compiler::keyboard::{InstrumentId, Program};
use whippen_compiler::modes::Modes;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_emulator::{BoardKind, CoreKind};
use whippen_runtime::device::Device;
use whippen_runtime::gesture::Gesture;

/// The keys of core 0 of the image, and all that the linked files have.
const OWN: usize = KEYS / 2;

/// A key that takes energy with its own damper and gives it with another one; what pushes it may be
/// set while it plays.
const TEXT: &str = "instrument guarded {
    sense x: length in -0.5 mm .. 10.5 mm over 1 ms
    live param push = 0 N in 0 N .. 8 N
    force spring = 900 N/m * (x - 2 mm)
    force gives  = -4 N*s/m * x'
    force pushed = push
}";

fn compiled(text: &str) -> Compiled {
    let mut map = SourceMap::default();
    map.add("linked.whip", text);
    let options = whippen_compiler::check::Options {
        rate_hz: Some(RATE_HZ.into()),
        ..Default::default()
    };
    let (program, diagnostics) = compile_front(&mut map, &options);
    let model = program
        .unwrap_or_else(|| panic!("{diagnostics:?}"))
        .instruments
        .remove(0);
    compile(model, Device::mikey().scales(), false).unwrap_or_else(|e| panic!("{e:?}"))
}

/// What happens before the tick of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    None,
    /// As if the last tick had been one earlier: one is missed.
    Missed,
    /// The first live value becomes this.
    Live(i32),
}

/// Rows of sensor words of the keys, and what happens.
type Story = Vec<([u16; OWN], Fault)>;

/// What is left of a run.
#[derive(Debug, PartialEq, Eq)]
struct Played {
    /// Of each tick from the first on that the firmware served.
    drives: Vec<[i16; OWN]>,
    /// Ticks missed, faults, the key of the last one.
    told: [u32; 3],
}

/// The image on its board; and the number of the first tick that it served.
fn of_image(kind: BoardKind, compiled: &Compiled, setup: &Setup, story: &Story) -> (Played, u32) {
    let kernel = &compiled.lowered.kernel;
    let (modes, midi) = (Modes::single(kernel), midi(kernel));
    let instruments = [Instrument {
        modes: &modes,
        places: &[],
        midi: &midi,
        parts: None,
    }];
    let programs = vec![Program::of_zones("all", [(KEYS as u32, InstrumentId(0))])];
    let mut rig = Rig::on(kind, programs, &instruments, setup);
    let row = |words: &[u16; OWN]| words.iter().chain(words).copied().collect::<Vec<u16>>();
    let all: Vec<u16> = story.iter().flat_map(|(words, _)| row(words)).collect();
    rig.converter().samples.extend(all);
    while rig.block(0, core_block::TICK) == 0 {
        rig.step();
    }
    let first = rig.block(0, core_block::TICK);
    let (seen, live) = (
        rig.symbol("core0") + core_block::TICK,
        rig.symbol("core0_state") + rig.layout(0, 0).live_param(0).unwrap_or(0),
    );
    let mut drives = rig.run(0);
    for (row, (_, fault)) in story.iter().enumerate().skip(first as usize) {
        match fault {
            Fault::Missed => rig.set(seen, row as u32 - 1),
            Fault::Live(value) => rig.set(live, *value as u32),
            Fault::None => {}
        }
        drives.extend(rig.run(1));
    }
    drives.extend(rig.run(1));
    let rows = drives.chunks(KEYS).skip(first as usize - 1);
    let of_core = |row: &[i16]| row[..OWN].try_into().expect("a row");
    let drives = rows.map(of_core).take(story.len() - first as usize + 1);
    let told = [core_block::MISSED, core_block::FAULTS, core_block::FAULTY];
    let played = Played {
        drives: drives.collect(),
        told: told.map(|at| rig.block(0, at)),
    };
    (played, first)
}

/// All three, which must be the same; what the image did, and the cycles of a tick that were
/// measured and that are proven.
fn agree(kind: BoardKind, compiled: &Compiled, setup: &Setup, story: &Story) -> (Played, [u64; 2]) {
    let core = match kind {
        BoardKind::Rp2040 => CoreKind::CortexM0Plus,
        _ => CoreKind::CortexM33,
    };
    let (image, first) = of_image(kind, compiled, setup, story);
    assert_eq!(image.drives.len(), story.len() - first as usize + 1);
    let own = Setup {
        keys: vec![OWN as u32],
        ..setup.clone()
    };
    let mut linked = Linked::new(core, compiled, &own, 0);
    let (object, cycles) = linked.play(story, first);
    same(&object, &image, "the relocatable file");
    if let Some(c) = of_c(compiled, &own, story, first) {
        same(&c, &image, "the C text");
    }
    let proven = linked.cycles_max();
    println!("{kind:?}: {cycles} cycles of {proven} proven, with {OWN} keys");
    assert!(cycles <= proven, "{cycles} of {proven}");
    (image, [cycles, proven])
}

fn same(found: &Played, image: &Played, what: &str) {
    let ticks = found.drives.iter().zip(&image.drives);
    let first = ticks.clone().position(|(found, image)| found != image);
    if let Some(at) = first {
        let (found, image) = (&found.drives[at], &image.drives[at]);
        panic!("{what}, {at} ticks after the first:\n{found:?}\n{image:?}");
    }
    assert_eq!(found.told, image.told, "{what}");
    assert_eq!(found.drives.len(), image.drives.len(), "{what}");
}

/// Keys that are struck one after the other, again and again.
fn strokes(ticks: usize) -> Story {
    let device = Device::mikey();
    let motion = Gesture::new()
        .stroke(0.02, 0.03, 0.05, 0.04, 9.5e-3)
        .hold(0.05)
        .positions(RATE_HZ);
    let rest = device.word_of_position(0.0).0;
    let word = |tick: usize, key: usize| match tick.checked_sub(300 + 17 * key) {
        Some(at) => device.word_of_position(motion[at % motion.len()]).0,
        None => rest,
    };
    (0..ticks)
        .map(|tick| (std::array::from_fn(|key| word(tick, key)), Fault::None))
        .collect()
}

fn passive(setup: Setup) -> Setup {
    Setup {
        passivity: Some(Passivity {
            credit: 1 << 22,
            past: 3,
            damping: 300,
        }),
        ..setup
    }
}

/// A sensor at each rail, one that stands still while its key is pushed, a tick that is missed.
fn with_faults(mut story: Story, pushed: i32) -> Story {
    for (tick, (words, fault)) in story.iter_mut().enumerate() {
        match tick {
            700.. => (words[5], words[6]) = (65_535, 0),
            _ => {}
        }
        if tick >= 500 {
            words[9] = 30_000;
        }
        *fault = match tick {
            1500 => Fault::Missed,
            _ if tick > 1900 && tick % 97 == 0 => Fault::Live([0, pushed][tick / 97 % 2]),
            _ => Fault::None,
        };
    }
    story
}

const MISSED: u32 = 1;
const RAIL: u32 = 2;
const FROZEN: u32 = 4;
const HOT: u32 = 8;

#[test]
fn faults_are_guarded_against_as_in_an_image() {
    let compiled = compiled(TEXT);
    // 2 N of 8.
    let pushed = compiled.lowered.kernel.lives[0].range.high as i32 / 4;
    let story = with_faults(strokes(4500), pushed);
    for kind in [BoardKind::Rp2350, BoardKind::Rp2040] {
        let setup = match kind {
            BoardKind::Rp2350 => passive(setup()),
            _ => setup(),
        };
        let (image, _) = agree(kind, &compiled, &setup, &story);
        let [missed, faults, faulty] = image.told;
        assert_eq!((missed, faults, faulty), (1, MISSED | RAIL | FROZEN, 9));
        let last = image.drives.last().expect("ticks");
        assert_eq!([5, 6, 9].map(|key| last[key]), [0; 3], "they are free");
        assert!(last.iter().filter(|word| **word != 0).count() > 30);
    }
}

#[test]
fn energy_is_limited_as_in_an_image() {
    let compiled = compiled(TEXT);
    let story = strokes(2500);
    let (limited, _) = agree(BoardKind::Rp2350, &compiled, &passive(setup()), &story);
    let (free, _) = of_image(BoardKind::Rp2350, &compiled, &setup(), &story);
    let rows = limited.drives.iter().zip(&free.drives);
    let held = rows.filter(|(limited, free)| limited != free).count();
    assert!(held > 500, "keys are held back in {held} ticks");
}

#[test]
fn a_hot_motor_is_held_as_in_an_image() {
    let compiled = compiled(TEXT);
    let motor = Motor {
        rated: 2048,
        peak_ms: 4,
        newton: NEWTON,
    };
    let setup = Setup {
        ports: vec![guarded(motor)],
        ..setup()
    };
    let mut story = strokes(8000);
    for (tick, (words, _)) in story.iter_mut().enumerate() {
        // Down for a while, then at rest until it has cooled.
        let held = if (1000..2500).contains(&tick) {
            62_000
        } else {
            13_000
        };
        words[30] = held + (tick % 8) as u16;
    }
    let (image, _) = agree(BoardKind::Rp2350, &compiled, &setup, &story);
    assert_eq!(image.told[1], HOT);
    let of_key = |tick: usize| i32::from(image.drives[tick][30]).abs();
    assert!(
        of_key(2400) <= 2048 && of_key(1010) > 2 * 2048,
        "{}",
        of_key(1010)
    );
    assert!(of_key(7900) > 200, "it has cooled: {}", of_key(7900));
}
