//! Which core runs what changes no bit; and what there is against a core that is late.

use whippen_compiler::firmware::{EARLY, POLL, Role, WAIT, core_block};
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;

use crate::rig::{Image, Rig};
use crate::{SLOW_HZ, WEIGHTS, bent_violin, bow, compiled};

/// Ticks per second at which an RP2350 has time for the weights.
const FAST_HZ: u32 = 22_050;

/// Rows of sensor words for so many ticks.
fn rows(ticks: usize) -> impl Iterator<Item = Vec<u16>> {
    let word =
        |tick: usize, period: f64| (32_000.0 + 25_000.0 * (tick as f64 / period).sin()) as u16;
    (0..ticks).map(move |tick| vec![word(tick, 60.0), word(tick, 95.0)])
}

fn played(image: &Image, changed: &[(u32, [u16; 2])]) -> Vec<Vec<i16>> {
    Rig::new(image, changed).play(rows(150))
}

fn weights() -> Compiled {
    compiled(WEIGHTS, FAST_HZ)
}

#[test]
fn every_division_gives_the_same_words() {
    let compiled = weights();
    let mut first: Option<Vec<Vec<i16>>> = None;
    for chosen in [0, 7, 6, 1_usize] {
        // Head, three members, tail.
        let division = [0, chosen & 1, chosen >> 1 & 1, chosen >> 2, 0];
        let image = Image::divided(&compiled, BoardKind::Rp2350, &division);
        let roles = image.built.cut().expect("parts").parts.iter();
        let roles: Vec<Role> = roles.map(|part| part.role).collect();
        assert_eq!(roles[0], Role::Head);
        let words = played(&image, &[]);
        assert!(words.iter().flatten().filter(|word| **word != 0).count() > 100);
        match &first {
            None => first = Some(words),
            Some(first) => assert!(*first == words, "{division:?}"),
        }
    }
}

/// Two members are core 1's, so that it is the slower one.
fn slow_helper() -> Image {
    Image::divided(&weights(), BoardKind::Rp2350, &[0, 0, 1, 1, 0])
}

/// Without the wait the tail takes words of the tick before: what the wait is for.
#[test]
fn a_core_that_does_not_wait_is_noticed() {
    let image = slow_helper();
    // cmp r2, r1 becomes cmp r1, r1.
    let at = image.symbol(WAIT) + 2;
    let [waits, does_not] = [
        played(&image, &[]),
        played(&image, &[(at, [0x428a, 0x4289])]),
    ];
    assert!(waits != does_not);
}

/// Strings whose head takes longer than what core 1 does early.
fn late_head() -> Image {
    let text = bent_violin("x' * along + y' * lean", "x' * 5 s/m", "0.4 m/s * bent60");
    let compiled = compiled(&text, SLOW_HZ);
    let image = Image::of(&compiled, BoardKind::Rp2350);
    let cut = image.bounded().contended.cut.expect("parts");
    let early = cut.helped.and_then(|helped| helped.early_cycles_max());
    let [led, early] = early.expect("core 1 begins early");
    assert!(early < led);
    image
}

/// Core 1 begins while core 0 runs the head, and then waits for what that leaves.
#[test]
fn a_core_that_does_not_wait_for_the_head_is_noticed() {
    let image = late_head();
    // cmp r2, r1 becomes cmp r1, r1.
    let fault = (image.symbol(EARLY[1]) + 2, [0x428a, 0x4289]);
    let [waits, does_not] =
        [vec![], vec![fault]].map(|changed| Rig::new(&image, &changed).play((0..150).map(bow)));
    assert!(waits.iter().flatten().filter(|word| **word != 0).count() > 100);
    assert!(waits != does_not);
}

/// Core 1 stays where it looks for a number: no force, and every tick counts as missed.
#[test]
fn a_core_that_never_comes_is_given_up() {
    // beq and bne become branches to themselves.
    let never = |image: &Image, label: &str, looks: u16| {
        let changed = [(image.symbol(label) + 4, [looks, 0xe7fe])];
        let mut rig = Rig::new(image, &changed);
        let words = rig.play((0..60).map(bow));
        assert!(words.iter().flatten().all(|word| *word == 0), "{label}");
        assert!(rig.block(core_block::MISSED) > 20, "{label}");
    };
    never(&slow_helper(), POLL[1], 0xd0fc);
    let early = late_head();
    never(&early, POLL[1], 0xd0fc);
    never(&early, EARLY[1], 0xd1fc);
}
