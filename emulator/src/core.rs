//! One core at work: blocks where nothing can interfere, else instruction by instruction, exactly.
//!
//! ```text
//!   room for a whole block before the horizon? --yes--> run it, look its cycles up        fast
//!        | no, or an instruction needs the exact cycle
//!   step: one instruction, its cycles counted, its requests answered                      exact
//! ```
//!
//! Both ways give the same state and the same cycles. A block never does what another core or a
//! device could see: that is what [`Flow::Inexact`] is for.

use crate::block::Block;
use crate::bus::Bus;
use crate::code::Code;
use crate::cpu::Cpu;
use crate::memo::{Key, Known, Link, Pipes};
use crate::op::Flow;
use crate::outcome::Outcomes;
use crate::translate::{Native, RunMode, Time};
use whippen_isa::timing::{Core as Timing, Pipe, Target};

/// A core with what it has decoded and counted.
pub(crate) struct Core {
    pub cpu: Cpu,
    pub code: Code,
    pub pipes: Pipes,
    /// Number of the state of the pipeline.
    pub pipe: u16,
    /// The cycle in which its next instruction begins.
    pub cycle: u64,
    /// Instructions that ran so far, skipped ones too.
    pub instructions: u64,
    /// Where the next step probably is: block and instruction.
    pub cursor: (usize, usize),
    /// How often states of the pipeline got other numbers.
    pub renumbered: u32,
}

/// A run through a block, or through some of its instructions, that ended.
#[derive(Clone, Copy, Default)]
pub(crate) struct Run {
    pub block: usize,
    /// The first instruction.
    pub first: usize,
    /// Instructions that ran.
    pub done: usize,
    /// Whether it was to be a single instruction.
    pub single: bool,
    /// How its last instruction ended.
    pub flow: Flow,
}

impl Run {
    /// From the beginning of a block on: how the last instruction ended, and how many ran before.
    pub(crate) fn whole(block: usize, flow: Flow, before: usize) -> Self {
        Self {
            block,
            first: 0,
            done: before + usize::from(matches!(flow, Flow::Branch | Flow::Leave)),
            single: false,
            flow,
        }
    }
}

impl Core {
    pub fn new(cpu: Cpu, timing: Timing) -> Self {
        Self {
            cpu,
            code: Code::new(timing),
            pipes: Pipes::new(),
            pipe: 0,
            cycle: 0,
            instructions: 0,
            cursor: (0, 0),
            renumbered: 0,
        }
    }

    pub fn timing(&self) -> &Timing {
        &self.code.timing
    }

    /// Runs whole blocks as long as they end before `horizon`; stops in front of what has to be
    /// exact.
    pub fn run_blocks(&mut self, bus: &mut Bus, horizon: u64) {
        if self.code.is_full() {
            self.code.clear();
        }
        // A branch to an even address leaves Thumb state, which is a fault and so a step: no block
        // makes one.
        if !self.cpu.thumb {
            return;
        }
        let mut number = self.code.find(&mut bus.memory, self.cpu.pc, self.cpu.it);
        while self.cycle + self.code.blocks[number].cycles_max <= horizon {
            let translated = self.code.blocks[number]
                .translated
                .code(RunMode::Alone, self.pipe);
            let run = match translated.map(|code| self.run_translated(bus, code, horizon)) {
                Some(Ok(run)) => run,
                // In front of a block for which there is no room, or no translation here.
                Some(Err(next)) => {
                    (self.cpu.pc, self.cpu.it) = self.code.blocks[next].place(0);
                    number = next;
                    continue;
                }
                None => self.interpret(bus, number),
            };
            let block = &self.code.blocks[run.block];
            match run.flow {
                Flow::Branch => self.cpu.it = whippen_isa::ItState::OUTSIDE,
                Flow::Next => (self.cpu.pc, self.cpu.it) = (block.end, block.end_it),
                _ => (self.cpu.pc, self.cpu.it) = block.place(run.done),
            }
            number = match self.follow(&run) {
                Some(next) => next,
                None => match self.end_block(bus, &run) {
                    Some(next) => next,
                    None => return,
                },
            };
        }
    }

    /// Runs translated blocks: what was left over of the last one, or the next block.
    #[inline(always)]
    fn run_translated(&mut self, bus: &mut Bus, code: Native, horizon: u64) -> Result<Run, usize> {
        let mut time = Time::new(horizon - self.cycle, self.instructions);
        let left = time.left;
        let ended = code.run(&mut self.cpu, bus, &mut time);
        self.cycle = self.cycle.wrapping_add(left.wrapping_sub(time.left));
        self.instructions = time.instructions;
        self.pipe = ended.pipe;
        let flow = ended.flow.ok_or(ended.block)?;
        Ok(Run::whole(ended.block, flow, ended.done))
    }

    /// Runs the instructions of a block one by one.
    fn interpret(&mut self, bus: &mut Bus, number: usize) -> Run {
        let block = &mut self.code.blocks[number];
        if block.translated.is_due(block.ops.len()) {
            self.code.translate(number, self.pipe, RunMode::Alone);
        }
        self.cpu.outcomes = 1;
        let (mut flow, mut done) = (Flow::Next, 0);
        for op in &self.code.blocks[number].ops {
            flow = (op.run)(&mut self.cpu, bus, op);
            if flow != Flow::Next {
                break;
            }
            done += 1;
        }
        Run::whole(number, flow, done)
    }

    /// Adds what is known to follow from a run through a whole block; the number of the next one.
    #[inline(always)]
    pub(crate) fn follow(&mut self, run: &Run) -> Option<usize> {
        if !matches!(run.flow, Flow::Next | Flow::Branch) {
            return None;
        }
        let key = Key::of_whole(self.cpu.outcomes, self.pipe, self.cpu.pc);
        let link = self.code.blocks[run.block].links.get(&key)?;
        debug_assert_eq!(link.done as usize, run.done);
        self.cycle += u64::from(link.known.cycles);
        self.instructions += u64::from(link.done);
        self.pipe = link.known.pipe;
        Some(link.next as usize)
    }

    /// Adds the cycles of a run through a block; the next block, if it may follow at once.
    #[cold]
    #[inline(never)]
    fn end_block(&mut self, bus: &mut Bus, run: &Run) -> Option<usize> {
        if !matches!(run.flow, Flow::Next | Flow::Branch) {
            self.charge(run, false);
            return None;
        }
        let next = self.code.find(&mut bus.memory, self.cpu.pc, self.cpu.it);
        self.charge_and_link(run, next);
        (!self.code.is_full()).then_some(next)
    }

    /// Adds the cycles of a run through a whole block, and remembers what follows from it.
    pub(crate) fn charge_and_link(&mut self, run: &Run, next: usize) {
        let key = Key::of_whole(self.cpu.outcomes, self.pipe, self.cpu.pc);
        let (cycle, renumbered) = (self.cycle, self.renumbered);
        self.charge(run, self.code.blocks[next].wide);
        // Numbers of an earlier count mean nothing.
        if self.renumbered == renumbered {
            let known = Known {
                cycles: (self.cycle - cycle) as u32,
                pipe: self.pipe,
            };
            let (done, next) = (run.done as u32, next as u32);
            let links = &mut self.code.blocks[run.block].links;
            links.insert(key, Link { known, done, next });
        }
    }

    /// Adds the cycles of a run.
    pub(crate) fn charge(&mut self, run: &Run, wide: bool) {
        let pc = self.cpu.pc;
        let about = match run.flow {
            Flow::Branch => 1 << 2 | (pc >> 1 & 1) << 1 | u32::from(wide),
            _ => 0,
        };
        let key = Key::of_part(self.cpu.outcomes, self.pipe, run.done, about);
        let block = &self.code.blocks[run.block];
        let memo = match run.single {
            true => &block.infos[run.first].memo,
            false => &block.memo,
        };
        let known = match memo.get(&key) {
            Some(known) => *known,
            None => self.count(run, key, Target { address: pc, wide }),
        };
        self.cycle += u64::from(known.cycles);
        self.instructions += run.done as u64;
        self.pipe = known.pipe;
    }

    /// Counts a run instruction by instruction, and remembers the sum.
    #[cold]
    #[inline(never)]
    fn count(&mut self, run: &Run, key: Key, target: Target) -> Known {
        let block = &self.code.blocks[run.block];
        let mut outcomes = Outcomes::new(key.outcomes);
        let (mut pipe, mut cycles) = (self.pipes.state(self.pipe), 0);
        let infos = &block.infos[run.first..run.first + run.done];
        for (i, info) in infos.iter().enumerate() {
            let target = (run.flow == Flow::Branch && i + 1 == run.done).then_some(target);
            let outcome = outcomes.next(info, target);
            if let Ok((_, timed)) = &info.inst {
                let (after, cost) = self.code.timing.issue(pipe, timed, info.address, &outcome);
                pipe = after;
                cycles += cost.cycles();
            }
        }
        let numbers = self.pipes.len();
        let known = Known {
            cycles,
            pipe: self.number(pipe),
        };
        // Numbers of an earlier count mean nothing.
        if self.pipes.len() >= numbers && run.done > 0 {
            let block = &mut self.code.blocks[run.block];
            let memo = match run.single {
                true => &mut block.infos[run.first].memo,
                false => &mut block.memo,
            };
            memo.insert(key, known);
        }
        known
    }

    /// The number of a pipeline state; when there are too many, everything known by number is
    /// forgotten.
    pub fn number(&mut self, pipe: Pipe) -> u16 {
        if let Some(number) = self.pipes.number(pipe) {
            return number;
        }
        self.forget_numbers();
        self.pipes.number(pipe).unwrap_or(0)
    }

    /// Forgets all numbers of pipeline states, and everything that is known by number.
    pub(crate) fn forget_numbers(&mut self) {
        self.code.blocks.iter_mut().for_each(Block::forget_cycles);
        self.pipes = Pipes::new();
        self.renumbered += 1;
    }

    /// Forgets all decoded code.
    pub fn forget_code(&mut self) {
        self.code.clear();
    }

    pub fn pipe_state(&self) -> Pipe {
        self.pipes.state(self.pipe)
    }
}
