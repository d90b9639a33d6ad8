//! What an instruction asks of the machine beyond its own state.

use crate::stop::{FaultKind, Reason};

/// A request that ends an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Trap {
    /// A fault; the instruction has changed nothing that matters.
    Fault {
        kind: FaultKind,
        reason: Reason,
        address: u32,
    },
    /// SVC.
    SupervisorCall,
    /// BKPT with its number.
    Breakpoint(u8),
    /// A branch to this EXC_RETURN value in Handler mode.
    ExceptionReturn(u32),
    /// WFI.
    WaitForInterrupt,
    /// WFE.
    WaitForEvent,
    /// SEV.
    SendEvent,
}
