//! Forward dataflow: which cells may have been stored to, at the start of each block of a mode.

use whippen_ids::IdMap;
use whippen_kernel::{Inst, Op, all_insts};
use whippen_modes::{BlockId, Mode};

/// Whether each cell may have been stored to.
pub(super) type StoredCells = Vec<bool>;

/// The cells stored to before each block.
pub(super) type StartsOfBlocks = IdMap<BlockId, StoredCells>;

/// Finds them.
pub(super) fn at_starts_of_blocks(mode: &Mode, cells: usize) -> StartsOfBlocks {
    let mut starts = IdMap::filled(vec![false; cells], mode.blocks.len());
    // What a block names comes after it, so one pass sees every way in.
    for (index, block) in mode.blocks.enumerated() {
        let mut stored = starts[index].clone();
        note_stores(&block.insts, &mut stored);
        for target in block.end.targets() {
            let start = starts[target.block].iter_mut();
            start
                .zip(&stored)
                .for_each(|(known, stored)| *known |= stored);
        }
    }
    starts
}

/// Adds the cells that instructions may store to, those inside them included.
pub(super) fn note_stores(insts: &[Inst], stored: &mut StoredCells) {
    for inst in all_insts(insts) {
        match inst.op {
            Op::Set(cell) | Op::SetAt(cell) => stored[cell as usize] = true,
            Op::Wave(e, v) => [e, v].iter().for_each(|cell| stored[*cell as usize] = true),
            _ => {}
        }
    }
}
