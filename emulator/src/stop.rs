//! Why a run ended, and faults in words.

use std::fmt;

/// Why a run ended.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Stop {
    /// The function that was called came back.
    Returned {
        /// Cycles from the entry of the function to its return, without the caller's branch.
        cycles: u64,
        /// R0 and R1.
        result: [u32; 2],
    },
    /// A fault that the program cannot handle: its handler is absent, or the core has locked up.
    Fault(Fault),
    /// The limit of cycles was reached.
    Limit,
    /// The program ended by semihosting.
    Exit {
        /// Its exit code; 0 is success.
        code: u32,
    },
    /// A breakpoint, the caller's or a BKPT; the instruction has not run.
    Breakpoint {
        /// Which core.
        core: usize,
        /// Where.
        address: u32,
    },
    /// An access that is watched; the instruction has run.
    Watchpoint {
        /// Which core.
        core: usize,
        /// The instruction.
        pc: u32,
        /// What it accessed.
        address: u32,
        /// Whether it stored.
        write: bool,
    },
    /// All cores sleep and nothing will wake them.
    Asleep,
    /// The program or its watchdog asked for a reset of the system.
    Reset,
    /// The auxiliary source of a clock was changed while it was in use: nobody knows what a chip
    /// does then.
    Glitch {
        /// Which clock.
        clock: &'static str,
    },
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Returned { cycles, result } => {
                write!(f, "returned {:#x} after {cycles} cycles", result[0])
            }
            Self::Fault(fault) => fault.fmt(f),
            Self::Limit => f.write_str("the limit of cycles was reached"),
            Self::Exit { code } => write!(f, "exit {code}"),
            Self::Breakpoint { core, address } => {
                write!(f, "core {core}: breakpoint at {address:#010x}")
            }
            Self::Watchpoint {
                core,
                pc,
                address,
                write,
            } => {
                let verb = if *write { "stores to" } else { "loads from" };
                write!(
                    f,
                    "core {core}: {pc:#010x} {verb} {address:#010x}, which is watched"
                )
            }
            Self::Asleep => f.write_str("all cores sleep and nothing will wake them"),
            Self::Reset => f.write_str("the program or its watchdog asked for a reset"),
            Self::Glitch { clock } => write!(
                f,
                "{clock} glitched: its auxiliary source was changed while it was in use"
            ),
        }
    }
}

/// The exception that a fault raises.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum FaultKind {
    /// HardFault, number 3.
    HardFault,
    /// MemManage, number 4.
    MemManage,
    /// BusFault, number 5.
    BusFault,
    /// UsageFault, number 6.
    UsageFault,
}

/// Why a fault was raised.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reason {
    /// The halfwords are UNDEFINED.
    Undefined,
    /// The halfwords are UNPREDICTABLE.
    Unpredictable(whippen_isa::Why),
    /// An access that must be aligned is not.
    Unaligned,
    /// A division by zero, which CCR.DIV_0_TRP traps.
    DivideByZero,
    /// A coprocessor that is absent or not enabled in CPACR.
    NoCoprocessor,
    /// A branch to an even address: there is no ARM state.
    InvalidState,
    /// A stack pointer below its limit.
    StackOverflow,
    /// An exception return that does not fit the state of the core.
    InvalidReturn,
    /// A load from where nothing answers.
    Read,
    /// A store to where nothing answers or that cannot be written.
    Write,
    /// Execution where there is no memory.
    Fetch,
    /// Execution of a region that never executes.
    ExecuteNever,
    /// While registers were saved for an exception.
    Stacking,
    /// While registers were restored after an exception.
    Unstacking,
    /// While floating-point registers were saved lazily.
    LazyStacking,
    /// While a vector was read.
    Vector,
    /// SVC where its priority does not let it be taken.
    Escalated,
}

impl Reason {
    /// The exception that it raises, where the reason alone decides.
    pub(crate) fn kind(self) -> Option<FaultKind> {
        match self {
            Self::Fetch => Some(FaultKind::BusFault),
            Self::ExecuteNever => Some(FaultKind::MemManage),
            _ => None,
        }
    }

    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Undefined => "undefined instruction",
            Self::Unpredictable(_) => "unpredictable instruction",
            Self::Unaligned => "unaligned access",
            Self::DivideByZero => "division by zero",
            Self::NoCoprocessor => {
                "coprocessor absent or disabled (floating point: CP10 and CP11 in CPACR)"
            }
            Self::InvalidState => "branch to an even address (no Thumb bit)",
            Self::StackOverflow => "stack pointer below its limit",
            Self::InvalidReturn => "invalid exception return",
            Self::Read => "nothing answers a load",
            Self::Write => "nothing takes a store",
            Self::Fetch => "no code",
            Self::ExecuteNever => "execution of memory that never executes",
            Self::Stacking => "no stack for the exception's frame",
            Self::Unstacking => "no stack frame to return with",
            Self::LazyStacking => "no stack for the floating-point registers",
            Self::Vector => "the vector cannot be read",
            Self::Escalated => "SVC where its priority does not let it be taken",
        }
    }
}

/// A fault: what, where, and by which instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fault {
    /// Which core.
    pub core: usize,
    /// The exception it raises.
    pub kind: FaultKind,
    /// Why.
    pub reason: Reason,
    /// The instruction.
    pub pc: u32,
    /// The address of the access; of a fault that is none, the instruction's.
    pub address: u32,
    /// Set when the core locked up: a second fault where none can be taken.
    pub lockup: bool,
}

/// As in `UsageFault: unaligned access at 0x20000102 by the instruction at 0x10000200`.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?}: {} at {:#010x}",
            self.kind,
            self.reason.text(),
            self.address
        )?;
        if let Reason::Unpredictable(why) = self.reason {
            write!(f, " ({why:?})")?;
        }
        if self.address != self.pc {
            write!(f, " by the instruction at {:#010x}", self.pc)?;
        }
        if self.core != 0 {
            write!(f, " of core {}", self.core)?;
        }
        if self.lockup {
            f.write_str("; the core has locked up")?;
        }
        Ok(())
    }
}
