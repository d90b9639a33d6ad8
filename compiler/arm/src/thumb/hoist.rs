//! Speculative hoisting: the first instruction of a block goes up over the branch to it, into a
//! stall of the block before.
//!
//! ```text
//!   ldr r5, a      ldr r5, a         Each of two short blocks waits for what it loads, and neither has anything to do meanwhile.
//!   cmp r0, r5     ldr r9, b         The load of the second goes into the wait of the first, if nobody wants what its register
//!   bge ..         cmp r0, r5        holds where the branch is taken.
//!   ldr r9, b      bge ..
//!   cmp r1, r9     cmp r1, r9
//! ```
//!
//! An instruction moves if its result is dead on the other side of the branch (or another register
//! is free for it), if it has no effect but its result, and if the worst-case path gets shorter.
//! Functions with loops are left as they are.

use super::critical_path;
use super::func::{Allocated, Block, BlockId, Cycles, Terminator};
use super::liveness::{RegisterSet, compute_live_in, live_in_of, live_out_of};
use super::minst::{Access, AliasClass, MInst, PReg, Use};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE, others};
use super::tuning::{HOIST_WINDOW, HOISTED_MAX};
use whippen_ids::IdMap;
use whippen_isa::Class;
use whippen_isa::reg::SP;
use whippen_isa::timing::Core;

/// Moves loads and single operations up over branches, where that makes the longest path shorter.
pub(super) fn hoist_over_branches(func: &mut Allocated, core: &Core) {
    if func.blocks.iter().any(|block| block.rounds.is_some()) {
        return;
    }
    let mut entered = IdMap::filled(0, func.blocks.len());
    func.blocks
        .iter()
        .flat_map(|block| block.end.targets())
        .for_each(|to| entered[to] += 1);
    let mut live = compute_live_in(func);
    let mut below = critical_path::cycles_from_each(func, core);
    for block in func.blocks.ids().rev() {
        if let Terminator::Branch { yes, no, .. } = func.blocks[block].end {
            for (from, other) in [(yes, no), (no, yes)] {
                let side = BranchSide { block, from, other };
                for _ in 0..HOISTED_MAX {
                    if entered[from] != 1 || !hoist_first(func, core, side, &live, &mut below) {
                        break;
                    }
                    live[from] = live_in_of(&func.blocks[from], &live);
                }
            }
        }
        live[block] = live_in_of(&func.blocks[block], &live);
        let own = critical_path::block_cycles(&func.blocks[block], core);
        below[block] = own.on
            + critical_path::worst_successor(&func.blocks[block].end, block, own.taken, &below);
    }
}

/// A branch at the end of a block, by the side that an instruction goes up from.
#[derive(Debug, Clone, Copy)]
struct BranchSide {
    block: BlockId,
    from: BlockId,
    other: BlockId,
}

/// What the blocks of a branch cost before an instruction goes up.
struct SideCost {
    /// The block that ends with the branch, and that end.
    upper: Cycles,
    end: Terminator<PReg>,
    /// The block that the instruction leaves, with it and without.
    lower: Cycles,
    shorter: Cycles,
    /// Cycles from the upper block on.
    before: u64,
}

impl SideCost {
    fn new(
        func: &Allocated,
        core: &Core,
        side: BranchSide,
        below: &IdMap<BlockId, u64>,
    ) -> SideCost {
        let upper = critical_path::block_cycles(&func.blocks[side.block], core);
        let lower = &func.blocks[side.from];
        let rest = lower.with_code(lower.code[1..].to_vec());
        let end = func.blocks[side.block].end.clone();
        let successor = critical_path::worst_successor(&end, side.block, upper.taken, below);
        SideCost {
            upper,
            lower: critical_path::block_cycles(lower, core),
            shorter: critical_path::block_cycles(&rest, core),
            before: upper.on + successor,
            end,
        }
    }

    /// Whether the path is shorter where the upper block takes such cycles and the lower one is
    /// without its first instruction, which `below` says already; or as long, and cycles are spared
    /// elsewhere.
    fn pays(&self, side: BranchSide, cycles: Cycles, below: &IdMap<BlockId, u64>) -> bool {
        let successor = critical_path::worst_successor(&self.end, side.block, cycles.taken, below);
        let now = cycles.on + successor;
        let spares = cycles.on + self.shorter.on < self.upper.on + self.lower.on;
        now < self.before || now == self.before && cycles.on <= self.upper.on && spares
    }
}

/// Moves the first instruction of a block up, if that pays; whether it did.
fn hoist_first(
    func: &mut Allocated,
    core: &Core,
    side: BranchSide,
    live: &IdMap<BlockId, RegisterSet>,
    below: &mut IdMap<BlockId, u64>,
) -> bool {
    let BranchSide { block, from, .. } = side;
    let first = func.blocks[from].code.first().copied();
    let Some(first) = first.filter(is_speculatable) else {
        return false;
    };
    let cost = SideCost::new(func, core, side, below);
    let was = below[from];
    below[from] = was - cost.lower.on + cost.shorter.on;
    let (_, own) = first.register_bits();
    // In its own register, or in another one that nobody wants.
    let registers = std::iter::once(own).chain(others(func.free, own));
    let worth = cost.pays(side, cost.upper, below);
    for register in registers.filter(|_| worth) {
        let Some(code) = with_first_in(func, core, side, live, [own, register]) else {
            continue;
        };
        let tried = find_best_place(&func.blocks[block], code[0], core);
        let tried = tried.filter(|(cycles, _)| cost.pays(side, *cycles, below));
        if let Some((_, tried)) = tried {
            func.blocks[block] = tried;
            func.blocks[from] = func.blocks[from].with_code(code[1..].to_vec());
            return true;
        }
    }
    below[from] = was;
    false
}

/// The code of the lower block with the result of its first instruction in another register than
/// its own; none if somebody wants what that holds.
fn with_first_in(
    func: &Allocated,
    core: &Core,
    side: BranchSide,
    live: &IdMap<BlockId, RegisterSet>,
    [own, register]: [u32; 2],
) -> Option<Vec<MInst<PReg>>> {
    let from = &func.blocks[side.from];
    if live[side.other].bits() & register != 0 {
        return None;
    }
    if register == own {
        return Some(from.code.clone());
    }
    let is_free = live[side.from].bits() & register == 0;
    let behind = live_out_of(from, live).bits();
    let renamed = is_free.then(|| rename_result(&from.code, own, register, behind, core));
    let mut code = renamed.flatten()?;
    code.extend_from_slice(&from.code[code.len()..]);
    Some(code)
}

/// The block with one more instruction near its end, where it costs least.
fn find_best_place(
    block: &Block<PReg>,
    goes: MInst<PReg>,
    core: &Core,
) -> Option<(Cycles, Block<PReg>)> {
    let mut best: Option<(Cycles, Block<PReg>)> = None;
    for place in (block.code.len().saturating_sub(HOIST_WINDOW)..=block.code.len()).rev() {
        if block
            .code
            .get(place)
            .is_some_and(|next| conflicts_with(next, &goes))
        {
            break;
        }
        let mut code = block.code.clone();
        code.insert(place, goes);
        let tried = block.with_code(code);
        let cycles = critical_path::block_cycles(&tried, core);
        if best.as_ref().is_none_or(|(least, _)| cycles.on < least.on) {
            best = Some((cycles, tried));
        }
    }
    best
}

/// The beginning of the code, as far as the result of its first instruction is wanted, with that
/// result in another register; none if it is wanted behind the code, or becomes something else in
/// place.
pub(super) fn rename_result(
    code: &[MInst<PReg>],
    from: u32,
    to: u32,
    behind: u32,
    core: &Core,
) -> Option<Vec<MInst<PReg>>> {
    let [old, new] = [from, to].map(|bit| PReg(bit.trailing_zeros() as u8));
    let (mut renamed, mut wanted) = (Vec::new(), true);
    for (at, inst) in code.iter().enumerate() {
        if !wanted {
            break;
        }
        let mut inst = *inst;
        let (uses, defs) = inst.register_bits();
        let is_called_with = inst.convention().is_some() && uses & from != 0;
        let is_bound = inst.inserted || inst.tied.is_some() || is_called_with;
        if is_bound || (uses | defs) & to != 0 {
            return None;
        }
        let uses: Vec<Use<PReg>> = inst.uses().filter(|u| u.operand.reg == old).collect();
        for u in uses {
            let in_place = u.reads || u.operand.old.is_some();
            if u.writes == (at == 0) {
                if u.writes && u.reads {
                    return None;
                }
                inst.set_register(u.role, new);
            } else if u.writes {
                if in_place || inst.inst.cond.is_some() {
                    return None;
                }
                wanted = false;
            }
        }
        renamed.push(inst.shortened(core.arch));
    }
    (!wanted || behind & from == 0).then_some(renamed)
}

/// Whether an instruction does no harm where its result is not wanted.
fn is_speculatable(fixed: &MInst<PReg>) -> bool {
    let inst = &fixed.inst;
    let plain = !fixed.inserted
        && inst.cond.is_none()
        && !inst.wback
        && fixed.touches_flags() == (false, false);
    // Another address may be right on one side of the branch only.
    let near = [STATE, RECORD, SAMPLES, HISTORY, SP]
        .iter()
        .any(|base| inst.uses().core_bits() == 1 << base);
    let load = near && matches!(fixed.access, Access::Read(_)) && inst.class() == Class::Load;
    let computes = matches!(
        inst.class(),
        Class::Alu
            | Class::Move
            | Class::Shift
            | Class::Bitfield
            | Class::Extend
            | Class::Multiply
            | Class::MultiplyAdd
    );
    plain && (load || fixed.access == Access::None && computes)
}

/// Whether an instruction must stay before one that goes up.
fn conflicts_with(stays: &MInst<PReg>, goes: &MInst<PReg>) -> bool {
    let ((uses, defs), (reads, writes)) = (stays.register_bits(), goes.register_bits());
    let overwrites = match (stays.access, goes.access) {
        (Access::Write(to), Access::Read(from)) => to == from,
        (Access::Update(cells), Access::Read(from)) => cells.map(AliasClass::Cell).contains(&from),
        _ => false,
    };
    overwrites || (uses | defs) & writes != 0 || defs & reads != 0
}
