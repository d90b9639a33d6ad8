//! One instrument in parts: its head, the members of its banks, its tail, called one after the
//! other as one instrument is; on two cores members are divided between them.
//!
//! How the cores call their parts is in `assembly`.
//!
//! Not here: what the parts are (`whippen-parts`), cycles (`whippen-budget`).

mod assembly;

use whippen_arm::image::Symbol;
use whippen_arm::thumb::{Built, ThumbError};
use whippen_kernel::Kernel;
use whippen_modes::Modes;
use whippen_parts::{Of, Parts, Role};

use super::CORES;
use super::code::ZoneCode;

pub(super) use assembly::as_assembly;

/// An instrument in parts, with the modes of each.
#[derive(Debug, Clone)]
pub struct InParts {
    /// What is cut.
    pub whole: Kernel,
    /// How many instructions the modes of a part may have.
    pub instructions: usize,
    /// The parts.
    pub parts: Parts,
    /// The modes of each, in the same order.
    pub modes: Vec<Modes>,
}

/// The code of a part; the tail is the zone that they belong to.
#[derive(Debug, Clone)]
pub struct PartCode {
    /// The prefix of its symbols.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// The core that runs it.
    pub core: usize,
    /// Code, state, and where the state has what.
    pub built: Built,
}

/// What is in parts.
#[derive(Debug, Clone)]
pub struct Cut {
    /// All parts but the tail, in their order.
    pub parts: Vec<PartCode>,
    /// The modes of all of them, by number; the tail's are the last.
    pub modes: Vec<Modes>,
    /// All of them, by number.
    of: Parts,
}

/// The function in which core 0 starts core 1, runs its own members and waits.
pub const MEMBERS: &str = "core0_members";
/// Where core 1 has been started.
pub const WENT: &str = "core0_went";
/// Where core 1 has what the head leaves.
pub const LED: &str = "core0_led";
/// The loop in which core 0 then waits for what is early.
pub const MEET: &str = "core0_meet";
/// Where core 0 gives that up.
pub const UNMET: &str = "core0_meet_late";
/// Where core 0 is done with its members.
pub const LEFT: &str = "core0_left";
/// The loop in which core 0 waits.
pub const WAIT: &str = "core0_wait";
/// Where core 1 begins to look for `go`, and the loop in which it does.
pub const POLL: [&str; 2] = ["core1_poll", "core1_wait"];
/// Where core 1, done with what is early, begins to look for what the head leaves, and the loop in
/// which it does.
pub const EARLY: [&str; 2] = ["core1_early", "core1_early_wait"];
/// Where core 1, done with its members, begins to look for what those of core 0 leave for what is
/// heard, and the loop in which it does.
pub const DONE: [&str; 2] = ["core1_done", "core1_done_wait"];
/// Where core 0 gives a tick up.
pub const LATE: &str = "core0_late";
/// Where core 1 has written its last number of a tick.
pub const FINISHED: &str = "core1_finished";

impl InParts {
    /// The kernel that has what is heard.
    pub(super) fn heard(&self) -> Option<&Kernel> {
        let heard = self.parts.parts.get(self.parts.heard()?);
        heard.map(|part| &part.kernel)
    }

    /// The core of every part, on so many: the most expensive member first, each to the core that
    /// has least, by these cycles. With one core, or nothing to divide, all are on core 0.
    pub fn divided(&self, cores: usize, cycles: impl Fn(usize) -> u64) -> Vec<usize> {
        let parts = &self.parts.parts;
        let is_member = |part: &usize| matches!(parts[*part].role, Role::Member(_));
        let mut members: Vec<usize> = (0..parts.len()).filter(is_member).collect();
        members.sort_by_key(|part| std::cmp::Reverse(cycles(*part)));
        let mut of_core = vec![0; parts.len()];
        let mut taken = [0, 0];
        for part in members {
            let core = usize::from(cores > 1 && taken[1] < taken[0]);
            taken[core] += cycles(part);
            of_core[part] = core;
        }
        of_core
    }

    /// The core of every part, on so many, where each member is all that one core has.
    pub fn on_own_cores(&self, cores: usize) -> Vec<usize> {
        let core = |role| match role {
            Role::Early | Role::Sound => cores.saturating_sub(1),
            Role::Member(number) => cores.saturating_sub(1).min(number as usize),
            _ => 0,
        };
        self.parts
            .parts
            .iter()
            .map(|part| core(part.role))
            .collect()
    }
}

/// The name of a part.
pub(super) fn part_name(core: usize, part: usize) -> String {
    format!("{}_part{part}", CORES[core])
}

impl Cut {
    /// What is cut so.
    pub(super) fn new(parts: Vec<PartCode>, of: &InParts) -> Cut {
        Cut {
            parts,
            modes: of.modes.clone(),
            of: of.parts.clone(),
        }
    }

    /// Whether core 1 has a part.
    pub fn has_helper(&self) -> bool {
        self.parts.iter().any(|part| part.core == 1)
    }

    /// Whether core 1 begins while core 0 runs the head.
    pub fn has_early(&self) -> bool {
        let is_early = |part: &PartCode| part.role == Role::Early && part.core == 1;
        self.parts.iter().any(is_early)
    }

    /// Words that core 0 writes to the memory of core 1 while that works: what the head leaves, and
    /// that it is there.
    pub fn crossing_early(&self) -> u32 {
        let of_head = |part: usize| self.parts.get(part).map(|part| part.role) == Some(Role::Head);
        let wires = self.of.wires.iter().filter(|wire| of_head(wire.from.part));
        let to = wires.flat_map(|wire| &wire.to);
        match self.has_early() {
            true => 1 + to.filter(|to| self.core_of(to.part) == 1).count() as u32,
            false => 0,
        }
    }

    /// Whether core 1 does what is heard while core 0 runs the tail.
    pub fn has_sound(&self) -> bool {
        let is_sound = |part: &PartCode| part.role == Role::Sound && part.core == 1;
        self.parts.iter().any(is_sound)
    }

    /// Words that core 0 writes to the memory of core 1 behind its members: what is heard of these,
    /// and that it is there.
    pub fn crossing_heard(&self) -> u32 {
        let of_member = |part: usize| {
            let part = self.parts.get(part);
            part.is_some_and(|part| part.core == 0 && matches!(part.role, Role::Member(_)))
        };
        let wires = self.of.wires.iter();
        let wires = wires.filter(|wire| of_member(wire.from.part));
        let to = wires.flat_map(|wire| &wire.to);
        match self.has_sound() {
            true => 1 + to.filter(|to| self.core_of(to.part) == 1).count() as u32,
            false => 0,
        }
    }

    /// Words that core 1 writes to the memory of core 0 in a tick: with what is heard a number, a
    /// sum and its tick.
    pub fn crossing_back(&self, channels: u32) -> u32 {
        let wires = self.of.wires.iter();
        let from_core1 = wires.filter(|wire| self.core_of(wire.from.part) == 1);
        let to = from_core1.flat_map(|wire| &wire.to);
        let words = to.filter(|to| self.core_of(to.part) == 0).count() as u32;
        let sound = match self.has_sound() {
            true => 2 + 2 * channels,
            false => 0,
        };
        1 + u32::from(self.has_early()) + sound + words
    }

    /// The tail is on core 0.
    fn core_of(&self, part: usize) -> usize {
        self.parts.get(part).map_or(0, |part| part.core)
    }

    /// Where a live value of the whole is: name of the state, offset there.
    pub(super) fn live<'a>(&'a self, tail: &'a ZoneCode, live: usize) -> Option<(&'a str, u32)> {
        let Of { part, number } = *self.of.lives.get(live)?;
        let (name, built) = self.part(tail, part);
        Some((name, built.layout.live_param(number as usize)?))
    }

    /// The part that has what is heard: name of the state, and what that has where.
    pub(super) fn heard<'a>(&'a self, tail: &'a ZoneCode) -> (&'a str, &'a Built) {
        self.part(tail, self.of.heard().unwrap_or(self.parts.len()))
    }

    fn part<'a>(&'a self, tail: &'a ZoneCode, part: usize) -> (&'a str, &'a Built) {
        match self.parts.get(part) {
            Some(own) => (&own.name, &own.built),
            None => (&tail.name, &tail.built),
        }
    }
}

/// Gives the tail the names by which the frame knows the state of the keys, and the function that
/// begins one, which nobody calls where there is one program.
pub(super) fn with_names_of_frame(mut tail: Built, own: &str, frame: &str) -> Built {
    let symbols = &mut tail.object.symbols;
    for what in ["state", "begin"] {
        let found = symbols
            .iter()
            .find(|known| known.name == format!("{own}_{what}"));
        let alias = found.map(|known| Symbol {
            name: format!("{frame}_{what}"),
            ..known.clone()
        });
        symbols.extend(alias);
    }
    tail
}

/// That a wire ends where it is told to.
pub(super) fn check(cut: &Cut, tail: &ZoneCode) -> Result<(), ThumbError> {
    for wire in &cut.of.wires {
        let ends = wire.to.iter().chain([&wire.from]);
        if ends.into_iter().any(|end| end.part > cut.parts.len()) {
            return Err(ThumbError::Bug(format!(
                "a wire of no part of {}",
                tail.name
            )));
        }
    }
    Ok(())
}
