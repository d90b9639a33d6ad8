//! One instruction, exactly: its cycles, and what it asks of the machine.

use crate::bus::Bus;
use crate::core::Core;
use crate::cpu::Activity;
use crate::machine::RETURN;
use crate::memo::{Key, Known};
use crate::observe::{Observer, Step};
use crate::op::Flow;
use crate::outcome::Outcomes;
use crate::semihosting::{Answer, Semihosting};
use crate::stop::{Fault, FaultKind, Reason, Stop};
use crate::system::nvic::SV_CALL;
use crate::trap::Trap;
use whippen_isa::timing::{Pipe, Target};

/// What a core needs from around it.
pub(crate) struct Around<'a, O> {
    pub bus: &'a mut Bus,
    pub semihosting: &'a mut Semihosting,
    pub observer: Option<&'a mut O>,
}

impl Core {
    /// Runs one instruction.
    pub fn step<O: Observer>(&mut self, around: &mut Around<'_, O>) -> Result<(), Stop> {
        if !self.cpu.thumb {
            return self.fault(
                around,
                FaultKind::UsageFault,
                Reason::InvalidState,
                self.cpu.pc,
            );
        }
        let (block, index) = self.locate(around.bus);
        let op = self.code.blocks[block].ops[index];
        if around.bus.memory.is_shared() {
            around
                .bus
                .fabric
                .fetch(self.cpu.index, op.address, self.cycle);
        }
        self.cpu.begin(self.cycle);
        let flow = (op.run)(&mut self.cpu, around.bus, &op);
        self.cpu.exact = false;
        let trap = self.cpu.trap.take().filter(|_| flow == Flow::Trap);
        if let Some(Trap::Fault {
            kind,
            reason,
            address,
        }) = trap
        {
            let reason = self.code.blocks[block].infos[index]
                .inst
                .as_ref()
                .err()
                .copied()
                .unwrap_or(reason);
            return self.fault(around, kind, reason, address);
        }
        if flow != Flow::Branch && !matches!(trap, Some(Trap::ExceptionReturn(_))) {
            (self.cpu.pc, self.cpu.it) = self.code.blocks[block].place(index + 1);
        } else {
            self.cpu.it = whippen_isa::ItState::OUTSIDE;
        }
        self.cursor = (block, index + 1);
        self.count_step(around, block, index, flow == Flow::Branch);
        match trap {
            Some(trap) => self.answer(around, trap, op.address),
            None => self.watched(op.address),
        }
    }

    /// The cursor, if the instruction at PC is there.
    pub fn located(&self) -> Option<(usize, usize)> {
        let (block, index) = self.cursor;
        let info = self.code.blocks.get(block).and_then(|b| b.infos.get(index));
        let is_here = info.is_some_and(|i| i.address == self.cpu.pc && i.it == self.cpu.it);
        is_here.then_some(self.cursor)
    }

    /// The decoded instruction at PC.
    pub(crate) fn locate(&mut self, bus: &mut Bus) -> (usize, usize) {
        if let Some(cursor) = self.located() {
            return cursor;
        }
        if self.code.is_full() {
            self.code.clear();
        }
        (self.code.find(&mut bus.memory, self.cpu.pc, self.cpu.it), 0)
    }

    fn count_step<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        block: usize,
        index: usize,
        taken: bool,
    ) {
        let pc = self.cpu.pc;
        let wide = taken
            && around
                .bus
                .memory
                .halfword(pc)
                .is_some_and(whippen_isa::is_wide);
        self.instructions += 1;
        let about = u32::from(taken) << 2 | (pc >> 1 & 1) << 1 | u32::from(wide);
        let key = Key::of_part(
            self.cpu.outcomes,
            self.pipe,
            1,
            if taken { about } else { 0 },
        );
        let looks = around.observer.is_some() && O::INSTRUCTIONS;
        let forgettable = !looks && self.cpu.stall == 0;
        let memo = &self.code.blocks[block].infos[index].memo;
        match memo.get(&key).copied().filter(|_| forgettable) {
            Some(known) => {
                self.cycle += u64::from(known.cycles);
                self.pipe = known.pipe;
            }
            None => {
                let target = taken.then_some(Target { address: pc, wide });
                let known = self.issue_step(around, block, index, target);
                if let Some(known) = known.filter(|_| forgettable) {
                    self.code.blocks[block].infos[index].memo.insert(key, known);
                }
            }
        }
    }

    /// Counts the instruction, with the reasons for whoever watches; what is known then, unless it
    /// is not to be kept.
    fn issue_step<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        block: usize,
        index: usize,
        target: Option<Target>,
    ) -> Option<Known> {
        let info = &self.code.blocks[block].infos[index];
        let Ok((inst, timed)) = &info.inst else {
            return None;
        };
        let mut outcome = Outcomes::new(self.cpu.outcomes).next(info, target);
        outcome.waits = self.cpu.stall.clamp(0, i64::from(u16::MAX)) as u16;
        outcome.near = self.cpu.stall < 0;
        let (pipe, cost) = self
            .code
            .timing
            .issue(self.pipe_state(), timed, info.address, &outcome);
        if let Some(observer) = &mut around.observer {
            let (core, address, cycle) = (self.cpu.index, info.address, self.cycle);
            observer.instruction(&Step {
                core,
                address,
                inst,
                cycle,
                cost,
                cpu: &self.cpu,
            });
        }
        self.cycle += u64::from(cost.cycles());
        let numbers = self.pipes.len();
        self.pipe = self.number(pipe);
        (self.pipes.len() >= numbers).then_some(Known {
            cycles: cost.cycles(),
            pipe: self.pipe,
        })
    }

    /// Ends the run after an access to a watched range.
    fn watched(&mut self, pc: u32) -> Result<(), Stop> {
        match self.cpu.watched.take() {
            Some((address, write)) => Err(Stop::Watchpoint {
                core: self.cpu.index,
                pc,
                address,
                write,
            }),
            None => Ok(()),
        }
    }

    fn answer<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        trap: Trap,
        address: u32,
    ) -> Result<(), Stop> {
        match trap {
            Trap::Fault { .. } => {}
            Trap::SupervisorCall => return self.supervisor_call(around, address),
            Trap::Breakpoint(number) => return self.breakpoint(around, number, address),
            Trap::ExceptionReturn(link) => return self.exception_return(around, link),
            Trap::WaitForInterrupt if !self.cpu.is_woken() => {
                self.cpu.activity = Activity::WaitingForInterrupt
            }
            Trap::WaitForEvent if !std::mem::take(&mut self.cpu.event) => {
                self.cpu.activity = Activity::WaitingForEvent
            }
            Trap::WaitForInterrupt | Trap::WaitForEvent => {}
            Trap::SendEvent => {
                self.cpu.event = true;
                around.bus.lines.event_from(self.cpu.index);
            }
        }
        Ok(())
    }

    fn breakpoint<O>(
        &mut self,
        around: &mut Around<'_, O>,
        number: u8,
        address: u32,
    ) -> Result<(), Stop> {
        let back = |core: &mut Self| {
            core.cpu.pc = address;
            Stop::Breakpoint {
                core: core.cpu.index,
                address,
            }
        };
        if number != 0xab || !around.semihosting.enabled {
            return Err(back(self));
        }
        match around.semihosting.call(
            &mut around.bus.memory,
            self.cpu.r[0],
            self.cpu.r[1],
            self.cycle,
        ) {
            Answer::Value(value) => self.cpu.r[0] = value,
            Answer::Exit(code) => return Err(Stop::Exit { code }),
        }
        Ok(())
    }

    fn supervisor_call<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        address: u32,
    ) -> Result<(), Stop> {
        if self.cpu.priority_group_of(SV_CALL) < self.cpu.priority() {
            return self.enter(around, SV_CALL);
        }
        let (core, kind, reason) = (self.cpu.index, FaultKind::HardFault, Reason::Escalated);
        let fault = Fault {
            core,
            kind,
            reason,
            pc: address,
            address,
            lockup: false,
        };
        let number = self.judged(around.bus, fault)?;
        self.enter(around, number)
    }

    /// Takes an exception whose context returns to PC.
    pub fn enter<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        number: u32,
    ) -> Result<(), Stop> {
        let pc = self.cpu.pc;
        self.cpu.begin(self.cycle);
        let entered = self.cpu.enter(around.bus, number);
        self.restart(u32::from(self.timing().exceptions.entry.cycles));
        if let Some(observer) = &mut around.observer {
            observer.exception(self.cpu.index, number, self.cycle);
        }
        entered.or_else(|derived| {
            self.cpu.system.nvic.set_active(number, false);
            self.cpu.system.nvic.set_pending(number, true);
            self.derived_fault(around, derived, pc)
        })
    }

    /// Time passes with the pipeline empty, wait states of the exception's accesses included.
    fn restart(&mut self, cycles: u32) {
        self.cpu.exact = false;
        self.cycle += u64::from(cycles) + self.cpu.stall.max(0) as u64;
        self.pipe = self.number(Pipe::default());
    }

    fn exception_return<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        link: u32,
    ) -> Result<(), Stop> {
        let (number, pc) = (self.cpu.ipsr, self.cpu.pc);
        self.cpu.begin(self.cycle);
        if let Err(derived) = self.cpu.deactivate(around.bus, link) {
            return self.derived_fault(around, derived, pc);
        }
        if let Some(observer) = &mut around.observer {
            observer.exception_return(self.cpu.index, number, self.cycle);
        }
        self.cpu.absorb(around.bus);
        if let Some(next) = self.cpu.preempting() {
            return self.tail_chain(around, next, link);
        }
        let left = self.cpu.leave(around.bus, link);
        self.restart(u32::from(self.timing().exceptions.exit.cycles));
        if let Some(observer) = &mut around.observer {
            observer.resumed(self.cpu.index, self.cycle);
        }
        if let Err(derived) = left {
            return self.derived_fault(around, derived, pc);
        }
        let sleeps = self.cpu.system.scr & 2 != 0 && !self.cpu.in_handler();
        if sleeps && !self.cpu.is_woken() {
            self.cpu.activity = Activity::WaitingForInterrupt;
        }
        Ok(())
    }

    fn tail_chain<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        next: u32,
        link: u32,
    ) -> Result<(), Stop> {
        let pc = self.cpu.pc;
        let taken = self.cpu.take(around.bus, next, link);
        self.restart(u32::from(self.timing().exceptions.tail_chain.cycles));
        if let Some(observer) = &mut around.observer {
            observer.exception(self.cpu.index, next, self.cycle);
        }
        taken.or_else(|derived| self.derived_fault(around, derived, pc))
    }

    /// A fault of the instruction at PC.
    fn fault<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        kind: FaultKind,
        reason: Reason,
        address: u32,
    ) -> Result<(), Stop> {
        let (core, pc) = (self.cpu.index, self.cpu.pc);
        let kind = reason.kind().unwrap_or(kind);
        let fault = self.judged(
            around.bus,
            Fault {
                core,
                kind,
                reason,
                pc,
                address,
                lockup: false,
            },
        )?;
        self.enter(around, fault)
    }

    /// A fault of entering or leaving an exception: its handler runs in place of the other, without
    /// a frame of its own.
    fn derived_fault<O: Observer>(
        &mut self,
        around: &mut Around<'_, O>,
        (kind, reason): (FaultKind, Reason),
        pc: u32,
    ) -> Result<(), Stop> {
        let (core, address) = (self.cpu.index, self.cpu.r[13]);
        let number = self.judged(
            around.bus,
            Fault {
                core,
                kind,
                reason,
                pc,
                address,
                lockup: false,
            },
        )?;
        let link = self.cpu.r[14];
        self.cpu.begin(self.cycle);
        let taken = self.cpu.take(around.bus, number, link);
        self.restart(u32::from(self.timing().exceptions.entry.cycles));
        let lockup = Fault {
            core,
            kind,
            reason,
            pc,
            address,
            lockup: true,
        };
        taken.map_err(|_| Stop::Fault(lockup))
    }

    /// The exception that takes a fault, or the end when none can.
    fn judged(&mut self, bus: &Bus, fault: Fault) -> Result<u32, Stop> {
        let lockup = self.cpu.is_locked_up();
        let number = self.cpu.fault_exception(&fault);
        // Nobody handles the end of a called function, whatever the image's vector table says.
        let unhandled = fault.pc == RETURN || !self.cpu.has_handler(bus, number);
        let fault = Fault { lockup, ..fault };
        if lockup || unhandled {
            Err(Stop::Fault(fault))
        } else {
            Ok(number)
        }
    }
}
