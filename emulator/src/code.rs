//! The decoded code of a core: blocks by the address they begin at.

use crate::block::Block;
use crate::memory::Memory;
use crate::translate::{Host, Node, RunMode, translate};
use std::collections::HashMap;
use whippen_isa::ItState;
use whippen_isa::timing::Core as Timing;

/// Blocks kept before all are forgotten.
const BLOCKS_MAX: usize = 1 << 16;
const RECENT: usize = 4096;

/// Blocks, and a table of those found last.
pub(crate) struct Code {
    pub blocks: Vec<Block>,
    by_place: HashMap<(u32, ItState), u32>,
    recent: Box<[(u32, u32); RECENT]>,
    pub timing: Timing,
    /// What translated blocks are in.
    pub host: Host,
}

/// No block begins at an odd address.
const NOWHERE: (u32, u32) = (1, 0);

impl Code {
    pub fn new(timing: Timing) -> Self {
        Self {
            blocks: Vec::new(),
            by_place: HashMap::new(),
            recent: Box::new([NOWHERE; RECENT]),
            timing,
            host: Host::default(),
        }
    }

    pub fn clear(&mut self) {
        self.blocks.clear();
        self.host.clear();
        self.by_place.clear();
        self.recent.fill(NOWHERE);
    }

    /// Whether it is time to clear.
    pub fn is_full(&self) -> bool {
        self.blocks.len() >= BLOCKS_MAX
    }

    /// Translates what begins with a block that has become hot.
    #[cold]
    pub fn translate(&mut self, block: usize, pipe: u16, mode: RunMode) {
        translate(&mut self.host, &mut self.blocks, Node { block, pipe }, mode);
    }

    /// The number of the block that begins at an address.
    #[inline(always)]
    pub fn find(&mut self, memory: &mut Memory, address: u32, it: ItState) -> usize {
        let (found, number) = self.recent[(address >> 1) as usize % RECENT];
        if found == address && !it.inside() {
            number as usize
        } else {
            self.look_up(memory, address, it)
        }
    }

    /// The number of the block that begins at an address, if it was decoded.
    #[inline(always)]
    pub fn known(&mut self, address: u32, it: ItState) -> Option<usize> {
        let (found, number) = self.recent[(address >> 1) as usize % RECENT];
        if found == address && !it.inside() {
            return Some(number as usize);
        }
        let number = *self.by_place.get(&(address, it))?;
        if !it.inside() {
            self.recent[(address >> 1) as usize % RECENT] = (address, number);
        }
        Some(number as usize)
    }

    #[cold]
    #[inline(never)]
    fn look_up(&mut self, memory: &mut Memory, address: u32, it: ItState) -> usize {
        let number = match self.by_place.get(&(address, it)) {
            Some(number) => *number,
            None => self.decode(memory, address, it),
        };
        if !it.inside() {
            self.recent[(address >> 1) as usize % RECENT] = (address, number);
        }
        number as usize
    }

    fn decode(&mut self, memory: &mut Memory, address: u32, it: ItState) -> u32 {
        let number = self.blocks.len() as u32;
        self.blocks
            .push(Block::decode(memory, &self.timing, address, it));
        self.by_place.insert((address, it), number);
        number
    }
}
