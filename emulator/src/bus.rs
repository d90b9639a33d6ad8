//! The bus: plain memory, devices, the lines from devices to cores, and the pins.
//!
//! A device is whatever answers reads and writes in a range of addresses. Plain memory never asks
//! the bus; a device is asked with the exact cycle of the access, and is woken when it said it
//! wants to be. While it acts it holds the rest of the bus, so it may read and write memory (a DMA)
//! or other devices, and raise lines; its own range is then absent.
//!
//! Not here: what every core has for itself at 0xE0000000 (`system`).

use crate::apart::Trail;
use crate::board::{Board, BoardError};
use crate::fabric::Fabric;
use crate::lines::Lines;
use crate::memory::Memory;
use crate::pins::Pins;
use std::any::Any;

/// One access to a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Access {
    /// Bytes from the device's base; a multiple of `size`.
    pub offset: u32,
    /// 1, 2 or 4 bytes.
    pub size: u32,
    /// The core that asks; [`Access::DMA`] when a device does.
    pub core: usize,
    /// The cycle in which it asks.
    pub cycle: u64,
}

impl Access {
    /// The number that stands for a device as the asker.
    pub const DMA: usize = usize::MAX;
}

/// An access that nobody answers, which the core sees as a bus fault.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BusError;

/// Something on the bus that is not plain memory.
pub trait Device: Any {
    /// A load: the value in the low bits.
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError>;

    /// A store of the low `8 * access.size` bits of `value`.
    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError>;

    /// The cycle from which on [`Device::attend`] must be called. Asked after every access to the
    /// device and every call of `attend`; until then nothing about the device costs time.
    fn due(&self) -> u64 {
        u64::MAX
    }

    /// Called when `due` has come, at the first instruction boundary from then on.
    fn attend(&mut self, _cycle: u64, _bus: &mut Bus) {}

    /// Whether it answers a read or write there, and that changes nothing but the device, lines and
    /// pins: no memory, no other device, not what cores find where, nor who goes first. A core that
    /// has run ahead need not be taken back for it then.
    fn keeps_to_itself(&self, _offset: u32, _write: bool) -> bool {
        false
    }

    /// The chip resets its peripherals. The run ends with that, so only what a host sees afterwards
    /// matters: what outputs put out.
    fn reset(&mut self) {}
}

/// Cycles that accesses take beyond one; negative where a port is faster than the core's load or
/// store.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Waits {
    /// Of a read.
    pub read: i8,
    /// Of a write.
    pub write: i8,
}

/// What devices tell each other of without an access.
#[derive(Clone, Copy, Default)]
pub(crate) struct Notices {
    /// A pin has changed its level.
    pub pins: bool,
    /// A request of a device for a DMA has changed.
    pub requests: bool,
}

struct Slot {
    base: u32,
    bytes: u32,
    waits: Waits,
    due: u64,
    /// What wakes it besides, and the first and the last cycle in which it will: what changes
    /// before its turn in a cycle wakes it in the next one, too.
    watches: Notices,
    noticed: Option<(u64, u64)>,
    /// Absent while it acts.
    device: Option<Box<dyn Device>>,
}

/// Which device: as [`Bus::attach`] returned it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct DeviceId(usize);

/// Memory, devices and lines.
pub struct Bus {
    /// Plain memory.
    pub memory: Memory,
    /// Interrupts and events, devices to cores.
    pub lines: Lines,
    /// What is on the pins.
    pub pins: Pins,
    /// Who waits for whom.
    pub(crate) fabric: Fabric,
    /// What the core that runs apart has done, and whether one does.
    pub(crate) trail: Trail,
    pub(crate) apart: bool,
    /// The address of the last access that such a core was refused, and was aligned.
    pub(crate) refused: Option<u32>,
    /// Whether banks and memory are such that cores may run apart.
    pub(crate) divides: bool,
    slots: Vec<Slot>,
    /// Requests that came in the last cycle in which some did, and those of before that nobody has
    /// taken: a bit for every number.
    request_pulses: (u64, u64),
    request_pulses_before: u64,
    /// Whether a request for a DMA has changed since the DMA was told.
    pub(crate) requests_changed: bool,
    /// The earliest cycle in which one of them wants attention.
    due: u64,
    /// The address that each core's exclusive monitor guards.
    pub(crate) exclusives: Vec<Option<u32>>,
}

impl Bus {
    pub(crate) fn new(board: &Board) -> Result<Self, BoardError> {
        let lines = Lines::new(board.cores);
        let mut memory = Memory::new(board)?;
        let divides = memory.set_ports(&board.banks);
        Ok(Self {
            memory,
            lines,
            pins: Pins::none(),
            fabric: Fabric::new(&board.banks),
            trail: Trail::default(),
            apart: false,
            refused: None,
            divides,
            slots: Vec::new(),
            request_pulses: (0, 0),
            request_pulses_before: 0,
            requests_changed: false,
            due: u64::MAX,
            exclusives: vec![None; board.cores],
        })
    }

    /// A core's store ends the exclusive access of others to the same word.
    pub(crate) fn break_exclusives(&mut self, core: usize, address: u32) {
        for (other, tag) in self.exclusives.iter_mut().enumerate() {
            if other != core && tag.is_some_and(|guarded| (guarded ^ address) & !3 == 0) {
                *tag = None;
            }
        }
    }

    /// Begins a core's exclusive access.
    pub(crate) fn guard(&mut self, core: usize, address: u32) {
        self.exclusives[core] = Some(address);
        if self.exclusives.len() > 1 {
            self.memory.guard(address);
        }
    }

    /// Puts a device at `base`. Where two devices overlap, or one lies over memory, the first and
    /// memory win.
    pub fn attach(
        &mut self,
        base: u32,
        bytes: u32,
        waits: Waits,
        device: Box<dyn Device>,
    ) -> DeviceId {
        let (index, due) = (self.slots.len(), device.due());
        self.slots.push(Slot {
            base,
            bytes,
            waits,
            due: u64::MAX,
            watches: Notices::default(),
            noticed: None,
            device: Some(device),
        });
        self.set_due(index, due);
        DeviceId(index)
    }

    /// Calls the device too when there is notice of something, in the cycle after.
    pub(crate) fn watch(&mut self, id: DeviceId, watches: Notices) {
        if let Some(slot) = self.slots.get_mut(id.0) {
            slot.watches = watches;
        }
    }

    /// The device as what it is.
    pub fn device<T: Device>(&self, id: DeviceId) -> Option<&T> {
        let device: &dyn Any = self.slots.get(id.0)?.device.as_deref()?;
        device.downcast_ref()
    }

    /// The device as what it is, to change. When it changes when it is due, [`Bus::reschedule`].
    pub fn device_mut<T: Device>(&mut self, id: DeviceId) -> Option<&mut T> {
        let device: &mut dyn Any = self.slots.get_mut(id.0)?.device.as_deref_mut()?;
        device.downcast_mut()
    }

    /// Asks a device again when it is due.
    pub fn reschedule(&mut self, id: DeviceId) {
        if let Some(device) = self.slots.get(id.0).and_then(|s| s.device.as_ref()) {
            self.set_due(id.0, device.due());
        }
    }

    /// The earliest cycle in which a device wants attention.
    pub(crate) fn due(&self) -> u64 {
        self.due
    }

    fn set_due(&mut self, index: usize, due: u64) {
        let noticed = self.slots[index].noticed;
        let due = noticed.map_or(due, |(first, _)| due.min(first));
        if self.slots[index].due != due {
            self.slots[index].due = due;
            self.due = self.slots.iter().map(|s| s.due).min().unwrap_or(u64::MAX);
        }
    }

    /// Resets pins and all devices that know how.
    pub(crate) fn reset(&mut self, cycle: u64) {
        self.pins.reset(cycle);
        let devices = self.slots.iter_mut().filter_map(|s| s.device.as_mut());
        devices.for_each(|device| device.reset());
    }

    /// Calls every device that is due, in the order of time, each in the cycle that it asked for.
    pub(crate) fn attend(&mut self, cycle: u64) {
        while let Some((due, index)) = self.next_due().filter(|(due, _)| *due <= cycle) {
            let noticed = &mut self.slots[index].noticed;
            *noticed = noticed.and_then(|(_, last)| (last > due).then_some((last, last)));
            self.with_device(index, |device, bus| device.attend(due, bus));
            self.give_notice(due);
            let slot = &self.slots[index];
            if slot.device.is_some() && slot.due <= due {
                self.set_due(index, due + 1);
            }
        }
    }

    /// The device that is due first, of those that are not acting.
    fn next_due(&self) -> Option<(u64, usize)> {
        let present = self.slots.iter().enumerate();
        let dues = present.filter(|(_, slot)| slot.device.is_some() && slot.due != u64::MAX);
        dues.map(|(index, slot)| (slot.due, index)).min()
    }

    /// Everything that is due before a core's access is done before it.
    fn catch_up(&mut self, core: usize, cycle: u64) {
        if self.due <= cycle && core != Access::DMA {
            self.attend(cycle);
        }
    }

    /// A device requests one transfer.
    pub(crate) fn request_pulse(&mut self, request: u32, cycle: u64) {
        let (last, requests) = self.request_pulses;
        let others = if last == cycle {
            requests
        } else {
            self.request_pulses_before |= requests;
            0
        };
        self.request_pulses = (cycle, others | 1 << request);
        self.requests_changed = true;
    }

    /// The requests that came before a cycle, once.
    pub(crate) fn take_request_pulses(&mut self, cycle: u64) -> u64 {
        let before = std::mem::take(&mut self.request_pulses_before);
        if self.request_pulses.0 >= cycle {
            return before;
        }
        before | std::mem::take(&mut self.request_pulses.1)
    }

    /// Calls those who watch what has just changed, in the next cycle.
    pub(crate) fn give_notice(&mut self, cycle: u64) {
        let pins = self.pins.take_changed();
        let requests = std::mem::take(&mut self.requests_changed);
        if !pins && !requests {
            return;
        }
        for index in 0..self.slots.len() {
            let watches = self.slots[index].watches;
            if watches.pins && pins || watches.requests && requests {
                let noticed = &mut self.slots[index].noticed;
                let (first, last) = noticed.unwrap_or((cycle + 1, cycle + 1));
                *noticed = Some((first.min(cycle + 1), last.max(cycle + 1)));
                self.set_due(index, self.slots[index].due);
            }
        }
    }

    /// A read as a device makes it, from memory or another device.
    pub fn read(&mut self, address: u32, size: u32, cycle: u64) -> Result<u32, BusError> {
        self.fabric.dma(address, cycle, false);
        let mut bytes = [0; 4];
        match self
            .memory
            .read(address, &mut bytes[..size.min(4) as usize])
        {
            Ok(()) => Ok(u32::from_le_bytes(bytes)),
            Err(_) => self
                .device_read(address, size, Access::DMA, cycle)
                .map(|(value, _)| value),
        }
    }

    /// A write as a device makes it, to memory that can be written or to another device.
    pub fn write(
        &mut self,
        address: u32,
        size: u32,
        value: u32,
        cycle: u64,
    ) -> Result<(), BusError> {
        self.fabric.dma(address, cycle, true);
        match self.memory.region(address) {
            Some(region) if !region.writable => Err(BusError),
            Some(_) => self
                .memory
                .write(address, &value.to_le_bytes()[..size.min(4) as usize])
                .map_err(|_| BusError),
            None => self
                .device_write(address, size, value, Access::DMA, cycle)
                .map(|_| ()),
        }
    }

    pub(crate) fn device_read(
        &mut self,
        address: u32,
        size: u32,
        core: usize,
        cycle: u64,
    ) -> Result<(u32, i8), BusError> {
        let (index, offset) = self.find(address)?;
        self.catch_up(core, cycle);
        let value = self
            .with_device(index, |d, bus| {
                d.read(
                    Access {
                        offset,
                        size,
                        core,
                        cycle,
                    },
                    bus,
                )
            })
            .ok_or(BusError)??;
        self.give_notice(cycle);
        Ok((value, self.slots[index].waits.read))
    }

    pub(crate) fn device_write(
        &mut self,
        address: u32,
        size: u32,
        value: u32,
        core: usize,
        cycle: u64,
    ) -> Result<i8, BusError> {
        let (index, offset) = self.find(address)?;
        self.catch_up(core, cycle);
        self.with_device(index, |d, bus| {
            d.write(
                Access {
                    offset,
                    size,
                    core,
                    cycle,
                },
                value,
                bus,
            )
        })
        .ok_or(BusError)??;
        self.give_notice(cycle);
        Ok(self.slots[index].waits.write)
    }

    fn find(&self, address: u32) -> Result<(usize, u32), BusError> {
        let offset = |s: &Slot| address.wrapping_sub(s.base);
        let index = self
            .slots
            .iter()
            .position(|s| offset(s) < s.bytes)
            .ok_or(BusError)?;
        Ok((index, offset(&self.slots[index])))
    }

    /// Whether a device is there that keeps to itself.
    pub(crate) fn keeps_to_itself(&self, address: u32, write: bool) -> bool {
        if self.memory.region(address).is_some() || crate::access::is_private(address) {
            return false;
        }
        let found = self.find(address).ok();
        found.is_some_and(|(index, offset)| {
            let device = self.slots[index].device.as_ref();
            device.is_some_and(|device| device.keeps_to_itself(offset, write))
        })
    }

    /// The device at an address.
    #[cfg(test)]
    pub(crate) fn at(&self, address: u32) -> Option<DeviceId> {
        self.find(address).ok().map(|(index, _)| DeviceId(index))
    }

    /// Lets a device act on the rest of the bus. Nothing when it is acting already.
    fn with_device<T>(
        &mut self,
        index: usize,
        act: impl FnOnce(&mut dyn Device, &mut Self) -> T,
    ) -> Option<T> {
        let mut device = self.slots[index].device.take()?;
        let result = act(device.as_mut(), self);
        let due = device.due();
        self.slots[index].device = Some(device);
        self.set_due(index, due);
        Some(result)
    }
}
