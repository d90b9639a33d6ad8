//! What a core did apart: ports, accesses and stores, to be checked against the other core's and
//! taken back.

use crate::bus::Bus;
use crate::core::Run;
use crate::memory::Replaced;

/// What a core did apart.
#[derive(Default)]
pub(crate) struct Trail {
    /// The ports that it used, a bit each.
    pub(super) ports: u32,
    /// The instruction of the stretch that runs.
    pub(super) op: u8,
    /// Accesses: instruction of the stretch, and port.
    pub(super) accesses: Vec<(u8, u8)>,
    pub(super) replaced: Vec<Replaced>,
    pub(super) stretches: Vec<Stretch>,
}

/// Instructions that ran, and how it was before them.
pub(super) struct Stretch {
    pub(super) run: Run,
    pub(super) outcomes: u64,
    pub(super) pipe: u16,
    pub(super) cycle: u64,
    /// How many accesses there were.
    pub(super) accesses: usize,
}

impl Trail {
    /// Where the number of the instruction is, for translated code.
    pub(crate) const OP: usize = std::mem::offset_of!(Trail, op);

    pub(super) fn begin(&mut self, ports: u32) {
        self.ports = ports;
        self.accesses.clear();
        self.replaced.clear();
        self.stretches.clear();
    }

    #[inline(always)]
    fn note(&mut self, port: u8) {
        self.ports |= 1_u32.checked_shl(port.into()).unwrap_or(0);
        self.accesses.push((self.op, port));
    }
}

impl Bus {
    /// A load of a core that runs apart; nothing when it has to be exact.
    pub(crate) fn load_apart(&mut self, address: u32, size: u32) -> Option<u32> {
        if !self.apart || !address.is_multiple_of(size) {
            return None;
        }
        let (value, port) = self.memory.read_apart(address, size)?;
        self.trail.note(port);
        Some(value)
    }

    /// A store of a core that runs apart; nothing when it has to be exact.
    pub(crate) fn store_apart(&mut self, address: u32, size: u32, value: u32) -> Option<()> {
        if !self.apart || !address.is_multiple_of(size) {
            return None;
        }
        let (replaced, port) = self.memory.write_apart(address, size, value)?;
        self.trail.note(port);
        self.trail.replaced.push(replaced);
        Some(())
    }

    /// Takes back what an instruction did before it turned out that it has to be exact: its stores,
    /// those after the first `kept`, and its accesses, of those after the first `before`.
    #[cold]
    pub(super) fn undo(&mut self, kept: usize, before: usize) {
        self.take_back(kept);
        let (op, accesses) = (self.trail.op, &mut self.trail.accesses);
        while accesses.len() > before && accesses.last().is_some_and(|last| last.0 == op) {
            accesses.pop();
        }
    }
}

impl Bus {
    /// Takes all but the first `kept` stores back.
    pub(super) fn take_back(&mut self, kept: usize) {
        for replaced in self.trail.replaced.drain(kept..).rev() {
            self.memory.put_back(&replaced);
        }
    }
}
