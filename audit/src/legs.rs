//! Two cores that run parts of one instrument: what core 0 takes with its waits, and when core 1 is
//! done.
//!
//! Between two places where the cores meet each runs a leg: from where it looks for the other's
//! number to where it has written its own and looks for the next one. A leg is bounded twice: with
//! one round of its wait, where the number is there, and with three, where it is waited for. It
//! ends at most at the later of
//!
//! ```text
//!   when it began to look + the leg with one round
//!   when the other wrote  + the leg with three rounds
//! ```
//!
//! Each access of the other core to its memory, in that leg, delays it once more. Both cores have
//! one clock, so their cycles add up. Core 0's first leg begins where it starts core 1, and waits
//! for nothing; the last piece of core 1's leads back to where it looks for the next tick.

#[cfg(test)]
mod tests;

use crate::Refusal;
use crate::certificate::{Frame, Function, Kind, Piece};
use crate::memory::Around;
use crate::step::Cost;

/// The core that helps.
pub const HELPER: u32 = 1;

/// Rounds of a loop that looks for the other core's number, once that is there: it is found in the
/// one behind the round in which it came; a third is for a core that has just gone back to its
/// loop.
pub const ROUNDS: u32 = 3;

/// What a core runs in its legs: with the number there, and waiting for it.
#[derive(Clone, Copy)]
struct Legs<'a> {
    at_once: &'a Function,
    late: &'a Function,
}

impl<'a> Legs<'a> {
    /// Those of a core in a frame. Core 0's first leg waits for nothing, nor does core 1's way
    /// back.
    fn of(frame: &'a Frame, core: u32) -> Result<Self, Refusal> {
        let mut legs = frame
            .functions_of(core)
            .iter()
            .filter(|own| own.kind == Kind::Legs);
        let (Some(at_once), Some(late), None) = (legs.next(), legs.next(), legs.next()) else {
            return Err(Refusal::new("a core has its legs twice".into()));
        };
        let own = Self { at_once, late };
        let entries = |function: &Function| {
            let entries = function.pieces.iter().map(|piece| piece.entry);
            entries.collect::<Vec<u32>>()
        };
        let same = entries(at_once) == entries(late);
        let waiting = match (core, &late.pieces[..]) {
            (HELPER, [waiting @ .., _]) | (_, [_, waiting @ ..]) => waiting,
            (_, []) => &[],
        };
        match same && waiting.iter().all(|leg| own.waits(leg)) {
            true => Ok(own),
            false => Err(Refusal::new(format!("`{}` does not wait", late.name))),
        }
    }

    /// Whether a leg has a loop that runs once where the number is there.
    fn waits(&self, leg: &Piece) -> bool {
        let mut heads = leg.rounds.iter().map(|(_, head, _)| *head);
        heads.any(|head| {
            self.at_once.loops.contains(&(head, 1)) && self.late.loops.contains(&(head, ROUNDS))
        })
    }

    /// When a leg ends, where the core began to look and the other wrote by then.
    fn end(&self, leg: usize, looks: u64, written: u64) -> u64 {
        let cycles = |own: &Function| own.pieces.get(leg).map_or(0, |piece| piece.cycles);
        let found = looks.saturating_add(cycles(self.at_once));
        found.max(written.saturating_add(cycles(self.late)))
    }
}

/// Where the cores meet, from where core 0 begins to start core 1.
pub(crate) struct Meetings<'a> {
    frame: &'a Frame,
    core0: Legs<'a>,
    /// When core 0 is done, with its last wait.
    done: u64,
    /// When core 1 is done with what core 0 does not wait for, if it does such a thing.
    heard: Option<u64>,
}

impl<'a> Meetings<'a> {
    /// Those of a frame whose core 1 helps.
    ///
    /// # Errors
    /// Legs that do not belong together.
    pub fn of(around: &Around, frame: &'a Frame) -> Result<Self, Refusal> {
        let none = || Refusal::new("legs lead to no other core".into());
        let helper = frame.helper.as_ref().ok_or_else(none)?;
        let visit = Around::new(around.certificate, around.elf, HELPER)?.visit();
        let (core0, core1) = (Legs::of(frame, frame.core)?, Legs::of(frame, HELPER)?);
        let (own, other) = (core0.late.pieces.len(), core1.late.pieces.len());
        if own < 2 || other != own && other != own + 1 || helper.visits.len() != other - 1 {
            return Err(Refusal::new("the cores do not meet as often".into()));
        }
        let visits = |leg: usize| u64::from(helper.visits[leg]).saturating_mul(visit);
        let entry = core0.late.pieces[0].entry;
        let started = until(&frame.functions, entry, None)?;
        let back = core1.late.pieces.last().map_or(0, |piece| piece.cycles);
        let (mut looks, mut writes) = ([0, started.saturating_add(back)], [0, started]);
        for leg in 0..own - 1 {
            let helper = core1.end(leg, looks[1], writes[1]);
            let own = core0.end(leg, looks[0], writes[0]);
            let ends = [own, helper.saturating_add(visits(leg))];
            (looks, writes) = (ends, [ends[1], ends[0]]);
        }
        let last = own - 1;
        let heard = (other > own).then(|| {
            let end = core1.end(last, looks[1], writes[1]);
            end.saturating_add(visits(last))
        });
        Ok(Self {
            frame,
            core0,
            done: core0.end(last, looks[0], writes[0]),
            heard,
        })
    }

    /// What core 0 takes.
    pub fn cost(&self) -> Cost {
        let Legs { at_once, late } = self.core0;
        Cost {
            cycles: self.done,
            stack: at_once.stack.max(late.stack),
            returns: late.returns,
            fetched: at_once.fetched & late.fetched,
        }
    }

    /// When core 1 is done with what core 0 does not wait for, where so many cycles pass around
    /// the handler that begins there.
    pub fn outlasts(&self, handler: u32, around: u64) -> Result<Option<u64>, Refusal> {
        let Some(heard) = self.heard else {
            return Ok(None);
        };
        let starts = self.core0.late.pieces[0].entry;
        let before = until(&self.frame.functions, handler, Some((starts, 0)))?;
        Ok(Some(around.saturating_add(before).saturating_add(heard)))
    }
}

/// Cycles from an entry to that place, which is come to with that pipeline, or to the one place
/// that is bounded from there.
fn until(functions: &[Function], entry: u32, place: Option<(u32, u128)>) -> Result<u64, Refusal> {
    let mut all = functions.iter().filter(|own| own.kind == Kind::Until);
    let found = all.find_map(|own| {
        let piece = own.pieces.first().filter(|piece| piece.entry == entry)?;
        let there = place.is_none() || own.until == place;
        there.then_some(piece.cycles)
    });
    found.ok_or_else(|| Refusal::at(entry, "is not bounded until the cores meet"))
}
