//! Control-flow graphs of machine instructions: functions of basic blocks, before and after
//! register allocation.
//!
//! Blocks have parameters until registers are allocated, and end by one terminator.

use super::minst::{MInst, PReg, Reg, Register, VReg};
use super::registers::ALL_FREE;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::OnceLock;
use whippen_ids::{IdMap, impl_id, longest_paths, reverse_postorder};
use whippen_isa::Cond;

/// A block of a function, by number; the first is the entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct BlockId(pub u32);

impl_id!(BlockId);

impl fmt::Display for BlockId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "block{}", self.0)
    }
}

/// A block and the values of its parameters.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Edge<V = VReg> {
    pub block: BlockId,
    /// None after allocation, where the values are in their registers.
    pub args: Vec<V>,
}

/// How a block ends.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Terminator<V = VReg> {
    Jump(Edge<V>),
    /// By the flags. Both blocks have no other predecessor.
    Branch {
        cond: Cond,
        yes: BlockId,
        no: BlockId,
        likely: Option<bool>,
    },
    /// To the address in this register, the code of the next key.
    NextKey(V),
    /// To the code after `init` of one key.
    FallThrough,
}

/// Cycles of a block, about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cycles {
    /// With its end, which is a branch that is not taken if it is a decision.
    pub on: u64,
    /// What the branch costs more where it is taken.
    pub taken: u64,
}

/// A basic block.
#[derive(Debug, Clone)]
pub(super) struct Block<R: Register = Reg> {
    /// None after allocation.
    pub params: Vec<R::Value>,
    pub code: Vec<MInst<R>>,
    pub end: Terminator<R::Value>,
    /// It runs at most so often each time it is entered from outside its loop.
    pub rounds: Option<u32>,
    /// Its cycles, once somebody has asked `critical_path` for them.
    pub cycles: OnceLock<Cycles>,
}

/// All code of a mode, or of `init`. The first block is the entry.
#[derive(Debug, Clone, Hash)]
pub(super) struct Func<R: Register = Reg> {
    pub blocks: IdMap<BlockId, Block<R>>,
    /// How many virtual registers it has.
    pub vregs: u32,
    /// The registers that it may use, as bits.
    pub free: u32,
    /// How many words of the stack it uses, which only the allocator knows.
    pub slots: usize,
}

/// A function with registers of the core.
pub(super) type Allocated = Func<PReg>;

impl Func {
    pub(super) fn new() -> Func {
        Func {
            blocks: IdMap::new(),
            vregs: 0,
            free: ALL_FREE,
            slots: 0,
        }
    }

    pub(super) fn fresh(&mut self) -> VReg {
        self.vregs += 1;
        VReg(self.vregs - 1)
    }

    pub(super) fn block(&mut self) -> BlockId {
        let end = Terminator::FallThrough;
        self.blocks.push(Block {
            params: Vec::new(),
            code: Vec::new(),
            end,
            rounds: None,
            cycles: OnceLock::new(),
        })
    }
}

impl<V: Copy> Terminator<V> {
    /// The values that it reads: arguments, or the address of the next key's code.
    pub(super) fn values_read(&self) -> &[V] {
        match self {
            Terminator::Jump(edge) => &edge.args,
            Terminator::NextKey(code) => std::slice::from_ref(code),
            Terminator::Branch { .. } | Terminator::FallThrough => &[],
        }
    }

    /// Where it goes.
    pub(super) fn targets(&self) -> Vec<BlockId> {
        match self {
            Terminator::Jump(edge) => vec![edge.block],
            Terminator::Branch { yes, no, .. } => vec![*yes, *no],
            Terminator::NextKey(_) | Terminator::FallThrough => Vec::new(),
        }
    }
}

/// Cycles follow from the rest.
impl<R: Register> Hash for Block<R> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Block {
            params,
            code,
            end,
            rounds,
            cycles: _,
        } = self;
        (params, code, end, rounds).hash(state);
    }
}

impl<R: Register> Block<R> {
    /// The same block with other code.
    pub(super) fn with_code(&self, code: Vec<MInst<R>>) -> Block<R> {
        Block {
            params: self.params.clone(),
            code,
            end: self.end.clone(),
            rounds: self.rounds,
            cycles: OnceLock::new(),
        }
    }
}

impl Func {
    /// The same without blocks that nobody comes to, in an order in which each but the first
    /// follows one that leads to it: `regalloc2`'s checker takes what comes from a later block for
    /// unknown if that has no predecessor yet.
    pub(super) fn into_reverse_postorder(mut self) -> Func {
        let order = self.reverse_postorder();
        let mut places = IdMap::filled(BlockId(0), self.blocks.len());
        for (place, block) in (0..).zip(&order) {
            places[block] = BlockId(place);
        }
        let mut left: IdMap<BlockId, Option<Block>> = std::mem::take(&mut self.blocks)
            .into_iter()
            .map(Some)
            .collect();
        let mut blocks: IdMap<BlockId, Block> = order
            .iter()
            .filter_map(|block| left[block].take())
            .collect();
        for block in blocks.iter_mut() {
            match &mut block.end {
                Terminator::Jump(edge) => edge.block = places[edge.block],
                Terminator::Branch { yes, no, .. } => (*yes, *no) = (places[*yes], places[*no]),
                Terminator::NextKey(_) | Terminator::FallThrough => {}
            }
        }
        Func { blocks, ..self }
    }

    /// Instructions on the longest path, loops counted once.
    pub(super) fn longest_path_len(&self) -> usize {
        let below = longest_paths(
            self.blocks.len(),
            self.reverse_postorder().into_iter().rev(),
            |at| self.blocks[at].code.len(),
            |at, below| {
                let targets = self.blocks[at].end.targets();
                targets.into_iter().map(|to| below[to]).max()
            },
        );
        below.first().copied().unwrap_or(0)
    }

    fn reverse_postorder(&self) -> Vec<BlockId> {
        let targets = |block: BlockId| self.blocks[block].end.targets();
        reverse_postorder(self.blocks.len(), BlockId(0), targets)
    }
}
