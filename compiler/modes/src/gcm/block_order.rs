//! Topological order of blocks: every block before those it leads to, unreachable ones dropped.

use crate::{Block, BlockId, End, ModeId};
use whippen_ids::IdMap;

/// Every block before those it leads to.
pub(super) fn in_order(mut blocks: IdMap<BlockId, Block>) -> IdMap<BlockId, Block> {
    let mut order = Vec::new();
    let mut seen = IdMap::filled(false, blocks.len());
    // A block is done once all that it names are.
    let mut open = vec![(BlockId(0), false)];
    while let Some((block, done)) = open.pop() {
        if done {
            order.push(block);
        } else if !std::mem::replace(&mut seen[block], true) {
            open.push((block, true));
            open.extend(
                blocks[block]
                    .end
                    .targets()
                    .map(|target| (target.block, false)),
            );
        }
    }
    order.reverse();
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
