//! Both cores start and play; the drive words are the interpreter's.

use crate::rig::{KEYS, RATE_HZ, Rig, kernel, kernel_of};
use whippen_compiler::firmware::core_block;
use whippen_compiler::firmware::with_values_from;
use whippen_compiler::kernel::{Interp, Kernel};
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;

/// Sensor words of 88 keys that are played one after the other, with the noise that a converter
/// has.
pub fn words(ticks: usize) -> Vec<u16> {
    let device = Device::mikey();
    let motion: Vec<u16> = default_gesture()
        .positions(RATE_HZ)
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    // Constant until both cores play: each key starts from the words that it is given first.
    let noise = |tick: usize| {
        if tick < 60 {
            0
        } else {
            ((tick * 40_503) >> 7 & 1) as u16
        }
    };
    let word = |tick: usize, key: usize| {
        motion[(tick.max(60) * 3 + key * 397) % motion.len()] ^ noise(tick)
    };
    (0..ticks)
        .flat_map(|tick| (0..KEYS).map(move |key| word(tick, key)))
        .collect()
}

/// Ticks before the keys begin, by core: what the state counts against what the converter counts.
fn begins(rig: &Rig) -> [usize; 2] {
    [0, 1].map(|core| {
        let state = rig.symbol(["core0_state", "core1_state"][core]);
        (rig.block(core, core_block::TICK) - rig.word(state + 12)) as usize
    })
}

/// The interpreter's drive words for a core's keys, which begin after so many ticks; nothing
/// before.
fn expected(
    kernel: &Kernel,
    words: &[u16],
    core: usize,
    first: usize,
    begin: usize,
) -> Vec<Vec<i16>> {
    let row = |tick: usize| &words[tick * KEYS + 44 * core..][..44];
    // Values per key go to the core that has the key.
    let own = with_values_from(kernel, 44 * core as u32);
    let mut interp = Interp::new(&own, 44).expect("verifies");
    interp.init(row(first));
    let mut drive = vec![0; 44];
    let ticks = words.len() / KEYS;
    let mut all = vec![vec![0; 44]; begin];
    for tick in begin..ticks {
        interp.tick(row(tick), &mut drive);
        all.push(drive.clone());
    }
    all
}

fn plays_as_the_interpreter(kernel: &Kernel, leaves: usize) -> Rig {
    let file = &kernel.name;
    let mut rig = Rig::new(kernel, leaves);
    let (ticks, words) = (1000, words(1000));
    let drives = rig.play(words.iter().copied());
    assert_eq!(rig.converter().overruns(), 0);
    let begins = begins(&rig);
    assert!(
        begins.iter().all(|begin| (1..200).contains(begin)),
        "{begins:?}"
    );
    let mut full = 0;
    for core in [0, 1] {
        let want = expected(kernel, &words, core, 0, begins[core]);
        for tick in 0..ticks - 2 {
            for key in 0..44 {
                let (got, want) = (drives[tick * KEYS + 44 * core + key], want[tick][key]);
                let told = || {
                    format!(
                        "{file}: core {core}, key {key}, tick {tick}; {begins:?}, faults {}",
                        rig.block(core, core_block::FAULTS)
                    )
                };
                if tick > begins[core] + 300 {
                    assert_eq!(got, want, "{}", told());
                    full += usize::from(want != 0);
                } else {
                    assert!(
                        got.unsigned_abs() <= want.unsigned_abs().saturating_add(1),
                        "{}: {got} {want}",
                        told()
                    );
                }
            }
        }
        assert_eq!(
            (
                rig.block(core, core_block::FAULTS),
                rig.block(core, core_block::MISSED)
            ),
            (0, 0)
        );
    }
    assert!(full > 10_000, "{full} words say something");
    rig
}

#[test]
fn a_spring_on_both_cores() {
    plays_as_the_interpreter(&kernel("virtual-spring.whip"), 0);
}

/// Every mode, both cores' values per key, events: the instrument with the most of everything.
#[test]
fn a_grand_on_both_cores() {
    plays_as_the_interpreter(&kernel("grand-piano.whip"), 12_000);
}

/// Keys whose records lie further apart than the constant of an addition or an access with
/// write-back reaches.
#[test]
fn large_records_on_both_cores() {
    let states: String = (1..66)
        .map(|at| {
            format!(
                "state s{at}: length in 0 mm .. 11 mm = 0 mm\nnext s{at} = s{}\n",
                at - 1
            )
        })
        .collect();
    let text = format!(
        "instrument large {{
            sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
            state s0: length in 0 mm .. 11 mm = 0 mm
            next s0 = x
            {states}
            force late = -100 N/m * s65
        }}"
    );
    let rig = plays_as_the_interpreter(&kernel_of("large.whip", &text), 0);
    let layout = rig.layout(0, 0);
    assert!(layout.record(1) - layout.record(0) > 255);
}
