//! What is translated together: blocks that follow each other, each for one state of the pipeline,
//! so that the cycles between them are constants.
//!
//! ```text
//!   (block, pipe) --what followed so far (`Block::links`)--> (block, pipe) --> ..
//! ```
//!
//! What happened in a block, the state of the pipeline and the next address are compared with what
//! is known, as `Core::follow` does; what is not known leaves the code.

use super::RunMode;
use crate::apart::{Before, Stretch};
use crate::block::Block;
use crate::memo::Link;
use crate::memory::Replaced;
use crate::op::Flow;
use std::collections::VecDeque;

/// Instructions of a unit at most, about.
const INSTRUCTIONS_MAX: usize = 128;
/// What may follow at one place at most.
const WAYS_MAX: usize = 8;

/// Time, and where it goes on, for translated code.
pub(crate) struct Time {
    /// Cycles up to the horizon; below 0 behind it.
    pub left: u64,
    /// Instructions that ran.
    pub instructions: u64,
    /// The rest is for a core that runs apart. The cycle of the horizon.
    pub end: u64,
    /// Ports of pages.
    pub stripes: *const u8,
    /// Where accesses, stores and stretches are noted.
    pub accesses: *mut [u8; 2],
    pub replaced: *mut Replaced,
    pub stretches: *mut Stretch,
    /// How many accesses and stretches there may be when a block begins.
    pub accesses_max: usize,
    pub stretches_max: usize,
    /// What was noted when the last block began.
    pub before: Before,
}

/// No horizon is so far away.
const LEFT_MAX: u64 = 1 << 62;

impl Time {
    pub fn new(left: u64, instructions: u64) -> Self {
        Self {
            left: left.min(LEFT_MAX),
            instructions,
            end: 0,
            stripes: std::ptr::null(),
            accesses: std::ptr::null_mut(),
            replaced: std::ptr::null_mut(),
            stretches: std::ptr::null_mut(),
            accesses_max: 0,
            stretches_max: 0,
            before: Before::default(),
        }
    }
}

/// How translated code ended.
#[derive(Clone, Copy)]
pub(crate) struct Exit {
    /// In this block, which it entered with this state of the pipeline.
    pub block: usize,
    pub pipe: u16,
    /// How its last instruction ended, and how many ran before that one; nothing when it ended
    /// in front of the block.
    pub flow: Option<Flow>,
    pub done: usize,
}

/// The number of no flow.
const IN_FRONT: u64 = 5;

impl Exit {
    /// From what code returns.
    #[inline(always)]
    pub fn of(word: u64) -> Self {
        let flow = match word & 0xff {
            0 => Some(Flow::Next),
            1 => Some(Flow::Branch),
            2 => Some(Flow::Leave),
            3 => Some(Flow::Inexact),
            4 => Some(Flow::Trap),
            _ => None,
        };
        Self {
            block: (word >> 32) as usize,
            pipe: (word >> 16) as u16,
            flow,
            done: (word >> 8 & 0xff) as usize,
        }
    }

    /// What code returns.
    pub fn word(&self) -> i64 {
        let flow = self.flow.map_or(IN_FRONT, |flow| flow as u64);
        let word = (self.block as u64) << 32 | u64::from(self.pipe) << 16;
        (word | (self.done as u64) << 8 | flow) as i64
    }
}

/// A block in a state of the pipeline.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Node {
    pub block: usize,
    pub pipe: u16,
}

/// What may follow from a run through a block.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub outcomes: u64,
    /// The address that follows.
    pub next: u32,
    pub link: Link,
}

impl Way {
    pub fn node(&self) -> Node {
        Node {
            block: self.link.next as usize,
            pipe: self.link.known.pipe,
        }
    }
}

/// The nodes of a unit, with what stands for them in the code.
pub(super) struct Unit<'a, T> {
    pub blocks: &'a [Block],
    mode: RunMode,
    nodes: Vec<(Node, T)>,
    open: VecDeque<(Node, T)>,
    instructions: usize,
}

impl<'a, T: Copy> Unit<'a, T> {
    pub fn new(blocks: &'a [Block], mode: RunMode) -> Self {
        Self {
            blocks,
            mode,
            nodes: Vec::new(),
            open: VecDeque::new(),
            instructions: 0,
        }
    }

    /// What stands for a node; of a new one, if there is room, what is made for it.
    pub fn node(&mut self, node: Node, make: impl FnOnce() -> T) -> Option<T> {
        if let Some((_, found)) = self.nodes.iter().find(|(known, _)| *known == node) {
            return Some(*found);
        }
        let block = &self.blocks[node.block];
        let count = block.ops.len();
        let full = self.instructions + count > INSTRUCTIONS_MAX;
        let elsewhere = block.translated.code(self.mode, node.pipe).is_some();
        if !self.nodes.is_empty() && (full || elsewhere) {
            return None;
        }
        self.instructions += count;
        let made = make();
        self.nodes.push((node, made));
        self.open.push_back((node, made));
        Some(made)
    }

    /// The next node that is to be emitted.
    pub fn next(&mut self) -> Option<(Node, T)> {
        self.open.pop_front()
    }

    /// What is known to follow where so many instructions of a node ran, with those outcomes and
    /// that address where they are known.
    pub fn ways(
        &self,
        node: Node,
        done: usize,
        outcomes: Option<u64>,
        next: Option<u32>,
    ) -> Vec<Way> {
        let links = self.blocks[node.block].links.iter();
        let ways =
            links.filter(|(key, link)| key.pipe() == node.pipe && link.done as usize == done);
        let ways = ways.map(|(key, link)| Way {
            outcomes: key.outcomes,
            next: self.blocks[link.next as usize].start(),
            link: *link,
        });
        let is_here = |way: &Way| {
            outcomes.is_none_or(|known| known == way.outcomes)
                && next.is_none_or(|known| known == way.next)
        };
        ways.filter(is_here).take(WAYS_MAX).collect()
    }
}
