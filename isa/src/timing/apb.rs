//! The peripheral bus of RP2040 and RP2350: what an access to a device on it takes beyond a cycle.
//!
//! A bridge stands between the crossbar and the peripherals; each access goes through it by itself.
//! What a device adds, and who else is at the bridge, come on top; the firmware's frame reads and
//! writes one device that adds nothing.

use super::facts::{Evidence, Fact};

/// More cycles of a read: at least 3 in all.
pub const READ: Fact = Fact::new(2, Evidence::Rule, "RP2350 datasheet 2.1.5");
/// More cycles of a write: at least 4 in all.
pub const WRITE: Fact = Fact::new(3, Evidence::Rule, "RP2350 datasheet 2.1.5");

/// Whether an address is on the bus.
pub const fn holds(address: u32) -> bool {
    address >> 28 == 4
}
