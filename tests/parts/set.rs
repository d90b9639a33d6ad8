//! Live values that are set while parts play: each is one word of one part, so that all parts have
//! the same one in a tick.

use whippen_compiler::firmware::MEET;
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;

use crate::rig::{Image, Rig};
use crate::{WEIGHTS, bent_violin, bow, compiled};

/// Ticks per second at which an RP2350 has time for the weights.
const FAST_HZ: u32 = 22_050;
/// Ticks, and that in which a value is set.
const TICKS: usize = 200;
const SET: usize = 100;

fn row(tick: usize) -> Vec<u16> {
    let word = |period: f64| (32_000.0 + 25_000.0 * (tick as f64 / period).sin()) as u16;
    vec![word(60.0), word(95.0)]
}

/// The words of a division whose first live value is set to its highest before a tick.
fn played(compiled: &Compiled, division: &[usize], set: usize) -> Vec<Vec<i16>> {
    let image = Image::divided(compiled, BoardKind::Rp2350, division);
    played_by(&image, &[], row, [0, high(compiled, 0)], set)
}

/// The highest word of a live value.
fn high(compiled: &Compiled, live: u32) -> u32 {
    compiled.lowered.kernel.lives[live as usize].range.high as u32
}

/// The words of an image, changed so, when a live value is set before a tick.
fn played_by(
    image: &Image,
    changed: &[(u32, [u16; 2])],
    row: fn(usize) -> Vec<u16>,
    [live, value]: [u32; 2],
    set: usize,
) -> Vec<Vec<i16>> {
    let mut rig = Rig::new(image, changed);
    let mut words = rig.play((0..set).map(row));
    if set < TICKS {
        let mailbox = image.symbol("mailbox");
        rig.set(mailbox + 4, live);
        rig.set(mailbox + 8, value);
        rig.set(mailbox, 1);
        words.extend(rig.play((set..TICKS).map(row)));
        let [done, outcome] = [12, 16].map(|at| rig.word(mailbox + at));
        assert_eq!([done, outcome], [1, 0]);
    }
    words
}

#[test]
fn a_value_that_is_set_is_that_of_all_parts() {
    let compiled = compiled(WEIGHTS, FAST_HZ);
    let alone = [0; 5];
    // It is looked for between ticks, which may be before this one or behind it.
    let expected = [0, 1].map(|late| played(&compiled, &alone, SET + late));
    assert!(expected[0] != played(&compiled, &alone, TICKS), "is felt");
    for division in [[0, 1, 0, 1, 0], [0, 0, 1, 1, 0]] {
        let found = played(&compiled, &division, SET);
        assert!(expected.contains(&found), "{division:?}");
    }
}

/// Values that glide are core 1's, which does with them what no sensor leads to while core 0 runs
/// the head. Here that takes longer, so core 0 waits.
#[test]
fn a_value_that_glides_early_is_that_of_all_parts() {
    let text = bent_violin("-7.1104 * grip", "grip", "-7.1104 * bent60");
    let compiled = compiled(&text, FAST_HZ);
    let lives = &compiled.lowered.kernel.lives;
    let grip = lives.iter().position(|live| live.name == "grip");
    let grip = grip.expect("a live value") as u32;
    let set = [grip, high(&compiled, grip)];
    let alone = Image::divided(&compiled, BoardKind::Rp2350, &[0; 6]);
    let expected = [0, 1].map(|late| played_by(&alone, &[], bow, set, SET + late));
    assert!(
        expected[0] != played_by(&alone, &[], bow, set, TICKS),
        "is felt"
    );
    let early = Image::of(&compiled, BoardKind::Rp2350);
    assert!(early.built.cut().expect("parts").has_early());
    assert!(expected.contains(&played_by(&early, &[], bow, set, SET)));
    // A core 0 that does not wait: cmp r2, r1 becomes cmp r1, r1.
    let fault = [(early.symbol(MEET) + 2, [0x428a, 0x4289])];
    assert!(!expected.contains(&played_by(&early, &fault, bow, set, SET)));
}
