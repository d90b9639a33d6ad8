//! One window: how far both cores come, which of them goes on, and what stands in the end.
//!
//! The core that is behind may do something exactly while the other one waits ahead (`deed`), and
//! goes on apart from there. Each can be taken back to behind the last thing that it did exactly.

use super::side::{Reach, Saved};
use crate::cpu::Activity;
use crate::machine::Machine;
use crate::observe::Observer;
use crate::stop::Stop;

/// How a window ended.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum WindowEnd {
    /// All instructions before its end ran.
    Stood,
    /// Cores met, or will.
    Met,
    /// Something happened that others must hear of.
    Changed,
}

/// Both cores in a window.
struct Window {
    /// As they were when it began, or behind what each of them did exactly.
    saved: [Saved; 2],
    /// The ports that they held on, and when that was.
    held: [u32; 2],
    since: [u64; 2],
    reach: [Reach; 2],
    /// Who ran last: over what the other one stored.
    last: usize,
    end: u64,
}

impl Machine {
    /// One window. Nothing where cores cannot run apart now.
    pub(super) fn window<O: Observer>(
        &mut self,
        start: u64,
        horizon: u64,
        observer: &mut Option<&mut O>,
    ) -> Result<Option<WindowEnd>, Stop> {
        let running = |i: &usize| self.cores[*i].cpu.activity == Activity::Running;
        let pair = self.cores.len() == 2 && (0..2).all(|i| running(&i));
        let even = self.bus.divides && self.bus.memory.is_shared() && self.bus.fabric.is_even();
        let held = match pair && even {
            true => self.bus.fabric.held(start),
            false => None,
        };
        let Some(held) = held else {
            return Ok(None);
        };
        let mut window = Window {
            saved: [self.cores[0].save(), self.cores[1].save()],
            held,
            since: [start; 2],
            reach: [Reach::There; 2],
            last: 1,
            end: horizon.min(start + self.apart.window),
        };
        // The first one may end with a block, and so ends the window.
        window.reach[0] = self.run_side(0, held[0], window.end, horizon);
        window.end = window.end.max(self.cores[0].cycle).min(horizon);
        if self.is_still_in(0, window.end) {
            self.shorten(0, &window, window.end);
        }
        window.reach[1] = self.run_side(1, held[1], window.end, window.end);
        loop {
            if !(0..2).all(|i| self.cores[i].is_numbered_as(&window.saved[i])) {
                self.take_both_back(&window);
                return Ok(Some(WindowEnd::Met));
            }
            let behind = self.behind(&window);
            let meeting = self.meeting(&window).filter(|meeting| {
                // All that the one behind did came before, and the other one ran after it.
                let before = |core: usize| self.cores[core].cycle < *meeting;
                !behind.is_some_and(|core| core != window.last && before(core))
            });
            if let Some(meeting) = meeting {
                self.apart.back += 1;
                self.cut_both(&window, meeting.min(window.end));
                return Ok(Some(WindowEnd::Met));
            }
            let Some(core) = behind else {
                (0..2).for_each(|core| self.settle(core, window.end));
                self.apart.stood += 1;
                return Ok(Some(WindowEnd::Stood));
            };
            if let Some(ended) = self.act(core, &mut window, observer)? {
                self.apart.stood += 1;
                return Ok(Some(ended));
            }
        }
    }

    /// The core that is behind and did not come to the end.
    fn behind(&self, window: &Window) -> Option<usize> {
        let stopped = (0..2)
            .filter(|i| window.reach[*i] != Reach::There && self.cores[*i].cycle < window.end);
        stopped.min_by_key(|i| self.cores[*i].cycle)
    }

    /// Lets the core that is behind do what stopped it, and go on apart; how the window ends if it
    /// does.
    fn act<O: Observer>(
        &mut self,
        core: usize,
        window: &mut Window,
        observer: &mut Option<&mut O>,
    ) -> Result<Option<WindowEnd>, Stop> {
        let (other, cycle) = (1 - core, self.cores[core].cycle);
        let beside = self.cores[other].cycle == cycle && self.is_still_in(core, cycle);
        if beside || !self.may_act(core, window.reach[core], self.apart.trails[other].ports) {
            if self.is_still_in(core, cycle) {
                self.cut_both(window, cycle);
            } else {
                self.settle(core, cycle);
                self.cut(other, window, cycle);
            }
            self.apart.in_front = Some((core, self.cores[core].instructions));
            return Ok(Some(WindowEnd::Stood));
        }
        self.settle(core, cycle);
        // What the other one ran before this.
        let before = cycle + u64::from(other < core);
        if window.reach[core] != Reach::Unknown {
            let stepped = self.step_core(core, observer);
            if stepped.is_err() || self.disturbs(other, window.end) {
                self.cut(other, window, before);
                return stepped.map(|()| Some(WindowEnd::Changed));
            }
            self.apart.deeds += 1;
        }
        Ok(self.go_on(core, window, before))
    }

    /// Lets a core go on apart after what it did, before which the other one had run up to a cycle.
    fn go_on(&mut self, core: usize, window: &mut Window, before: u64) -> Option<WindowEnd> {
        let other = 1 - core;
        let of = &self.cores[core];
        let (sleeps, now) = (of.cpu.activity != Activity::Running, of.cycle);
        if sleeps {
            // From then on nobody waits for anybody, nor uses ports.
            self.cut(other, window, before);
            return Some(WindowEnd::Changed);
        }
        if now >= window.end {
            // The other one can do nothing more that this one hears of.
            self.settle(other, self.cores[other].cycle.min(window.end));
            return Some(WindowEnd::Changed);
        }
        let held = self.bus.fabric.held(now);
        let Some(held) = held.filter(|_| !self.is_interrupted(core)) else {
            self.cut(other, window, now);
            return Some(WindowEnd::Changed);
        };
        if self.finds_code(core, self.apart.trails[other].ports) {
            self.cores[core].find_here(&mut self.bus);
        }
        window.saved[core] = self.cores[core].save();
        (window.held[core], window.since[core]) = (held[core], now);
        window.held[other] |= held[other];
        self.apart.trails[other].ports |= held[other];
        window.last = core;
        window.reach[core] = self.run_side(core, held[core], window.end, window.end);
        None
    }

    /// Leaves of both cores only what began before a cycle, if that stands.
    fn cut_both(&mut self, window: &Window, cycle: u64) {
        self.take_both_back(window);
        for core in [1 - window.last, window.last] {
            self.run_side(core, window.held[core], cycle, cycle);
        }
        let stands = (0..2).all(|i| {
            let core = &self.cores[i];
            core.cycle >= cycle && core.is_numbered_as(&window.saved[i])
        });
        if stands && self.apart.trails[0].ports & self.apart.trails[1].ports == 0 {
            (0..2).for_each(|core| self.settle(core, cycle));
            self.apart.stood += 1;
        } else {
            self.take_both_back(window);
        }
    }

    /// The first cycle by which both cores have used some port, if they have.
    fn meeting(&self, window: &Window) -> Option<u64> {
        let trails = &self.apart.trails;
        let both = trails[0].ports & trails[1].ports;
        if both == 0 {
            return None;
        }
        let uses = [0, 1].map(|core| {
            self.cores[core].first_uses(&trails[core], window.since[core], window.held[core])
        });
        let met = |port: usize| uses[0][port].max(uses[1][port]);
        let ports = (0..u32::BITS as usize).filter(|port| both >> port & 1 != 0);
        ports.map(met).min()
    }

    /// Runs a core apart from the ports that it holds on, up to the horizon if it can, and not
    /// beyond the limit.
    fn run_side(&mut self, core: usize, held: u32, horizon: u64, limit: u64) -> Reach {
        std::mem::swap(&mut self.bus.trail, &mut self.apart.trails[core]);
        self.bus.trail.begin(held);
        (self.bus.apart, self.bus.refused) = (true, None);
        let reach = self.cores[core].run_apart(&mut self.bus, horizon, limit);
        self.bus.apart = false;
        std::mem::swap(&mut self.bus.trail, &mut self.apart.trails[core]);
        reach
    }

    /// Leaves of a core, which ran ahead, only what began before a cycle, and that stands.
    fn cut(&mut self, core: usize, window: &Window, cycle: u64) {
        self.shorten(core, window, cycle);
        self.settle(core, cycle);
    }

    /// Leaves of a core only what began before a cycle.
    fn shorten(&mut self, core: usize, window: &Window, cycle: u64) {
        if self.cores[core].cycle > cycle || self.is_still_in(core, cycle) {
            self.take_back(core, &window.saved[core]);
            loop {
                let again = self.cores[core].save();
                self.run_side(core, window.held[core], cycle, cycle);
                if self.cores[core].is_numbered_as(&again) {
                    break;
                }
                self.take_back(core, &again);
            }
        }
    }

    /// Whether the last instruction of a core began in the cycle that it has come to.
    fn is_still_in(&self, core: usize, cycle: u64) -> bool {
        self.cores[core].is_still_in(&self.apart.trails[core], cycle)
    }

    /// As if neither core had run apart.
    fn take_both_back(&mut self, window: &Window) {
        for core in [window.last, 1 - window.last] {
            self.take_back(core, &window.saved[core]);
        }
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

    /// Tells the fabric what a core did apart.
    fn settle(&mut self, core: usize, common: u64) {
        let trail = &self.apart.trails[core];
        let Some(last) = trail.stretches.last() else {
            return;
        };
        let of = &self.cores[core];
        let accesses = of.last_accesses(trail, common);
        let info = &of.code.blocks[last.run.block].infos[last.run.first + last.run.done - 1];
        let fabric = &mut self.bus.fabric;
        fabric.settle(core, accesses.into_iter(), info.address);
    }
}
