//! The bus fabric's registers (RP2350 datasheet 12.15.4, RP2040 datasheet 2.1.5): priorities, which
//! are acknowledged at once. The counters of accesses stay at zero.

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;
use crate::device::registers::{Registers, Row, held, words};

const PRIORITY: u32 = 0;
const ROWS: &[Row] = &[held(PRIORITY, 0, 0x1111), held(4, 1, 0), words(8, 9)];

/// See the module.
pub(crate) struct BusCtrl(Registers);

impl BusCtrl {
    pub(crate) fn new() -> Self {
        Self(Registers::new(ROWS))
    }
}

impl Device for BusCtrl {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.0.read(access, bus)
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.0.write(access, value, bus)?;
        if alias::plain(access.offset) & !3 == PRIORITY {
            let priorities = self.0.read(
                Access {
                    offset: PRIORITY,
                    size: 4,
                    ..access
                },
                bus,
            )?;
            bus.fabric.set_priorities(priorities);
        }
        Ok(())
    }
}
