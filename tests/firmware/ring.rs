//! More events than anybody reads: they are counted, and nothing waits for them.

use crate::rig::{KEYS, Rig};
use whippen_compiler::firmware::core_block;
use whippen_compiler::kernel::{Kernel, parse};

/// Drive follows the sensor, and every tick above a quarter of the travel is an event.
fn talkative() -> Kernel {
    let text = "kernel talkative @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  event tell(1)
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [-32768..32767] = sub v0 v1
    v3: i32 [16384..16384] = const 16384
    v4: i1 [0..1] = lt v3 v0
    if v4 {
      emit tell v2
    } else {
    }
    out f v2
  }
}
";
    parse(text).unwrap_or_else(|error| panic!("{error:?}"))
}

/// Head, tail, lost, of a core's ring.
fn ring(rig: &Rig, core: usize) -> [u32; 3] {
    let state = rig.symbol(["core0_state", "core1_state"][core]);
    let ring = rig.layout(0, core).events().expect("keys have events");
    [ring.head, ring.tail, ring.lost].map(|at| rig.word(state + at))
}

#[test]
fn events_without_room_are_counted_and_nothing_waits() {
    let mut rig = Rig::new(&talkative(), 0);
    let row = |word: u16| (0..KEYS).map(move |key| word + key as u16);
    rig.play((0..300).flat_map(|_| row(8_000)));
    assert_eq!(
        [ring(&rig, 0), ring(&rig, 1)],
        [[0; 3]; 2],
        "nobody has said anything"
    );
    let loud = 50;
    let drives =
        rig.play((0..loud + 2).flat_map(|tick| row(if tick < loud { 40_000 } else { 8_000 })));
    for core in [0, 1] {
        let bytes = rig.layout(0, core).events().expect("keys have events");
        let [head, tail, lost] = ring(&rig, core);
        // Each tick has 44 events; what is left of the ring behind the last whole tick holds a
        // mark.
        let left = bytes.bytes % (44 * bytes.event);
        let written = (head - head / bytes.bytes * left) / bytes.event;
        assert!(
            lost > 0 && head - tail <= bytes.bytes,
            "{lost} lost, {} bytes wait",
            head - tail
        );
        assert_eq!(
            written + lost,
            loud as u32 * 44,
            "each event was written or counted"
        );
        assert_eq!(
            (
                rig.block(core, core_block::MISSED),
                rig.block(core, core_block::FAULTS)
            ),
            (0, 0)
        );
    }
    assert!(
        drives[3 * KEYS..loud * KEYS]
            .iter()
            .all(|word| *word > 7000),
        "keys play on"
    );
    assert_eq!(rig.converter().overruns(), 0);
    // The reader takes what is there, and the ring goes on.
    rig.play((0..3000).flat_map(|_| row(8_000)));
    for core in [0, 1] {
        let [head, tail, _] = ring(&rig, core);
        assert_eq!(head, tail);
    }
    let before = ring(&rig, 0);
    rig.play((0..10).flat_map(|tick| {
        (0..KEYS).map(move |key| if tick == 0 && key == 5 { 40_000 } else { 8_000 })
    }));
    let after = ring(&rig, 0);
    assert_eq!(
        after[0] - before[0],
        rig.layout(0, 0).events().expect("keys have events").event,
        "there is room again"
    );
    assert_eq!(after[2], before[2]);
}
