//! The frame of a core: everything that happens between the converter's request and the return from
//! its handler.
//!
//! ```text
//!   request -> instruction in progress -> entry -> handler -> exit
//!                                                  '- board_begin, keys, board_end, service, guard
//!                                                                  '- entry, one mode per key, end (`tick`)
//! ```
//!
//! The handler is bounded as one function whose call of the keys costs what their own bounds add up
//! to, so its worst-case path may also be the one of a missed tick, which leaves the keys out, or
//! of a program that begins: then one key less is played, and one begins. Nothing interrupts it:
//! every other vector of the core leads to the end of the firmware, which is checked in the bytes
//! of its table.

use std::collections::BTreeMap;

use whippen_isa::reg;
use whippen_isa::timing::{Core, Evidence};

use super::calls::{Calls, Costs, KnownCalls};
use super::idle::Idle;
use super::memory::{Interference, Reach, Waits};
use super::only::only_handler;
use super::parts::CutBound;
use super::program::Program;
use super::sending::Sending;
use super::tick::{Tick, ticks};
use super::waiting::{Tally, WaitCause, Waited};
use super::{Annotations, Bound, ByContention, NotBounded, Query, bound};
use whippen_arm::thumb::{self, Points};
use whippen_firmware::{CoreCode, Running};
use whippen_keyboard::CoreZone;

/// Words that an exception saves and restores.
const SAVED_WORDS: u16 = 8;
/// Bytes of those, and what aligns them.
const SAVED_BYTES: u32 = 4 * SAVED_WORDS as u32 + 4;

/// The bounds of one core's frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TickHandlerBound {
    /// Keys of the core.
    pub keys: u32,
    /// The code of the keys, by instrument: one zone, unless the program has several and some of
    /// them on this core.
    pub zones: Vec<ZoneBound>,
    /// Of an instrument in parts, whose tail is the zone: what runs before that.
    pub cut: Option<CutBound>,
    /// The handler, all keys included.
    pub handler: Bound,
    /// What the cycles around the keys are for, on the handler's worst-case path.
    pub parts: Vec<(String, u64)>,
    /// What the waiting of the frame consists of, as far as it is on the longest paths.
    pub waiting: Vec<Waited>,
    /// Of columns of converters: when it has read whether it is too late to send.
    pub sending: Option<Sending>,
    /// Cycles from the request to the return, at most.
    pub cycles_max: u64,
    /// Bytes of stack: what runs between ticks, the exception, the handler.
    pub stack_bytes_max: u32,
    /// As sure as the least sure number.
    pub class: Evidence,
}

/// The bounds of the keys that a core has of a zone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneBound {
    /// The name in front of `_tick`.
    pub name: String,
    /// Which keys, of which zone.
    pub of: CoreZone,
    /// Their code.
    pub tick: Tick,
}

impl ZoneBound {
    /// How many keys.
    pub fn keys(&self) -> u32 {
        self.of.keys.count()
    }
}

/// A core to be bounded.
#[derive(Debug, Clone, Copy)]
pub struct OnCore<'a> {
    /// Final bytes.
    pub program: &'a Program,
    /// Its timing.
    pub core: &'a Core,
    /// What runs on it.
    pub running: &'a Running,
    /// Which core it is.
    pub number: usize,
    /// Its code of the program that plays.
    pub playing: &'a CoreCode,
    /// Its code of all programs.
    pub programs: &'a [&'a CoreCode],
    /// Memory and who else uses it.
    pub interference: &'a Interference<'a>,
    /// The same for core 1, where that runs parts.
    pub helper: Option<ByContention<&'a Interference<'a>>>,
}

impl TickHandlerBound {
    /// Cycles around the keys, at most.
    pub fn around_cycles_max(&self) -> u64 {
        self.cycles_max.saturating_sub(self.keys_cycles_max())
    }

    /// Cycles of all keys, at most.
    pub fn keys_cycles_max(&self) -> u64 {
        let zones = self.zones.iter();
        let keys = zones.map(|zone| u64::from(zone.keys()) * zone.tick.key_cycles_max());
        keys.sum::<u64>() + self.before_tail_cycles_max()
    }

    /// Cycles of the parts of this core that run before the tail, at most.
    fn before_tail_cycles_max(&self) -> u64 {
        self.cut.as_ref().map_or(0, CutBound::own_cycles_max)
    }

    /// Cycles of the worst-case key, at most.
    pub fn key_cycles_max(&self) -> u64 {
        self.zones
            .iter()
            .map(|zone| zone.tick.key_cycles_max())
            .max()
            .unwrap_or(0)
            + self.before_tail_cycles_max()
    }

    /// How sure the cycles of a key are.
    pub fn key_class(&self) -> Evidence {
        self.zones
            .iter()
            .map(|zone| zone.tick.class())
            .max()
            .unwrap_or(Evidence::Exact)
    }
}

/// Bounds the frame of a core while it plays one of its programs, with each of two interferences,
/// which take the place of its own.
///
/// # Errors
/// What cannot be bounded, or is not there.
pub fn tick_handlers(
    of: &OnCore,
    interferences: ByContention<&Interference>,
) -> Result<ByContention<TickHandlerBound>, NotBounded> {
    let (program, running) = (of.program, of.running);
    only_handler(program, running, find(program, running.handler)?)?;
    let calls = Calls::find(of)?;
    let zones = of.bound_zones(&calls, interferences)?;
    let zones = zones.zip(of.bound_cut(interferences)?);
    let frames = interferences
        .zip(zones)
        .map(|(interference, (zones, cut))| {
            let of = OnCore {
                interference,
                ..*of
            };
            of.bound_frame(&calls, zones, cut)
        });
    frames.both()
}

/// Cycles that a frame takes besides its handler.
pub(super) struct Around {
    /// The longest instruction that the tick interrupts.
    idle: Idle,
    /// Waiting for memory, for each word that the exception saves and restores.
    stacking: Waits,
    /// For its vector.
    vector: Waits,
}

impl<'a> OnCore<'a> {
    /// The ticks of the zones that play.
    fn bound_zones(
        &self,
        calls: &Calls,
        interferences: ByContention<&Interference>,
    ) -> Result<ByContention<Vec<ZoneBound>>, NotBounded> {
        // Zones are called in one row, so each comes back to another place: to the most expensive.
        let return_to = if self.playing.is_split() || self.playing.cut.is_some() {
            None
        } else {
            calls.return_to
        };
        let mut zones: ByContention<Vec<ZoneBound>> = ByContention::default();
        for zone in &self.playing.zones {
            let name = &zone.name;
            let bound = |tick| ZoneBound {
                name: name.clone(),
                of: zone.of,
                tick,
            };
            let bounds = ticks(
                self.program,
                name,
                self.core,
                interferences,
                return_to,
                self.entered(name, None),
                self.bases_of_keys(name)?,
            )?
            .map(bound);
            zones.alone.push(bounds.alone);
            zones.contended.push(bounds.contended);
        }
        Ok(zones)
    }

    /// The frame around the ticks of zones.
    fn bound_frame(
        &self,
        calls: &Calls,
        zones: Vec<ZoneBound>,
        cut: Option<CutBound>,
    ) -> Result<TickHandlerBound, NotBounded> {
        let handler = find(self.program, self.running.handler)?;
        let costs = calls.costs(self, &zones, cut.as_ref())?;
        let handled = self.bound_handler(handler, calls.known(&costs))?;
        let around = Around {
            idle: self.bound_idle()?,
            stacking: self
                .interference
                .exception_word(handler, &self.stack()?.1)?,
            vector: self
                .interference
                .exception_word(handler, &self.vectors()?)?,
        };
        let keys_cycles: u64 = zones
            .iter()
            .map(|zone| u64::from(zone.keys()) * zone.tick.key_cycles_max())
            .sum::<u64>()
            + cut.as_ref().map_or(0, CutBound::own_cycles_max);
        // The longest way may be one on which no key plays.
        let keys_cycles = match handled.path.iter().any(|step| step.address == calls.tick) {
            true => keys_cycles,
            false => 0,
        };
        let of_handler = calls.parts(self.program, &handled.path, keys_cycles);
        let mut parts = self.list_parts(&around, of_handler);
        let sum = |parts: &[(String, u64)]| {
            keys_cycles + parts.iter().map(|(_, cycles)| cycles).sum::<u64>()
        };
        let (before, own) = (self.cycles_before(&around), sum(&parts));
        parts.extend(cut.as_ref().and_then(|cut| cut.outlasts(before, own)));
        let waiting = self.list_waiting(&around, &handled, &zones, cut.as_ref(), &costs);
        let stack_bytes_max = around.idle.stack_bytes_max + SAVED_BYTES + handled.stack_bytes_max;
        self.has_stack_room(self.stack()?.0, stack_bytes_max)?;
        Ok(TickHandlerBound {
            keys: self.playing.keys.count(),
            cycles_max: sum(&parts),
            stack_bytes_max,
            class: self.class_of_frame(&handled, &zones, cut.as_ref()),
            zones,
            cut,
            handler: handled,
            parts,
            waiting,
            sending: self.bound_sending(handler, &around)?,
        })
    }

    /// What may go by before the handler, and what others may take of its time.
    pub(super) fn cycles_before(&self, around: &Around) -> u64 {
        let entered = around.idle.cycles_max + self.enter_cycles(around);
        entered + self.visits_cycles() + self.dma_cycles()
    }

    pub(super) fn query<'q>(&self, entry: u32, annotations: &'q Annotations) -> Query<'q>
    where
        'a: 'q,
    {
        Query {
            core: self.core,
            code: &self.program.code,
            entry,
            annotations,
            interference: Some(self.interference),
        }
    }

    /// The handler, whose calls of keys cost what is known of them.
    fn bound_handler(&self, handler: u32, known: KnownCalls) -> Result<Bound, NotBounded> {
        let annotations = Annotations {
            handler: true,
            known,
            bases: self.stack_base()?,
            ..self.program.annotations.clone()
        };
        let query = self.query(handler, &annotations);
        self.runs_only_its_own(&query)?;
        bound(&query)
    }

    /// What runs between ticks.
    fn bound_idle(&self) -> Result<Idle, NotBounded> {
        let sleeping = Annotations {
            sleeps: true,
            bases: self.stack_base()?,
            ..self.program.annotations.clone()
        };
        let query = self.query(find(self.program, self.running.idle)?, &sleeping);
        self.runs_only_its_own(&query)?;
        Idle::of(&query)
    }

    /// Where the table of vectors lies.
    fn vectors(&self) -> Result<Reach, NotBounded> {
        let vectors = find(self.program, self.running.vectors)?;
        let reach = self.program.reach_of(self.interference.board, vectors);
        Ok(reach.unwrap_or_default())
    }

    /// What the cycles around the keys are for, in the order of time.
    fn list_parts(&self, around: &Around, of_handler: Vec<(String, u64)>) -> Vec<(String, u64)> {
        let saved = u64::from(around.stacking.times(SAVED_WORDS).cycles());
        let leave = u64::from(self.core.exceptions.exit.cycles) + saved;
        let named = |name: &str, cycles| (name.to_string(), cycles);
        let mut parts = vec![
            named("the instruction in progress", around.idle.cycles_max),
            named("entry of the interrupt", self.enter_cycles(around)),
        ];
        parts.extend(of_handler);
        parts.push(named("return from the interrupt", leave));
        let visits = self.visits_cycles();
        parts.extend((visits > 0).then(|| (WaitCause::Visits.to_string(), visits)));
        let dma = self.dma_cycles();
        parts.extend((dma > 0).then(|| named("the DMA at memory", dma)));
        parts
    }

    /// What the interrupt takes before the handler.
    fn enter_cycles(&self, around: &Around) -> u64 {
        let saved = u64::from(around.stacking.times(SAVED_WORDS).cycles());
        let vector = u64::from(around.vector.cycles());
        u64::from(self.core.exceptions.entry.cycles) + saved + vector
    }

    /// What the other core's visits cost a frame.
    pub(super) fn visits_cycles(&self) -> u64 {
        let others = &self.interference.others;
        u64::from(others.remote_accesses * self.interference.remote_access_cycles())
    }

    /// What a DMA at memory costs a frame.
    fn dma_cycles(&self) -> u64 {
        self.interference.dma_cycles().into()
    }

    /// What is waited for on the longest paths.
    fn list_waiting(
        &self,
        around: &Around,
        handled: &Bound,
        zones: &[ZoneBound],
        cut: Option<&CutBound>,
        costs: &Costs,
    ) -> Vec<Waited> {
        let mut tally = Tally::default();
        let begins = costs.begins_on(&handled.path);
        tally.add_frame(self.program, &handled.path);
        if let Some(begin) = begins {
            tally.add_frame(self.program, &begin.path);
        }
        if let Some(row) = &costs.row {
            tally.add_frame(self.program, &row.path);
        }
        for zone in zones {
            let keys = match (begins, zones) {
                (Some(_), [_]) => zone.keys().saturating_sub(1),
                _ => zone.keys(),
            };
            tally.add_keys(self.program, zone, keys);
        }
        let before = cut.iter().flat_map(|cut| &cut.parts);
        for part in before.filter(|part| part.core == self.number) {
            tally.add_keys(self.program, &part.code, 1);
        }
        let saved = 2 * u64::from(SAVED_WORDS);
        tally.add("what the interrupt saves", around.stacking, saved);
        tally.add("what the interrupt saves", around.vector, 1);
        tally.add_cycles(WaitCause::Visits, "", self.visits_cycles());
        tally.add_cycles(WaitCause::Dma, "memory", self.dma_cycles());
        tally.list()
    }

    /// As sure as the least sure number of a frame.
    fn class_of_frame(
        &self,
        handled: &Bound,
        zones: &[ZoneBound],
        cut: Option<&CutBound>,
    ) -> Evidence {
        let exceptions = &self.core.exceptions;
        let around = handled
            .class
            .max(exceptions.entry.evidence)
            .max(exceptions.exit.evidence)
            .max(cut.map_or(Evidence::Exact, CutBound::class));
        zones
            .iter()
            .map(|zone| zone.tick.class())
            .fold(around, Evidence::max)
    }
}

impl OnCore<'_> {
    /// Where registers point while keys are ticked: `thumb` says what they are for, the image where
    /// that is.
    pub(super) fn bases_of_keys(&self, name: &str) -> Result<BTreeMap<u8, Reach>, NotBounded> {
        let Points {
            state,
            histories,
            words,
        } = thumb::POINTS;
        let of = |symbol: &str| {
            let at = *self.program.symbols.get(symbol)?;
            self.program.reach_of(self.interference.board, at)
        };
        let state = of(&format!("{name}_state"))
            .into_iter()
            .flat_map(|reach| state.map(|register| (register, reach.clone())));
        let histories = of(&format!("{name}_histories")).map(|reach| (histories, reach));
        let words = of(self.running.words).map(|reach| (words, reach));
        let (_, stack) = self.stack()?;
        Ok(state
            .chain(histories)
            .chain(words)
            .chain([(reg::SP, stack)])
            .collect())
    }

    /// What the functions of keys of that name are called with: their state in R0, a word of theirs
    /// in R1; in R2 which key it is, of so many, where it is one.
    pub(super) fn entered(&self, name: &str, keys: Option<u32>) -> BTreeMap<u8, [u32; 2]> {
        let symbol = |name: &str| self.program.symbols.get(name).copied();
        let state = symbol(&format!("{name}_state")).map(|at| (0, [at, at]));
        let words = symbol(self.running.words).and_then(|at| {
            self.program
                .words_of(at)
                .last()
                .map(|last| (1, [at, last + 2]))
        });
        let key = keys.map(|keys| (2, [0, keys.saturating_sub(1)]));
        [state, words, key].into_iter().flatten().collect()
    }
}

pub(super) fn find(program: &Program, name: &str) -> Result<u32, NotBounded> {
    program
        .symbols
        .get(name)
        .copied()
        .ok_or_else(|| NotBounded::NoSymbol {
            name: name.to_string(),
        })
}

#[cfg(test)]
pub(crate) mod tests;
