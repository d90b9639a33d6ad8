//! Topological order of blocks: every block before those it leads to, unreachable ones dropped.

use crate::{Block, BlockId, End, ModeId};
use whippen_ids::{IdMap, reverse_postorder};

/// Every block before those it leads to.
pub(super) fn in_order(mut blocks: IdMap<BlockId, Block>) -> IdMap<BlockId, Block> {
    let targets = |block: BlockId| blocks[block].end.targets().map(|target| target.block);
    let order = reverse_postorder(blocks.len(), BlockId(0), targets);
    let mut place = IdMap::filled(BlockId(0), blocks.len());
    for (at, block) in (0..).zip(&order) {
        place[block] = BlockId(at);
    }
    let moved = |block: &BlockId| {
        let mut block = std::mem::replace(&mut blocks[block], empty_block());
        block
            .end
            .targets_mut()
            .for_each(|target| target.block = place[target.block]);
        block
    };
    order.iter().map(moved).collect()
}

/// A block to be filled.
pub(super) fn empty_block() -> Block {
    Block {
        params: Vec::new(),
        insts: Vec::new(),
        end: End::Next(ModeId(0)),
    }
}
