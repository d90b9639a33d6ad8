//! Liveness: which registers hold something that is still read, by backward data flow over blocks.
//!
//! The same before and after allocation. Registers with a role of their own are followed only
//! after it, where they are registers like all others.

use super::func::{Block, BlockId, Func};
use super::minst::{MInst, Register};
use whippen_ids::IdMap;

/// A set of registers, a bit for each.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RegisterSet(Vec<u64>);

impl RegisterSet {
    fn insert<R: Register>(&mut self, reg: R) {
        let Some(index) = reg.index() else { return };
        if self.0.len() <= index / 64 {
            self.0.resize(index / 64 + 1, 0);
        }
        self.0[index / 64] |= 1 << (index % 64);
    }

    fn remove<R: Register>(&mut self, reg: R) {
        let word = reg.index().and_then(|index| self.0.get_mut(index / 64));
        if let (Some(index), Some(word)) = (reg.index(), word) {
            *word &= !(1 << (index % 64));
        }
    }

    fn add_all(&mut self, other: &RegisterSet) {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        self.0
            .iter_mut()
            .zip(&other.0)
            .for_each(|(all, more)| *all |= more);
    }

    /// Those of the first registers that have a bit here.
    pub(super) fn of_bits(bits: u32) -> RegisterSet {
        RegisterSet(vec![bits.into()])
    }

    /// The first registers as bits; all of them after allocation.
    pub(super) fn bits(&self) -> u32 {
        self.0.first().map_or(0, |word| *word as u32)
    }

    /// The numbers of its registers, in order.
    pub(super) fn members(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.0).flat_map(|(word, bits)| {
            let is_in = move |bit: &u32| bits >> bit & 1 != 0;
            (0..64).filter(is_in).map(move |bit| 64 * word + bit)
        })
    }
}

/// The registers that hold something where a block begins, by block.
pub(super) fn compute_live_in<R: Register>(func: &Func<R>) -> IdMap<BlockId, RegisterSet> {
    let mut live_in = IdMap::filled(RegisterSet::default(), func.blocks.len());
    let is_loop = func.blocks.iter().any(|block| block.rounds.is_some());
    loop {
        let known = live_in.clone();
        // Blocks follow those that lead to them, so once is enough but for loops.
        for (index, block) in func.blocks.enumerated().rev() {
            live_in[index] = live_in_of(block, &live_in);
        }
        if !is_loop || live_in == known {
            return live_in;
        }
    }
}

/// The registers that hold something where a block ends, given those where others begin.
pub(super) fn live_out_of<R: Register>(
    block: &Block<R>,
    live_in: &IdMap<BlockId, RegisterSet>,
) -> RegisterSet {
    let mut live = RegisterSet::default();
    for target in block.end.targets() {
        live.add_all(&live_in[target]);
    }
    for value in block.end.values_read() {
        live.insert(R::of_value(*value));
    }
    live
}

/// The registers that hold something where a block begins, given those where others begin.
pub(super) fn live_in_of<R: Register>(
    block: &Block<R>,
    live_in: &IdMap<BlockId, RegisterSet>,
) -> RegisterSet {
    let mut live = live_out_of(block, live_in);
    for inst in block.code.iter().rev() {
        step_back(inst, &mut live);
    }
    for param in &block.params {
        live.remove(R::of_value(*param));
    }
    live
}

/// From the registers that hold something behind an instruction to those before it. What it skips
/// under a condition is among what it reads.
pub(super) fn step_back<R: Register>(inst: &MInst<R>, live: &mut RegisterSet) {
    inst.registers_written().for_each(|reg| live.remove(reg));
    inst.registers_read().for_each(|reg| live.insert(reg));
}
