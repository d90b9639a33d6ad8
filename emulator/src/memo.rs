//! Cycles that are known already: of a block, by the state of the pipeline at its entry and what
//! happened in it.
//!
//! A small table per block, grown while it pays and overwritten after that. Pipeline states are
//! numbered, so that a key is two words.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use whippen_isa::timing::Pipe;

/// What the cycles of a run through a block depend on.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Key {
    /// Never 0, but of no run.
    pub outcomes: u64,
    /// Number of the pipeline state at entry, how far the run came, and where it led to.
    place: u64,
}

impl Key {
    /// Of a run through some instructions. `about_target`: 3 bits.
    pub fn of_part(outcomes: u64, pipe: u16, done: usize, about_target: u32) -> Self {
        Self {
            outcomes,
            place: u64::from(pipe) << 32 | (done as u64) << 3 | u64::from(about_target),
        }
    }

    /// Of a run through a whole block, up to its end or a branch in it, whose outcomes tell which:
    /// `next` is the address that follows.
    #[inline(always)]
    pub fn of_whole(outcomes: u64, pipe: u16, next: u32) -> Self {
        Self {
            outcomes,
            place: u64::from(pipe) << 32 | u64::from(next),
        }
    }

    /// The number of the pipeline state at entry.
    pub fn pipe(&self) -> u16 {
        (self.place >> 32) as u16
    }

    #[inline(always)]
    fn hash(&self) -> usize {
        let mixed = (self.outcomes ^ self.place.rotate_left(20)).wrapping_mul(GOLDEN);
        (mixed >> 48) as usize
    }
}

/// 2^64 over the golden ratio: spreads what differs in low bits over the high ones.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Cycles and the number of the pipeline state afterwards.
#[derive(Clone, Copy, Default)]
pub(crate) struct Known {
    pub cycles: u32,
    pub pipe: u16,
}

/// All that follows from a run through a whole block.
#[derive(Clone, Copy, Default)]
pub(crate) struct Link {
    pub known: Known,
    /// Instructions that ran.
    pub done: u32,
    /// The number of the block that follows.
    pub next: u32,
}

/// What is known of one block.
#[derive(Default)]
pub(crate) struct Memo<T> {
    slots: Vec<(Key, T)>,
}

/// Slots of a memo at most.
const SLOTS_MAX: usize = 1024;

impl<T: Copy + Default> Memo<T> {
    #[inline(always)]
    pub fn get(&self, key: &Key) -> Option<&T> {
        let (found, known) = self
            .slots
            .get(key.hash() & self.slots.len().wrapping_sub(1))?;
        (found == key).then_some(known)
    }

    #[cfg(test)]
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// All that is known.
    pub fn iter(&self) -> impl Iterator<Item = (&Key, &T)> {
        let known = self.slots.iter().filter(|(key, _)| *key != Key::default());
        known.map(|(key, known)| (key, known))
    }

    pub fn insert(&mut self, key: Key, known: T) {
        let mask = self.slots.len().wrapping_sub(1);
        let taken = self
            .slots
            .get(key.hash() & mask)
            .is_none_or(|(found, _)| *found != Key::default());
        if taken && self.slots.len() < SLOTS_MAX {
            self.grow();
        }
        let mask = self.slots.len() - 1;
        self.slots[key.hash() & mask] = (key, known);
    }

    fn grow(&mut self) {
        let wanted = (self.slots.len() * 2).max(2);
        let old = std::mem::replace(&mut self.slots, vec![Default::default(); wanted]);
        for (key, known) in old.into_iter().filter(|(key, _)| *key != Key::default()) {
            self.slots[key.hash() & (wanted - 1)] = (key, known);
        }
    }
}

/// A quick hash: its keys come from the emulator itself, not from an adversary.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0.rotate_left(5) ^ u64::from(*byte)).wrapping_mul(GOLDEN);
        }
    }

    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }
}

/// Pipeline states by number.
pub(crate) struct Pipes {
    states: Vec<Pipe>,
    numbers: HashMap<Pipe, u16, BuildHasherDefault<Mix>>,
}

impl Pipes {
    pub fn new() -> Self {
        let mut pipes = Self {
            states: Vec::new(),
            numbers: HashMap::default(),
        };
        pipes.number(Pipe::default());
        pipes
    }

    pub fn len(&self) -> usize {
        self.states.len()
    }

    pub fn state(&self, number: u16) -> Pipe {
        self.states[number as usize]
    }

    /// The number of a state. Number 0 is the default; nothing when all numbers are taken.
    pub fn number(&mut self, pipe: Pipe) -> Option<u16> {
        if let Some(number) = self.numbers.get(&pipe) {
            return Some(*number);
        }
        let number = u16::try_from(self.states.len()).ok()?;
        self.states.push(pipe);
        self.numbers.insert(pipe, number);
        Some(number)
    }
}
