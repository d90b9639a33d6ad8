//! Exceptions: priority, entry, return.
//!
//! ```text
//!   pending and high enough? --> push frame --> vector --> handler --> BX EXC_RETURN --> another one? --> tail-chain
//!                                                                          | no
//!                                                                     pop frame
//! ```
//!
//! Names are the manual's: `ExecutionPriority`, `PushStack`, `ExceptionTaken`, `ExceptionReturn`,
//! `PopStack`. Faults are decided in `faults`.

use crate::board::CoreKind;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::stop::{FaultKind, Reason};
use crate::system::nvic::{BUS_FAULT, FIRST, MEM_MANAGE, NMI, USAGE_FAULT};

/// What goes wrong around exceptions: which fault, and why.
pub(crate) type Derived = (FaultKind, Reason);

/// CONTROL: floating-point context active, in the Secure state too, PSP in use.
pub(crate) const FPCA: u32 = 4;
pub(crate) const SFPA: u32 = 8;
/// Where SFPA is kept in the frame's XPSR.
const FRAME_SFPA: u32 = 1 << 20;
const SPSEL: u32 = 2;
/// FPCCR: lazy state preservation active; whose context it is; which faults it may still raise;
/// lazy state preservation enabled.
const LSPACT: u32 = 1;
const USER: u32 = 1 << 1;
const S: u32 = 1 << 2;
const THREAD: u32 = 1 << 3;
const HFRDY: u32 = 1 << 4;
const MMRDY: u32 = 1 << 5;
const BFRDY: u32 = 1 << 6;
const UFRDY: u32 = 1 << 10;
const LSPEN: u32 = 1 << 30;

/// Whether a value written to PC in Handler mode is an EXC_RETURN.
pub(crate) fn is_return(kind: CoreKind, address: u32) -> bool {
    match kind {
        CoreKind::CortexM33 => address >> 24 == 0xff,
        _ => address >> 28 == 15,
    }
}

impl Cpu {
    /// `ExecutionPriority`: 256 in Thread mode without any mask.
    pub(crate) fn priority(&self) -> i32 {
        self.priority_unmasked()
            .min(if self.primask { 0 } else { 256 })
    }

    /// The same without PRIMASK.
    fn priority_unmasked(&self) -> i32 {
        let active = self
            .system
            .nvic
            .active_priorities()
            .map(|p| self.group(p))
            .min()
            .unwrap_or(256);
        let base = if self.basepri != 0 {
            self.group(self.basepri as i32)
        } else {
            256
        };
        let fault = if self.faultmask { -1 } else { 256 };
        active.min(base).min(fault)
    }

    /// The part of a priority that preempts.
    fn group(&self, priority: i32) -> i32 {
        if priority < 0 {
            priority
        } else {
            priority & !((2 << self.system.priority_group) - 1)
        }
    }

    /// The priority of an exception, as far as it preempts.
    pub(crate) fn priority_group_of(&self, number: u32) -> i32 {
        self.group(self.system.nvic.priority_of(number))
    }

    /// Takes over what devices did with the core's lines.
    pub(crate) fn absorb(&mut self, bus: &mut Bus) {
        let lines = &mut bus.lines.cores[self.index];
        self.system.changed = true;
        let was_pending = self.system.nvic.pending;
        let risen = std::mem::take(&mut lines.risen);
        for (word, edges) in risen.into_iter().enumerate() {
            let mut high = lines.level[word] | edges;
            while high != 0 {
                let number = FIRST + word as u32 * 64 + high.trailing_zeros();
                let edge = edges >> high.trailing_zeros() & 1 != 0;
                if edge || !self.system.nvic.is_active(number) {
                    self.system.nvic.set_pending(number, true);
                }
                high &= high - 1;
            }
        }
        if std::mem::take(&mut lines.nmi) {
            self.system.nvic.set_pending(NMI, true);
        }
        let sev_on_pend = self.system.scr & 1 << 4 != 0;
        self.event |= std::mem::take(&mut lines.event)
            || sev_on_pend && self.system.nvic.pending != was_pending;
    }

    /// The pending exception that would be taken now.
    pub(crate) fn preempting(&self) -> Option<u32> {
        let (number, priority) = self.system.nvic.next()?;
        (self.group(priority) < self.priority()).then_some(number)
    }

    /// Whether an exception is pending that would be taken if PRIMASK were clear: what ends a wait.
    pub(crate) fn is_woken(&self) -> bool {
        self.system
            .nvic
            .next()
            .is_some_and(|(_, priority)| self.group(priority) < self.priority_unmasked())
    }

    /// `ExceptionEntry`: saves the context that returns to `pc`, and goes to the handler.
    pub(crate) fn enter(&mut self, bus: &mut Bus, number: u32) -> Result<(), Derived> {
        let mut result = self.push_stack(bus);
        let link = self.exception_link();
        // The stack may not have a frame then, but the handler runs.
        if let Err(derived) = self.take(bus, number, link) {
            result = result.and(Err(derived));
        }
        result
    }

    /// The EXC_RETURN that leads back to the present mode and stack.
    fn exception_link(&self) -> u32 {
        let float = if self.control & FPCA != 0 { 0 } else { 1 << 4 };
        let mode = if self.in_handler() { 0 } else { 1 << 3 };
        let stack = if self.uses_psp() { 1 << 2 } else { 0 };
        0xffff_ffe1 | float | mode | stack
    }

    /// `PushStack`.
    fn push_stack(&mut self, bus: &mut Bus) -> Result<(), Derived> {
        let float = self.control & FPCA != 0;
        let size = if float { 0x68 } else { 0x20 };
        let aligned = float || self.system.ccr & 1 << 9 != 0;
        let padding = aligned && self.r[13] & 4 != 0;
        let frame = self.r[13].wrapping_sub(size) & if aligned { !7 } else { !3 };
        let limit = self.sp_limit();
        if frame < limit {
            self.r[13] = limit;
            return Err((FaultKind::UsageFault, Reason::StackOverflow));
        }
        self.r[13] = frame;
        let sfpa = if self.control & SFPA != 0 {
            FRAME_SFPA
        } else {
            0
        };
        let xpsr = self.xpsr() & !(1 << 9) | u32::from(padding) << 9 | sfpa;
        let [r0, r1, r2, r3] = [self.r[0], self.r[1], self.r[2], self.r[3]];
        let words = [r0, r1, r2, r3, self.r[12], self.r[14], self.pc, xpsr];
        self.put_words(bus, frame, &words, Reason::Stacking)?;
        if float {
            self.push_float(bus, frame.wrapping_add(0x20))
        } else {
            Ok(())
        }
    }

    /// Saves S0 to S15 and FPSCR, or remembers where to.
    fn push_float(&mut self, bus: &mut Bus, address: u32) -> Result<(), Derived> {
        if self.system.fpccr & LSPEN != 0 {
            self.update_fpccr(address);
            return Ok(());
        }
        self.save_float(bus, address, Reason::Stacking)
    }

    /// `UpdateFPCCR`: where the context goes, and whose it is, so that a fault of the saving that
    /// comes later is judged as one of the interrupted program.
    fn update_fpccr(&mut self, address: u32) {
        self.system.fpcar = address;
        let is_v8 = self.kind == CoreKind::CortexM33;
        let is_ready = |fault: u32| {
            self.system.is_fault_enabled(fault) && self.priority() > self.priority_group_of(fault)
        };
        let bits = [
            (true, LSPACT),
            (!self.is_privileged(), USER),
            (is_v8, S),
            (!self.in_handler(), THREAD),
            (self.priority() > -1, HFRDY),
            (is_ready(MEM_MANAGE), MMRDY),
            (is_ready(BUS_FAULT), BFRDY),
            (is_v8 && is_ready(USAGE_FAULT), UFRDY),
        ];
        let set = bits.iter().filter(|(holds, _)| *holds);
        let status = set.fold(0, |word, (_, bit)| word | bit);
        self.system.fpccr = self.system.fpccr & !self.kind.fpccr_status() | status;
    }

    fn save_float(&mut self, bus: &mut Bus, address: u32, reason: Reason) -> Result<(), Derived> {
        let mut words = [0; 17];
        words[..16].copy_from_slice(&self.s[..16]);
        words[16] = self.fpscr;
        self.put_words(bus, address, &words, reason)
    }

    /// `PreserveFPState`: what `push_float` put off.
    pub(crate) fn preserve_float(&mut self, bus: &mut Bus) -> Result<(), Derived> {
        if self.system.fpccr & LSPACT != 0 {
            self.save_float(bus, self.system.fpcar, Reason::LazyStacking)?;
            self.system.fpccr &= !LSPACT;
        }
        Ok(())
    }

    /// `ExceptionTaken`: from here on the handler runs.
    pub(crate) fn take(&mut self, bus: &mut Bus, number: u32, link: u32) -> Result<(), Derived> {
        let vector = self.get_word(
            bus,
            self.system.vtor.wrapping_add(4 * number),
            Reason::Vector,
        );
        self.change_mode(number, self.control & !(SPSEL | FPCA | SFPA));
        self.r[14] = link;
        self.it = whippen_isa::ItState::OUTSIDE;
        self.system.nvic.set_pending(number, false);
        self.system.nvic.set_active(number, true);
        self.system.changed = true;
        self.event = true;
        bus.exclusives[self.index] = None;
        let vector = vector.map_err(|(_, reason)| (FaultKind::HardFault, reason))?;
        self.thumb = vector & 1 != 0;
        self.pc = vector & !1;
        Ok(())
    }

    /// `DeActivate` and the checks of `ExceptionReturn`. The core is then at the level it returns
    /// to, but its registers are still those of the handler.
    pub(crate) fn deactivate(&mut self, bus: &mut Bus, link: u32) -> Result<(), Derived> {
        let number = self.ipsr;
        let was_active = self.system.nvic.is_active(number);
        self.system.nvic.set_active(number, false);
        if number != NMI {
            self.faultmask = false;
        }
        self.system.changed = true;
        bus.lines.changed = true;
        let nested = self.system.nvic.active_priorities().count() > 0;
        let to_thread = link & 1 << 3 != 0;
        let may_leave_nested = self.system.ccr & 1 != 0;
        let consistent = if to_thread {
            !nested || may_leave_nested
        } else {
            nested
        };
        let valid = was_active && self.is_valid_link(link) && consistent;
        if valid {
            Ok(())
        } else {
            Err((FaultKind::UsageFault, Reason::InvalidReturn))
        }
    }

    /// Whether the bits of an EXC_RETURN make sense. Those that name a security state may name
    /// either.
    fn is_valid_link(&self, link: u32) -> bool {
        let low = link & 0xf;
        let float = self.kind != CoreKind::CortexM0Plus || link & 1 << 4 != 0;
        match self.kind {
            CoreKind::CortexM33 => link & 2 == 0 && link & 0xc != 4,
            _ => matches!(low, 1 | 9 | 13) && float,
        }
    }

    /// `PopStack` and the rest of `ExceptionReturn`.
    pub(crate) fn leave(&mut self, bus: &mut Bus, link: u32) -> Result<(), Derived> {
        let to_thread = link & 1 << 3 != 0;
        let float = link & 1 << 4 == 0;
        let spsel = if to_thread && link & 1 << 2 != 0 {
            SPSEL
        } else {
            0
        };
        let mut control =
            self.control & !(SPSEL | FPCA | SFPA) | spsel | if float { FPCA } else { 0 };
        let from = self.ipsr;
        // Thread mode for a moment: R13 becomes the stack of the frame.
        self.change_mode(if to_thread { 0 } else { from }, control);
        let frame = self.r[13];
        let words = self.get_frame(bus, frame)?;
        if float {
            self.pop_float(bus, frame.wrapping_add(0x20))?;
        }
        let [r0, r1, r2, r3, r12, lr, pc, xpsr] = words;
        self.r[..4].copy_from_slice(&[r0, r1, r2, r3]);
        (self.r[12], self.r[14]) = (r12, lr);
        let padding = (xpsr >> 9 & 1) << 2;
        self.r[13] = frame.wrapping_add(if float { 0x68 } else { 0x20 }) | padding;
        self.pc = pc & !1;
        self.set_xpsr(xpsr);
        if self.kind == CoreKind::CortexM33 && xpsr & FRAME_SFPA != 0 {
            control |= SFPA;
        }
        let ipsr = if to_thread { 0 } else { xpsr & 0x1ff };
        self.change_mode(ipsr, control);
        bus.exclusives[self.index] = None;
        self.event = true;
        let fits = to_thread == (xpsr & 0x1ff == 0);
        if fits {
            Ok(())
        } else {
            Err((FaultKind::UsageFault, Reason::InvalidReturn))
        }
    }

    fn get_frame(&mut self, bus: &mut Bus, frame: u32) -> Result<[u32; 8], Derived> {
        let mut words = [0; 8];
        for (i, word) in words.iter_mut().enumerate() {
            *word = self.get_word(bus, frame.wrapping_add(4 * i as u32), Reason::Unstacking)?;
        }
        Ok(words)
    }

    /// Registers that were never saved are still there.
    fn pop_float(&mut self, bus: &mut Bus, address: u32) -> Result<(), Derived> {
        if self.system.fpccr & LSPACT != 0 {
            self.system.fpccr &= !LSPACT;
            return Ok(());
        }
        for i in 0..16 {
            self.s[i] =
                self.get_word(bus, address.wrapping_add(4 * i as u32), Reason::Unstacking)?;
        }
        self.fpscr = self.get_word(bus, address.wrapping_add(64), Reason::Unstacking)?
            & crate::float::FPSCR_BITS;
        Ok(())
    }

    fn put_words(
        &mut self,
        bus: &mut Bus,
        address: u32,
        words: &[u32],
        reason: Reason,
    ) -> Result<(), Derived> {
        for (i, word) in words.iter().enumerate() {
            let stored = self.store_aligned::<u32>(bus, address.wrapping_add(4 * i as u32), *word);
            stored.map_err(|_| self.derived(reason))?;
        }
        Ok(())
    }

    fn get_word(&mut self, bus: &mut Bus, address: u32, reason: Reason) -> Result<u32, Derived> {
        self.load_aligned::<u32>(bus, address)
            .map_err(|_| self.derived(reason))
    }

    /// The access's own fault gives way to the one that names the circumstance.
    fn derived(&mut self, reason: Reason) -> Derived {
        self.trap = None;
        (FaultKind::BusFault, reason)
    }
}
