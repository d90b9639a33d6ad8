//! Parameters in, events out.

use crate::rig::{KEYS, RATE_HZ, Rig, kernel, setup};
use whippen_compiler::firmware::{Setup, core_block};
use whippen_compiler::kernel::parse;
use whippen_compiler::kernel::random::Rng;
use whippen_emulator::Stop;
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;

/// A request in the mailbox: parameter, value; what came of it.
fn ask(rig: &mut Rig, number: u32, parameter: u32, value: i32) -> u32 {
    let mailbox = rig.symbol("mailbox");
    rig.set(mailbox + 4, parameter);
    rig.set(mailbox + 8, value as u32);
    rig.set(mailbox, number);
    rig.play(vec![20_000; 6 * KEYS]);
    assert_eq!(rig.word(mailbox + 12), number, "it is done");
    rig.word(mailbox + 16)
}

#[test]
fn parameters_are_set_within_their_ranges() {
    let kernel = kernel("grand-piano.whip");
    let live = kernel.lives.first().expect("a live parameter");
    let mut rig = Rig::with(
        &[&kernel],
        0,
        &Setup {
            rate_hz: 4410.into(),
            ..setup()
        },
    );
    rig.play(vec![20_000; 200 * KEYS]);
    let at = rig.layout(0, 0).live_param(0).expect("a place");
    let values = |rig: &Rig| {
        ["core0_state", "core1_state"].map(|state| rig.word(rig.symbol(state) + at) as i32)
    };
    assert_eq!(values(&rig), [live.init; 2]);
    let (low, high) = (live.range.low as i32, live.range.high as i32);
    assert_eq!((ask(&mut rig, 1, 0, high), values(&rig)), (0, [high; 2]));
    assert_eq!((ask(&mut rig, 2, 0, low), values(&rig)), (0, [low; 2]));
    assert_eq!(
        (ask(&mut rig, 3, 0, high.wrapping_add(1)), values(&rig)),
        (2, [low; 2])
    );
    assert_eq!(ask(&mut rig, 4, kernel.lives.len() as u32, low), 1);
    assert_eq!(rig.converter().overruns(), 0);
}

/// Every key plays the number that is set.
const SET: &str = "kernel set @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  live level: i32 [0..30000] = 0
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..30000] = live level
    out f v1
  }
}
";

/// Values that are set at random times shortly before a tick, which may come at any instruction.
#[test]
fn a_value_is_set_on_both_cores_in_one_tick() {
    let kernel = parse(SET).unwrap_or_else(|error| panic!("{error:?}"));
    let mut rig = Rig::with(&[&kernel], 0, &setup());
    let function = rig.symbol("whippen_set");
    // Force comes up.
    rig.play(vec![20_000; 500 * KEYS]);
    let mut rng = Rng::new(31);
    let (mut played, mut late) = (vec![0], 0);
    for value in 1..400 {
        let tick = rig.converter().ticks();
        let before = 20 + rng.next() % 100;
        let until = rig.converter().cycle_of(tick) - before;
        assert!(matches!(rig.machine.run(until), Stop::Limit));
        // Between ticks core 0 sleeps: it wakes for this, and goes on as if it had not.
        let asleep = rig.machine.cpu(0).clone();
        assert_eq!(asleep.exception(), 0);
        let stop = rig.machine.call(function, [0, value, 0, 0], 100_000);
        assert!(
            matches!(stop, Stop::Returned { result: [0, _], .. }),
            "{stop:?}"
        );
        *rig.machine.cpu_mut(0) = asleep;
        late += usize::from(rig.converter().ticks() > tick);
        let drives = rig.run(5);
        for row in drives.chunks(KEYS) {
            assert!(row.iter().all(|word| *word == row[0]), "{value}: {row:?}");
            played.push(row[0]);
        }
    }
    assert!(late > 50, "{late} were interrupted");
    played.dedup();
    assert_eq!(played, (0..400).collect::<Vec<i16>>());
}

/// A value that comes while the one before waits is refused, and the mailbox asks again.
#[test]
fn values_are_set_one_after_the_other() {
    let kernel = parse(SET).unwrap_or_else(|error| panic!("{error:?}"));
    let mut rig = Rig::with(&[&kernel], 0, &setup());
    rig.play(vec![20_000; 500 * KEYS]);
    // As if core 1 had another one to come, for a word that nobody reads.
    let core1 = rig.symbol("core1");
    let later = 2 * (rig.block(0, core_block::TICK) + 100) + 1;
    rig.set(core1 + core_block::WHERE, core1 + core_block::VALUE);
    rig.set(core1 + core_block::LATCH, later);
    let mailbox = rig.symbol("mailbox");
    rig.set(mailbox + 8, 7);
    rig.set(mailbox, 1);
    rig.play(vec![20_000; 90 * KEYS]);
    assert_eq!(rig.word(mailbox + 12), 0, "not yet");
    rig.play(vec![20_000; 20 * KEYS]);
    assert_eq!([rig.word(mailbox + 12), rig.word(mailbox + 16)], [1, 0]);
    assert_eq!(
        [0, 1].map(|core| rig.block(core, core_block::LATCH)),
        [0; 2]
    );
}

#[test]
fn notes_leave_as_midi() {
    let kernel = kernel("grand-piano.whip");
    let mut rig = Rig::new(&kernel, 0);
    let device = Device::mikey();
    let motion = default_gesture().positions(RATE_HZ);
    let rest = device.word_of_position(0.0).0;
    let word = |tick: usize, key: usize| match key {
        3 | 60 => {
            device
                .word_of_position(motion[tick.saturating_sub(400) * 6 % motion.len()])
                .0
        }
        _ => rest,
    };
    let words: Vec<u16> = (0..8000)
        .flat_map(|tick| (0..KEYS).map(move |key| word(tick, key)))
        .collect();
    rig.play(words);
    let sent = rig.sent();
    assert!(sent.len() >= 12 && sent.len().is_multiple_of(3), "{sent:?}");
    let messages: Vec<&[u8]> = sent.chunks(3).collect();
    for key in [3, 60] {
        let of_key: Vec<_> = messages.iter().filter(|m| m[1] == 21 + key).collect();
        assert!(
            of_key.iter().any(|m| m[0] == 0x90 && m[2] > 0),
            "{key}: {messages:?}"
        );
        assert!(of_key.iter().any(|m| m[0] == 0x80), "{key}: {messages:?}");
    }
    assert!(
        messages
            .iter()
            .all(|m| [24, 81].contains(&m[1]) && m[2] < 128),
        "{messages:?}"
    );
}
