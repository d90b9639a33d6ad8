//! An instrument in parts: what its members take, on one core or on two.
//!
//! Where core 1 has members, both cores are bounded from the moment in which core 0 begins to start
//! it. Core 0 leaves its wait at most so late, whichever is the longer:
//!
//! ```text
//!   own      core 0's members, and a wait that finds `done` at once
//!   helped   until `go` is written + core 1 until `done` is written + rounds of the wait that is left
//! ```
//!
//! Both cores have one clock, so their cycles add up. Each looks for the other's number in a loop.
//! A number that comes during a round is found in the next one, so two rounds follow it at most;
//! three are charged, which covers a core 1 that has just gone back to its loop. How often the wait
//! may go round is then no question: it ends by itself only after as many rounds as a tick has
//! cycles, each of one cycle at least, and a bound that long is refused as late.

use std::collections::{BTreeMap, BTreeSet};

use super::calls::KnownCalls;
use super::memory::Interference;
use super::tick::ticks;
use super::tick_handler::{OnCore, ZoneBound, find};
use super::{Annotations, Bound, ByContention, Known, NotBounded, bound};
use whippen_firmware::{Cut, FINISHED, MEMBERS, POLL, RUNNING, Role, WAIT, WENT};

/// Rounds of a loop that looks for the other core's number, once that is there.
const ROUNDS: u32 = 3;

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
    /// Core 0, where it need not wait.
    pub own: Bound,
    /// Core 0 until it has started core 1.
    pub start: Bound,
    /// Core 1 from its loop to where it is done.
    pub core1: Bound,
    /// Core 0 from the number to the end of its wait.
    pub leave: Bound,
}

impl Helped {
    /// Cycles of core 0 with its wait, at most.
    pub fn cycles_max(&self) -> u64 {
        self.own.cycles_max.max(self.helped_cycles_max())
    }

    /// The same where it waits.
    pub fn helped_cycles_max(&self) -> u64 {
        let bounds = [&self.start, &self.core1, &self.leave];
        bounds.into_iter().map(|bound| bound.cycles_max).sum()
    }

    fn bounds(&self) -> [&Bound; 4] {
        [&self.own, &self.start, &self.core1, &self.leave]
    }
}

impl CutBound {
    /// Cycles of core 0's parts, at most, without what is between them.
    pub fn own_cycles_max(&self) -> u64 {
        let own = self.parts.iter().filter(|part| part.core == 0);
        own.map(|part| part.code.tick.key_cycles_max()).sum()
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
        let place = |name: &str| find(self.program, name);
        let at = |of: &OnCore, core, entry: &str, stop: Option<&str>, rounds| {
            let stops: BTreeSet<u32> = stop.map(place).transpose()?.into_iter().collect();
            let mut annotations = Annotations {
                known: known_on(of, parts, core)?,
                bases: of.stack_base()?,
                inside: true,
                stops,
                ..of.program.annotations.clone()
            };
            let looking = [WAIT, POLL[1]].map(place);
            for head in looking {
                annotations.loops.insert(head?, rounds);
            }
            bound(&of.query(place(entry)?, &annotations))
        };
        let helped = Helped {
            own: at(self, 0, MEMBERS, None, 1)?,
            start: at(self, 0, MEMBERS, Some(WENT), 1)?,
            core1: at(helper, 1, POLL[0], Some(FINISHED), ROUNDS)?,
            leave: at(self, 0, WAIT, None, ROUNDS)?,
        };
        helper.has_stack_room(helper.stack()?.0, helped.core1.stack_bytes_max)?;
        Ok(helped)
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
                stack_bytes: helped.own.stack_bytes_max,
            };
            known.insert((None, find(self.program, MEMBERS)?), both);
        }
        Ok(known)
    }
}
