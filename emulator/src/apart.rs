//! Two cores that run apart: each by blocks, as if the other were not there, up to a common cycle;
//! what turns out not to be so is taken back.
//!
//! ```text
//!   window of both cores: remember registers
//!      |  each core to the end:  blocks, then single instructions; ports and stores are noted
//!      |
//!   a port that both used? --yes--> registers and stores back, again up to where both had used it,
//!      | no                          from there on turns for a while (`schedule`)
//!   the core that is behind stands in front of what has to be exact?
//!      | no              | yes, and the other one need not see it: that is done, the core goes on
//!      | <---------------+   apart from there, while the other one waits ahead     (`deed`)
//!   nobody waited, and nobody saw what the other did: the ports get the last accesses, done
//! ```
//!
//! Words lie at one port each, so cores without a port in common neither wait for each other nor
//! see each other's stores, and their instructions may change places. All instructions that begin
//! before the common cycle have then run, and none that begins later: as when cores take turns.
//! Whatever reaches beyond plain memory (devices, special registers, exclusive accesses) stops the
//! core in front of it. If the other core might see it, the common cycle is then that one.

mod deed;
mod side;
mod trail;
mod window;

use crate::core::Core;
use crate::cpu::Activity;
use crate::machine::Machine;
use crate::observe::Observer;
use crate::stop::Stop;
pub(crate) use trail::{Before, Stretch, Trail};
use window::WindowEnd;

/// Cycles of a window at least, which it has at first, and at most.
const WINDOW_MIN: u64 = 1 << 6;
const WINDOW_MAX: u64 = 1 << 12;
/// What a window has to gain for the next one to be tried soon.
const GAIN_MIN: u64 = 32;
/// Cycles by turns where two cores met, at least and at most.
const TURNS_MIN: u64 = 4;
const TURNS_MAX: u64 = 16;
/// Cycles by turns where a window could not be tried: most often a DMA holds a port, or a core is
/// owed a cycle, which passes soon.
const TURNS_BUSY: u64 = 4;

/// How windows are tried.
pub(crate) struct Apart {
    trails: [Trail; 2],
    window: u64,
    /// The cycle from which on a window is tried again.
    from: u64,
    /// How many cycles of turns follow when cores meet the next time.
    turns: u64,
    /// Who stands in front of an instruction that has to be exact, and what it had run then.
    in_front: Option<(usize, u64)>,
    /// Windows that stood, and their cycles; those that were taken back.
    stood: u64,
    cycles: u64,
    back: u64,
    /// What cores did exactly while the other one waited ahead.
    deeds: u64,
}

impl Default for Apart {
    fn default() -> Self {
        Self {
            trails: Default::default(),
            window: WINDOW_MIN,
            from: 0,
            turns: TURNS_MIN,
            in_front: None,
            stood: 0,
            cycles: 0,
            back: 0,
            deeds: 0,
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
    /// horizon, where that can be done and seems to pay; whether something happened that others
    /// must hear of.
    pub(crate) fn try_apart<O: Observer>(
        &mut self,
        horizon: u64,
        observer: &mut Option<&mut O>,
    ) -> Result<bool, Stop> {
        let now = self.now();
        let stands = |(core, instructions)| {
            let core: &Core = &self.cores[core];
            core.instructions == instructions && core.cpu.activity == Activity::Running
        };
        let stirred = self.cores.iter().any(|core| core.cpu.system.changed);
        if self.apart.in_front.is_some_and(stands) || stirred || self.bus.lines.changed {
            return Ok(false);
        }
        self.apart.in_front = None;
        let Some(ended) = self.window(now, horizon, observer)? else {
            self.apart.from = now + TURNS_BUSY;
            return Ok(false);
        };
        let met = ended == WindowEnd::Met;
        let gained = self.now() - now;
        self.apart.cycles += gained;
        self.apart.turns = match gained >= GAIN_MIN {
            true => TURNS_MIN,
            false => (2 * self.apart.turns).min(TURNS_MAX),
        };
        if met || gained < GAIN_MIN {
            self.apart.from = now + gained + self.apart.turns;
        }
        self.apart.window = match ended {
            WindowEnd::Stood => (8 * self.apart.window).min(WINDOW_MAX),
            WindowEnd::Met | WindowEnd::Changed => WINDOW_MIN,
        };
        // What was done exactly may have set a device or a timer.
        Ok(ended == WindowEnd::Changed || self.next_due() < horizon)
    }
}

#[cfg(test)]
mod tests;
