//! Who waits for whom, by hand.

use super::*;

const BANKS: &[Banks] = &[
    Banks {
        base: 0x2000_0000,
        bytes: 0x100,
        first_port: 0,
        ports: 4,
    },
    Banks {
        base: 0x2000_0100,
        bytes: 0x100,
        first_port: 4,
        ports: 1,
    },
];

#[test]
fn one_access_a_cycle_and_port() {
    let mut fabric = Fabric::new(BANKS);
    assert_eq!(fabric.data(0, 0x2000_0000, 10, false), 0);
    assert_eq!(fabric.data(1, 0x2000_0004, 10, false), 0, "another bank");
    assert_eq!(
        fabric.data(1, 0x2000_0010, 10, false),
        1,
        "the same bank, four words on"
    );
    assert_eq!(
        fabric.data(0, 0x2000_0020, 11, false),
        1,
        "now the one that waited has it"
    );
    assert_eq!(fabric.data(1, 0x2000_0000, 13, false), 0);
    assert_eq!(
        fabric.data(0, 0x3000_0000, 13, false),
        0,
        "no memory of these"
    );
}

#[test]
fn memories_may_have_a_port_in_common() {
    let also = Banks {
        base: 0x2100_0000,
        bytes: 0x40,
        first_port: 2,
        ports: 1,
    };
    let mut fabric = Fabric::new(&[BANKS[0], also]);
    assert_eq!(fabric.data(0, 0x2000_0008, 10, false), 0);
    assert_eq!(fabric.data(1, 0x2100_0000, 10, false), 1);
}

#[test]
fn a_core_does_not_wait_for_its_own_fetches_but_others_do() {
    let mut fabric = Fabric::new(BANKS);
    fabric.fetch(0, 0x2000_0100, 20);
    assert_eq!(fabric.data(0, 0x2000_0180, 20, false), 0);
    fabric.fetch(0, 0x2000_0104, 21);
    assert_eq!(fabric.data(1, 0x2000_0180, 21, false), 1);
    fabric.fetch(0, 0x2000_0106, 23);
    assert_eq!(
        fabric.data(1, 0x2000_0180, 23, false),
        0,
        "the same word is fetched once"
    );
}

#[test]
fn at_the_worst_own_data_wait_for_own_fetches() {
    let mut fabric = Fabric::new(BANKS);
    fabric.fetch(0, 0x2000_0000, 20);
    let waits = |fabric: &mut Fabric| {
        [0, 4, 8, 12, 0x100].map(|bank| fabric.data(0, 0x2000_0040 + bank, 30, false))
    };
    assert_eq!(waits(&mut fabric), [0; 5]);
    fabric.meets_fetches = true;
    assert_eq!(waits(&mut fabric), [1, 1, 1, 1, 0]);
    fabric.fetch(0, 0x2000_00f8, 40);
    assert_eq!(
        waits(&mut fabric),
        [0, 0, 1, 1, 1],
        "up to the end, and beyond"
    );
}

#[test]
fn high_priority_goes_first() {
    let mut fabric = Fabric::new(BANKS);
    fabric.set_priorities(1 << 4);
    assert_eq!(fabric.data(0, 0x2000_0000, 5, false), 0);
    assert_eq!(fabric.data(1, 0x2000_0000, 5, false), 0);
    assert_eq!(
        fabric.data(0, 0x2000_0004, 6, false),
        1,
        "what it should have waited"
    );
}

#[test]
fn a_dma_is_one_of_them() {
    let mut fabric = Fabric::new(BANKS);
    fabric.dma(0x2000_0008, 7, false);
    assert_eq!(fabric.data(0, 0x2000_0018, 7, false), 1);
    // Both of its managers may be before a core, unless the core has priority.
    fabric.dma(0x2000_0008, 20, false);
    fabric.dma(0x2000_0018, 20, true);
    assert_eq!(fabric.data(0, 0x2000_0028, 20, false), 2);
    fabric.set_priorities(1);
    fabric.dma(0x2000_0008, 30, false);
    fabric.dma(0x2000_0018, 30, true);
    assert_eq!(fabric.data(0, 0x2000_0028, 30, false), 0);
}

const BRIDGE: Bridge = Bridge {
    base: 0x4000_0000,
    bytes: 0x100,
    number: 0,
    read: 3,
    write: 4,
};

/// Core 0 and the DMA at a bridge, and a write of the DMA that has the port from cycle 10.
fn bridged(priorities: u32) -> Fabric {
    let mut fabric = Fabric::new(BANKS);
    fabric.set_bridges(&[BRIDGE]);
    fabric.set_priorities(priorities);
    fabric
}

#[test]
fn a_bridge_is_held_for_several_cycles_and_nothing_under_way_is_ended() {
    for priorities in [0, 0x1, 0x11] {
        let mut fabric = bridged(priorities);
        fabric.dma(0x4000_0010, 10, true);
        assert_eq!(fabric.data(0, 0x4000_0000, 11, false), 3);
        assert_eq!(
            fabric.data(0, 0x2000_0000, 11, false),
            0,
            "a bank is no bridge"
        );
        assert_eq!(fabric.take_dma_cycles(), 3);
        fabric.dma(0x4000_0010, 15, false);
        assert_eq!(fabric.take_dma_cycles(), 2 + 2, "it waits for the core too");
        assert_eq!(fabric.data(1, 0x4000_0000, 16, false), 4);
        assert_eq!(fabric.data(0, 0x4000_0000, 21, false), 2, "cores meet too");
    }
}

#[test]
fn both_accesses_of_a_dma_may_be_before_one_of_a_core() {
    let mut fabric = bridged(0);
    fabric.dma(0x4000_0010, 10, false);
    fabric.dma(0x4000_0020, 10, true);
    assert_eq!(fabric.data(0, 0x4000_0000, 10, false), 7);
}

#[test]
fn priorities_of_bridges_are_other_managers() {
    // Reads of the DMA are low with 0x11, as they are said to be; its writes are high (E27).
    let mut fabric = bridged(0x11);
    fabric.dma(0x4000_0010, 10, false);
    assert_eq!(fabric.data(0, 0x4000_0000, 10, false), 0);
    assert_eq!(fabric.take_dma_cycles(), 2);
    fabric.dma(0x4000_0010, 20, false);
    assert_eq!(
        fabric.take_dma_cycles(),
        2 + 3,
        "what it should have waited"
    );
    let mut fabric = bridged(0x11);
    fabric.dma(0x4000_0010, 10, true);
    assert_eq!(fabric.data(0, 0x4000_0000, 10, false), 4);
    let mut fabric = bridged(0x1);
    fabric.dma(0x4000_0010, 10, true);
    assert_eq!(fabric.data(0, 0x4000_0000, 10, false), 0);
}

#[test]
fn a_dma_waits_for_cores_of_high_priority() {
    let mut fabric = bridged(0x11);
    // Four accesses in a row of one core at the bank that the DMA wants in the first cycle.
    fabric.dma(0x2000_0100, 10, false);
    let waited: u64 = (10..14)
        .map(|c| fabric.data(0, 0x2000_0104, c, false))
        .sum();
    assert_eq!(waited, 0);
    fabric.dma(0x2000_0108, 13, false);
    assert_eq!(
        fabric.take_dma_cycles(),
        1 + 1,
        "this one's turn, and what it owes"
    );
}

#[test]
fn what_others_may_take_from_a_core_is_not_held_apart() {
    for (priorities, held) in [(0, Some([1, 0])), (1 << 4, None), (0x11, Some([1, 0]))] {
        let mut fabric = Fabric::new(BANKS);
        fabric.set_priorities(priorities);
        fabric.data(0, 0x2000_0000, 10, false);
        assert_eq!(fabric.held(10), held);
        assert_eq!(fabric.held(11), Some([0; 2]));
    }
}
