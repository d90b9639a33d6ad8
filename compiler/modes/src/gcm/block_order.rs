//! Topological order of blocks: every block before those it leads to, unreachable ones dropped.

use crate::{Block, End};

/// Every block before those it leads to.
pub(super) fn in_order(mut blocks: Vec<Block>) -> Vec<Block> {
    let mut order = Vec::new();
    let mut seen = vec![false; blocks.len()];
    // A block is done once all that it names are.
    let mut open = vec![(0, false)];
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
    let mut place = vec![0; blocks.len()];
    order
        .iter()
        .enumerate()
        .for_each(|(at, block)| place[*block] = at);
    let moved = |block: &usize| {
        let mut block = std::mem::replace(&mut blocks[*block], empty_block());
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
        end: End::Next(0),
    }
}
