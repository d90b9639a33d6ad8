//! What is heard, which core 1 does while core 0 runs the tail.

use whippen_compiler::firmware::{DONE, core_block};
use whippen_emulator::BoardKind;

use crate::rig::{Image, Rig};
use crate::{KEYTAR, SLOW_HZ, SOUND_HZ, STRINGS, VIOLIN, bow, compiled, compiled_bare};

/// The sums of so many ticks, as they are sent; 0 where that of a tick is not there.
fn sums(image: &Image, changed: &[(u32, [u16; 2])], ticks: usize) -> Vec<u32> {
    let mut rig = Rig::new(image, changed);
    let sum = |tick: usize| {
        rig.play([bow(tick)].into_iter());
        let number = rig.block(core_block::TICK);
        let at = image.symbol("sound0") + 32 * (number & 1);
        match rig.word(at) == number {
            true => rig.word(at + 4),
            false => 0,
        }
    };
    (0..ticks).map(sum).collect()
}

fn with_sound(text: &str, rate_hz: u32) -> Image {
    let image = Image::of(&compiled(text, rate_hz), BoardKind::Rp2350);
    assert!(image.built.cut().expect("parts").has_sound());
    image
}

/// Without the wait what is heard has words of the tick before: what the wait is for.
#[test]
fn a_core_that_does_not_wait_for_what_is_heard_is_noticed() {
    let image = with_sound(STRINGS, SLOW_HZ);
    // cmp r2, r1 becomes cmp r1, r1.
    let fault = (image.symbol(DONE[1]) + 2, [0x428a, 0x4289]);
    let [waits, does_not] = [vec![], vec![fault]].map(|changed| sums(&image, &changed, 150));
    assert!(waits.iter().filter(|sum| **sum != 0).count() > 100);
    assert!(waits != does_not);
}

/// Core 1 stays where it looks for what core 0's members leave: nothing is heard, no force, and
/// every tick counts as missed.
#[test]
fn a_core_that_is_never_done_with_what_is_heard_is_given_up() {
    let image = with_sound(STRINGS, SLOW_HZ);
    // bne becomes a branch to itself.
    let never = [(image.symbol(DONE[1]) + 4, [0xd1fc, 0xe7fe])];
    assert!(sums(&image, &never, 60).iter().all(|sum| *sum == 0));
    let mut rig = Rig::new(&image, &never);
    let words = rig.play((0..60).map(bow));
    assert!(words.iter().flatten().all(|word| *word == 0));
    assert!(rig.block(core_block::MISSED) > 20);
}

/// Cycles between two looks.
const LOOK_CYCLES: u64 = 4;

/// Core 1 has written the sum when the bound says so: no frame of core 0 shows that.
#[test]
fn what_is_heard_is_there_in_time() {
    let image = with_sound(VIOLIN, SOUND_HZ);
    in_time(&image, sound_cycles_max(&image), bow);
}

/// The same where it has all that sounds, with no members before it: strings are plucked.
#[test]
fn strings_that_only_sound_are_there_in_time() {
    let image = Image::of(&compiled_bare(KEYTAR, SOUND_HZ), BoardKind::Rp2350);
    let pluck = |tick: usize| {
        let y = 32_768.0 + 25_000.0 * (tick as f64 / 15.0).sin();
        vec![32_768, y as u16, 9_000]
    };
    in_time(&image, sound_cycles_max(&image), pluck);
}

/// A frame takes as long as what is heard, where that takes longer than all the rest.
#[test]
fn a_frame_ends_with_what_is_heard() {
    let heard = "violin_body(1 N^-1 * sum(strings.bridge))";
    let (before, after) = VIOLIN.split_once(heard).expect("what is heard");
    let (before, out) = before.rsplit_once('\n').expect("lines");
    let mut text = format!("{before}\n    let tone0 = {heard}\n");
    for tone in 1..=40 {
        text += &format!("    let tone{tone} = sin(tone{})\n", tone - 1);
    }
    let image = with_sound(&format!("{text}{out}tone40{after}"), SLOW_HZ);
    let most = sound_cycles_max(&image);
    let bound = image.bounded().contended;
    let (last, longer) = bound.parts.last().expect("parts");
    println!("{longer} of {} cycles: {last}", bound.cycles_max);
    assert!(last.contains("heard") && bound.cycles_max > most && *longer > 500);
    in_time(&image, most, bow);
}

/// From `go` until core 1 is done with what is heard.
fn sound_cycles_max(image: &Image) -> u64 {
    let cut = image.bounded().contended.cut.expect("parts");
    let most = cut.helped.and_then(|helped| helped.sound_cycles_max());
    most.expect("core 1 has what is heard")
}

/// A board has the sum of each of some ticks so many cycles after `go`.
fn in_time(image: &Image, most: u64, row: fn(usize) -> Vec<u16>) {
    let [turn, heard] = ["core0_turn", "core0_heard"].map(|word| image.symbol(word));
    let mut rig = Rig::new(image, &[]);
    let mut longest = 0;
    rig.play((0..20).map(row));
    for tick in 20..120 {
        let [given, before] = [turn, heard].map(|word| rig.word(word));
        if before != given {
            rig.looks(heard, before, LOOK_CYCLES);
        }
        rig.next(row(tick));
        rig.looks(turn, given, LOOK_CYCLES);
        let took = rig.looks(heard, given, LOOK_CYCLES);
        longest = took.max(longest);
        // The first look may be so much late.
        assert!(took <= most + LOOK_CYCLES, "{took}, at most {most}");
    }
    println!("{longest}, at most {most}");
    assert!(longest > most / 2, "{longest}");
}
