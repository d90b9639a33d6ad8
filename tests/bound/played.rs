//! Whole boards that play: noise, strokes, gestures, recordings; both cores at once, then one
//! alone.

use whippen_compiler::budget::TickHandlerBound;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;

use crate::board::{Board, Watch};
use crate::common;
use crate::image::{Image, instruments};

/// Ticks of each instrument and source of motion, where the environment does not say.
const TICKS: usize = 600;
/// Ticks in which the cores come up: nothing is played yet.
const START: usize = 60;
/// Keys of all cores: so many always fit.
const KEYS: usize = 9;

fn ticks() -> usize {
    whippen_need::count("WHIPPEN_TICKS", TICKS)
}

/// Words of all keys, tick by tick.
type Source = Box<dyn FnMut(usize) -> Vec<u16>>;

/// A motion that all keys play, each from another place on and at another speed.
fn motion(words: Vec<u16>, keys: usize) -> Source {
    let at = move |tick: usize, key: usize| words[(tick * (1 + key) + key * 7919) % words.len()];
    Box::new(move |tick| (0..keys).map(|key| at(tick, key)).collect())
}

/// Any word at any time; or, key by key, words that stay near the one before.
fn noise(seed: u64, keys: usize) -> Source {
    let mut rng = Rng::new(seed);
    let mut last = vec![0_u16; keys];
    Box::new(move |_| {
        for (key, word) in last.iter_mut().enumerate() {
            let span = 1 << (2 * key).min(16);
            let near = rng.below(span) as i32 - span as i32 / 2;
            *word = if key < 3 {
                rng.next() as u16
            } else {
                i32::from(*word).wrapping_add(near).clamp(0, 65_535) as u16
            };
        }
        last.clone()
    })
}

/// Strokes of random speed, from anywhere to anywhere, with rests between them.
fn strokes(seed: u64, keys: usize) -> Source {
    let mut rng = Rng::new(seed);
    let mut state = vec![(0_i64, 0_i64, 0_u32); keys];
    Box::new(move |_| {
        for (word, speed, left) in &mut state {
            if *left == 0 {
                let to = rng.pick(&[0, 6000, 30_000, 40_000, 55_000, 65_535]);
                let longest = 1 << rng.below(11);
                *left = 1 + rng.below(longest) as u32;
                *speed = if rng.chance(1, 5) {
                    0
                } else {
                    (to - *word) / i64::from(*left)
                };
            }
            *left -= 1;
            *word = (*word + *speed).clamp(0, 65_535);
        }
        state.iter().map(|(word, _, _)| *word as u16).collect()
    })
}

/// Every source of motion there is, by name.
fn sources(compiled: &Compiled, keys: usize) -> Vec<(&'static str, Source)> {
    let mut all: Vec<(&str, Source)> = vec![
        ("noise", noise(11, keys)),
        ("strokes", strokes(12, keys)),
        ("gesture", motion(common::gesture_words(compiled), keys)),
    ];
    if !Device::of(&compiled.model).turns()
        && let Some(positions) = common::recording()
    {
        all.push(("recording", motion(common::words(&positions), keys)));
    }
    all
}

/// Nobody took longer than a frame's bounds say.
fn holds(
    image: &Image,
    watch: &Watch,
    core: usize,
    frame: &TickHandlerBound,
    visits: u64,
) -> (u64, u64) {
    for ((mode, bound), &observed) in frame.zones[0].tick.modes.iter().zip(&watch.keys[core]) {
        let allowed = bound.cycles_max + visits;
        assert!(
            observed <= allowed,
            "{}: {mode}: {observed} > {allowed}",
            image.name()
        );
    }
    let (observed, bound) = (watch.frames[core], frame.handler.cycles_max + visits);
    assert!(
        observed <= bound,
        "{}: frame of core {core}: {observed} > {bound}",
        image.name()
    );
    let longest = watch.keys[core].iter().max().copied().unwrap_or(0);
    (longest, observed)
}

/// Plays every source on a board, with both cores and then with one, and compares with the bounds;
/// how many ticks of a key.
fn play(kind: BoardKind, compiled: Compiled, keys: usize) -> u64 {
    play_image(&Image::on(kind, compiled, keys as u32), keys)
}

fn play_image(image: &Image, keys: usize) -> u64 {
    let mut sources = sources(&image.compiled, keys);
    let mut board = Board::new(image);
    let (mut both, mut alone) = (Watch::new(image), Watch::new(image));
    board.play(sources[0].1(0).repeat(START), false, &mut Watch::new(image));
    for (_, source) in &mut sources {
        board.play(
            (0..ticks()).flat_map(&mut *source).collect(),
            false,
            &mut both,
        );
    }
    board.has_stack_left();
    board.leave_core0_alone();
    for (_, source) in &mut sources {
        board.play(
            (0..ticks()).flat_map(&mut *source).collect(),
            true,
            &mut alone,
        );
    }
    let contended = image.cores.iter().enumerate().map(|(core, bounds)| {
        let visits = image.visits(core);
        let (key, frame) = holds(image, &both, core, &bounds.contended, visits);
        assert!(both.frames_seen[core] > 0, "it played");
        format!(
            "key {key} of {}, frame {frame} of {}",
            bounds.contended.key_cycles_max(),
            bounds.contended.handler.cycles_max
        )
    });
    let contended: Vec<String> = contended.collect();
    let frame = &image.cores[0].alone;
    let (key, observed) = holds(image, &alone, 0, frame, 0);
    assert!(
        alone.frames_seen[0] as usize + 4 >= sources.len() * ticks(),
        "it played"
    );
    println!(
        "{} on {}: alone: key {key} of {}, frame {observed} of {}; contended: {}",
        image.name(),
        image.board.name,
        frame.key_cycles_max(),
        frame.handler.cycles_max,
        contended.join("; ")
    );
    if image.whole.passes_midi {
        assert!(board.passed() > 100, "{} bytes go on", board.passed());
    }
    if image.whole.monitored {
        assert!(
            board.answered > 40,
            "{} requests are answered",
            board.answered
        );
    }
    both.keys_seen + alone.keys_seen
}

#[test]
fn nobody_takes_longer_than_the_bound() {
    let keys: u64 = instruments()
        .into_iter()
        .map(|compiled| play(BoardKind::Rp2350, compiled, KEYS))
        .sum();
    println!("{keys} ticks of a key");
}

/// With the monitor at work: captures that go on, its answers between ticks.
#[test]
fn nor_with_the_monitor() {
    let known = |name: &str| {
        let mut all = instruments().into_iter();
        all.find(|compiled| compiled.model.name == name)
    };
    for (kind, name, keys) in [
        (BoardKind::Rp2350, "grand_piano", KEYS),
        (BoardKind::Rp2350, "virtual_spring", 90),
        (BoardKind::Rp2040, "virtual_spring", KEYS),
    ] {
        let compiled = known(name).expect("it is bundled");
        play_image(&Image::monitored(kind, compiled, keys as u32), keys);
    }
}

/// One of several chips, whose serial port is never silent: control changes, some of them with
/// their low bits ahead, are done and sent on.
#[test]
fn nor_where_midi_is_passed_on() {
    for (kind, name, keys) in [
        (BoardKind::Rp2350, "grand_piano", KEYS),
        (BoardKind::Rp2350, "virtual_spring", 90),
        (BoardKind::Rp2040, "virtual_spring", KEYS),
        (BoardKind::Stm32f4, "virtual_spring", KEYS),
    ] {
        let mut all = instruments().into_iter();
        let compiled = all.find(|compiled| compiled.model.name == name);
        let image = Image::passing(kind, compiled.expect("it is bundled"), keys as u32);
        play_image(&image, keys);
    }
}

/// So many keys that what they keep has no room near a core: their code lies there.
#[test]
fn nor_with_code_near_the_core() {
    let near = [("virtual_spring", 90), ("hammond", 90), ("snap_dome", 60)];
    for compiled in instruments() {
        let name = compiled.model.name.clone();
        let Some((_, keys)) = near.iter().find(|(own, _)| *own == name) else {
            continue;
        };
        play(BoardKind::Rp2350, compiled, *keys);
    }
}

/// The instruments that `docs/bars.md` counts for all boards.
const EVERYWHERE: [&str; 5] = [
    "virtual_spring",
    "baker",
    "hammond",
    "harpsichord",
    "grand_piano",
];

#[test]
fn nor_on_cores_of_armv6_m() {
    let known = instruments()
        .into_iter()
        .filter(|compiled| EVERYWHERE.contains(&compiled.model.name.as_str()));
    let played: Vec<u64> = known
        .map(|compiled| play(BoardKind::Rp2040, compiled, 2))
        .collect();
    assert_eq!(played.len(), EVERYWHERE.len());
    println!("{} ticks of a key", played.iter().sum::<u64>());
}

#[test]
fn nor_on_a_cortex_m4() {
    let keys: u64 = instruments()
        .into_iter()
        .map(|compiled| {
            // So many keys of four bodies do not fit in a tick.
            let keys = match compiled.model.name.as_str() {
                "grand_action" => 5,
                _ => KEYS,
            };
            play(BoardKind::Stm32f4, compiled, keys)
        })
        .sum();
    println!("{keys} ticks of a key");
}

/// A key that takes little, and is heard on both sides.
const HEARD: &str = "instrument heard {
    sense x: length in 0 mm .. 10 mm
    live param loud = 50 m^-1 in 0 m^-1 .. 100 m^-1
    force spring = 80 N/m * x
    sound a on left = loud * x
    sound b on right = -0.5
}";

#[test]
fn nor_where_keys_are_heard() {
    let plucked = common::PROGRAMS
        .iter()
        .find(|(name, _)| *name == "sound.whip");
    let (_, plucked) = plucked.expect("a program");
    for (kind, text, keys) in [
        (BoardKind::Rp2350, *plucked, 9),
        (BoardKind::Stm32f4, *plucked, 5),
        (BoardKind::Rp2350, HEARD, 60),
        (BoardKind::Stm32f4, HEARD, 30),
        (BoardKind::Rp2040, HEARD, 4),
    ] {
        let model = common::compiled("heard.whip", text, &[]).remove(0).model;
        let scales = Device::of(&model).scales();
        let compiled = compile(model, scales, false).unwrap_or_else(|e| panic!("{e:?}"));
        play(kind, compiled, keys);
    }
}

/// An image that is late still plays its keys when the converter moves the words of the next tick:
/// each of them makes an access wait for a cycle at most, and that is all that the bound leaves
/// out.
#[test]
fn a_late_image_waits_for_the_converter_besides() {
    let mut all = instruments();
    all.retain(|compiled| compiled.model.name == "grand_action");
    let image = Image::new(all.remove(0), 24);
    let (mut board, mut watch) = (Board::new(&image), Watch::new(&image));
    let words = image.words_each_way();
    let mut source = noise(11, words);
    board.play(source(0).repeat(START), false, &mut Watch::new(&image));
    let all = (0..4 * ticks()).flat_map(&mut *source).collect();
    board.play(all, false, &mut watch);
    assert!(watch.keys_seen > 0, "it played");
    for (core, bounds) in image.cores.iter().enumerate() {
        let bounds = &bounds.contended;
        assert!(bounds.cycles_max > image.period, "it is late");
        let besides = image.visits(core) + 2 * words as u64;
        let (key, frame) = holds(&image, &watch, core, bounds, besides);
        println!("core {core}, late: key {key}, frame {frame}");
    }
}

/// A board's text of one's own, whose loop runs another number of times in each tick.
#[test]
fn nor_with_texts_of_ones_own() {
    let text = include_str!("../../compiler/firmware/src/converter.s");
    let own = text.replace(
        "\nboard_end:\n",
        "\nboard_end:
        ldr     r1, =CONVERTER
        ldr     r0, [r1, #0x1c]
        movs    r1, #63
        ands    r0, r1
        adds    r0, #1
@! rounds 64
1:      subs    r0, #1
        bne     1b
",
    );
    for kind in BoardKind::ALL {
        let images = [["converter.s", text], ["converter.s", &own]].map(|own| {
            let organ = instruments()
                .into_iter()
                .find(|own| own.model.name == "hammond");
            Image::with_text(kind, organ.expect("it is bundled"), KEYS as u32, own)
        });
        let frames = images.each_ref().map(|image| {
            let (mut board, mut watch) = (Board::new(image), Watch::new(image));
            let mut source = noise(13, KEYS);
            board.play(source(0).repeat(START), false, &mut Watch::new(image));
            let words = (0..4 * ticks()).flat_map(&mut *source).collect();
            board.play(words, false, &mut watch);
            board.has_stack_left();
            let cores = image.cores.iter().enumerate();
            let frames = cores.map(|(core, bounds)| {
                let (_, frame) = holds(image, &watch, core, &bounds.contended, image.visits(core));
                [frame, bounds.contended.handler.cycles_max]
            });
            frames.collect::<Vec<_>>()
        });
        println!("{}: frame, of: {frames:?}", kind.name());
        for (usual, own) in frames[0].iter().zip(&frames[1]) {
            assert!(own[0] > usual[0] + 100, "{frames:?}");
        }
    }
}

#[test]
fn instruments_with_several_ports() {
    for file in ["two-axis-spring.whip", "pad.whip", "dial-and-lever.whip"] {
        let found = common::PROGRAMS.iter().find(|(name, _)| *name == file);
        let (_, text) = found.expect("a program");
        let observed = common::compiled(file, text, &[]).remove(0);
        for kind in BoardKind::ALL {
            let (model, device) = (observed.model.clone(), Device::of(&observed.model));
            let compiled =
                compile(model, device.scales(), false).unwrap_or_else(|e| panic!("{e:?}"));
            let image = Image::on(kind, compiled, 1);
            let mut board = Board::new(&image);
            let mut watch = Watch::new(&image);
            let words = image.words_each_way();
            let mut all: [Source; 2] = [noise(11, words), strokes(12, words)];
            board.play(all[0](0).repeat(START), false, &mut Watch::new(&image));
            for source in &mut all {
                let words = (0..4 * ticks()).flat_map(&mut *source).collect();
                board.play(words, false, &mut watch);
            }
            board.has_stack_left();
            assert_eq!(image.cores.len(), 1);
            let (key, frame) = holds(&image, &watch, 0, &image.cores[0].contended, 0);
            assert!(
                watch.frames_seen[0] as usize + 4 >= 8 * ticks(),
                "it played"
            );
            println!("{file} on {}: key {key}, frame {frame}", kind.name());
        }
    }
}
