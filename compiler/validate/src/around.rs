//! What a tick's entry and end, and `init`, leave in the state besides what keys read of it: the
//! ring of events, indices of rings, pointers into histories, the tick's number. It is told from
//! where things lie.
//!
//! ```text
//!   entry: a piece of the ring where all events of a tick have room, or the spare behind it
//!   end:   head behind what was written, or a number of lost events; the next slot of each line,
//!          how far each pointer is from the first line's row; tick + 1
//!   init:  the pointers
//! ```

use std::collections::BTreeSet;

use crate::check::on_one_side;
use crate::memory::Memory;
use crate::places::{LinePlace, Question, RingPlace};
use crate::stop::Told;
use crate::term::{Base, Kind, Term, Terms};
use crate::truth::Truth;

/// The state, by offsets.
pub(crate) struct StateWords<'a> {
    question: &'a Question<'a>,
    /// What was stored.
    memory: Memory,
}

impl<'a> StateWords<'a> {
    /// What the tick's entry stores, but for words of all keys.
    pub fn at_entry(question: &'a Question<'a>, terms: &mut Terms) -> Told<Memory> {
        Self::stored(question, terms, &Memory::default(), StateWords::enter)
    }

    /// What the tick's end stores where memory is so before.
    pub fn at_end(question: &'a Question<'a>, terms: &mut Terms, before: &Memory) -> Told<Memory> {
        Self::stored(question, terms, before, StateWords::leave)
    }

    /// What `init` stores where memory is so before, but for keys.
    pub fn at_init(question: &'a Question<'a>, terms: &mut Terms, before: &Memory) -> Told<Memory> {
        Self::stored(question, terms, before, |words, terms| {
            words.take_words(terms)?;
            words.point(terms)
        })
    }

    fn stored(
        question: &'a Question<'a>,
        terms: &mut Terms,
        before: &Memory,
        run: impl Fn(&mut Self, &mut Terms) -> Told<()>,
    ) -> Told<Memory> {
        settled(terms, |terms| {
            let mut words = StateWords {
                question,
                memory: before.clone(),
            };
            run(&mut words, terms)?;
            Ok(words.memory)
        })
    }

    /// Where the words are.
    fn take_words(&mut self, terms: &mut Terms) -> Told<()> {
        let Some(at) = self.question.places.words else {
            return Ok(());
        };
        let samples = terms.of(Kind::Base(Base::Samples));
        self.store(terms, at, samples)
    }

    fn enter(&mut self, terms: &mut Terms) -> Told<()> {
        self.take_words(terms)?;
        match self.question.places.events {
            Some(ring) => self.open(terms, &ring),
            None => Ok(()),
        }
    }

    fn leave(&mut self, terms: &mut Terms) -> Told<()> {
        let places = self.question.places;
        if let Some(ring) = places.events {
            self.close(terms, &ring)?;
        }
        self.next_slots(terms)?;
        self.point(terms)?;
        let tick = self.load(terms, places.tick)?;
        let tick = terms.plus(tick, 1)?;
        self.store(terms, places.tick, tick)
    }

    /// Where this tick's events go: on behind the last one; where what is left up to the ring's end
    /// may not be enough, at its beginning, behind a mark; where that has no room, to the spare.
    fn open(&mut self, terms: &mut Terms, ring: &RingPlace) -> Told<()> {
        let base = ring_base(self.question, terms, ring)?;
        let (head, tail) = (self.load(terms, ring.head)?, self.load(terms, ring.tail)?);
        let waiting = terms.sub(head, tail)?;
        let mut waiting = terms.unsigned(waiting)?;
        let mut at = terms.low_bits(head, ring.bytes.ilog2())?;
        let most = i128::from(ring.bytes - ring.tick_bytes);
        let is_here = is_at_most(terms, at, most)?;
        if !is_here {
            let bytes = terms.constant(ring.bytes.into());
            let left = terms.sub(bytes, at)?;
            let all = terms.add(waiting, left)?;
            waiting = terms.unsigned(all)?;
        }
        if !is_at_most(terms, waiting, most)? {
            at = terms.constant(ring.spare.into());
        } else if !is_here {
            let (mark, around) = (terms.add(base, at)?, terms.sub(head, at)?);
            let second = terms.plus(mark, 4)?;
            let nothing = terms.constant(-1);
            self.memory.store(terms, second, 4, nothing, Truth::YES)?;
            let around = terms.plus(around, ring.bytes.into())?;
            self.store(terms, ring.head, around)?;
            at = terms.constant(0);
        }
        let next = terms.add(base, at)?;
        self.store(terms, self.question.places.next_event, next)
    }

    /// Events in the ring are the reader's from now on; those in the spare are counted.
    fn close(&mut self, terms: &mut Terms, ring: &RingPlace) -> Told<()> {
        let base = ring_base(self.question, terms, ring)?;
        let next = self.load(terms, self.question.places.next_event)?;
        let written = terms.sub(next, base)?;
        let written = terms.unsigned(written)?;
        if is_at_most(terms, written, ring.bytes.into())? {
            let head = self.load(terms, ring.head)?;
            let at = terms.low_bits(head, ring.bytes.ilog2())?;
            let round = terms.sub(head, at)?;
            let head = terms.add(round, written)?;
            return self.store(terms, ring.head, head);
        }
        let lost = self.load(terms, ring.lost)?;
        let bytes = terms.plus(written, -i128::from(ring.spare))?;
        let bytes = terms.unsigned(bytes)?;
        let events = terms.floor(bytes, self.question.places.event_bytes.ilog2())?;
        let lost = terms.add(lost, events)?;
        self.store(terms, ring.lost, lost)
    }

    /// In each line the next slot is written next, behind the last one the first.
    fn next_slots(&mut self, terms: &mut Terms) -> Told<()> {
        let lines = self.question.places.lines.iter();
        let rings: BTreeSet<(u32, u32)> = lines.map(|line| (line.ring, line.len)).collect();
        for (ring, len) in rings {
            let slot = self.load(terms, ring)?;
            let next = terms.plus(slot, 1)?;
            let (zero, len) = (terms.constant(0), terms.constant(len.into()));
            let is_last = terms.equal(next, len)?;
            let next = terms.select(is_last, zero, next)?;
            self.store(terms, ring, next)?;
        }
        Ok(())
    }

    /// The row of the first line, and pointers as far as they are from it.
    fn point(&mut self, terms: &mut Terms) -> Told<()> {
        let places = self.question.places;
        let Some(first) = places.first_line else {
            return Ok(());
        };
        let first = self.row(terms, &places.lines[first as usize], 0)?;
        self.store(terms, places.row, first)?;
        for line in &places.lines {
            for (ticks, at) in &line.pointers {
                let row = self.row(terms, line, *ticks)?;
                let apart = terms.add_scaled(row, first, -(1 << line.scale))?;
                self.store(terms, *at, apart)?;
            }
        }
        Ok(())
    }

    /// The address of the row of a line that was written so many ticks ago, or is written now.
    fn row(&self, terms: &mut Terms, line: &LinePlace, ticks: u32) -> Told<Term> {
        let slot = self.load(terms, line.ring)?;
        let back = terms.plus(slot, -i128::from(ticks))?;
        let around = terms.plus(back, line.len.into())?;
        let is_there = terms.at_least(back, 0)?;
        let slot = match ticks {
            0 => slot,
            _ => terms.select(is_there, back, around)?,
        };
        let from = histories(self.question, terms)?;
        let from = terms.plus(from, line.at.into())?;
        terms.add_scaled(from, slot, line.row.into())
    }

    fn load(&self, terms: &mut Terms, at: u32) -> Told<Term> {
        let address = state_word(terms, at)?;
        self.memory.load(terms, address, 4)
    }

    fn store(&mut self, terms: &mut Terms, at: u32, value: Term) -> Told<()> {
        let address = state_word(terms, at)?;
        self.memory.store(terms, address, 4, value, Truth::YES)
    }
}

/// From where histories are counted.
pub(crate) fn histories(question: &Question, terms: &mut Terms) -> Told<Term> {
    apart_or_state(question, terms, 0)
}

/// Where the ring of events begins.
pub(crate) fn ring_base(question: &Question, terms: &mut Terms, ring: &RingPlace) -> Told<Term> {
    let from = apart_or_state(question, terms, 4)?;
    terms.plus(from, ring.start.into())
}

/// The state, or where it says that something lies apart; no code changes what it says.
fn apart_or_state(question: &Question, terms: &mut Terms, word: u32) -> Told<Term> {
    match question.places.apart {
        Some(at) => {
            let address = state_word(terms, at + word)?;
            Ok(terms.unread(address, 4))
        }
        None => Ok(terms.of(Kind::Base(Base::State))),
    }
}

/// The address of a word of the state.
pub(crate) fn state_word(terms: &mut Terms, at: u32) -> Told<Term> {
    let state = terms.of(Kind::Base(Base::State));
    terms.plus(state, at.into())
}

/// Run twice: what the first run learns makes the terms of the second simpler.
fn settled<T>(terms: &mut Terms, run: impl Fn(&mut Terms) -> Told<T>) -> Told<T> {
    on_one_side(terms, &run)?;
    terms.known.refresh();
    run(terms)
}

fn is_at_most(terms: &mut Terms, term: Term, most: i128) -> Told<bool> {
    let most = terms.constant(most);
    let left = terms.sub(most, term)?;
    let truth = terms.at_least(left, 0)?;
    terms.decide(truth)
}
