//! What the monitor refuses, and images that have none.

use whippen_compiler::firmware::{Fact, captured};
use whippen_emulator::BoardKind;
use whippen_runtime::monitor::{Capture, MonitorError, Trigger, capture_room};

use crate::monitor::{RATE_HZ, compiled, monitored};
use crate::rig::{Rig, kernel};

/// What a setting must not have is refused, and nothing is captured.
#[test]
fn settings_out_of_range_are_refused() {
    let compiled = compiled("virtual-spring.whip", RATE_HZ);
    let mut client = monitored(BoardKind::Rp2040, &compiled, 1_000_000);
    let facts = client.identify().expect("it answers");
    let room = capture_room(&facts, 0);
    let good = Capture {
        keys: vec![1, 2],
        cells: vec![],
        ticks: 100,
        after: 10,
        trigger: Some(Trigger::Now),
        group: 3,
    };
    let good = good.setting(facts.word(Fact::Status)).expect("a setting");
    let wrong: [(usize, u32); 12] = [
        (0, 40),
        (0, 6),
        (1, 24),
        (1, 2),
        (2, room.end - room.start),
        (2, 7),
        (3, 1),
        (3, 88),
        (7, 0x1000_0000),
        (7, 0x4000_0000),
        (11, 4),
        (12, 36),
    ];
    for (at, value) in wrong {
        let mut setting = good.clone();
        setting[at] = value;
        let refused = client.capture(0, &setting);
        assert!(
            matches!(refused, Err(MonitorError::Refused(_))),
            "{at}: {refused:?}"
        );
    }
    assert!(matches!(
        client.capture(2, &good),
        Err(MonitorError::Refused(_))
    ));
    assert!(matches!(
        client.capture(0, &good[1..]),
        Err(MonitorError::Refused(_))
    ));
    let next = facts.word(Fact::Capture0) + captured::NEXT;
    assert_eq!(client.link().rig.word(next), 0);
    client.capture(0, &good).expect("it captures");
}

#[test]
fn without_the_monitor_an_image_has_none_of_it() {
    let rig = Rig::new(&kernel("virtual-spring.whip"), 0);
    let has = |name: &str| rig.image.symbols.iter().any(|symbol| symbol.name == name);
    assert!(!has("monitor_facts") && !has("captured0") && has("midi_step"));
}
