//! Parameters in, events out.

use crate::rig::{KEYS, RATE_HZ, Rig, kernel, setup};
use whippen_compiler::firmware::Setup;
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;

/// A request in the mailbox: parameter, value; what came of it.
fn ask(rig: &mut Rig, number: u32, parameter: u32, value: i32) -> u32 {
    let mailbox = rig.symbol("mailbox");
    rig.set(mailbox + 4, parameter);
    rig.set(mailbox + 8, value as u32);
    rig.set(mailbox, number);
    rig.play(vec![20_000; 4 * KEYS]);
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
            rate_hz: 4410,
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
