//! An instrument in parts: what its members take, on one core or on two.
//!
//! Where core 1 has members, both cores are bounded from the moment in which core 0 begins to start
//! it. Between two places where they meet each runs a leg: it begins where the core looks for the
//! other's number, and ends where it has written its own and looks for the next one.
//!
//! ```text
//!   core 0   members' calls -> [led, early?] -> members -> done? -> end
//!   core 1   go? -> [early -> early, led?] -> members -> done
//! ```
//!
//! A core either finds the number with its first look, and then its leg begins when it looked; or
//! it waits, and then its leg begins when the other core wrote. Which of both is later is not
//! known, so the end of a leg is the longer of
//!
//! ```text
//!   when it began to look + the leg with one round of its wait
//!   when the other wrote  + the leg with three rounds
//! ```
//!
//! A number that comes during a round is found in the next one, so two rounds follow it at most;
//! three are charged, which covers a core 1 that has just gone back to its loop. Both cores have
//! one clock, so their cycles add up. How often the wait may go round is then no question: it ends
//! by itself only after as many rounds as a tick has cycles, each of one cycle at least, and a
//! bound that long is refused as late.
//!
//! Core 0 writes to the memory of core 1 while that does what is early, and, of what is heard,
//! while that runs members; each word makes one of its accesses wait at most.
//!
//! Where core 1 has what is heard, its last leg begins where both are done with their members, and
//! ends in no place where they meet: core 0 takes the sum at its next tick. So it is in time if it
//! ends before that tick begins, and a frame takes as long as the core that is done last.

use std::collections::{BTreeMap, BTreeSet};

use super::calls::KnownCalls;
use super::memory::Interference;
use super::tick::ticks;
use super::tick_handler::{OnCore, ZoneBound, find};
use super::{Annotations, Bound, ByContention, Known, NotBounded, bound};
use whippen_firmware::{
    Cut, DONE, EARLY, FINISHED, LATE, LED, LEFT, MEET, MEMBERS, POLL, RUNNING, Role, UNMET, WAIT,
    WENT,
};

/// Rounds of a loop that looks for the other core's number, once that is there.
pub(super) const ROUNDS: u32 = 3;

/// The bound of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartBound {
    /// What it is.
    pub role: Role,
    /// The core that runs it.
    pub core: usize,
    /// Its code.
    pub code: ZoneBound,
}

/// The bounds of what runs before the tail.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CutBound {
    /// Each part but the tail.
    pub parts: Vec<PartBound>,
    /// Where core 1 has some of them.
    pub helped: Option<Helped>,
}

/// The bounds of members on two cores.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Helped {
    /// Core 0 until it has started core 1.
    pub start: Bound,
    /// What core 0 runs before, between and behind the places where the cores meet.
    pub core0: Vec<Leg>,
    /// What core 1 runs before and between them, and what is heard behind the last.
    pub core1: Vec<Leg>,
    /// Where core 1 has what is heard: a frame until it calls the parts, and these until core 0
    /// begins to start core 1.
    pub before: Option<[Bound; 2]>,
}

/// What a core runs from where it looks for the other's number to where it looks for the next one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leg {
    /// Where the number is there at once.
    pub at_once: Bound,
    /// Where it is waited for.
    pub late: Bound,
    /// Cycles that it waits for words that the other core writes to its memory, at most.
    pub visits_cycles: u64,
}

impl Leg {
    /// When it ends at the latest, where it began to look and the other core wrote by then.
    fn end(&self, looks: u64, written: u64) -> u64 {
        let began = (looks + self.at_once.cycles_max).max(written + self.late.cycles_max);
        began + self.visits_cycles
    }
}

impl Helped {
    /// When the cores have written their numbers and look for the other's, where they meet first,
    /// second and so on, at the latest.
    fn meetings(&self) -> Vec<[u64; 2]> {
        let start = self.start.cycles_max;
        let mut cycles = [0, start];
        // The last leg of core 0 leads to no meeting.
        let meetings = self.core0.len().saturating_sub(1);
        let legs = self.core0.iter().zip(&self.core1).take(meetings);
        let meeting = |(number, [own, helper]): (usize, [&Leg; 2])| {
            let written = if number == 0 {
                [0, start]
            } else {
                [cycles[1], cycles[0]]
            };
            cycles = [
                own.end(cycles[0], written[0]),
                helper.end(cycles[1], written[1]),
            ];
            cycles
        };
        let legs = legs.map(|(own, helper)| [own, helper]);
        legs.enumerate().map(meeting).collect()
    }

    /// When the cores meet before their members, where core 1 begins early: until core 0 has led,
    /// and until core 1 has done what is early, at most.
    pub fn early_cycles_max(&self) -> Option<[u64; 2]> {
        let meetings = self.meetings();
        (meetings.len() > 1).then(|| meetings[0])
    }

    /// Until each core is done with its members, at most.
    pub fn members_cycles_max(&self) -> [u64; 2] {
        self.meetings().last().copied().unwrap_or_default()
    }

    /// Cycles of core 0 with its wait, at most.
    pub fn cycles_max(&self) -> u64 {
        let [looks, written] = self.members_cycles_max();
        self.core0.last().map_or(0, |leg| leg.end(looks, written))
    }

    /// Until core 1 is done with what is heard, where it has that, at most.
    pub fn sound_cycles_max(&self) -> Option<u64> {
        let [written, looks] = self.members_cycles_max();
        let leg = self.core1.get(self.core0.len().saturating_sub(1))?;
        Some(leg.end(looks, written))
    }

    /// From the beginning of core 0's handler until core 1 is done with what is heard, where it has
    /// that, at most.
    pub(super) fn handler_cycles_max(&self) -> Option<u64> {
        let before = self.before.iter().flatten().map(|bound| bound.cycles_max);
        Some(before.sum::<u64>() + self.sound_cycles_max()?)
    }

    /// Bytes of core 0's stack, at most.
    fn stack_bytes_max(&self) -> u32 {
        // What is on it where they meet is on it until the end.
        let kept = self
            .core0
            .first()
            .map_or(0, |leg| leg.late.stack_left.unsigned_abs());
        let legs = self.core0.iter().enumerate();
        let bytes = legs.map(|(number, leg)| {
            let before = if number == 0 { 0 } else { kept };
            before + leg.late.stack_bytes_max
        });
        bytes.max().unwrap_or(0)
    }

    fn bounds(&self) -> impl Iterator<Item = &Bound> {
        let legs = self.core0.iter().chain(&self.core1);
        let legs = legs.flat_map(|leg| [&leg.at_once, &leg.late]);
        legs.chain([&self.start])
            .chain(self.before.iter().flatten())
    }
}

impl CutBound {
    /// Cycles of core 0's parts, at most, without what is between them.
    pub fn own_cycles_max(&self) -> u64 {
        let own = self.parts.iter().filter(|part| part.core == 0);
        own.map(|part| part.code.tick.key_cycles_max()).sum()
    }

    /// What a frame takes longer because core 1 is done with what is heard after core 0 with all
    /// the rest: that takes so many cycles, and so many before the handler and for visits.
    pub(super) fn outlasts(&self, around_cycles: u64, rest_cycles: u64) -> Option<(String, u64)> {
        let helped = self.helped.as_ref()?.handler_cycles_max()?;
        let longer = (around_cycles + helped).checked_sub(rest_cycles)?;
        (longer > 0).then(|| ("core 1, with what is heard".to_string(), longer))
    }

    /// As sure as the least sure.
    pub fn class(&self) -> whippen_isa::timing::Evidence {
        let ticks = self.parts.iter().map(|part| part.code.tick.class());
        let helped = self.helped.iter().flat_map(Helped::bounds);
        let all = ticks.chain(helped.map(|bound| bound.class));
        all.max().unwrap_or(whippen_isa::timing::Evidence::Exact)
    }
}

/// What is known of the ticks of parts on a core.
fn known_on(of: &OnCore, parts: &[PartBound], core: usize) -> Result<KnownCalls, NotBounded> {
    let own = parts.iter().filter(|part| part.core == core);
    let known = |part: &PartBound| {
        let tick = &part.code.tick;
        let known = Known {
            cycles: tick.cycles_max(1),
            stack_bytes: tick.stack_bytes_max(),
        };
        let entry = find(of.program, &format!("{}_tick", part.code.name))?;
        Ok(((None, entry), known))
    };
    own.map(known).collect()
}

/// The loops in which the cores wait.
pub(super) fn waits(cut: &Cut) -> impl Iterator<Item = &'static str> {
    let early = [MEET, EARLY[1]].into_iter().filter(|_| cut.has_early());
    let sound = [DONE[1]].into_iter().filter(|_| cut.has_sound());
    [WAIT, POLL[1]].into_iter().chain(early).chain(sound)
}

/// Where the legs of each core begin and end.
pub(super) fn meeting_places(cut: &Cut) -> [Vec<Option<&'static str>>; 2] {
    let (led, early) = match cut.has_early() {
        true => (Some(LED), Some(EARLY[0])),
        false => (None, None),
    };
    let sound = cut.has_sound().then_some(DONE[0]);
    let core0 = [Some(MEMBERS), led, Some(LEFT)];
    let core1 = [Some(POLL[0]), early, sound, Some(FINISHED)];
    let there = |places: &[Option<&'static str>]| -> Vec<Option<&'static str>> {
        places
            .iter()
            .filter(|place| place.is_some())
            .copied()
            .collect()
    };
    let (mut core0, core1) = (there(&core0), there(&core1));
    // The last leg ends with the function.
    core0.push(None);
    [core0, core1]
}

/// Words that core 0 writes to the memory of core 1 in its legs.
pub(super) fn crossing(cut: &Cut) -> impl Iterator<Item = u32> {
    let early = cut.has_early().then(|| cut.crossing_early());
    early.into_iter().chain([cut.crossing_heard()])
}

impl OnCore<'_> {
    /// The parts that run before the tail, with each of two interferences.
    pub(super) fn bound_cut(
        &self,
        interferences: ByContention<&Interference>,
    ) -> Result<ByContention<Option<CutBound>>, NotBounded> {
        let Some(cut) = &self.playing.cut else {
            return Ok(ByContention::default());
        };
        let mut parts: ByContention<Vec<PartBound>> = ByContention::default();
        for part in &cut.parts {
            let on = self.on(part.core);
            let meets = if part.core == 0 {
                interferences
            } else {
                self.helper(interferences)
            };
            let bounds = ticks(
                on.program,
                &part.name,
                on.core,
                meets,
                None,
                on.entered(&part.name, None),
                on.bases_of_keys(&part.name)?,
            )?;
            let bounds = bounds.map(|tick| PartBound {
                role: part.role,
                core: part.core,
                code: ZoneBound {
                    name: part.name.clone(),
                    of: self.playing.zones[0].of,
                    tick,
                },
            });
            parts.alone.push(bounds.alone);
            parts.contended.push(bounds.contended);
        }
        let helper = self.helper(interferences);
        let found = parts
            .zip(interferences.zip(helper))
            .map(|(parts, (own, helper))| {
                let own = OnCore {
                    interference: own,
                    ..*self
                };
                let helper = OnCore {
                    interference: helper,
                    ..self.on(1)
                };
                let helped = cut
                    .has_helper()
                    .then(|| own.bound_helped(cut, &helper, &parts));
                Ok(Some(CutBound {
                    helped: helped.transpose()?,
                    parts,
                }))
            });
        found.both()
    }

    /// The same program on that core.
    fn on(&self, core: usize) -> Self {
        OnCore {
            number: core,
            running: &RUNNING[core],
            ..*self
        }
    }

    /// The interferences of core 1.
    fn helper<'i>(
        &'i self,
        own: ByContention<&'i Interference<'i>>,
    ) -> ByContention<&'i Interference<'i>> {
        self.helper.unwrap_or(own)
    }

    /// Members on two cores.
    fn bound_helped(
        &self,
        cut: &Cut,
        helper: &OnCore,
        parts: &[PartBound],
    ) -> Result<Helped, NotBounded> {
        debug_assert_eq!(cut.parts.len(), parts.len());
        let at = |of: &OnCore, entry: &str, stop: Option<&str>, rounds| {
            let known = known_on(of, parts, of.number)?;
            of.bound_leg(cut, known, [Some(entry), stop], rounds)
        };
        let legs = |of: &OnCore, places: &[Option<&str>], visits_cycles: &[u64]| {
            let ends = places.windows(2).zip(visits_cycles.iter().chain(&[0; 4]));
            let leg = |(ends, visits): (&[Option<&str>], &u64)| {
                let from = ends[0].unwrap_or_default();
                Ok(Leg {
                    at_once: at(of, from, ends[1], 1)?,
                    late: at(of, from, ends[1], ROUNDS)?,
                    visits_cycles: *visits,
                })
            };
            ends.map(leg).collect::<Result<Vec<Leg>, NotBounded>>()
        };
        let [on_core0, on_core1] = meeting_places(cut);
        let access_cycles = helper.interference.remote_access_cycles();
        let visits = crossing(cut).map(|words| u64::from(words * access_cycles));
        let visits: Vec<u64> = visits.collect();
        let helped = Helped {
            start: at(self, MEMBERS, Some(WENT), 1)?,
            core0: legs(self, &on_core0, &[])?,
            core1: legs(helper, &on_core1, &visits)?,
            before: match cut.has_sound() {
                true => Some(self.bound_before(parts)?),
                false => None,
            },
        };
        let stacks = helped.core1.iter().map(|leg| leg.late.stack_bytes_max);
        helper.has_stack_room(helper.stack()?.0, stacks.max().unwrap_or(0))?;
        Ok(helped)
    }

    /// From a place to the next one where the cores meet, or to the end, with so many rounds of
    /// each wait.
    fn bound_leg(
        &self,
        cut: &Cut,
        known: KnownCalls,
        [entry, stop]: [Option<&str>; 2],
        rounds: u32,
    ) -> Result<Bound, NotBounded> {
        let place = |name: &str| find(self.program, name);
        let entry = place(entry.unwrap_or_default())?;
        // The way on which core 0 gives up before its members is no longer than a tick.
        let gives_up = (stop == Some(LEFT) && cut.has_early()).then_some(UNMET);
        let stops = stop.into_iter().chain(gives_up).map(place);
        let mut annotations = Annotations {
            known,
            bases: self.stack_base()?,
            inside: true,
            stops: stops.collect::<Result<BTreeSet<u32>, NotBounded>>()?,
            ..self.program.annotations.clone()
        };
        for head in waits(cut) {
            annotations.loops.insert(place(head)?, rounds);
        }
        let leg = bound(&self.query(entry, &annotations))?;
        match leg.delays_nobody {
            true => Ok(leg),
            // The next leg is bounded as if nothing were in the pipeline.
            false => Err(NotBounded::Unsettled { address: entry }),
        }
    }

    /// A frame until it calls the parts, and these until core 0 begins to start core 1. Both may
    /// also end where that is not started.
    fn bound_before(&self, parts: &[PartBound]) -> Result<[Bound; 2], NotBounded> {
        let place = |name: &str| self.program.symbols.get(name).copied();
        let calls = format!("{}_tick", self.playing.name);
        let at = |entry: &str, ends: &[&str]| {
            let annotations = Annotations {
                handler: true,
                known: known_on(self, parts, 0)?,
                bases: self.stack_base()?,
                stops: ends.iter().copied().filter_map(place).collect(),
                ..self.program.annotations.clone()
            };
            bound(&self.query(find(self.program, entry)?, &annotations))
        };
        let ends = [&calls, "missed", "alarmed", "beginning", "watch"];
        Ok([
            at(self.running.handler, &ends)?,
            at(&calls, &[MEMBERS, LATE])?,
        ])
    }

    /// What is known of what the row of an instrument in parts calls.
    pub(super) fn known_of_row(
        &self,
        tail: &ZoneBound,
        cut: &CutBound,
    ) -> Result<KnownCalls, NotBounded> {
        let mut known: BTreeMap<_, _> = known_on(self, &cut.parts, 0)?;
        let entry = find(self.program, &format!("{}_tick", tail.name))?;
        let of_tail = Known {
            cycles: tail.tick.cycles_max(1),
            stack_bytes: tail.tick.stack_bytes_max(),
        };
        known.insert((None, entry), of_tail);
        if let Some(helped) = &cut.helped {
            let both = Known {
                cycles: helped.cycles_max(),
                stack_bytes: helped.stack_bytes_max(),
            };
            known.insert((None, find(self.program, MEMBERS)?), both);
        }
        Ok(known)
    }
}

#[cfg(test)]
pub(crate) mod tests;
