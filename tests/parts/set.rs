//! Live values that are set while parts play: each is one word of one part, so that all parts have
//! the same one in a tick.

use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;

use crate::rig::{Image, Rig};
use crate::{WEIGHTS, compiled};

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
    let value = compiled.lowered.kernel.lives[0].range.high as u32;
    let image = Image::divided(compiled, BoardKind::Rp2350, division);
    let mut rig = Rig::new(&image, &[]);
    let mut words = rig.play((0..set).map(row));
    if set < TICKS {
        let mailbox = image.symbol("mailbox");
        rig.set(mailbox + 4, 0);
        rig.set(mailbox + 8, value);
        rig.set(mailbox, 1);
        words.extend(rig.play((set..TICKS).map(row)));
        let [done, outcome] = [12, 16].map(|at| rig.word(mailbox + at));
        assert_eq!([done, outcome], [1, 0], "{division:?}");
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
