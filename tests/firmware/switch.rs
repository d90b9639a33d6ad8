//! Another program begins while one plays.

use crate::rig::{KEYS, RATE_HZ, Rig, kernel, kernel_of, setup};
use whippen_compiler::firmware::core_block;
use whippen_compiler::firmware::{Setup, keys_name};
use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::rate::Rate;
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;

/// What the mailbox calls the program.
const PROGRAM: u32 = u32::MAX;
/// Ticks after which force is whole again (20 ms), and every key plays.
pub fn ramp(rate_hz: impl Into<Rate>) -> usize {
    rate_hz.into().ticks_in(20) as usize + 3 * 16 + 44
}

/// Asks for another program; it begins within the next ticks.
pub fn ask(rig: &mut Rig, request: u32, program: u32) {
    set(rig, request, PROGRAM, program);
}

/// Asks the mailbox for a value.
pub fn set(rig: &mut Rig, request: u32, parameter: u32, value: u32) {
    let mailbox = rig.symbol("mailbox");
    rig.set(mailbox + 4, parameter);
    rig.set(mailbox + 8, value);
    rig.set(mailbox, request);
}

/// Sensor words of so many ticks: every key plays the gesture at a time of its own, three times as
/// fast.
pub fn words(rate_hz: impl Into<Rate>, ticks: std::ops::Range<usize>) -> Vec<u16> {
    let device = Device::mikey();
    let motion: Vec<u16> = default_gesture()
        .positions(rate_hz)
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    let word = |tick: usize, key: usize| {
        motion[(tick * 3 + key * 397) % motion.len()] ^ ((tick * 40_503) >> 7 & 1) as u16
    };
    ticks
        .flat_map(|tick| (0..KEYS).map(move |key| (tick, key)))
        .map(|(tick, key)| word(tick, key))
        .collect()
}

/// How many ticks a program has played, by core.
pub fn played(rig: &Rig, program: usize) -> [u32; 2] {
    [0, 1].map(|core| rig.word(rig.symbol(&format!("{}_state", keys_name(core, program))) + 12))
}

/// After how many ticks a program began that had played so many before and plays still.
pub fn begins(rig: &Rig, program: usize, before: [u32; 2]) -> [usize; 2] {
    let now = played(rig, program);
    [0, 1].map(|core| (rig.block(core, core_block::TICK) - (now[core] - before[core])) as usize)
}

/// From when force is whole, drive words are those of a program whose keys began one after the
/// other.
fn plays(
    kernel: &Kernel,
    begins: [usize; 2],
    words: &[u16],
    drives: &[i16],
    ticks: std::ops::Range<usize>,
) {
    let mut compared = 0;
    for key in 0..KEYS {
        let (core, own) = (key / 44, key % 44);
        compared += key_plays(
            kernel,
            key,
            begins[core] + own,
            words,
            drives,
            ticks.clone(),
        );
    }
    assert!(compared > 1000, "{compared} words say something");
}

/// The same of one key that began in a tick; how many of the words that must be equal are not 0.
pub fn key_plays(
    kernel: &Kernel,
    key: usize,
    begin: usize,
    words: &[u16],
    drives: &[i16],
    ticks: std::ops::Range<usize>,
) -> usize {
    let mut compared = 0;
    let mut interp = Interp::new(kernel, 1).expect("verifies");
    let word = |tick: usize| [words[tick * KEYS + key]];
    interp.init(&word(begin));
    for tick in begin + 1..ticks.end {
        let mut want = [0];
        interp.tick(&word(tick), &mut want);
        let got = drives[tick * KEYS + key];
        if tick < ticks.start {
            assert!(
                got.unsigned_abs() <= want[0].unsigned_abs() + 1,
                "key {key}, tick {tick}: {got} {want:?}"
            );
        } else {
            assert_eq!(
                got, want[0],
                "{}: key {key}, tick {tick}, began at {begin}",
                kernel.name
            );
            compared += usize::from(got != 0);
        }
    }
    compared
}

/// At a rate that leaves little time.
#[test]
fn no_tick_is_missed() {
    let rate_hz = 32_000;
    let kernels = ["hammond.whip", "virtual-spring.whip"].map(kernel);
    let [organ, spring] = &kernels;
    let mut rig = Rig::with(
        &[organ, spring],
        4000,
        &Setup {
            rate_hz: rate_hz.into(),
            ..setup()
        },
    );
    let (first, second, third) = (2000, 4000, 6000);
    let words = words(rate_hz, 0..third);
    let mut drives = rig.play(words[..first * KEYS].iter().copied());
    ask(&mut rig, 1, 1);
    drives.extend(rig.play(words[first * KEYS..second * KEYS].iter().copied()));
    let of_spring = begins(&rig, 1, [0; 2]);
    plays(
        spring,
        of_spring,
        &words,
        &drives,
        first + ramp(rate_hz)..second - 2,
    );
    let before = played(&rig, 0);
    ask(&mut rig, 2, 0);
    drives.extend(rig.play(words[second * KEYS..].iter().copied()));
    plays(
        organ,
        begins(&rig, 0, before),
        &words,
        &drives,
        second + ramp(rate_hz)..third - 2,
    );
    let ended = played(&rig, 1);
    assert!(
        (0..2).all(|core| of_spring[core] + (ended[core] as usize) < second + 4),
        "the spring does not go on"
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
    let mailbox = rig.symbol("mailbox");
    assert_eq!((rig.word(mailbox + 12), rig.word(mailbox + 16)), (2, 0));
}

/// A force of where the key was 441 ticks ago, from a line that no key fills itself.
const ECHO: &str = "
instrument echo {
    sense x: length in 0 mm .. 10 mm
    delay past: length in 0 mm .. 10 mm lasting 12 ms
    feed past = x
    force late = 80 N/m * past(10 ms)
}
";

/// A program that is called again does not go on with what its lines held when it was left.
#[test]
fn lines_are_empty_when_a_program_begins() {
    let kernels = [kernel_of("echo.whip", ECHO), kernel("virtual-spring.whip")];
    let mut rig = Rig::with(&kernels.each_ref(), 0, &setup());
    let (first, second, third) = (1200, 2400, 4000);
    let words = words(RATE_HZ, 0..third);
    let mut drives = rig.play(words[..first * KEYS].iter().copied());
    ask(&mut rig, 1, 1);
    drives.extend(rig.play(words[first * KEYS..second * KEYS].iter().copied()));
    let before = played(&rig, 0);
    ask(&mut rig, 2, 0);
    drives.extend(rig.play(words[second * KEYS..].iter().copied()));
    let begins = begins(&rig, 0, before);
    // The line of a core's 44 keys, half a kilobyte a tick.
    let emptied = (44 * 4 * kernels[0].lines[0].len as usize).div_ceil(512);
    assert!(emptied > 160, "{emptied} ticks");
    let wanted = second + emptied..second + emptied + 6;
    assert!(
        begins.iter().all(|begin| wanted.contains(begin)),
        "{begins:?}, {emptied} ticks"
    );
    let whole = second + emptied + ramp(RATE_HZ);
    plays(&kernels[0], begins, &words, &drives, whole..third - 2);
}

#[test]
fn there_is_no_such_program() {
    let kernel = kernel("virtual-spring.whip");
    let mut rig = Rig::new(&kernel, 0);
    rig.play(vec![20_000; 200 * KEYS]);
    ask(&mut rig, 1, 1);
    let drives = rig.play(vec![20_000; 200 * KEYS]);
    assert_eq!(rig.word(rig.symbol("mailbox") + 16), 1);
    assert!(
        drives[100 * KEYS..]
            .iter()
            .all(|word| *word == drives[100 * KEYS] && *word != 0)
    );
}

/// A key is held when the program changes: its note ends.
#[test]
fn notes_end_with_their_program() {
    let kernels = ["hammond.whip", "virtual-spring.whip"].map(kernel);
    let mut rig = Rig::with(&kernels.each_ref(), 0, &setup());
    let device = Device::mikey();
    let [up, down] = [0.0, 5e-3].map(|x| device.word_of_position(x).0);
    let row = |held: bool| {
        (0..KEYS).map(move |key| {
            if held && [3, 60].contains(&key) {
                down
            } else {
                up
            }
        })
    };
    rig.play((0..400).flat_map(|_| row(false)));
    rig.play((0..400).flat_map(|_| row(true)));
    let on = rig.sent();
    assert_eq!((on.len(), on[0], on[3]), (6, 0x90, 0x90), "{on:?}");
    ask(&mut rig, 1, 1);
    rig.play((0..400).flat_map(|_| row(true)));
    let off = rig.sent();
    assert_eq!(off, [0x80, 21 + 3, 64, 0x80, 21 + 60, 64]);
}
