//! The state of one core, as the architecture defines it: registers, flags, special registers.
//!
//! N and Z are kept as words (the sign of one, whether the other is zero), so that setting flags
//! costs no comparison. R13 is the stack pointer in use; the other one lies beside it. R15 is only
//! an operand: the address of the next instruction is `pc`.

use crate::board::CoreKind;
use crate::system::System;
use whippen_isa::{Cond, ItState};

/// A core.
#[derive(Clone)]
pub struct Cpu {
    pub(crate) kind: CoreKind,
    pub(crate) index: usize,
    pub(crate) r: [u32; 16],
    /// The address of the next instruction.
    pub(crate) pc: u32,
    /// The stack pointer that R13 is not: PSP while MSP is in use.
    pub(crate) other_sp: u32,
    /// N is its sign.
    pub(crate) negative: u32,
    /// Z is whether it is zero.
    pub(crate) zero: u32,
    pub(crate) carry: bool,
    pub(crate) overflow: bool,
    pub(crate) q: bool,
    pub(crate) ge: u8,
    pub(crate) it: ItState,
    pub(crate) thumb: bool,
    /// The exception being handled; 0 in Thread mode.
    pub(crate) ipsr: u32,
    pub(crate) s: [u32; 32],
    pub(crate) fpscr: u32,
    pub(crate) primask: bool,
    pub(crate) faultmask: bool,
    pub(crate) basepri: u32,
    pub(crate) control: u32,
    pub(crate) msplim: u32,
    pub(crate) psplim: u32,
    /// Whether floating-point instructions need no preparation: allowed, context active, nothing to
    /// be saved.
    pub(crate) float_ready: bool,
    /// The first access of the instruction to a watched range: address, and whether it stored.
    pub(crate) watched: Option<(u32, bool)>,
    /// The event register of WFE.
    pub(crate) event: bool,
    pub(crate) activity: Activity,
    pub(crate) system: System,
    /// The cycle of the instruction, when `exact`.
    pub(crate) now: u64,
    /// Whether `now` holds, so that devices may be accessed.
    pub(crate) exact: bool,
    /// Cycles lost to wait states since they were last charged.
    pub(crate) stall: i64,
    /// Accesses of this instruction that were arbitrated.
    pub(crate) accesses: u64,
    /// What the instruction did that timing depends on: see `outcome`.
    pub(crate) outcomes: u64,
    pub(crate) trap: Option<crate::trap::Trap>,
}

/// Names what of a core is saved and put back.
macro_rules! saved {
    ($($field:ident: $kind:ty,)*) => {
        /// What instructions change that do not need the exact cycle: all but the system's
        /// registers.
        #[derive(Clone, Copy)]
        pub(crate) struct SavedRegisters {
            $($field: $kind,)*
        }

        impl Cpu {
            /// What instructions change that do not need the exact cycle.
            pub(crate) fn registers(&self) -> SavedRegisters {
                SavedRegisters { $($field: self.$field,)* }
            }

            /// Puts them back.
            pub(crate) fn set_registers(&mut self, saved: &SavedRegisters) {
                $(self.$field = saved.$field;)*
            }
        }
    };
}

saved! {
    r: [u32; 16],
    pc: u32,
    negative: u32,
    zero: u32,
    carry: bool,
    overflow: bool,
    q: bool,
    ge: u8,
    it: ItState,
    thumb: bool,
    s: [u32; 32],
    fpscr: u32,
    outcomes: u64,
}

/// Whether a core runs.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Activity {
    /// It executes.
    Running,
    /// It waits for an interrupt (WFI).
    WaitingForInterrupt,
    /// It waits for an event or an interrupt (WFE).
    WaitingForEvent,
    /// It has not been started.
    Halted,
}

impl Cpu {
    pub(crate) fn new(kind: CoreKind, index: usize, interrupts: usize) -> Self {
        Self {
            kind,
            index,
            r: [0; 16],
            pc: 0,
            other_sp: 0,
            negative: 0,
            zero: 1,
            carry: false,
            overflow: false,
            q: false,
            ge: 0,
            it: ItState::OUTSIDE,
            thumb: true,
            ipsr: 0,
            s: [0; 32],
            fpscr: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            control: 0,
            msplim: 0,
            psplim: 0,
            float_ready: false,
            watched: None,
            event: false,
            activity: Activity::Halted,
            system: System::new(kind, interrupts),
            now: 0,
            exact: false,
            stall: 0,
            accesses: 0,
            outcomes: 1,
            trap: None,
        }
    }

    /// Prepares for an instruction that begins in a known cycle.
    pub(crate) fn begin(&mut self, cycle: u64) {
        self.now = cycle;
        self.exact = true;
        self.stall = 0;
        self.accesses = 0;
        self.outcomes = 1;
        self.trap = None;
    }

    /// The kind of core.
    pub fn kind(&self) -> CoreKind {
        self.kind
    }

    /// Whether it runs.
    pub fn activity(&self) -> Activity {
        self.activity
    }

    /// The exception being handled; 0 in Thread mode.
    pub fn exception(&self) -> u32 {
        self.ipsr
    }

    /// `ConditionPassed()`.
    #[inline(always)]
    pub(crate) fn holds(&self, cond: Cond) -> bool {
        cond.holds(
            self.negative >> 31 != 0,
            self.zero == 0,
            self.carry,
            self.overflow,
        )
    }

    /// Sets all four flags by a result, a carry and an overflow.
    #[inline(always)]
    pub(crate) fn set_nzcv(&mut self, result: u32, c: bool, v: bool) {
        self.negative = result;
        self.zero = result;
        self.carry = c;
        self.overflow = v;
    }

    /// APSR: N, Z, C, V, Q and GE in their places.
    pub(crate) fn apsr(&self) -> u32 {
        let flag = |set: bool, place: u32| u32::from(set) << place;
        self.negative & 1 << 31
            | flag(self.zero == 0, 30)
            | flag(self.carry, 29)
            | flag(self.overflow, 28)
            | flag(self.q, 27)
            | u32::from(self.ge) << 16
    }

    /// Sets N, Z, C and V from their places.
    pub(crate) fn set_nzcv_bits(&mut self, word: u32) {
        self.negative = word;
        self.zero = !word & 1 << 30;
        self.carry = word >> 29 & 1 != 0;
        self.overflow = word >> 28 & 1 != 0;
    }

    /// XPSR: the flags, ITSTATE, T and the exception's number.
    pub(crate) fn xpsr(&self) -> u32 {
        let it = u32::from(self.it.bits());
        let epsr = (it & 3) << 25 | (it >> 2) << 10 | u32::from(self.thumb) << 24;
        self.apsr() | epsr | self.ipsr
    }

    /// Sets XPSR but for the exception's number.
    pub(crate) fn set_xpsr(&mut self, word: u32) {
        self.set_nzcv_bits(word);
        self.q = word >> 27 & 1 != 0 && self.kind != CoreKind::CortexM0Plus;
        self.ge = if self.kind == CoreKind::CortexM0Plus {
            0
        } else {
            (word >> 16 & 15) as u8
        };
        self.thumb = word >> 24 & 1 != 0;
        let it = (word >> 25 & 3 | (word >> 10 & 63) << 2) as u8;
        self.it = ItState::from_bits(it).unwrap_or_default();
    }

    /// Whether the core is in Handler mode.
    pub(crate) fn in_handler(&self) -> bool {
        self.ipsr != 0
    }

    /// Whether it may do everything: Handler mode, or CONTROL.nPRIV is clear.
    pub(crate) fn is_privileged(&self) -> bool {
        self.in_handler() || self.control & 1 == 0
    }

    /// Whether R13 is PSP.
    pub(crate) fn uses_psp(&self) -> bool {
        !self.in_handler() && self.control & 2 != 0
    }

    /// MSP.
    pub(crate) fn msp(&self) -> u32 {
        if self.uses_psp() {
            self.other_sp
        } else {
            self.r[13]
        }
    }

    /// PSP.
    pub(crate) fn psp(&self) -> u32 {
        if self.uses_psp() {
            self.r[13]
        } else {
            self.other_sp
        }
    }

    pub(crate) fn set_msp(&mut self, value: u32) {
        let slot = if self.uses_psp() {
            &mut self.other_sp
        } else {
            &mut self.r[13]
        };
        *slot = value & !3;
    }

    pub(crate) fn set_psp(&mut self, value: u32) {
        let slot = if self.uses_psp() {
            &mut self.r[13]
        } else {
            &mut self.other_sp
        };
        *slot = value & !3;
    }

    /// Changes mode or CONTROL, keeping R13 the stack pointer in use.
    pub(crate) fn change_mode(&mut self, ipsr: u32, control: u32) {
        let was = self.uses_psp();
        self.float_ready = false;
        self.ipsr = ipsr;
        self.control = control;
        if self.uses_psp() != was {
            std::mem::swap(&mut self.r[13], &mut self.other_sp);
        }
    }

    /// The limit of the stack pointer in use; 0 where there is none.
    #[inline(always)]
    pub(crate) fn sp_limit(&self) -> u32 {
        if self.uses_psp() {
            self.psplim
        } else {
            self.msplim
        }
    }
}
