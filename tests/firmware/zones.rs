//! A program whose keys play different instruments, several of them on one core.

use crate::rig::{KEYS, RATED, Rig, kernel, midi, setup};
use crate::switch::{ask, key_plays, ramp, words};
use whippen_compiler::firmware::{Instrument, Midi, Passivity, Setup, ZoneCode};
use whippen_compiler::firmware::{core_block, key_guard};
use whippen_compiler::kernel::{Interp, Kernel, parse};
use whippen_compiler::keyboard::{InstrumentId, Program};
use whippen_compiler::modes::{Modes, specialize};

/// Keys of each core: not half and half, and both begin or end in the midst of a zone.
const CORES: [u32; 2] = [50, 38];
/// The program of zones: how many keys, which instrument.
const SPLIT: [(u32, usize); 3] = [(20, 0), (40, 1), (28, 0)];

/// The instruments: an organ, a spring.
fn kernels() -> [Kernel; 2] {
    ["hammond.whip", "virtual-spring.whip"].map(kernel)
}

/// A board with the spring on all keys, and with zones.
fn rig(kernels: &[Kernel; 2], programs: &[&[(u32, usize)]], setup: &Setup) -> Rig {
    let modes: Vec<Modes> = kernels
        .iter()
        .map(|kernel| specialize(kernel, 4000))
        .collect();
    let notes: Vec<Midi> = kernels.iter().map(midi).collect();
    let instruments: Vec<Instrument> = modes
        .iter()
        .zip(&notes)
        .map(|(modes, midi)| Instrument {
            modes,
            places: &[],
            midi,
            parts: None,
        })
        .collect();
    let program = |zones: &&[(u32, usize)]| {
        let id = |at: usize| InstrumentId(at as u32);
        Program::of_zones("zones", zones.iter().map(|&(keys, at)| (keys, id(at))))
    };
    Rig::of_programs(programs.iter().map(program).collect(), &instruments, setup)
}

fn divided(rate_hz: u32) -> Setup {
    Setup {
        keys: CORES.to_vec(),
        rate_hz: rate_hz.into(),
        ..setup()
    }
}

fn place(key: usize) -> (usize, usize) {
    let first = CORES[0] as usize;
    if key < first {
        (0, key)
    } else {
        (1, key - first)
    }
}

/// Which instrument a key has.
fn instrument(zones: &[(u32, usize)], key: usize) -> usize {
    let mut from = 0;
    let zone = zones.iter().find(|(keys, _)| {
        from += *keys as usize;
        key < from
    });
    zone.expect("every key is in a zone").1
}

/// How many ticks a program has played, by core.
fn played(rig: &Rig, program: usize) -> [u32; 2] {
    let first = |core: usize| &rig.code(program, core).zones[0];
    [0, 1].map(|core| rig.word(rig.symbol(&format!("{}_state", first(core).name)) + 12))
}

/// From when force is whole, drive words are those of each key's instrument alone, begun in its
/// turn.
fn plays(
    kernels: &[Kernel; 2],
    zones: &[(u32, usize)],
    begins: [usize; 2],
    words: &[u16],
    drives: &[i16],
    ticks: std::ops::Range<usize>,
) {
    let mut compared = [0; 2];
    for key in 0..KEYS {
        let (core, own) = place(key);
        let which = instrument(zones, key);
        compared[which] += key_plays(
            &kernels[which],
            key,
            begins[core] + own,
            words,
            drives,
            ticks.clone(),
        );
    }
    assert!(
        zones.iter().all(|(_, which)| compared[*which] > 1000),
        "{compared:?} words say something"
    );
}

/// From all keys alike to zones and back, at a rate that leaves little time.
fn switches(setup: &Setup) {
    let kernels = kernels();
    let plain: &[(u32, usize)] = &[(88, 1)];
    let rate_hz = setup.rate_hz;
    let mut rig = rig(&kernels, &[plain, &SPLIT], setup);
    let segments = |program: usize, core: usize| -> Vec<(usize, u32, u32)> {
        rig.code(program, core)
            .zones
            .iter()
            .map(|zone| (zone.of.zone.index(), zone.first_on_core, zone.keys()))
            .collect()
    };
    assert_eq!(segments(1, 0), [(0, 0, 20), (1, 20, 30)]);
    assert_eq!(segments(1, 1), [(1, 0, 10), (2, 10, 28)]);
    assert_eq!(
        [segments(0, 0), segments(0, 1)],
        [vec![(0, 0, 50)], vec![(0, 0, 38)]]
    );
    let (first, second, third) = (2000, 4000, 6000);
    let words = words(rate_hz, 0..third);
    let mut drives = rig.play(words[..first * KEYS].iter().copied());
    ask(&mut rig, 1, 1);
    drives.extend(rig.play(words[first * KEYS..second * KEYS].iter().copied()));
    let begins = |rig: &Rig, program: usize, before: [u32; 2]| {
        let now = played(rig, program);
        [0, 1].map(|core| (rig.block(core, core_block::TICK) - (now[core] - before[core])) as usize)
    };
    plays(
        &kernels,
        &SPLIT,
        begins(&rig, 1, [0; 2]),
        &words,
        &drives,
        first + ramp(rate_hz)..second - 2,
    );
    let before = played(&rig, 0);
    ask(&mut rig, 2, 0);
    drives.extend(rig.play(words[second * KEYS..].iter().copied()));
    plays(
        &kernels,
        plain,
        begins(&rig, 0, before),
        &words,
        &drives,
        second + ramp(rate_hz)..third - 2,
    );
    assert_eq!(rig.converter().overruns(), 0);
    for core in [0, 1] {
        assert_eq!(
            (
                rig.block(core, core_block::MISSED),
                rig.block(core, core_block::FAULTS)
            ),
            (0, 0)
        );
    }
}

#[test]
fn every_key_plays_as_its_instrument_alone_and_no_tick_is_missed() {
    switches(&divided(24_000));
}

/// A credit that nobody uses up changes no word.
#[test]
fn energy_is_watched_across_zones() {
    switches(&Setup {
        passivity: Some(Passivity {
            credit: 1 << 30,
            past: 5,
            damping: 300,
        }),
        ..divided(20_000)
    });
}

/// The same at the start, and twice: what begins anew begins from its first states.
#[test]
fn zones_may_be_the_first_program() {
    let kernels = kernels();
    let mut rig = rig(&kernels, &[&SPLIT], &divided(11_025));
    let ticks = 1200;
    let words = words(11_025, 0..ticks);
    let drives = rig.play(words.iter().copied());
    let begins = [0, 1]
        .map(|core| rig.block(core, core_block::TICK) as usize - played(&rig, 0)[core] as usize);
    let (mut compared, ramp) = (0, ramp(11_025) + 50);
    for key in 0..KEYS {
        let mut interp = Interp::new(&kernels[instrument(&SPLIT, key)], 1).expect("verifies");
        interp.init(&[words[key]]);
        for tick in begins[place(key).0]..ticks - 2 {
            let mut want = [0];
            interp.tick(&[words[tick * KEYS + key]], &mut want);
            if tick > ramp {
                assert_eq!(
                    drives[tick * KEYS + key],
                    want[0],
                    "key {key}, tick {tick}, {begins:?}"
                );
                compared += usize::from(want[0] != 0);
            }
        }
    }
    assert!(compared > 10_000, "{compared}");
}

/// A sensor at its rail frees its key, in the second zone of either core, and no other.
#[test]
fn a_key_of_another_zone_goes_free() {
    let kernels = kernels();
    let mut rig = rig(&kernels, &[&SPLIT], &divided(11_025));
    let broken = [35, 75];
    let row = |faulty: bool| {
        (0..KEYS).map(move |key| {
            if faulty && broken.contains(&key) {
                65_535
            } else {
                20_000 + 100 * key as u16
            }
        })
    };
    rig.play((0..500).flat_map(|_| row(false)));
    let drives = rig.play((0..600).flat_map(|_| row(true)));
    let last = &drives[drives.len() - KEYS..];
    for (key, &word) in last.iter().enumerate() {
        let (core, own) = place(key);
        let ceiling =
            rig.word(rig.block(core, core_block::GUARDS) + 16 * own as u32 + key_guard::CEILING);
        let zone = rig
            .code(0, core)
            .zones
            .iter()
            .rfind(|zone| zone.first_on_core as usize <= own)
            .expect("a zone");
        let gain = zone
            .layout()
            .gain(own as u32 - zone.first_on_core)
            .expect("a gain");
        let gain = rig.word(rig.symbol(&format!("{}_state", zone.name)) + gain);
        let free = broken.contains(&key);
        assert_eq!(
            (ceiling, gain),
            if free { (0, 0) } else { (65_536, 65_536) },
            "key {key}"
        );
        assert_eq!(word == 0, free, "key {key}: {word}");
    }
    for (core, own) in broken.map(place) {
        assert_eq!(
            (
                rig.block(core, core_block::FAULTS),
                rig.block(core, core_block::FAULTY)
            ),
            (2, own as u32),
            "core {core}"
        );
    }
}

/// Force comes back after the start in every zone; a motor that is hot is held back, whatever zone
/// its key is in, and no other.
#[test]
fn gains_follow_in_every_zone() {
    let kernels = kernels();
    let mut rig = rig(&kernels, &[&SPLIT], &divided(11_025));
    rig.play(vec![0x4000; 400 * KEYS]);
    let gains = |rig: &Rig| -> Vec<u32> {
        let of = |zone: &ZoneCode| -> Vec<u32> {
            let state = rig.symbol(&format!("{}_state", zone.name));
            (0..zone.keys())
                .map(|key| rig.word(state + zone.layout().gain(key).expect("a gain")))
                .collect()
        };
        rig.programs[0].zones().flat_map(of).collect()
    };
    assert_eq!(gains(&rig), vec![65_536; KEYS]);
    let hot = [7, 49, 59, 60];
    for (core, own) in hot.map(place) {
        let guard = rig.block(core, core_block::GUARDS) + 16 * own as u32;
        rig.set(guard, (1 << 30) - 1);
    }
    rig.play(vec![0x4000; 100 * KEYS]);
    for (key, gain) in gains(&rig).into_iter().enumerate() {
        let (core, own) = place(key);
        let ceiling =
            rig.word(rig.block(core, core_block::GUARDS) + 16 * own as u32 + key_guard::CEILING);
        assert_eq!(gain, ceiling, "key {key}");
        assert_eq!(
            ceiling,
            if hot.contains(&key) {
                2 * RATED
            } else {
                65_536
            },
            "key {key}"
        );
    }
}

/// What is set per key goes to the key, whatever zone and core it is in.
#[test]
fn values_per_key_follow_the_keyboard() {
    let values: Vec<String> = (0..KEYS).map(|key| (100 * key).to_string()).collect();
    let text = format!(
        "kernel keyed @11025 {{
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  keyed weight: i32 [0..9000] = {{ {} }}
  tick {{
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [0..9000] = keyed weight
    v3: i32 [-32768..32767] = sub v0 v1
    v4: i32 [-41768..32767] = sub v3 v2
    v5: i32 [-32768..-32768] = const -32768
    v6: i32 [-32768..32767] = max v4 v5
    out f v6
  }}
}}
",
        values.join(", ")
    );
    let keyed = parse(&text).unwrap_or_else(|error| panic!("{error:?}"));
    let kernels = [keyed, kernel("virtual-spring.whip")];
    let modes = kernels.each_ref().map(Modes::single);
    let notes = kernels.each_ref().map(midi);
    let instruments = [0, 1].map(|at: usize| Instrument {
        modes: &modes[at],
        places: &[],
        midi: &notes[at],
        parts: None,
    });
    let zones = [(9, 0), (21, 1), (58, 0)].map(|(keys, at)| (keys, InstrumentId(at)));
    let program = Program::of_zones("zones", zones);
    let mut rig = Rig::of_programs(vec![program], &instruments, &divided(11_025));
    let drives = rig.play(vec![40_000; 500 * KEYS]);
    let last = &drives[drives.len() - KEYS..];
    for (key, &word) in last
        .iter()
        .enumerate()
        .filter(|(key, _)| !(9..30).contains(key))
    {
        assert_eq!(
            i32::from(word),
            40_000 - 32_768 - 100 * key as i32,
            "key {key}"
        );
    }
}

/// Notes have the keyboard's numbers, in whatever zone their keys are; they end with their program.
#[test]
fn notes_of_all_zones_are_sent() {
    let kernels = kernels();
    let mut rig = rig(&kernels, &[&SPLIT, &[(88, 1)]], &divided(11_025));
    let held = [3, 19, 61, 87];
    let row = |down: bool| {
        (0..KEYS).map(move |key| {
            if down && held.contains(&key) {
                40_000
            } else {
                3000
            }
        })
    };
    rig.play((0..400).flat_map(|_| row(false)));
    rig.play((0..600).flat_map(|_| row(true)));
    let sent = rig.sent();
    let mut on: Vec<u8> = sent
        .chunks(3)
        .filter(|message| message[0] == 0x90)
        .map(|message| message[1])
        .collect();
    on.sort_unstable();
    assert_eq!(
        (on, sent.len()),
        (held.map(|key| 21 + key as u8).to_vec(), 12)
    );
    ask(&mut rig, 1, 1);
    rig.play((0..600).flat_map(|_| row(true)));
    let sent = rig.sent();
    let mut off: Vec<u8> = sent
        .chunks(3)
        .filter(|message| message[0] == 0x80)
        .map(|message| message[1])
        .collect();
    off.sort_unstable();
    assert_eq!(
        (off, sent.len()),
        (held.map(|key| 21 + key as u8).to_vec(), 12)
    );
}

/// Each zone has parameters of its own, numbered through: one that a core has not is the other's
/// alone.
#[test]
fn zones_have_parameters_of_their_own() {
    let kernels = kernels();
    let mut rig = rig(&kernels, &[&[(88, 1)], &SPLIT], &divided(11_025));
    rig.play(vec![20_000; 100 * KEYS]);
    let [organ, spring] = [0, 1].map(|at: usize| kernels[at].lives.len() as u32);
    assert!(organ > 0);
    // The plain program's first, then those of the first zone, of the second, of the third.
    let third = spring + organ + spring;
    let mailbox = rig.symbol("mailbox");
    let value = kernels[0].lives[0].range.high as u32;
    rig.set(mailbox + 4, third);
    rig.set(mailbox + 8, value);
    rig.set(mailbox, 1);
    rig.play(vec![20_000; 100 * KEYS]);
    assert_eq!((rig.word(mailbox + 12), rig.word(mailbox + 16)), (1, 0));
    let live = |core: usize, zone: usize| {
        let zone = &rig.code(1, core).zones[zone];
        rig.word(
            rig.symbol(&format!("{}_state", zone.name))
                + zone.layout().live_param(0).expect("a place"),
        )
    };
    let first = kernels[0].lives[0].init as u32;
    assert_ne!(first, value);
    assert_eq!(
        (live(0, 0), live(1, 1)),
        (first, value),
        "the first zone keeps its own"
    );
}
