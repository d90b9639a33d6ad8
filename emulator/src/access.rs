//! Loads and stores of a core: plain memory at once, everything else the slow way.
//!
//! ```text
//!   aligned, in a plain page? --yes--> done
//!        | no
//!   is the cycle known (`Cpu::exact`)? --no--> does the core run apart, and is it plain? --yes--> done (`apart`)
//!        | yes                                    | no
//!        |                                        Flow::Inexact: the machine runs the instruction again, knowing it
//!        | yes
//!   unaligned? code? wait states? private peripherals? device? nobody: BusFault
//! ```

use crate::board::CoreKind;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::memory::Memory;
use crate::op::Flow;
use crate::stop::{FaultKind, Reason};

/// What is loaded or stored: a size, and for a load the extension.
pub(crate) trait Datum {
    const SIZE: u32;
    fn fast_read(memory: &Memory, address: u32) -> Option<u32>;
    fn fast_write(memory: &mut Memory, address: u32, value: u32) -> Option<()>;
    fn extend(value: u32) -> u32;
}

macro_rules! data {
    ($($type:ident $size:literal,)+) => {
        $(impl Datum for $type {
            const SIZE: u32 = $size;
            #[inline(always)]
            fn fast_read(memory: &Memory, address: u32) -> Option<u32> {
                memory.fast_read::<$size>(address).map(|bytes| $type::from_le_bytes(bytes) as u32)
            }
            #[inline(always)]
            fn fast_write(memory: &mut Memory, address: u32, value: u32) -> Option<()> {
                memory.fast_write::<$size>(address, (value as $type).to_le_bytes())
            }
            fn extend(value: u32) -> u32 {
                value as $type as u32
            }
        })+
    };
}

data! { u8 1, i8 1, u16 2, i16 2, u32 4, }

/// Extra cycles of an access that is not aligned: it is made as two.
const UNALIGNED_CYCLES: i64 = 1;

impl Cpu {
    /// Loads from an address that need not be aligned.
    #[inline(always)]
    pub(crate) fn load<T: Datum>(&mut self, bus: &mut Bus, address: u32) -> Result<u32, Flow> {
        if address & (T::SIZE - 1) == 0
            && let Some(value) = T::fast_read(&bus.memory, address)
        {
            return Ok(value);
        }
        self.load_slow(bus, address, T::SIZE, false).map(T::extend)
    }

    /// Loads from an address that must be aligned.
    #[inline(always)]
    pub(crate) fn load_aligned<T: Datum>(
        &mut self,
        bus: &mut Bus,
        address: u32,
    ) -> Result<u32, Flow> {
        if address & (T::SIZE - 1) == 0
            && let Some(value) = T::fast_read(&bus.memory, address)
        {
            return Ok(value);
        }
        self.load_slow(bus, address, T::SIZE, true).map(T::extend)
    }

    /// Stores to an address that need not be aligned.
    #[inline(always)]
    pub(crate) fn store<T: Datum>(
        &mut self,
        bus: &mut Bus,
        address: u32,
        value: u32,
    ) -> Result<(), Flow> {
        if address & (T::SIZE - 1) == 0 && T::fast_write(&mut bus.memory, address, value).is_some()
        {
            return Ok(());
        }
        self.store_slow(bus, address, T::SIZE, value, false)
    }

    /// Stores to an address that must be aligned.
    #[inline(always)]
    pub(crate) fn store_aligned<T: Datum>(
        &mut self,
        bus: &mut Bus,
        address: u32,
        value: u32,
    ) -> Result<(), Flow> {
        if address & (T::SIZE - 1) == 0 && T::fast_write(&mut bus.memory, address, value).is_some()
        {
            return Ok(());
        }
        self.store_slow(bus, address, T::SIZE, value, true)
    }

    #[cold]
    #[inline(never)]
    fn load_slow(
        &mut self,
        bus: &mut Bus,
        address: u32,
        size: u32,
        aligned: bool,
    ) -> Result<u32, Flow> {
        if !self.exact {
            return bus.load_apart(address, size).ok_or(Flow::Inexact);
        }
        if !address.is_multiple_of(size) {
            self.check_alignment(address, aligned)?;
            return self.load_bytes(bus, address, size);
        }
        self.note_access(bus, address, size, false);
        self.arbitrate(bus, address, false);
        self.load_one(bus, address, size)
    }

    #[cold]
    #[inline(never)]
    fn store_slow(
        &mut self,
        bus: &mut Bus,
        address: u32,
        size: u32,
        value: u32,
        aligned: bool,
    ) -> Result<(), Flow> {
        let unseen = !bus.memory.is_shared() && address.is_multiple_of(size);
        if unseen && bus.memory.write_beside_code(address, size, value) {
            bus.break_exclusives(self.index, address);
            return Ok(());
        }
        if !self.exact {
            return bus.store_apart(address, size, value).ok_or(Flow::Inexact);
        }
        if !address.is_multiple_of(size) {
            self.check_alignment(address, aligned)?;
            return self.store_bytes(bus, address, size, value);
        }
        self.note_access(bus, address, size, true);
        self.arbitrate(bus, address, true);
        self.store_one(bus, address, size, value)
    }

    /// Waits for the port of an access, when others may use it. Accesses of one instruction follow
    /// each other by a cycle.
    fn arbitrate(&mut self, bus: &mut Bus, address: u32, write: bool) {
        if bus.memory.is_shared() {
            let cycle = self.now.saturating_add_signed(self.stall) + self.accesses;
            let wait = bus.fabric.data(self.index, address, cycle, write);
            self.stall += wait as i64;
            self.accesses += 1;
        }
    }

    /// Unaligned accesses are faults in ARMv6-M, for some instructions, and when CCR says so.
    fn check_alignment(&mut self, address: u32, aligned: bool) -> Result<(), Flow> {
        let is_device = address >> 29 == 2 || address >> 29 >= 5;
        if aligned
            || is_device
            || self.kind == CoreKind::CortexM0Plus
            || self.system.traps_unaligned()
        {
            return Err(self.fault(FaultKind::UsageFault, Reason::Unaligned, address));
        }
        self.stall += UNALIGNED_CYCLES;
        Ok(())
    }

    fn load_bytes(&mut self, bus: &mut Bus, address: u32, size: u32) -> Result<u32, Flow> {
        self.note_access(bus, address, size, false);
        let mut value = 0;
        for i in 0..size {
            value |= self.load_one(bus, address.wrapping_add(i), 1)? << (8 * i);
        }
        Ok(value)
    }

    fn store_bytes(
        &mut self,
        bus: &mut Bus,
        address: u32,
        size: u32,
        value: u32,
    ) -> Result<(), Flow> {
        self.note_access(bus, address, size, true);
        for i in 0..size {
            self.store_one(bus, address.wrapping_add(i), 1, value >> (8 * i))?;
        }
        Ok(())
    }

    /// Remembers the first access to a watched range.
    fn note_access(&mut self, bus: &mut Bus, address: u32, size: u32, write: bool) {
        if self.watched.is_none() && bus.memory.is_watched(address, size, write) {
            self.watched = Some((address, write));
        }
    }

    fn load_one(&mut self, bus: &mut Bus, address: u32, size: u32) -> Result<u32, Flow> {
        if let Some((value, wait)) = bus.memory.slow_read(address, size) {
            self.stall += i64::from(wait);
            return Ok(value);
        }
        let answer = match is_private(address) {
            true => self.system_read(address, size).map(|value| (value, 0)),
            false => bus.device_read(address, size, self.index, self.now).ok(),
        };
        match answer {
            Some((value, wait)) => {
                self.stall += i64::from(wait);
                Ok(value)
            }
            None => Err(self.fault(FaultKind::BusFault, Reason::Read, address)),
        }
    }

    fn store_one(
        &mut self,
        bus: &mut Bus,
        address: u32,
        size: u32,
        value: u32,
    ) -> Result<(), Flow> {
        if let Some(wait) = bus.memory.slow_write(address, size, value) {
            bus.break_exclusives(self.index, address);
            self.stall += i64::from(wait);
            return Ok(());
        }
        let answer = match is_private(address) {
            true => self.system_write(address, size, value).map(|()| 0),
            false => bus
                .device_write(address, size, value, self.index, self.now)
                .ok(),
        };
        match answer {
            Some(wait) => {
                self.stall += i64::from(wait);
                Ok(())
            }
            None => Err(self.fault(FaultKind::BusFault, Reason::Write, address)),
        }
    }
}

/// Whether an address belongs to the core itself.
pub(crate) fn is_private(address: u32) -> bool {
    address >> 20 == 0xe00
}
