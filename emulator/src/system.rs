//! What every core has for itself at 0xE0000000: NVIC, SysTick, system control block, cycle
//! counter.
//!
//! ```text
//!   0xE0001000  DWT: CYCCNT             0xE000E100  NVIC
//!   0xE000E010  SysTick                 0xE000ED00  system control block, coprocessor access, floating-point context
//! ```
//!
//! Registers that are not here read as zero and ignore writes, as those of an absent MPU, ITM or
//! debug unit do. The Non-secure alias of the block, 0xE002E000, reads and writes the same
//! registers: there is one security state.

pub(crate) mod nvic;
mod registers;
mod systick;

pub(crate) use nvic::Nvic;
pub(crate) use systick::SysTick;

use crate::board::CoreKind;

/// The private peripherals of a core.
#[derive(Clone)]
pub(crate) struct System {
    pub kind: CoreKind,
    pub nvic: Nvic,
    pub systick: SysTick,
    pub vtor: u32,
    /// AIRCR.PRIGROUP.
    pub priority_group: u32,
    /// SCR: SLEEPONEXIT, SLEEPDEEP, SEVONPEND.
    pub scr: u32,
    pub ccr: u32,
    /// Enables of MemManage, BusFault, UsageFault: SHCSR bits 16 to 18.
    pub faults_enabled: u32,
    /// CFSR, HFSR, MMFAR, BFAR.
    pub cfsr: u32,
    pub hfsr: u32,
    pub mmfar: u32,
    pub bfar: u32,
    /// CPACR.
    pub cpacr: u32,
    pub fpccr: u32,
    pub fpcar: u32,
    pub fpdscr: u32,
    /// DEMCR, whose TRCENA runs the cycle counter.
    pub demcr: u32,
    pub dwt_control: u32,
    /// CYCCNT minus the cycle, while it counts; its value, while it does not.
    pub cyccnt: u32,
    /// A write that may have changed which exception is taken next.
    pub changed: bool,
    /// AIRCR.SYSRESETREQ was written.
    pub reset: bool,
}

/// CCR bits.
const UNALIGN_TRP: u32 = 1 << 3;
const DIV_0_TRP: u32 = 1 << 4;

/// FPCCR at reset: ASPEN and LSPEN.
const FPCCR_RESET: u32 = 3 << 30;

impl System {
    pub fn new(kind: CoreKind, interrupts: usize) -> Self {
        let ccr = match kind {
            CoreKind::CortexM0Plus => 1 << 9 | UNALIGN_TRP,
            CoreKind::CortexM4 => 1 << 9,
            CoreKind::CortexM33 => 1 << 9 | 1,
        };
        Self {
            kind,
            nvic: Nvic::new(interrupts),
            systick: SysTick::default(),
            vtor: 0,
            priority_group: 0,
            scr: 0,
            ccr,
            faults_enabled: 0,
            cfsr: 0,
            hfsr: 0,
            mmfar: 0,
            bfar: 0,
            cpacr: 0,
            fpccr: FPCCR_RESET,
            fpcar: 0,
            fpdscr: 0,
            demcr: 0,
            dwt_control: 0,
            cyccnt: 0,
            changed: false,
            reset: false,
        }
    }

    /// The bits of a priority that exist.
    pub fn priority_mask(&self) -> u32 {
        0xff << (8 - self.kind.priority_bits()) & 0xff
    }

    pub fn traps_unaligned(&self) -> bool {
        self.ccr & UNALIGN_TRP != 0
    }

    pub fn traps_division_by_zero(&self) -> bool {
        self.ccr & DIV_0_TRP != 0
    }

    /// Whether coprocessors 10 and 11 may be used.
    pub fn allows_float(&self, privileged: bool) -> bool {
        let access = self.cpacr >> 20 & 3;
        self.kind != CoreKind::CortexM0Plus && (access == 3 || access == 1 && privileged)
    }

    /// Whether the cycle counter counts.
    fn counts_cycles(&self) -> bool {
        self.demcr >> 24 & 1 != 0 && self.dwt_control & 1 != 0
    }

    fn cycle_count(&self, now: u64) -> u32 {
        if self.counts_cycles() {
            self.cyccnt.wrapping_add(now as u32)
        } else {
            self.cyccnt
        }
    }

    /// Changes what may start or stop the cycle counter, keeping its value.
    fn change_counter(&mut self, now: u64, change: impl FnOnce(&mut Self)) {
        let value = self.cycle_count(now);
        change(self);
        self.cyccnt = if self.counts_cycles() {
            value.wrapping_sub(now as u32)
        } else {
            value
        };
    }
}
