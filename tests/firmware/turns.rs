//! Whole images on the emulated chip by windows, blocks and translated code, and by turns of single
//! instructions: the same registers, cycles, exceptions, memory, words and samples wherever one
//! looks.

#[path = "../../emulator/tests/made/seen.rs"]
mod seen;

use whippen_compiler::kernel::parse;
use whippen_compiler::kernel::random::Rng;
use whippen_emulator::{Machine, Observer, Step, Stop};

use crate::key_columns::{ColumnBench, KEY_PARTS, START_MS, built};
use crate::play::words;
use crate::rig::{KEYS, Rig, kernel, setup};
use crate::sound::HEARD;
use crate::sound_out::{attach_dac, take_frames};

/// RAM of the chip.
const RAM_BYTES: usize = 520 << 10;

/// Which core took or left an exception, and when. Who looks at instructions has them run by turns.
#[derive(Default)]
struct Exceptions<const INSTRUCTIONS: bool>(Vec<(usize, u32, u64)>);

impl<const INSTRUCTIONS: bool> Observer for Exceptions<INSTRUCTIONS> {
    const INSTRUCTIONS: bool = INSTRUCTIONS;

    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, core: usize, number: u32, cycle: u64) {
        self.0.push((core, number, cycle));
    }

    fn resumed(&mut self, core: usize, cycle: u64) {
        self.0.push((core, 0, cycle));
    }
}

/// Runs both for so many cycles, with stops in between.
fn agree(what: &str, fast: &mut Machine, judge: &mut Machine, cycles: u64) {
    let (mut of_fast, mut of_judge) = (
        Exceptions::<false>::default(),
        Exceptions::<true>::default(),
    );
    let mut rng = Rng::new(3);
    let mut until = fast.cycle(0).max(fast.cycle(1));
    let end = until + cycles;
    while until < end {
        let most = [50, 2000, 20_000][rng.below(3) as usize];
        until += 1 + rng.below(most);
        assert_eq!(
            fast.run_observed(until, &mut of_fast),
            Stop::Limit,
            "{what}"
        );
        assert_eq!(
            judge.run_observed(until, &mut of_judge),
            Stop::Limit,
            "{what}"
        );
        assert!(of_fast.0 == of_judge.0, "{what}, up to {until}: exceptions");
        assert_eq!(
            seen::cores(fast),
            seen::cores(judge),
            "{what}, up to {until}"
        );
    }
    assert!(of_fast.0.len() > 100, "{what}: {}", of_fast.0.len());
    let [fast, judge] = [fast, judge].map(|machine| seen::ram(machine, RAM_BYTES));
    assert!(fast == judge, "{what}: RAM");
}

#[test]
fn keyboards_of_two_cores_do_what_they_do_by_turns() {
    let kernels = [
        ("grands", kernel("grand-piano.whip")),
        ("sound", parse(HEARD).expect("a kernel")),
    ];
    for (what, kernel) in kernels {
        let ready = || {
            let mut rig = Rig::with(&[&kernel], 12_000, &setup());
            let words = words(900);
            let (before, after) = words.split_at(400 * KEYS);
            // Force is up then.
            rig.play(before.iter().copied());
            rig.converter().samples.extend(after);
            rig.converter().listening = true;
            rig
        };
        let (mut fast, mut judge) = (ready(), ready());
        agree(what, &mut fast.machine, &mut judge.machine, 5_000_000);
        let seen = |rig: &mut Rig| {
            let sent = rig.sent();
            let converter = rig.converter();
            let counts = (converter.ticks(), converter.overruns());
            (
                sent,
                converter.drives.clone(),
                converter.heard.clone(),
                counts,
            )
        };
        let seen = (seen(&mut fast), seen(&mut judge));
        assert!(seen.0 == seen.1, "{what}");
        let (sent, drives, heard, counts) = seen.0;
        assert!(drives.iter().any(|word| *word != 0), "{what}");
        let sounds = heard.iter().any(|both| *both != [0; 2]);
        assert_eq!(sounds, what == "sound", "{what}");
        assert_eq!(sent.is_empty(), what == "sound", "{what}");
        assert!(counts.0 > 700 && counts.1 == 0, "{what}: {counts:?}");
    }
}

#[test]
fn columns_of_two_cores_do_what_they_do_by_turns() {
    let built = built("clavichord-heard.whip", 16, 2);
    let ready = || {
        let mut bench = ColumnBench::new(&built, KEY_PARTS);
        let port = built.board.i2s.expect("a sound output");
        let dac = attach_dac(&mut bench.machine, port);
        bench.pass_ms(START_MS + 1);
        (0..16).for_each(|key| bench.key(key).finger.force_n = 1.0);
        (bench, dac)
    };
    let ((mut fast, dac), (mut judge, _)) = (ready(), ready());
    agree("columns", &mut fast.machine, &mut judge.machine, 1_500_000);
    assert_eq!(fast.driven(), judge.driven());
    assert_eq!(fast.sensed(), judge.sensed());
    let heard = [&mut fast, &mut judge].map(|bench| take_frames(&mut bench.machine, dac));
    assert!(
        heard[0] == heard[1] && heard[0].len() > 400,
        "{}",
        heard[0].len()
    );
}
