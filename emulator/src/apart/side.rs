//! A core that runs apart: whole blocks while there is room, single instructions up to the common
//! cycle, in front of what has to be exact it stops.

use super::trail::{Stretch, Trail};
use crate::bus::Bus;
use crate::core::{Core, Run};
use crate::cpu::Cpu;
use crate::memory::NO_PORT;
use crate::op::Flow;
use crate::outcome::Outcomes;
use crate::translate::{Native, RunMode, Time};
use whippen_isa::timing::Pipe;

/// No access comes so many cycles after its instruction began: the longest list has 32 words.
const ACCESS_CYCLES: u64 = 64;

/// How a stretch ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ended {
    /// Where it was to end.
    There,
    /// With a branch: the block that is next, if it is known.
    Branched(Option<usize>),
    /// In front of what has to be exact, or behind what may have changed code.
    Stopped,
}

/// A core as it was.
pub(super) struct Saved {
    cpu: Cpu,
    pipe: Pipe,
    cycle: u64,
    instructions: u64,
    cursor: (usize, usize),
    pub(super) renumbered: u32,
}

impl Core {
    pub(super) fn save(&self) -> Saved {
        Saved {
            cpu: self.cpu.clone(),
            pipe: self.pipe_state(),
            cycle: self.cycle,
            instructions: self.instructions,
            cursor: self.cursor,
            renumbered: self.renumbered,
        }
    }

    pub(super) fn restore(&mut self, saved: &Saved) {
        self.cpu.clone_from(&saved.cpu);
        self.pipe = self.number(saved.pipe);
        self.cycle = saved.cycle;
        self.instructions = saved.instructions;
        self.cursor = saved.cursor;
    }

    /// Runs all instructions that begin before `horizon`, unless it comes to one that has to be
    /// exact; whether it did not.
    pub(super) fn run_apart(&mut self, bus: &mut Bus, horizon: u64) -> bool {
        if let Some((block, index)) = self.located().filter(|(_, index)| *index > 0)
            && self.run_singly(bus, block, index, horizon) == Ended::Stopped
        {
            return false;
        }
        let mut next = None;
        while self.cycle < horizon {
            let known = next.or_else(|| self.code.known(self.cpu.pc, self.cpu.it));
            let Some(number) = known.filter(|_| self.cpu.thumb) else {
                return false;
            };
            let block = &self.code.blocks[number];
            let room = horizon - self.cycle;
            let ended = if block.cycles_max <= room {
                self.run_whole(bus, number, room)
            } else if u64::from(block.took) <= room {
                self.run_if_it_fits(bus, number, horizon)
            } else {
                self.run_singly(bus, number, 0, horizon)
            };
            next = match ended {
                Ended::Stopped => return false,
                Ended::Branched(next) => next,
                Ended::There => None,
            };
        }
        true
    }

    /// Runs a block that took few enough cycles the last time, or one by one if it takes more now.
    fn run_if_it_fits(&mut self, bus: &mut Bus, block: usize, horizon: u64) -> Ended {
        let saved = self.save();
        let trail = &bus.trail;
        let (kept, accesses) = (trail.replaced.len(), trail.accesses.len());
        let stretches = trail.stretches.len();
        let ended = self.run_whole(bus, block, 0);
        // An instruction may take no cycle, but a branch does.
        let last = bus.trail.stretches[stretches..].last();
        let taken = last.is_some_and(|last| last.run.flow == Flow::Branch);
        if self.cycle < horizon || self.cycle == horizon && taken {
            return ended;
        }
        self.restore(&saved);
        bus.take_back(kept);
        bus.trail.accesses.truncate(accesses);
        bus.trail.stretches.truncate(stretches);
        self.run_singly(bus, block, 0, horizon)
    }

    /// Runs a block from an instruction on, one by one, up to its end, a branch or the horizon.
    fn run_singly(&mut self, bus: &mut Bus, block: usize, from: usize, horizon: u64) -> Ended {
        for index in from..self.code.blocks[block].ops.len() {
            if self.cycle >= horizon {
                break;
            }
            let ended = self.run_stretch(bus, block, index, 1);
            if ended != Ended::There {
                return ended;
            }
            self.cursor = (block, index + 1);
        }
        Ended::There
    }

    /// Runs a block, and those behind it that are translated with it while there is room for them.
    #[inline(always)]
    fn run_whole(&mut self, bus: &mut Bus, number: usize, room: u64) -> Ended {
        let block = &mut self.code.blocks[number];
        let count = block.ops.len();
        if let Some(code) = block.translated.code(RunMode::Apart, self.pipe) {
            return self.run_translated_apart(bus, code, room);
        }
        if block.translated.is_due(count) {
            self.code.translate(number, self.pipe, RunMode::Apart);
        }
        self.run_stretch(bus, number, 0, count)
    }

    fn run_translated_apart(&mut self, bus: &mut Bus, code: Native, room: u64) -> Ended {
        let mut time = Time::new(room, self.instructions);
        time.end = self.cycle.wrapping_add(time.left);
        let left = time.left;
        let ended = code.run_apart(&mut self.cpu, bus, &mut time);
        self.cycle = self.cycle.wrapping_add(left.wrapping_sub(time.left));
        self.instructions = time.instructions;
        self.pipe = ended.pipe;
        let Some(flow) = ended.flow else {
            (self.cpu.pc, self.cpu.it) = self.code.blocks[ended.block].place(0);
            return Ended::Branched(Some(ended.block));
        };
        let run = Run::whole(ended.block, flow, ended.done);
        self.end_stretch(bus, run, time.replaced_before, time.accesses_before)
    }

    /// Runs some instructions of a block that follow each other.
    #[inline(always)]
    fn run_stretch(&mut self, bus: &mut Bus, block: usize, first: usize, count: usize) -> Ended {
        let (kept, accesses) = (bus.trail.replaced.len(), bus.trail.accesses.len());
        bus.trail.ports |= self.code.blocks[block].ports;
        let outcomes = std::mem::replace(&mut self.cpu.outcomes, 1);
        let (mut flow, mut before) = (Flow::Next, 0);
        for op in &self.code.blocks[block].ops[first..first + count] {
            bus.trail.op = before as u8;
            flow = (op.run)(&mut self.cpu, bus, op);
            if flow != Flow::Next {
                break;
            }
            before += 1;
        }
        let run = Run {
            first,
            single: count == 1,
            ..Run::whole(block, flow, before)
        };
        if run.done == 0 {
            self.cpu.outcomes = outcomes;
        }
        self.end_stretch(bus, run, kept, accesses)
    }

    /// What follows from a stretch, before which there were so many stores and accesses.
    #[inline(always)]
    fn end_stretch(&mut self, bus: &mut Bus, run: Run, kept: usize, accesses: usize) -> Ended {
        if matches!(run.flow, Flow::Inexact | Flow::Trap) {
            bus.trail.op = run.done as u8;
            bus.undo(kept, accesses);
        }
        let block = &self.code.blocks[run.block];
        if run.flow == Flow::Branch {
            self.cpu.it = whippen_isa::ItState::OUTSIDE;
        } else {
            (self.cpu.pc, self.cpu.it) = block.place(run.first + run.done);
        }
        let goes_on = matches!(run.flow, Flow::Next | Flow::Branch);
        let whole = goes_on && run.first == 0 && !run.single;
        let next = if whole || run.flow == Flow::Branch {
            self.target(bus)
        } else {
            (None, false)
        };
        if run.done > 0 {
            bus.trail.stretches.push(Stretch {
                outcomes: self.cpu.outcomes,
                pipe: self.pipe,
                cycle: self.cycle,
                accesses,
                run,
            });
            let before = self.cycle;
            match next.0.filter(|_| whole) {
                Some(next) if self.follow(&run).is_none() => self.charge_and_link(&run, next),
                Some(_) => {}
                None => self.charge(&run, next.1),
            }
            if whole {
                self.code.blocks[run.block].took = (self.cycle - before) as u32;
            }
        }
        match run.flow {
            Flow::Next if !whole => Ended::There,
            Flow::Next | Flow::Branch => Ended::Branched(next.0),
            Flow::Leave | Flow::Inexact | Flow::Trap => Ended::Stopped,
        }
    }

    /// The block at PC, if it is known, and whether it begins with an instruction of 32 bits.
    #[inline(always)]
    fn target(&mut self, bus: &mut Bus) -> (Option<usize>, bool) {
        let pc = self.cpu.pc;
        match self.code.known(pc, self.cpu.it) {
            Some(next) => (Some(next), self.code.blocks[next].wide),
            None => {
                bus.trail.ports |= bus.memory.port_bit(pc);
                let first = bus.memory.halfword(pc);
                (None, first.is_some_and(whippen_isa::is_wide))
            }
        }
    }

    /// The cycle by which each port was used first.
    pub(super) fn first_uses(
        &self,
        trail: &Trail,
        start: u64,
        held: u32,
    ) -> [u64; u32::BITS as usize] {
        let mut uses = [self.cycle; u32::BITS as usize];
        let mut seen = 0;
        let mut note = |ports: u32, cycle: u64| {
            let mut new = ports & !seen;
            seen |= ports;
            while new != 0 {
                uses[new.trailing_zeros() as usize] = cycle;
                new &= new - 1;
            }
        };
        note(held, start);
        let mut accesses = trail.accesses.iter();
        let ends = trail.stretches.iter().skip(1).map(|next| next.accesses);
        let ends = ends.chain(std::iter::once(trail.accesses.len()));
        for (stretch, end) in trail.stretches.iter().zip(ends) {
            let own = accesses.by_ref().take(end - stretch.accesses);
            let bit = |access: &[u8; 2]| 1_u32.checked_shl(access[1].into()).unwrap_or(0);
            let ports = own.fold(0, |ports, access| ports | bit(access));
            note(
                ports | self.code.blocks[stretch.run.block].ports,
                stretch.cycle,
            );
        }
        uses
    }

    /// The port and the cycle of each access of those instructions that may have one at `horizon`
    /// or later; others may be among them.
    pub(super) fn last_accesses(&self, trail: &Trail, horizon: u64) -> Vec<(u8, u64)> {
        let mut found = Vec::new();
        let mut end = trail.accesses.len();
        for stretch in trail.stretches.iter().rev() {
            // The first access of an instruction comes when it begins, which is before.
            let accesses = &trail.accesses[stretch.accesses..end];
            if accesses.windows(2).any(|pair| pair[0][0] == pair[1][0]) {
                self.replay(stretch, accesses, &mut found);
            }
            end = stretch.accesses;
            if stretch.cycle + ACCESS_CYCLES <= horizon {
                break;
            }
        }
        found
    }

    /// Counts a stretch again, for the cycles of its accesses.
    fn replay(&self, stretch: &Stretch, mut accesses: &[[u8; 2]], found: &mut Vec<(u8, u64)>) {
        let Run { first, done, .. } = stretch.run;
        let (mut pipe, mut cycle) = (self.pipes.state(stretch.pipe), stretch.cycle);
        let mut outcomes = Outcomes::new(stretch.outcomes);
        let infos = &self.code.blocks[stretch.run.block].infos[first..first + done];
        for (i, info) in infos.iter().enumerate() {
            let count = accesses
                .iter()
                .take_while(|[op, _]| *op as usize == i)
                .count();
            let (own, rest) = accesses.split_at(count);
            accesses = rest;
            let cycles = (cycle..).zip(own).map(|(cycle, [_, port])| (*port, cycle));
            found.extend(cycles.filter(|(port, _)| *port != NO_PORT));
            if i + 1 == done {
                break;
            }
            // The branch, if there is one, is the last.
            let outcome = outcomes.next(info, None);
            if let Ok((_, timed)) = &info.inst {
                let (after, cost) = self.code.timing.issue(pipe, timed, info.address, &outcome);
                pipe = after;
                cycle += u64::from(cost.cycles());
            }
        }
    }
}
