//! Who runs next, and how far: the order of cores, devices, timers and exceptions in time.

use crate::cpu::Activity;
use crate::lines::Order;
use crate::machine::Machine;
use crate::observe::Observer;
use crate::step::Around;
use crate::stop::Stop;
use crate::system::nvic::SYS_TICK;

/// Room before the horizon for which it pays to look for a block.
const BLOCK_CYCLES_MIN: u64 = 16;

impl Machine {
    /// The cycle that all running cores have reached; that of the furthest core when none runs.
    pub(crate) fn now(&self) -> u64 {
        let running = self
            .cores
            .iter()
            .filter(|c| c.cpu.activity == Activity::Running);
        let furthest = || self.cores.iter().map(|c| c.cycle).max().unwrap_or(0);
        running.map(|c| c.cycle).min().unwrap_or_else(furthest)
    }

    pub(crate) fn run_with<O: Observer>(
        &mut self,
        until: u64,
        mut observer: Option<&mut O>,
    ) -> Stop {
        let mut first = true;
        loop {
            let Some(core) = self.next_core() else {
                match self.sleep(until) {
                    Some(stop) => return stop,
                    None => continue,
                }
            };
            let cycle = self.cores[core].cycle;
            if let Err(stop) = self.attend(core, cycle, &mut observer) {
                return stop;
            }
            // An exception may have been taken, a core woken.
            if self.next_core() != Some(core) {
                continue;
            }
            if self.cores[core].cycle >= until {
                return Stop::Limit;
            }
            self.bus.memory.set_shared(self.is_contended());
            let ran = match self.running() {
                1 => self.run_core(core, until.min(self.next_due()), first, &mut observer),
                _ => self.run_turns(until.min(self.next_due()), first, &mut observer),
            };
            if let Err(stop) = ran {
                return stop;
            }
            first = false;
        }
    }

    /// The running core that is furthest behind.
    fn next_core(&self) -> Option<usize> {
        let running =
            (0..self.cores.len()).filter(|i| self.cores[*i].cpu.activity == Activity::Running);
        running.min_by_key(|i| self.cores[*i].cycle)
    }

    /// Whether more than one core, or a core and a DMA, may want memory in the same cycle.
    fn is_contended(&self) -> bool {
        let fabric = &self.bus.fabric;
        fabric.arbitrates() && (fabric.dma || fabric.meets_fetches || self.running() > 1)
    }

    /// How many cores run.
    fn running(&self) -> usize {
        self.cores
            .iter()
            .filter(|c| c.cpu.activity == Activity::Running)
            .count()
    }

    /// The earliest cycle in which a device or a timer is due.
    pub(crate) fn next_due(&self) -> u64 {
        let timers = self.cores.iter().map(|c| c.cpu.system.systick.due()).min();
        self.bus.due().min(timers.unwrap_or(u64::MAX))
    }

    /// Runs the only running core to the horizon, or until something happened that others must hear
    /// of.
    fn run_core<O: Observer>(
        &mut self,
        core: usize,
        horizon: u64,
        mut first: bool,
        observer: &mut Option<&mut O>,
    ) -> Result<(), Stop> {
        let fast = !looks(observer) && !self.has_breakpoints() && !self.bus.memory.is_shared();
        loop {
            if fast && horizon.saturating_sub(self.cores[core].cycle) >= BLOCK_CYCLES_MIN {
                self.cores[core].run_blocks(&mut self.bus, horizon);
                if self.bus.memory.code_changed {
                    self.forget_code();
                }
            }
            if self.cores[core].cycle >= horizon || self.step_one(core, horizon, first, observer)? {
                return Ok(());
            }
            first = false;
        }
    }

    /// Runs several cores to the horizon, apart where that can be done, else always the one that is
    /// furthest behind by one instruction, or until something happened that others must hear of.
    fn run_turns<O: Observer>(
        &mut self,
        horizon: u64,
        mut first: bool,
        observer: &mut Option<&mut O>,
    ) -> Result<(), Stop> {
        let fast = !looks(observer) && !self.has_breakpoints();
        while let Some(mut core) = self.next_core() {
            if fast && self.tries_apart(self.cores[core].cycle) {
                if self.try_apart(horizon, observer)? {
                    break;
                }
                core = self.next_core().unwrap_or(core);
            }
            let changed = self.cores[core].cpu.system.changed && !first;
            if changed
                || self.cores[core].cycle >= horizon
                || self.step_one(core, horizon, first, observer)?
            {
                break;
            }
            first = false;
        }
        Ok(())
    }

    /// One instruction, unless a breakpoint is in front of it; whether something happened that
    /// others must hear of.
    fn step_one<O: Observer>(
        &mut self,
        core: usize,
        horizon: u64,
        first: bool,
        observer: &mut Option<&mut O>,
    ) -> Result<bool, Stop> {
        let address = self.cores[core].cpu.pc;
        if !first && self.has_breakpoint(address) {
            return Err(Stop::Breakpoint { core, address });
        }
        self.step_core(core, observer)?;
        let cpu = &self.cores[core].cpu;
        let changed = cpu.system.changed | self.bus.lines.changed;
        // A device that was accessed may be due before the horizon that was set without it.
        Ok(changed || cpu.activity != Activity::Running || self.bus.due() < horizon)
    }

    /// Brings everything up to a cycle: devices, timers, lines; then the core's exceptions.
    pub(crate) fn attend<O: Observer>(
        &mut self,
        core: usize,
        cycle: u64,
        observer: &mut Option<&mut O>,
    ) -> Result<(), Stop> {
        if self.bus.due() <= cycle {
            self.bus.attend(cycle);
        }
        if std::mem::take(&mut self.bus.lines.reset) {
            if std::mem::take(&mut self.bus.lines.reset_peripherals) {
                self.bus.reset(cycle);
            }
            return Err(Stop::Reset);
        }
        if let Some(clock) = self.bus.lines.glitch.take() {
            return Err(Stop::Glitch { clock });
        }
        self.obey();
        for i in 0..self.cores.len() {
            self.wake(i, cycle);
        }
        let cpu = &mut self.cores[core].cpu;
        if !cpu.system.changed || cpu.activity == Activity::Halted {
            return Ok(());
        }
        cpu.system.changed = false;
        let Some(number) = cpu.preempting() else {
            return Ok(());
        };
        let (bus, semihosting) = (&mut self.bus, &mut self.semihosting);
        let mut around = Around {
            bus,
            semihosting,
            observer: observer.as_deref_mut(),
        };
        self.cores[core].enter(&mut around, number)
    }

    /// Starts and halts cores as devices asked.
    pub(crate) fn obey(&mut self) {
        if !std::mem::take(&mut self.bus.lines.changed) {
            return;
        }
        for core in 0..self.cores.len() {
            match self.bus.lines.cores[core].order.take() {
                Some(Order::Start(start)) => self.start(core, start),
                Some(Order::Halt) => self.halt(core),
                None => {}
            }
            self.cores[core].cpu.absorb(&mut self.bus);
        }
    }

    /// Moves a core's timer, and ends its wait if there is a reason.
    fn wake(&mut self, index: usize, cycle: u64) {
        let core = &mut self.cores[index];
        if core.cpu.system.systick.advance(cycle) {
            core.cpu.system.nvic.set_pending(SYS_TICK, true);
            core.cpu.system.changed = true;
            core.cpu.event |= core.cpu.system.scr & 1 << 4 != 0;
        }
        let awake = match core.cpu.activity {
            Activity::WaitingForInterrupt => core.cpu.is_woken(),
            Activity::WaitingForEvent => core.cpu.is_woken() || std::mem::take(&mut core.cpu.event),
            Activity::Running | Activity::Halted => return,
        };
        if awake {
            core.cpu.activity = Activity::Running;
            core.cycle = core.cycle.max(cycle);
        }
    }

    /// With no core running, time passes to what is due next.
    fn sleep(&mut self, until: u64) -> Option<Stop> {
        let (now, due) = (self.now(), self.next_due());
        let cycle = due.max(now).min(until.max(now));
        let asleep = self
            .cores
            .iter()
            .any(|c| c.cpu.activity != Activity::Halted);
        self.cores
            .iter_mut()
            .filter(|c| c.cpu.activity != Activity::Halted)
            .for_each(|c| c.cycle = c.cycle.max(cycle));
        self.bus.attend(cycle);
        self.obey();
        (0..self.cores.len()).for_each(|core| self.wake(core, cycle));
        let running = self
            .cores
            .iter()
            .any(|c| c.cpu.activity == Activity::Running);
        match () {
            () if running => None,
            () if due == u64::MAX || !asleep => Some(Stop::Asleep),
            () if cycle >= until => Some(Stop::Limit),
            () => None,
        }
    }
}

/// Whether somebody looks at every instruction.
fn looks<O: Observer>(observer: &Option<&mut O>) -> bool {
    observer.is_some() && O::INSTRUCTIONS
}
