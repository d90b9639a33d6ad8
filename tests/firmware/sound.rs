//! What is heard: the samples of all keys, summed over both cores.

use crate::rig::{KEYS, Rig, setup};
use whippen_compiler::firmware::core_block;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::kernel::{FULL_SCALE, Kernel, parse};

/// A key's sample is its word around the middle, on the right with the other sign and half as loud;
/// 0 and 65535 are full scale.
pub const HEARD: &str = "kernel heard @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  cell \"channel left.emit\": i32 [-1073741824..1073741824] = 0
  cell \"channel right.emit\": i32 [-1073741824..1073741824] = 0
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [-32768..32767] = sub v0 v1
    v3: i32 [-1073741824..1073709056] = shl v2 15
    v4: i32 [0..0] = const 0
    v5: i32 [-32767..32768] = sub v4 v2
    v6: i32 [-536854528..536870912] = shl v5 14
    set \"channel left.emit\" v3
    set \"channel right.emit\" v6
    out f v2
  }
}
";

/// The same without a right side.
fn one_side() -> String {
    let lines = HEARD.lines().filter(|line| !line.contains("right"));
    lines
        .collect::<Vec<_>>()
        .join("\n")
        .replace("channel left", "sound")
}

/// The same without sound.
fn silent() -> String {
    let lines = HEARD.lines().filter(|line| !line.contains(".emit"));
    lines.collect::<Vec<_>>().join("\n")
}

fn kernel(text: &str) -> Kernel {
    parse(text).unwrap_or_else(|error| panic!("{error:?}\n{text}"))
}

/// Sums of all keys' samples that are loud, quiet, and beside full scale in either direction.
fn rows(ticks: usize) -> Vec<Vec<u16>> {
    let mut rng = Rng::new(5);
    let row = |tick: usize| {
        let span = [4, 400, 4000, 65_536][tick % 4];
        let middle = 32_768 + [0, 370, -370][tick / 4 % 3];
        let word = |_| (middle + rng.below(span) as i64 - span as i64 / 2).clamp(0, 65_535) as u16;
        (0..KEYS).map(word).collect()
    };
    (0..ticks).map(row).collect()
}

/// What is heard of a tick's words, and how many samples are clipped.
fn heard(row: &[u16], sides: [(i64, u32); 2]) -> ([i32; 2], u32) {
    let sum: i64 = row.iter().map(|word| i64::from(*word) - 32_768).sum();
    let all = sides.map(|(sign, shift)| (sign * sum) << shift);
    let clipped = all.iter().filter(|all| all.abs() > FULL_SCALE).count();
    (
        all.map(|all| all.clamp(-FULL_SCALE, FULL_SCALE) as i32),
        clipped as u32,
    )
}

fn play(text: &str, sides: [(i64, u32); 2], channels: u32) {
    let mut rig = Rig::with(&[&kernel(text)], 0, &setup());
    rig.play(vec![32_768; 100 * KEYS]);
    rig.converter().listening = true;
    let rows = rows(600);
    rig.play(rows.concat());
    let samples = std::mem::take(&mut rig.converter().heard);
    // A sample leaves at the beginning of the tick after its own; before the first are silent ones.
    assert_eq!(samples.len(), rows.len());
    assert_eq!(samples[0], [0; 2]);
    let (expected, clipped): (Vec<[i32; 2]>, Vec<u32>) =
        rows.iter().map(|row| heard(row, sides)).unzip();
    assert_eq!(samples[1..], expected[..rows.len() - 1]);
    let counted = rig.block(0, core_block::CLIPPED);
    let of_all: u32 = clipped[..rows.len() - 1].iter().sum();
    assert!(counted > 50, "{counted}");
    assert_eq!(counted, of_all * channels / 2);
}

#[test]
fn samples_of_all_keys_are_summed_exactly() {
    play(HEARD, [(1, 15), (-1, 14)], 2);
    play(&one_side(), [(1, 15), (1, 15)], 1);
}

/// While a program begins, and after a missed tick, nothing is heard of keys that do not play.
#[test]
fn what_does_not_play_is_not_heard() {
    let (loud, silent) = (kernel(HEARD), kernel(&silent()));
    let mut rig = Rig::with(&[&loud, &silent], 0, &setup());
    // All keys together are a quarter of full scale, which each core has half of.
    let (row, quarter) = (vec![32_768 + 93; KEYS], (44 * 93) << 15);
    rig.play(row.repeat(200));
    rig.converter().listening = true;
    let samples = |rig: &mut Rig, ticks: usize| {
        rig.play(row.repeat(ticks));
        let heard = std::mem::take(&mut rig.converter().heard);
        let mut left: Vec<i32> = heard.iter().map(|both| both[0]).collect();
        left.dedup();
        left
    };
    assert_eq!(samples(&mut rig, 20), [2 * quarter]);
    let missed = rig.symbol("core1") + core_block::TICK;
    let seen = rig.word(missed);
    rig.set(missed, seen - 1);
    let found = samples(&mut rig, 20);
    // The keys of core 1 are left out, and those of core 0 in the same tick or the next one.
    let silences = [0, quarter].map(|silence| vec![2 * quarter, silence, 2 * quarter]);
    assert!(silences.contains(&found), "{found:?}");
    let mailbox = rig.symbol("mailbox");
    // In the tick in which the last key of each core begins, all others are heard.
    let begins = (86 * 93) << 15;
    let heard = [vec![2 * quarter, 0], vec![0, begins, 2 * quarter]];
    for (request, program) in [(1, 1), (2, 0)] {
        rig.set(mailbox + 4, u32::MAX);
        rig.set(mailbox + 8, program);
        rig.set(mailbox, request);
        let found = samples(&mut rig, 100);
        assert_eq!(found, heard[request as usize - 1], "program {program}");
    }
}
