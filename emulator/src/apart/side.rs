//! A core that runs apart: whole blocks while there is room, single instructions up to the common
//! cycle, in front of what has to be exact it stops.

use super::trail::{Before, Stretch, Trail};
use crate::bus::Bus;
use crate::core::{Core, Run};
use crate::cpu::SavedRegisters;
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
    /// In front of what has to be exact.
    Refused,
    /// Behind what may have changed code.
    Stopped,
}

/// How far a core came.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// To the horizon.
    There,
    /// In front of an instruction that has to be exact, perhaps for what is at an address.
    Refused(Option<u32>),
    /// In front of code that is not decoded, or may have changed.
    Unknown,
}

/// A core as it was.
pub(super) struct Saved {
    registers: SavedRegisters,
    pipe: (u16, Pipe),
    cycle: u64,
    instructions: u64,
    cursor: (usize, usize),
    renumbered: u32,
}

impl Core {
    pub(super) fn save(&self) -> Saved {
        Saved {
            registers: self.cpu.registers(),
            pipe: (self.pipe, self.pipe_state()),
            cycle: self.cycle,
            instructions: self.instructions,
            cursor: self.cursor,
            renumbered: self.renumbered,
        }
    }

    pub(super) fn restore(&mut self, saved: &Saved) {
        self.cpu.set_registers(&saved.registers);
        self.pipe = match self.is_numbered_as(saved) {
            true => saved.pipe.0,
            false => self.number(saved.pipe.1),
        };
        self.cycle = saved.cycle;
        self.instructions = saved.instructions;
        self.cursor = saved.cursor;
    }

    /// A block begins here from now on, if it did not: one instruction of the one before ran alone.
    pub(super) fn find_here(&mut self, bus: &mut Bus) {
        let number = self.code.find(&mut bus.memory, self.cpu.pc, self.cpu.it);
        self.cursor = (number, 0);
    }

    /// Whether numbers of states of the pipeline are those of then.
    pub(super) fn is_numbered_as(&self, saved: &Saved) -> bool {
        self.renumbered == saved.renumbered
    }

    /// Runs all instructions that begin before `horizon`, and those behind it of the last block if
    /// that ends by `limit`, unless it comes to one that has to be exact.
    pub(super) fn run_apart(&mut self, bus: &mut Bus, horizon: u64, limit: u64) -> Reach {
        if let Some((block, index)) = self.located().filter(|(_, index)| *index > 0) {
            match self.run_singly(bus, block, index, horizon) {
                Ended::Refused => return Reach::Refused(bus.refused),
                Ended::Stopped => return Reach::Unknown,
                Ended::There | Ended::Branched(_) => {}
            }
        }
        let mut next = None;
        while self.cycle < horizon {
            let known = next.or_else(|| self.code.known(self.cpu.pc, self.cpu.it));
            let Some(number) = known.filter(|_| self.cpu.thumb) else {
                return Reach::Unknown;
            };
            let block = &self.code.blocks[number];
            let room = horizon - self.cycle;
            let ended = if block.cycles_max <= room.max(limit.saturating_sub(self.cycle)) {
                self.run_whole(bus, number, room.max(block.cycles_max))
            } else if u64::from(block.took) <= room {
                self.run_if_it_fits(bus, number, horizon)
            } else {
                self.run_singly(bus, number, 0, horizon)
            };
            next = match ended {
                Ended::Refused => return Reach::Refused(bus.refused),
                Ended::Stopped => return Reach::Unknown,
                Ended::Branched(next) => next,
                Ended::There => None,
            };
        }
        Reach::There
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
        bus.refused = None;
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
        self.end_stretch(bus, run, &time.before)
    }

    /// Runs some instructions of a block that follow each other.
    #[inline(always)]
    fn run_stretch(&mut self, bus: &mut Bus, block: usize, first: usize, count: usize) -> Ended {
        let before = Before::of(&bus.trail);
        bus.trail.ports |= self.code.blocks[block].ports;
        let outcomes = std::mem::replace(&mut self.cpu.outcomes, 1);
        let (mut flow, mut done) = (Flow::Next, 0);
        for op in &self.code.blocks[block].ops[first..first + count] {
            bus.trail.op = done as u8;
            flow = (op.run)(&mut self.cpu, bus, op);
            if flow != Flow::Next {
                break;
            }
            done += 1;
        }
        let run = Run {
            first,
            single: count == 1,
            ..Run::whole(block, flow, done)
        };
        if run.done == 0 {
            self.cpu.outcomes = outcomes;
        }
        self.end_stretch(bus, run, &before)
    }

    /// What follows from a stretch.
    #[inline(always)]
    fn end_stretch(&mut self, bus: &mut Bus, run: Run, before: &Before) -> Ended {
        if matches!(run.flow, Flow::Inexact | Flow::Trap) {
            bus.trail.op = run.done as u8;
            bus.undo(before.replaced, before.accesses);
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
                accesses: before.accesses,
                ports: before.ports,
                run,
            });
            let cycle = self.cycle;
            match next.0.filter(|_| whole) {
                Some(next) if self.follow(&run).is_none() => self.charge_and_link(&run, next),
                Some(_) => {}
                None => self.charge(&run, next.1),
            }
            if whole {
                self.code.blocks[run.block].took = (self.cycle - cycle) as u32;
            }
        }
        match run.flow {
            Flow::Next if !whole => Ended::There,
            Flow::Next | Flow::Branch => Ended::Branched(next.0),
            Flow::Inexact | Flow::Trap => Ended::Refused,
            Flow::Leave => Ended::Stopped,
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
        let after = trail.stretches.iter().skip(1).map(|next| next.ports);
        let after = after.chain(std::iter::once(trail.ports));
        for (stretch, ports) in trail.stretches.iter().zip(after) {
            note(ports, stretch.cycle);
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

    /// Adds the port and the cycle of each access of a stretch.
    fn replay(&self, stretch: &Stretch, mut accesses: &[[u8; 2]], found: &mut Vec<(u8, u64)>) {
        self.count_again(stretch, |i, cycle| {
            let of_this = |access: &&[u8; 2]| access[0] as usize == i;
            let count = accesses.iter().take_while(of_this).count();
            let (own, rest) = accesses.split_at(count);
            accesses = rest;
            let cycles = (cycle..).zip(own).map(|(cycle, [_, port])| (*port, cycle));
            found.extend(cycles.filter(|(port, _)| *port != NO_PORT));
        });
    }

    /// Counts a stretch again: the number of each instruction, and the cycle in which it began.
    fn count_again(&self, stretch: &Stretch, mut each: impl FnMut(usize, u64)) {
        let Run { first, done, .. } = stretch.run;
        let (mut pipe, mut cycle) = (self.pipes.state(stretch.pipe), stretch.cycle);
        let mut outcomes = Outcomes::new(stretch.outcomes);
        let infos = &self.code.blocks[stretch.run.block].infos[first..first + done];
        for (i, info) in infos.iter().enumerate() {
            each(i, cycle);
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

    /// Whether the last instruction began in the cycle that the core has come to: some take none.
    /// It then uses its ports in that cycle.
    pub(super) fn is_still_in(&self, trail: &Trail, cycle: u64) -> bool {
        let last = trail.stretches.last().filter(|_| self.cycle == cycle);
        // A branch takes cycles.
        let Some(last) = last.filter(|last| last.run.flow != Flow::Branch) else {
            return false;
        };
        let mut began = last.cycle;
        self.count_again(last, |_, cycle| began = cycle);
        began >= cycle
    }
}
