//! About how many cycles the longest way through a function takes: the measure by which orders of instructions are chosen.
//!
//! A block is counted by `isa::timing` from an empty pipeline; ends cost a taken branch. What holds for final bytes is found by
//! `budget`, not here.

use super::allocate::{Allocated, Placed};
use super::emit::finish;
use super::vcode::End;
use whippen_isa::timing::{Core, Outcome, Pipe};

/// The same without folding, which is fast and a little more.
pub(super) fn roughly(func: &Allocated, core: &Core) -> u64 {
    let cycles = |block: &Placed| {
        let mut pipe = Pipe::default();
        let issue = |fixed: &super::allocate::Fixed| {
            let (next, cost) = core.issue(pipe, &core.prepare(&fixed.inst), 0, &Outcome::NEXT);
            pipe = next;
            u64::from(cost.cycles())
        };
        block.code.iter().map(issue).sum::<u64>() + end(block)
    };
    below(func, func.blocks.iter().map(cycles).collect()).first().copied().unwrap_or(0)
}

/// Cycles of the longest way; blocks of loops count as often as they run.
pub(super) fn longest(func: &Allocated, core: &Core) -> u64 {
    from_each(func, core).first().copied().unwrap_or(0)
}

/// Cycles of the longest way from each block on.
pub(super) fn from_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let cycles = |block: &Placed| *block.cycles.get_or_init(|| block_cycles(block, core));
    below(func, func.blocks.iter().map(cycles).collect())
}

/// The longest way from each block on, given the cycles of each.
fn below(func: &Allocated, mut cycles: Vec<u64>) -> Vec<u64> {
    // Loops are short and rare: their rounds are charged to their heads.
    for (block, cycles) in func.blocks.iter().zip(&mut cycles) {
        *cycles *= u64::from(block.rounds.unwrap_or(1));
    }
    // Blocks follow those that lead to them, but for the way back in a loop, which does not count.
    for block in (0..cycles.len()).rev() {
        let below = func.blocks[block].end.targets().into_iter().filter(|to| *to > block).map(|to| cycles[to]);
        cycles[block] += below.max().unwrap_or(0);
    }
    cycles
}

/// Cycles of the longest way through each block.
pub(super) fn through_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let below = from_each(func, core);
    let mut above = vec![0; func.blocks.len()];
    for block in 0..func.blocks.len() {
        let targets: Vec<usize> = func.blocks[block].end.targets().into_iter().filter(|to| *to > block).collect();
        let own = below[block] - targets.iter().map(|to| below[*to]).max().unwrap_or(0);
        let here = above[block] + own;
        targets.into_iter().for_each(|to| above[to] = here.max(above[to]));
    }
    above.iter().zip(below).map(|(above, below)| above + below).collect()
}

fn block_cycles(block: &Placed, core: &Core) -> u64 {
    let mut code = block.code.iter().map(|fixed| (fixed.inst, None, None)).collect();
    finish(&mut code, core.arch, matches!(block.end, End::Branch { .. }));
    let (mut pipe, mut at, mut sum) = (Pipe::default(), 0, 0);
    for (inst, ..) in &code {
        let (next, cost) = core.issue(pipe, &core.prepare(inst), at, &Outcome::NEXT);
        (pipe, at, sum) = (next, at + inst.size(), sum + u64::from(cost.cycles()));
    }
    sum + end(block)
}

fn end(block: &Placed) -> u64 {
    match block.end {
        End::Jump(_) => 0,
        End::Branch { .. } => 1,
        End::Next(_) | End::InitDone => 2,
    }
}
