//! Two cores that run apart: each by blocks, as if the other were not there, up to a common cycle;
//! what turns out not to be so is taken back.
//!
//! ```text
//!   window of both cores: remember registers
//!      |  first core to the horizon:  blocks, then single instructions; ports and stores are noted
//!      |  second core to the horizon: the same
//!      |
//!   a port that both used? --yes--> registers and stores back, again up to where both had used it,
//!      | no                          from there on turns for a while (`schedule`)
//!   nobody waited, and nobody saw what the other did: the ports get the last accesses, done
//! ```
//!
//! Words lie at one port each, so cores without a port in common neither wait for each other nor
//! see each other's stores, and their instructions may change places. All instructions that begin
//! before the common cycle have then run, and none that begins later: as when cores take turns.
//! Whatever reaches beyond plain memory (devices, special registers, exclusive accesses, code that
//! was not decoded yet) stops the core in front of it; the common cycle is then that one.

mod side;
mod trail;

use crate::core::Core;
use crate::cpu::Activity;
use crate::machine::Machine;
use side::Saved;
pub(crate) use trail::{Stretch, Trail};

/// Cycles of a window at least, which it has at first, and at most.
const WINDOW_MIN: u64 = 1 << 11;
const WINDOW_MAX: u64 = 1 << 12;
/// What a window has to gain for the next one to be tried soon.
const GAIN_MIN: u64 = 64;
/// Cycles by turns where two cores met, at least and at most.
const TURNS_MIN: u64 = 16;
const TURNS_MAX: u64 = 1 << 6;
/// Cycles by turns where a window could not be tried: most often a DMA holds a port, or a core is
/// owed a cycle, which passes soon.
const TURNS_BUSY: u64 = 16;

/// How windows are tried.
pub(crate) struct Apart {
    trails: [Trail; 2],
    window: u64,
    /// The cycle from which on a window is tried again.
    from: u64,
    /// How many cycles of turns follow when cores meet the next time.
    turns: u64,
    /// Who stopped first the last time: it goes first.
    first: usize,
    /// Who stands in front of an instruction that has to be exact, and what it had run then.
    in_front: Option<(usize, u64)>,
    /// Windows that stood, and their cycles; those that were taken back.
    stood: u64,
    cycles: u64,
    back: u64,
}

impl Default for Apart {
    fn default() -> Self {
        Self {
            trails: Default::default(),
            window: WINDOW_MIN,
            from: 0,
            turns: TURNS_MIN,
            first: 0,
            in_front: None,
            stood: 0,
            cycles: 0,
            back: 0,
        }
    }
}

impl Machine {
    /// Whether it is time to try a window.
    #[inline(always)]
    pub(crate) fn tries_apart(&self, now: u64) -> bool {
        now >= self.apart.from
    }

    /// Runs two cores apart for a while, all instructions that begin before some cycle up to the
    /// horizon, where that can be done and seems to pay.
    pub(crate) fn try_apart(&mut self, horizon: u64) {
        let now = self.now();
        let stands = |(core, instructions)| {
            let core: &Core = &self.cores[core];
            core.instructions == instructions && core.cpu.activity == Activity::Running
        };
        let stirred = self.cores.iter().any(|core| core.cpu.system.changed);
        if self.apart.in_front.is_some_and(stands) || stirred || self.bus.lines.changed {
            return;
        }
        self.apart.in_front = None;
        let Some(met) = self.window(now, horizon) else {
            self.apart.from = now + TURNS_BUSY;
            return;
        };
        let gained = self.now() - now;
        self.apart.cycles += gained;
        self.apart.turns = match gained >= GAIN_MIN {
            true => TURNS_MIN,
            false => (2 * self.apart.turns).min(TURNS_MAX),
        };
        if met || gained < GAIN_MIN {
            self.apart.from = now + gained + self.apart.turns;
        }
        self.apart.window = match met {
            true => gained.clamp(WINDOW_MIN, WINDOW_MAX),
            false => (2 * self.apart.window).min(WINDOW_MAX),
        };
    }

    /// One window; whether cores met in it, so that it ends there. Nothing where they cannot run
    /// apart now.
    fn window(&mut self, start: u64, horizon: u64) -> Option<bool> {
        let running = |i: &usize| self.cores[*i].cpu.activity == Activity::Running;
        let pair = self.cores.len() == 2 && (0..2).all(|i| running(&i));
        let even = self.bus.divides && self.bus.memory.is_shared() && self.bus.fabric.is_even();
        if !pair || !even {
            return None;
        }
        let held = self.bus.fabric.held(start)?;
        let mut common = horizon.min(start + self.apart.window);
        let saved = [self.cores[0].save(), self.cores[1].save()];
        let (first, second) = (self.apart.first, 1 - self.apart.first);
        let mut stopped = None;
        for core in [first, second] {
            if !self.run_side(core, held[core], common) {
                common = common.min(self.cores[core].cycle);
                stopped = Some(core);
            }
        }
        let meeting = self.meeting(start, held);
        if let Some(meeting) = meeting {
            common = meeting.min(common);
            stopped = None;
            self.apart.back += 1;
            self.take_both_back(second, &saved);
            self.run_side(first, held[first], common);
            self.run_side(second, held[second], common);
        } else if stopped == Some(second) && self.cores[first].cycle > common {
            // What the second one does there may concern the first one, which is beyond it.
            self.apart.first = second;
            self.take_back(first, &saved[first]);
            self.run_side(first, held[first], common);
        }
        let stands = (0..2).all(|i| {
            let core = &self.cores[i];
            let is_there = core.cycle >= common || stopped == Some(i);
            is_there && core.renumbered == saved[i].renumbered
        });
        if !stands || self.apart.trails[0].ports & self.apart.trails[1].ports != 0 {
            self.take_both_back(second, &saved);
            return Some(true);
        }
        self.apart.in_front = stopped.map(|core| (core, self.cores[core].instructions));
        self.apart.stood += 1;
        self.settle(common);
        Some(meeting.is_some())
    }

    /// The first cycle by which both cores have used some port, if they have.
    fn meeting(&self, start: u64, held: [u32; 2]) -> Option<u64> {
        let trails = &self.apart.trails;
        let both = trails[0].ports & trails[1].ports;
        if both == 0 {
            return None;
        }
        let uses = [0, 1].map(|core| self.cores[core].first_uses(&trails[core], start, held[core]));
        let met = |port: usize| uses[0][port].max(uses[1][port]);
        let ports = (0..u32::BITS as usize).filter(|port| both >> port & 1 != 0);
        ports.map(met).min()
    }

    /// Runs a core apart from the ports that it holds on; whether it came to the horizon.
    fn run_side(&mut self, core: usize, held: u32, horizon: u64) -> bool {
        std::mem::swap(&mut self.bus.trail, &mut self.apart.trails[core]);
        self.bus.trail.begin(held);
        self.bus.apart = true;
        let reached = self.cores[core].run_apart(&mut self.bus, horizon);
        self.bus.apart = false;
        std::mem::swap(&mut self.bus.trail, &mut self.apart.trails[core]);
        reached
    }

    /// As if neither core had run apart; the second one ran over what the first one stored.
    fn take_both_back(&mut self, second: usize, saved: &[Saved; 2]) {
        self.take_back(second, &saved[second]);
        self.take_back(1 - second, &saved[1 - second]);
    }

    /// As if a core had not run apart.
    fn take_back(&mut self, core: usize, saved: &Saved) {
        let replaced = &mut self.apart.trails[core].replaced;
        for replaced in replaced.iter().rev() {
            self.bus.memory.put_back(replaced);
        }
        replaced.truncate(0);
        self.cores[core].restore(saved);
    }

    /// Tells the fabric what the cores did apart.
    fn settle(&mut self, common: u64) {
        for (core, trail) in self.apart.trails.iter().enumerate() {
            let Some(last) = trail.stretches.last() else {
                continue;
            };
            let of = &self.cores[core];
            let accesses = of.last_accesses(trail, common);
            let info = &of.code.blocks[last.run.block].infos[last.run.first + last.run.done - 1];
            self.bus
                .fabric
                .settle(core, accesses.into_iter(), info.address);
        }
    }
}

#[cfg(test)]
mod tests;
