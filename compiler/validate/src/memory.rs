//! Memory as what was stored, by address: a base, what is added to it, and a constant.

use crate::stop::{Reason, Told, unproven_as};
use crate::term::{Atom, Kind, Sum, Term, Terms};
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
        parts.filter(|atom| match self.kind(*atom) {
            Kind::Base(_) => true,
            Kind::Load(address, 4) => self.pointers.contains(address),
            _ => false,
        })
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
    /// What an address holds, as so many bytes: words are signed, others are not.
    pub fn load(&self, terms: &mut Terms, address: Term, bytes: u8) -> Told<Term> {
        let place = terms.address(address);
        for held in self.held.iter().rev() {
            match terms.meeting((place, bytes), (held.address, held.bytes))? {
                Meeting::Same => return Ok(held.value),
                Meeting::Apart => {}
                Meeting::Unknown => {
                    let why = "a load that may meet another store";
                    return unproven_as(Reason::Places, why);
                }
            }
        }
        Ok(terms.unread(address, bytes))
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
                    let why = "a store that may meet another one";
                    return unproven_as(Reason::Places, why);
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

    /// What is there that was not there at the beginning, by address.
    pub fn changed(&self, terms: &mut Terms) -> Told<Vec<Held>> {
        let mut all = Vec::new();
        for held in &self.held {
            let address = terms.of_address(held.address)?;
            let old = terms.unread(address, held.bytes);
            if held.value != old {
                all.push(*held);
            }
        }
        all.sort_by_key(|held| (held.address, held.bytes));
        Ok(all)
    }
}
