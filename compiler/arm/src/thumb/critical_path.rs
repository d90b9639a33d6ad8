//! About how many cycles the longest way through a function takes: the measure by which orders of
//! instructions are chosen.
//!
//! A block is counted by `isa::timing` from an empty pipeline, its end as one that leads on to the
//! next block; the shorter one of two ways is branched to. What holds for final bytes is found by
//! `budget`, not here.

use super::emit::{branch_inst, select_encodings};
use super::func::{Allocated, Block, Cycles, Terminator};
use super::minst::{MInst, PReg, template};
use whippen_isa::reg::LR;
use whippen_isa::timing::{Core, Outcome, Pipe};
use whippen_isa::{Inst, Op};

/// Cycles of the longest path without folding, which is fast and a little more.
pub(super) fn estimate_cycles(func: &Allocated, core: &Core) -> u64 {
    let cycles = |block: &Block<PReg>| {
        let taken = u64::from(matches!(block.end, Terminator::Branch { .. }));
        let mut pipe = Pipe::default();
        let issue = |fixed: &MInst<PReg>| {
            let (next, cost) = core.issue(pipe, &core.prepare(&fixed.inst), 0, &Outcome::NEXT);
            pipe = next;
            u64::from(cost.cycles())
        };
        let on = block.code.iter().map(issue).sum::<u64>()
            + if matches!(block.end, Terminator::Jump(_)) {
                0
            } else {
                2 - taken
            };
        Cycles { on, taken }
    };
    below(func, func.blocks.iter().map(cycles).collect())
        .first()
        .copied()
        .unwrap_or(0)
}

/// Cycles of the longest way; blocks of loops count as often as they run.
pub(super) fn worst_case_cycles(func: &Allocated, core: &Core) -> u64 {
    cycles_from_each(func, core).first().copied().unwrap_or(0)
}

/// Cycles of the longest way from each block on.
pub(super) fn cycles_from_each(func: &Allocated, core: &Core) -> Vec<u64> {
    below(
        func,
        func.blocks
            .iter()
            .map(|block| block_cycles(block, core))
            .collect(),
    )
}

/// The longest way from each block on, given the cycles of each.
fn below(func: &Allocated, of_blocks: Vec<Cycles>) -> Vec<u64> {
    let mut cycles = vec![0; of_blocks.len()];
    // Blocks follow those that lead to them, but for the way back in a loop, which does not count.
    for (block, own) in of_blocks.into_iter().enumerate().rev() {
        // Loops are short and rare: their rounds are charged to their heads.
        let rounds = u64::from(func.blocks[block].rounds.unwrap_or(1));
        cycles[block] =
            rounds * own.on + worst_successor(&func.blocks[block].end, block, own.taken, &cycles);
    }
    cycles
}

/// The longer one of the ways on from a block. Only one of two can be what follows; the other one
/// is branched to, which costs so much more.
pub(super) fn worst_successor(
    end: &Terminator<PReg>,
    block: usize,
    taken: u64,
    cycles: &[u64],
) -> u64 {
    let below: Vec<u64> = end
        .targets()
        .into_iter()
        .filter(|to| *to > block)
        .map(|to| cycles[to])
        .collect();
    match below[..] {
        [first, second] => first.max(second).max(first.min(second) + taken),
        _ => below.first().copied().unwrap_or(0),
    }
}

/// Cycles of the longest way through each block.
pub(super) fn cycles_through_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let below = cycles_from_each(func, core);
    let mut above = vec![0; func.blocks.len()];
    for block in 0..func.blocks.len() {
        let targets: Vec<usize> = func.blocks[block]
            .end
            .targets()
            .into_iter()
            .filter(|to| *to > block)
            .collect();
        let taken = block_cycles(&func.blocks[block], core).taken;
        let own = below[block] - worst_successor(&func.blocks[block].end, block, taken, &below);
        let here = above[block] + own;
        targets
            .into_iter()
            .for_each(|to| above[to] = here.max(above[to]));
    }
    above
        .iter()
        .zip(below)
        .map(|(above, below)| above + below)
        .collect()
}

/// Cycles of a block.
pub(super) fn block_cycles(block: &Block<PReg>, core: &Core) -> Cycles {
    *block.cycles.get_or_init(|| count_cycles(block, core))
}

fn count_cycles(block: &Block<PReg>, core: &Core) -> Cycles {
    let mut code = block
        .code
        .iter()
        .map(|fixed| (fixed.inst, None, None))
        .collect();
    select_encodings(
        &mut code,
        core.arch,
        matches!(block.end, Terminator::Branch { .. }),
    );
    let (mut pipe, mut at, mut sum) = (Pipe::default(), 0, 0);
    for (inst, ..) in &code {
        let (next, cost) = core.issue(pipe, &core.prepare(inst), at, &Outcome::NEXT);
        (pipe, at, sum) = (next, at + inst.size(), sum + u64::from(cost.cycles()));
    }
    let cycles = |inst: &Inst, way: &Outcome| {
        u64::from(core.issue(pipe, &core.prepare(inst), at, way).1.cycles())
    };
    let taken = Outcome::taken(0, false);
    match block.end {
        Terminator::Jump(_) => Cycles { on: sum, taken: 0 },
        Terminator::Branch { cond, .. } => {
            let branch = branch_inst(Some(cond), false, 0);
            let on = cycles(&branch, &Outcome::NEXT);
            Cycles {
                on: sum + on,
                taken: cycles(&branch, &taken).saturating_sub(on),
            }
        }
        Terminator::NextKey(_) => Cycles {
            on: sum
                + cycles(
                    &Inst {
                        m: LR,
                        ..template(Op::BX)
                    },
                    &taken,
                ),
            taken: 0,
        },
        Terminator::FallThrough => Cycles {
            on: sum + 2,
            taken: 0,
        },
    }
}
