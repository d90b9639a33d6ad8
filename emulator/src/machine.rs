//! The machine: cores, bus and time.
//!
//! ```text
//!   attend: devices and timers that are due, lines, exceptions, waking       (schedule)
//!      |
//!   the core that is furthest behind runs to the horizon:                      (core, step)
//!      the next thing that is due, or where another core is furthest behind
//! ```
//!
//! Cores interleave by cycle, the lower number first where cycles are equal: each sees what the
//! others did before, as the hardware would without bus conflicts.

use crate::apart::Apart;
use crate::board::{Board, BoardError};
use crate::bus::Bus;
use crate::core::Core;
use crate::cpu::{Activity, Cpu};
use crate::lines::Start;
use crate::memory::Watch;
use crate::observe::{Observer, Step};
use crate::semihosting::Semihosting;
use crate::step::Around;
use crate::stop::{Reason, Stop};
use std::collections::BTreeSet;

/// The address that a called function returns to: where the architecture's function return would
/// go, and no memory is.
pub(crate) const RETURN: u32 = 0xfeff_fffe;

/// A board at work.
pub struct Machine {
    /// Memory, devices and lines.
    pub bus: Bus,
    /// What the program prints and reads.
    pub semihosting: Semihosting,
    board: Board,
    pub(crate) cores: Vec<Core>,
    pub(crate) apart: Apart,
    breakpoints: BTreeSet<u32>,
    watches: Vec<Watch>,
    /// While a called function runs, the cycle in which it was entered.
    called: Option<u64>,
}

/// Nobody watches.
struct Nobody;

impl Observer for Nobody {
    fn instruction(&mut self, _: &Step<'_>) {}
}

impl Machine {
    /// A board with its memory zero and its cores halted: load an image, then [`Machine::reset`] or
    /// [`Machine::call`].
    pub fn new(board: Board) -> Result<Self, BoardError> {
        if board.cores == 0 || board.cores > 8 {
            return Err(BoardError::Cores);
        }
        if board.interrupts > 480 {
            return Err(BoardError::Interrupts);
        }
        let core = |i| {
            Core::new(
                Cpu::new(board.core, i, board.interrupts),
                board.core.timing(),
            )
        };
        Ok(Self {
            bus: Bus::new(&board)?,
            semihosting: Semihosting {
                clock_hz: board.clock_hz,
                ..Semihosting::default()
            },
            cores: (0..board.cores).map(core).collect(),
            apart: Apart::default(),
            board,
            breakpoints: BTreeSet::new(),
            watches: Vec::new(),
            called: None,
        })
    }

    /// The board it was made from.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// How many cores there are.
    pub fn cores(&self) -> usize {
        self.cores.len()
    }

    /// A core; the first one when there are not so many.
    pub fn cpu(&self, core: usize) -> &Cpu {
        &self.cores[self.existing(core)].cpu
    }

    /// A core, to change its registers.
    pub fn cpu_mut(&mut self, core: usize) -> &mut Cpu {
        let core = self.existing(core);
        let cpu = &mut self.cores[core].cpu;
        cpu.system.changed = true;
        cpu
    }

    fn existing(&self, core: usize) -> usize {
        if core < self.cores.len() { core } else { 0 }
    }

    /// The cycle a core has reached.
    pub fn cycle(&self, core: usize) -> u64 {
        self.cores[self.existing(core)].cycle
    }

    /// Instructions that all cores have run since the machine was made, skipped ones too.
    pub fn instructions(&self) -> u64 {
        self.cores.iter().map(|c| c.instructions).sum()
    }

    /// Takes another side where sources of cycles disagree; the default is the datasheet's.
    pub fn set_rules(&mut self, rules: whippen_isa::timing::Rules) {
        self.cores
            .iter_mut()
            .for_each(|core| core.code.timing.rules = rules);
        // What is known of blocks was counted by other rules.
        self.forget_code();
    }

    /// Whether a core's data wait a cycle for its own fetches wherever they may, as no count shows
    /// but a datasheet leaves open; they do not unless this is said.
    pub fn set_meets_fetches(&mut self, meets: bool) {
        self.bus.fabric.meets_fetches = meets;
    }

    /// Cycles that loads and stores of all cores have waited for others so far: at banks of memory,
    /// and behind bridges to peripherals.
    pub fn waited_cycles(&self) -> [u64; 2] {
        self.bus.fabric.waited
    }

    /// Resets all cores, keeping memory and time: the first one starts from the board's vector
    /// table, the others where the board says, or halt.
    pub fn reset(&mut self) {
        let mut words = [0; 8];
        let table = self.board.vector_table;
        // Without memory there the core starts at address 0, and stops with a fault that says so.
        let _ = self.bus.memory.read(table, &mut words);
        let word = |at: usize| {
            u32::from_le_bytes([words[at], words[at + 1], words[at + 2], words[at + 3]])
        };
        let start = Start {
            vector_table: table,
            stack: word(0),
            address: word(4),
        };
        for core in 1..self.cores.len() {
            match self.board.others {
                Some(start) => self.start(core, start),
                None => self.halt(core),
            }
        }
        self.start(0, start);
    }

    /// Starts a core from its reset state. An even address is a fault of its first instruction.
    pub fn start(&mut self, core: usize, start: Start) {
        let now = self.now();
        let Some(core) = self.cores.get_mut(core) else {
            return;
        };
        let interrupts = core.cpu.system.nvic.count as usize - 16;
        core.cpu = Cpu::new(core.cpu.kind, core.cpu.index, interrupts);
        core.cpu.system.vtor = start.vector_table;
        core.cpu.r[13] = start.stack & !3;
        core.cpu.r[14] = u32::MAX;
        core.cpu.pc = start.address & !1;
        core.cpu.thumb = start.address & 1 != 0;
        core.cpu.activity = Activity::Running;
        core.cycle = core.cycle.max(now);
        core.pipe = 0;
    }

    /// Halts a core until it is started.
    pub fn halt(&mut self, core: usize) {
        if let Some(core) = self.cores.get_mut(core) {
            core.cpu.activity = Activity::Halted;
        }
    }

    /// Runs until every running core has reached cycle `until`, or something stops it.
    pub fn run(&mut self, until: u64) -> Stop {
        self.run_with(until, None::<&mut Nobody>)
    }

    /// As [`Machine::run`], telling an observer about every instruction. Cycles are the same.
    pub fn run_observed(&mut self, until: u64, observer: &mut impl Observer) -> Stop {
        self.run_with(until, Some(observer))
    }

    /// One instruction of one core, whatever the others do, and an exception before it if one is
    /// due. Nothing when it may go on.
    pub fn step(&mut self, core: usize) -> Option<Stop> {
        let core = self.existing(core);
        let cycle = self.cores[core].cycle;
        self.attend(core, cycle, &mut None::<&mut Nobody>)
            .and_then(|()| self.step_core(core, &mut None::<&mut Nobody>))
            .err()
    }

    /// Calls a function of the C calling convention on the first core: R0 to R3 are its arguments,
    /// it returns to an address that no memory has. The stack pointer stays as it is, or is taken
    /// from the vector table if it is 0; the rest of the core keeps its state, the pipeline is
    /// empty.
    pub fn call(&mut self, address: u32, arguments: [u32; 4], cycles_max: u64) -> Stop {
        self.prepare_call(address, arguments);
        let stop = self.run(self.cycle(0).saturating_add(cycles_max));
        self.called = None;
        stop
    }

    /// As [`Machine::call`], with an observer.
    pub fn call_observed(
        &mut self,
        address: u32,
        arguments: [u32; 4],
        cycles_max: u64,
        observer: &mut impl Observer,
    ) -> Stop {
        self.prepare_call(address, arguments);
        let stop = self.run_observed(self.cycle(0).saturating_add(cycles_max), observer);
        self.called = None;
        stop
    }

    /// Puts the first core in front of a function, as [`Machine::call`] does; a run then ends with
    /// [`Stop::Returned`]. The floating-point unit is on, because start-up code that would turn it
    /// on need not have run.
    pub fn prepare_call(&mut self, address: u32, arguments: [u32; 4]) {
        let mut stack = [0; 4];
        let known = self
            .bus
            .memory
            .read(self.board.vector_table, &mut stack)
            .is_ok();
        let core = &mut self.cores[0];
        if core.cpu.r[13] == 0 && known {
            core.cpu.r[13] = u32::from_le_bytes(stack) & !7;
        }
        core.cpu.r[..4].copy_from_slice(&arguments);
        core.cpu.r[14] = RETURN | 1;
        core.cpu.pc = address & !1;
        core.cpu.thumb = true;
        core.cpu.it = whippen_isa::ItState::OUTSIDE;
        core.cpu.activity = Activity::Running;
        core.cpu.system.cpacr |= 0xf << 20;
        core.pipe = 0;
        self.called = Some(core.cycle);
    }

    /// The fault of having no code at the address of return is no fault.
    pub(crate) fn returned(&self, core: usize, stop: Stop) -> Stop {
        match (&stop, self.called) {
            (Stop::Fault(fault), Some(begun))
                if core == 0 && fault.pc == RETURN && is_fetch(fault.reason) =>
            {
                let core = &self.cores[0];
                Stop::Returned {
                    cycles: core.cycle - begun,
                    result: [core.cpu.r[0], core.cpu.r[1]],
                }
            }
            _ => stop,
        }
    }

    /// Stops runs before the instruction at an address.
    pub fn set_breakpoint(&mut self, address: u32) {
        self.breakpoints.insert(address & !1);
        self.forget_code();
    }

    /// Takes a breakpoint away.
    pub fn clear_breakpoint(&mut self, address: u32) {
        self.breakpoints.remove(&(address & !1));
        self.forget_code();
    }

    /// Stops runs after accesses to a range of plain memory.
    pub fn set_watch(&mut self, watch: Watch) {
        self.watches.push(watch);
        self.bus.memory.watch(&self.watches);
    }

    /// Takes a watch away.
    pub fn clear_watch(&mut self, watch: Watch) {
        self.watches.retain(|w| *w != watch);
        self.bus.memory.watch(&self.watches);
    }

    pub(crate) fn has_breakpoint(&self, address: u32) -> bool {
        self.breakpoints.contains(&address)
    }

    pub(crate) fn has_breakpoints(&self) -> bool {
        !self.breakpoints.is_empty()
    }

    /// Decodes all code again when it is run next.
    pub(crate) fn forget_code(&mut self) {
        self.cores.iter_mut().for_each(Core::forget_code);
        self.bus.memory.forget_code();
    }

    /// One instruction; an observer may end the run behind it.
    pub(crate) fn step_core<O: Observer>(
        &mut self,
        core: usize,
        observer: &mut Option<&mut O>,
    ) -> Result<(), Stop> {
        let (bus, semihosting) = (&mut self.bus, &mut self.semihosting);
        let mut around = Around {
            bus,
            semihosting,
            observer: observer.as_deref_mut(),
        };
        let stepped = self.cores[core].step(&mut around);
        if self.bus.memory.code_changed {
            self.forget_code();
        }
        if std::mem::take(&mut self.cores[core].cpu.system.reset) {
            return Err(Stop::Reset);
        }
        stepped.map_err(|stop| self.returned(core, stop))?;
        match observer {
            Some(observer) if observer.stops() => Err(Stop::Limit),
            _ => Ok(()),
        }
    }
}

fn is_fetch(reason: Reason) -> bool {
    matches!(reason, Reason::Fetch | Reason::ExecuteNever)
}
