//! Memory as what was stored, by address: a base, what is added to it, and a constant.
//!
//! Where it is not known whether a place is one that was stored to, as with an index into a string
//! whose points have all moved, what it holds is a function of all stores that may be there, in
//! their order. Two stores that certainly do not meet may change places, so they are sorted; the
//! same stores make the same function, whichever way code and Kernel came to them.

use crate::stop::{Reason, Told, unproven_as};
use crate::term::{Atom, Function, Kind, Sum, Term, Terms};
use crate::truth::Truth;

/// An address: without its constant, and that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Address {
    pub moving: Term,
    pub at: i128,
}

/// What lies somewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Held {
    pub address: Address,
    pub bytes: u8,
    pub value: Term,
}

/// All that was stored, the last at the end; one entry for a place.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    pub held: Vec<Held>,
    /// Whether some of these may lie where another one does.
    meets: bool,
}

/// What is there that was not there at the beginning.
#[derive(Debug, Clone, Default)]
pub(crate) struct Changes {
    /// What meets nothing else, by address.
    pub apart: Vec<Held>,
    /// What may meet others of these, in order.
    pub ordered: Vec<Held>,
}

/// How two accesses lie to each other.
#[derive(Debug, PartialEq, Eq)]
enum Meeting {
    Same,
    Apart,
    Unknown,
}

impl Terms {
    pub fn address(&mut self, term: Term) -> Address {
        let Sum { parts, constant } = self.sum(term).clone();
        Address {
            moving: self.intern(Sum { parts, constant: 0 }),
            at: constant,
        }
    }

    pub fn of_address(&mut self, address: Address) -> Told<Term> {
        self.plus(address.moving, address.at)
    }

    /// What is of a region in an address: bases, and pointers that memory holds.
    fn region(&self, term: Term) -> impl Iterator<Item = Atom> {
        let parts = self.sum(term).parts.iter().map(|(atom, _)| *atom);
        parts.filter(|atom| self.is_of_region(*atom))
    }

    /// Whether it is a base, or a pointer that memory holds.
    pub fn is_of_region(&self, atom: Atom) -> bool {
        match self.kind(atom) {
            Kind::Base(_) => true,
            Kind::Load(address, 4) => self.pointers.contains(address),
            _ => false,
        }
    }

    fn meeting(&mut self, (a, x): (Address, u8), (b, y): (Address, u8)) -> Told<Meeting> {
        let apart = |low: i128, high: i128| low >= i128::from(y) || high <= -i128::from(x);
        if a.moving == b.moving {
            let by = a.at - b.at;
            return Ok(match (by, x == y) {
                (0, true) => Meeting::Same,
                _ if apart(by, by) => Meeting::Apart,
                _ => Meeting::Unknown,
            });
        }
        if self.region(a.moving).ne(self.region(b.moving)) {
            return Ok(Meeting::Apart);
        }
        let by = self.sub(a.moving, b.moving)?;
        let (low, high) = self.bounds(by);
        let by = a.at - b.at;
        Ok(if apart(low + by, high + by) {
            Meeting::Apart
        } else {
            Meeting::Unknown
        })
    }
}

impl Memory {
    /// Takes what another one holds, too.
    pub fn extend(&mut self, other: Memory) {
        self.held.extend(other.held);
        self.meets |= other.meets;
    }

    /// What an address holds, as so many bytes: words are signed, others are not.
    pub fn load(&self, terms: &mut Terms, address: Term, bytes: u8) -> Told<Term> {
        let place = terms.address(address);
        let (mut below, mut over) = (None, Vec::new());
        for held in self.held.iter().rev() {
            match terms.meeting((place, bytes), (held.address, held.bytes))? {
                Meeting::Same => {
                    below = Some(held.value);
                    break;
                }
                Meeting::Apart => {}
                Meeting::Unknown => over.push(*held),
            }
        }
        let below = below.unwrap_or_else(|| terms.unread(address, bytes));
        if over.is_empty() {
            return Ok(below);
        }
        if bytes != 4 || over.iter().any(|held| held.bytes != 4) {
            return unproven_as(Reason::Places, "a load that may meet another store");
        }
        over.reverse();
        let mut args = vec![address, below];
        for held in in_order(terms, over)? {
            args.extend([terms.of_address(held.address)?, held.value]);
        }
        Ok(terms.apply(Function::Held, args))
    }

    /// Stores a value where something holds.
    pub fn store(
        &mut self,
        terms: &mut Terms,
        address: Term,
        bytes: u8,
        value: Term,
        holds: Truth,
    ) -> Told<()> {
        let value = match bytes {
            4 => terms.word(value)?,
            _ => terms.low_bits(value, 8 * u32::from(bytes))?,
        };
        let value = match terms.settle(holds).settled() {
            Some(false) => return Ok(()),
            Some(true) => value,
            None => {
                let old = self.load(terms, address, bytes)?;
                terms.select(holds, value, old)?
            }
        };
        let place = terms.address(address);
        let mut kept = Vec::with_capacity(self.held.len() + 1);
        for held in &self.held {
            match terms.meeting((place, bytes), (held.address, held.bytes))? {
                Meeting::Same => {}
                Meeting::Apart => kept.push(*held),
                Meeting::Unknown => {
                    kept.push(*held);
                    self.meets = true;
                }
            }
        }
        kept.push(Held {
            address: place,
            bytes,
            value,
        });
        self.held = kept;
        Ok(())
    }

    /// This where something holds, else another one; none where stores may meet each other.
    pub fn or_else(&self, terms: &mut Terms, other: &Memory, holds: Truth) -> Told<Option<Memory>> {
        if self.held == other.held {
            return Ok(Some(self.clone()));
        }
        if self.meets || other.meets {
            return Ok(None);
        }
        let mut all = other.clone();
        for held in self.held.iter().chain(&other.held) {
            let address = terms.of_address(held.address)?;
            let [own, others] = [self, other].map(|memory| memory.load(terms, address, held.bytes));
            let (own, others) = (own?, others?);
            if own != others {
                all.store(terms, address, held.bytes, own, holds)?;
            }
        }
        Ok((!all.meets).then_some(all))
    }

    /// What is there that was not there at the beginning.
    pub fn changes(&self, terms: &mut Terms) -> Told<Changes> {
        let mut all = Changes::default();
        let mut meeting = Vec::new();
        for (at, held) in self.held.iter().enumerate() {
            if self.meets && self.meets_another(terms, at)? {
                meeting.push(*held);
                continue;
            }
            let address = terms.of_address(held.address)?;
            let old = terms.unread(address, held.bytes);
            if held.value != old {
                all.apart.push(*held);
            }
        }
        all.apart.sort_by_key(|held| (held.address, held.bytes));
        all.ordered = in_order(terms, meeting)?;
        Ok(all)
    }

    fn meets_another(&self, terms: &mut Terms, at: usize) -> Told<bool> {
        let own = self.held[at];
        for (other, held) in self.held.iter().enumerate() {
            let places = [own, *held].map(|held| (held.address, held.bytes));
            if other != at && terms.meeting(places[0], places[1])? != Meeting::Apart {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Stores in an order that does not depend on which of two came first that do not meet.
fn in_order(terms: &mut Terms, stores: Vec<Held>) -> Told<Vec<Held>> {
    let mut ordered: Vec<Held> = Vec::with_capacity(stores.len());
    for held in stores {
        let mut at = ordered.len();
        while let Some(before) = at.checked_sub(1).map(|at| ordered[at])
            && held.address < before.address
        {
            let places = [held, before].map(|held| (held.address, held.bytes));
            if terms.meeting(places[0], places[1])? != Meeting::Apart {
                break;
            }
            at -= 1;
        }
        ordered.insert(at, held);
    }
    Ok(ordered)
}
