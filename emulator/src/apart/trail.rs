//! What a core did apart: ports, accesses and stores, to be checked against the other core's and
//! taken back.

use crate::bus::Bus;
use crate::core::Run;
use crate::memory::Replaced;
use std::mem::offset_of;

/// What a core did apart.
#[derive(Default)]
pub(crate) struct Trail {
    /// The ports that it used, a bit each.
    pub(super) ports: u32,
    /// The instruction of the stretch that runs.
    pub(super) op: u8,
    /// Accesses: instruction of the stretch, and port. Translated code leaves out those that are an
    /// instruction's only one.
    pub(crate) accesses: Log<[u8; 2]>,
    pub(crate) replaced: Log<Replaced>,
    pub(crate) stretches: Log<Stretch>,
}

/// A list that translated code adds to, which has made room for it before.
#[derive(Default)]
pub(crate) struct Log<T> {
    room: Vec<T>,
    len: usize,
}

impl<T: Copy + Default> Log<T> {
    /// Makes room for so many more: where the first one is, whatever is added.
    pub fn reserve(&mut self, more: usize) -> *mut T {
        let wanted = self.len + more;
        if self.room.len() < wanted {
            self.room.resize(wanted.next_power_of_two(), T::default());
        }
        self.room.as_mut_ptr()
    }

    pub fn truncate(&mut self, len: usize) {
        self.len = len.min(self.len);
    }

    #[inline(always)]
    pub fn push(&mut self, entry: T) {
        self.reserve(1);
        self.room[self.len] = entry;
        self.len += 1;
    }
}

impl<T> std::ops::Deref for Log<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.room[..self.len]
    }
}

/// Instructions that ran, and how it was before them.
#[derive(Clone, Copy, Default)]
pub(crate) struct Stretch {
    pub run: Run,
    pub outcomes: u64,
    pub pipe: u16,
    pub cycle: u64,
    /// How many accesses there were, and the ports that were used.
    pub accesses: usize,
    pub ports: u32,
}

/// How much was noted before a stretch.
#[derive(Clone, Copy, Default)]
#[repr(C)]
pub(crate) struct Before {
    pub replaced: usize,
    pub accesses: usize,
    pub ports: u32,
}

impl Before {
    #[inline(always)]
    pub fn of(trail: &Trail) -> Self {
        Self {
            replaced: trail.replaced.len(),
            accesses: trail.accesses.len(),
            ports: trail.ports,
        }
    }
}

impl Trail {
    /// Where the number of the instruction is, for translated code.
    pub(crate) const OP: usize = offset_of!(Trail, op);
    /// Where the ports are that were used.
    pub(crate) const PORTS: usize = offset_of!(Trail, ports);
    /// Where the numbers of accesses and of stores are.
    pub(crate) const ACCESSES: usize = offset_of!(Trail, accesses) + offset_of!(Log<[u8; 2]>, len);
    pub(crate) const REPLACED: usize = offset_of!(Trail, replaced) + offset_of!(Log<Replaced>, len);
    /// Where the number of stretches is.
    pub(crate) const STRETCHES: usize =
        offset_of!(Trail, stretches) + offset_of!(Log<Stretch>, len);

    pub(super) fn begin(&mut self, ports: u32) {
        self.ports = ports;
        self.accesses.truncate(0);
        self.replaced.truncate(0);
        self.stretches.truncate(0);
    }

    #[inline(always)]
    fn note(&mut self, port: u8) {
        self.ports |= 1_u32.checked_shl(port.into()).unwrap_or(0);
        self.accesses.push([self.op, port]);
    }
}

impl Bus {
    /// A load of a core that runs apart; nothing when it has to be exact.
    pub(crate) fn load_apart(&mut self, address: u32, size: u32) -> Option<u32> {
        if !self.apart || !address.is_multiple_of(size) {
            return None;
        }
        let Some((value, port)) = self.memory.read_apart(address, size) else {
            self.refused = Some(address);
            return None;
        };
        self.trail.note(port);
        Some(value)
    }

    /// A store of a core that runs apart; nothing when it has to be exact.
    pub(crate) fn store_apart(&mut self, address: u32, size: u32, value: u32) -> Option<()> {
        if !self.apart || !address.is_multiple_of(size) {
            return None;
        }
        let Some((mut replaced, port)) = self.memory.write_apart(address, size, value) else {
            self.refused = Some(address);
            return None;
        };
        replaced.op = self.trail.op;
        self.trail.note(port);
        self.trail.replaced.push(replaced);
        Some(())
    }

    /// Takes back what the last instruction of a stretch did before it turned out that it has to be
    /// exact: its stores, those after the first `kept`, and its accesses, of those after the first
    /// `before`.
    #[cold]
    pub(super) fn undo(&mut self, kept: usize, before: usize) {
        let trail = &mut self.trail;
        let others = trail.replaced[kept..].iter();
        let others = others
            .take_while(|replaced| replaced.op != trail.op)
            .count();
        let of_others = trail.accesses[before..].iter();
        let of_others = of_others.take_while(|access| access[0] != trail.op).count();
        trail.accesses.truncate(before + of_others);
        self.take_back(kept + others);
    }
}

impl Bus {
    /// Takes all but the first `kept` stores back.
    pub(super) fn take_back(&mut self, kept: usize) {
        for replaced in self.trail.replaced[kept..].iter().rev() {
            self.memory.put_back(replaced);
        }
        self.trail.replaced.truncate(kept);
    }
}
