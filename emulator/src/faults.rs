//! Faults: their status registers, which handler takes them, and when none can.

use crate::board::CoreKind;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::stop::{Fault, FaultKind, Reason};
use crate::system::nvic::{BUS_FAULT, HARD_FAULT, MEM_MANAGE, USAGE_FAULT};

/// `B .`, which is how start-up code says that there is no handler.
const BRANCH_TO_SELF: u16 = 0xe7fe;

/// The bit of CFSR that a fault sets.
fn cfsr_bit(kind: FaultKind, reason: Reason) -> u32 {
    match (kind, reason) {
        (FaultKind::MemManage, _) => 1 << 0,
        (_, Reason::Fetch) => 1 << 8,
        (_, Reason::Read | Reason::Write) => 1 << 9,
        (_, Reason::Unstacking) => 1 << 11,
        (_, Reason::Stacking) => 1 << 12,
        (_, Reason::LazyStacking) => 1 << 13,
        (_, Reason::Undefined | Reason::Unpredictable(_)) => 1 << 16,
        (_, Reason::InvalidState) => 1 << 17,
        (_, Reason::InvalidReturn) => 1 << 18,
        (_, Reason::NoCoprocessor) => 1 << 19,
        (_, Reason::StackOverflow) => 1 << 20,
        (_, Reason::Unaligned) => 1 << 24,
        (_, Reason::DivideByZero) => 1 << 25,
        _ => 0,
    }
}

/// BFARVALID.
const ADDRESS_VALID: u32 = 1 << 15;
/// HFSR bits: a vector could not be read; another exception escalated.
const VECTTBL: u32 = 1 << 1;
const FORCED: u32 = 1 << 30;

impl Cpu {
    /// Sets the status registers and gives the exception that takes the fault.
    pub(crate) fn fault_exception(&mut self, fault: &Fault) -> u32 {
        let number = match fault.kind {
            FaultKind::HardFault => HARD_FAULT,
            FaultKind::MemManage => MEM_MANAGE,
            FaultKind::BusFault => BUS_FAULT,
            FaultKind::UsageFault => USAGE_FAULT,
        };
        if self.kind == CoreKind::CortexM0Plus {
            return HARD_FAULT;
        }
        self.system.cfsr |= cfsr_bit(fault.kind, fault.reason);
        if matches!(fault.reason, Reason::Read | Reason::Write) {
            self.system.cfsr |= ADDRESS_VALID;
            self.system.bfar = fault.address;
        }
        let preempts = self.priority_group_of(number) < self.priority();
        if number != HARD_FAULT && self.system.is_fault_enabled(number) && preempts {
            return number;
        }
        self.system.hfsr |= if fault.reason == Reason::Vector {
            VECTTBL
        } else {
            FORCED
        };
        HARD_FAULT
    }

    /// Whether not even HardFault can be taken.
    pub(crate) fn is_locked_up(&self) -> bool {
        self.priority() <= -1
    }

    /// Whether an exception has a handler that does more than `B .`.
    pub(crate) fn has_handler(&self, bus: &Bus, number: u32) -> bool {
        let mut word = [0; 4];
        let table = self.system.vtor.wrapping_add(4 * number);
        let vector = bus
            .memory
            .read(table, &mut word)
            .map(|()| u32::from_le_bytes(word))
            .unwrap_or(0);
        let first = bus.memory.halfword(vector & !1);
        vector & 1 != 0 && first.is_some_and(|hw| hw != BRANCH_TO_SELF && hw >> 8 != 0xbe)
    }
}
