//! About how many cycles the longest way through a function takes: the measure by which orders of instructions are chosen.
//!
//! A block is counted by `isa::timing` from an empty pipeline; ends cost a taken branch. What holds for final bytes is found by
//! `budget`, not here.

use super::allocate::{Allocated, Placed};
use super::emit::finish;
use super::vcode::End;
use whippen_isa::Arch;
use whippen_isa::timing::{Core, Outcome, Pipe};

/// Cycles of the longest way; blocks of loops count as often as they run.
pub(super) fn longest(func: &Allocated, core: &Core) -> u64 {
    from_each(func, core).first().copied().unwrap_or(0)
}

/// Cycles of the longest way from each block on.
pub(super) fn from_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let mut cycles: Vec<u64> = func.blocks.iter().map(|block| block_cycles(block, core)).collect();
    // Loops are short and rare: their rounds are charged to their heads.
    for (block, cycles) in func.blocks.iter().zip(&mut cycles) {
        *cycles *= u64::from(block.rounds.unwrap_or(1));
    }
    let mut longest = vec![None; func.blocks.len()];
    way(func, 0, &cycles, &mut longest);
    longest.into_iter().map(|way| way.unwrap_or(0)).collect()
}

/// Cycles of the longest way through each block.
pub(super) fn through_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let below = from_each(func, core);
    let own = |block: usize| {
        let targets = func.blocks[block].end.targets();
        below[block] - targets.into_iter().map(|to| below[to]).max().unwrap_or(0).min(below[block])
    };
    let mut above = vec![0; func.blocks.len()];
    // Blocks follow those that lead to them, but for the way back in a loop, which does not count.
    for block in 0..func.blocks.len() {
        let here = above[block] + own(block);
        for to in func.blocks[block].end.targets().into_iter().filter(|to| *to > block) {
            above[to] = above[to].max(here);
        }
    }
    above.iter().zip(below).map(|(above, below)| above + below).collect()
}

/// The longest way from a block on; a block that is being visited is a loop's head, and ends the way.
fn way(func: &Allocated, block: usize, cycles: &[u64], known: &mut [Option<u64>]) -> u64 {
    if let Some(known) = known[block] {
        return known;
    }
    known[block] = Some(0);
    let targets = func.blocks[block].end.targets();
    let below = targets.into_iter().map(|to| way(func, to, cycles, known)).max().unwrap_or(0);
    let all = cycles[block] + below;
    known[block] = Some(all);
    all
}

fn block_cycles(block: &Placed, core: &Core) -> u64 {
    let mut code = block.code.iter().map(|fixed| (fixed.inst, None, None)).collect();
    finish(&mut code, Arch::V8M, matches!(block.end, End::Branch { .. }));
    let (mut pipe, mut at, mut sum) = (Pipe::default(), 0, 0);
    for (inst, ..) in &code {
        let inst = inst.shortest(Arch::V8M).unwrap_or(*inst);
        let (next, cost) = core.issue(pipe, &core.prepare(&inst), at, &Outcome::NEXT);
        (pipe, at, sum) = (next, at + inst.size(), sum + u64::from(cost.cycles()));
    }
    let end = match block.end {
        End::Jump(_) => 0,
        End::Branch { .. } => 1,
        End::Next(_) | End::InitDone => 2,
    };
    sum + end
}
