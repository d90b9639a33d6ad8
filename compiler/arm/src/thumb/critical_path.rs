//! Critical path of a function: an estimate of the cycles on its longest path, the measure by which
//! strategies and orders of instructions are compared.
//!
//! Each block is timed by `isa::timing` from an empty pipeline, its end as one that leads on to the
//! next block; of two successors, the one with the shorter path is branched to.
//!
//! Not here: the bound, which holds for the final bytes (`budget`).

use super::emit::{branch_inst, select_encodings};
use super::func::{Allocated, Block, BlockId, Cycles, Terminator};
use super::minst::{MInst, PReg, template};
use whippen_ids::{IdMap, longest_paths};
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
    longest_from_each(func, cycles)
        .first()
        .copied()
        .unwrap_or(0)
}

/// Cycles of the longest path; blocks of loops count as often as they run.
pub(super) fn worst_case_cycles(func: &Allocated, core: &Core) -> u64 {
    cycles_from_each(func, core).first().copied().unwrap_or(0)
}

/// Cycles of the longest path from each block on.
pub(super) fn cycles_from_each(func: &Allocated, core: &Core) -> IdMap<BlockId, u64> {
    longest_from_each(func, |block| block_cycles(block, core))
}

/// The longest path from each block on, given the cycles of each.
fn longest_from_each(
    func: &Allocated,
    cycles: impl Fn(&Block<PReg>) -> Cycles,
) -> IdMap<BlockId, u64> {
    let cycles: IdMap<BlockId, Cycles> = func.blocks.iter().map(cycles).collect();
    longest_paths(
        func.blocks.len(),
        func.blocks.ids().rev(),
        |block| in_all_rounds(&func.blocks[block], cycles[block]),
        |block, below| {
            let end = &func.blocks[block].end;
            Some(worst_successor(end, block, cycles[block].taken, below))
        },
    )
}

/// Cycles of a block as often as it runs. Loops are short and rare: all rounds of a loop are
/// charged to its head.
fn in_all_rounds(block: &Block<PReg>, cycles: Cycles) -> u64 {
    u64::from(block.rounds.unwrap_or(1)) * cycles.on
}

/// The longer one of the paths on from a block. Only one of two successors can be what follows in
/// memory; the other one is branched to, which costs so much more.
pub(super) fn worst_successor(
    end: &Terminator<PReg>,
    block: BlockId,
    taken: u64,
    cycles: &IdMap<BlockId, u64>,
) -> u64 {
    let below: Vec<u64> = forward_targets(end, block).map(|to| cycles[to]).collect();
    match below[..] {
        [first, second] => first.max(second).max(first.min(second) + taken),
        _ => below.first().copied().unwrap_or(0),
    }
}

/// Where a block leads, but for the edge back in a loop: blocks stand behind those that lead to
/// them.
fn forward_targets(end: &Terminator<PReg>, block: BlockId) -> impl Iterator<Item = BlockId> {
    end.targets().into_iter().filter(move |to| *to > block)
}

/// Cycles of the longest path through each block.
pub(super) fn cycles_through_each(func: &Allocated, core: &Core) -> Vec<u64> {
    let blocks = func.blocks.len();
    let mut predecessors = IdMap::filled(Vec::new(), blocks);
    for (block, code) in func.blocks.enumerated() {
        forward_targets(&code.end, block).for_each(|to| predecessors[to].push(block));
    }
    let own = |block: BlockId| {
        let code = &func.blocks[block];
        in_all_rounds(code, block_cycles(code, core))
    };
    let to_each = longest_paths(blocks, func.blocks.ids(), own, |block, above| {
        predecessors[block].iter().map(|from| above[from]).max()
    });
    let from_each = cycles_from_each(func, core);
    (func.blocks.ids())
        .map(|block| to_each[block] + from_each[block] - own(block))
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
    let cycles = |inst: &Inst, outcome: &Outcome| {
        u64::from(
            core.issue(pipe, &core.prepare(inst), at, outcome)
                .1
                .cycles(),
        )
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
