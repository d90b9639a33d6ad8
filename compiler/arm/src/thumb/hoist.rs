//! What a block begins with is begun in the block before, where that has nothing better to do.
//!
//! ```text
//!   ldr r5, a      ldr r5, a         Each of two short blocks waits for what it loads, and neither has anything to do meanwhile.
//!   cmp r0, r5     ldr r9, b         The load of the second goes into the wait of the first, if nobody wants what its register
//!   bge ..         cmp r0, r5        holds where the branch is taken.
//!   ldr r9, b      bge ..
//!   cmp r1, r9     cmp r1, r9
//! ```

use std::sync::OnceLock;

use super::allocate::{Allocated, Fixed, Placed, next_key_register};
use super::critical_path::{self, Cycles};
use super::minst::{Access, Terminator};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE, others};
use super::tuning::{HOIST_WINDOW, HOISTED_MAX};
use whippen_isa::reg::SP;
use whippen_isa::timing::Core;
use whippen_isa::{Class, Flags};

/// Moves loads and single operations up over branches, where that makes the longest way shorter.
pub(super) fn hoist_over_branches(func: &mut Allocated, core: &Core) {
    if func.blocks.iter().any(|block| block.rounds.is_some()) {
        return;
    }
    let mut entered = vec![0; func.blocks.len()];
    func.blocks
        .iter()
        .flat_map(|block| block.end.targets())
        .for_each(|to| entered[to] += 1);
    let mut live = compute_live_in(func, core);
    let mut below = critical_path::cycles_from_each(func, core);
    for block in (0..func.blocks.len()).rev() {
        if let Terminator::Branch { yes, no, .. } = func.blocks[block].end {
            for (from, other) in [(yes, no), (no, yes)] {
                for _ in 0..HOISTED_MAX {
                    if entered[from] != 1
                        || !hoist_first(func, core, (block, from, other), &live, &mut below)
                    {
                        break;
                    }
                    live[from] = live_in_of(
                        &func.blocks[from],
                        live_out_of(&func.blocks[from], &live, core),
                    );
                }
            }
        }
        live[block] = live_in_of(
            &func.blocks[block],
            live_out_of(&func.blocks[block], &live, core),
        );
        let own = critical_path::block_cycles(&func.blocks[block], core);
        below[block] = own.on
            + critical_path::worst_successor(&func.blocks[block].end, block, own.taken, &below);
    }
}

/// Moves the first instruction of a block up, if that pays; whether it did.
fn hoist_first(
    func: &mut Allocated,
    core: &Core,
    (block, from, other): (usize, usize, usize),
    live: &[u32],
    below: &mut [u64],
) -> bool {
    let Some(first) = func.blocks[from]
        .code
        .first()
        .copied()
        .filter(is_speculatable)
    else {
        return false;
    };
    let rest = with_code(&func.blocks[from], func.blocks[from].code[1..].to_vec());
    let (upper, lower) = (
        critical_path::block_cycles(&func.blocks[block], core),
        critical_path::block_cycles(&func.blocks[from], core),
    );
    let shorter = critical_path::block_cycles(&rest, core);
    let end = func.blocks[block].end.clone();
    let before = upper.on + critical_path::worst_successor(&end, block, upper.taken, below);
    let was = below[from];
    below[from] = was - lower.on + shorter.on;
    let with_below = |cycles: Cycles| {
        cycles.on + critical_path::worst_successor(&end, block, cycles.taken, below)
    };
    let pays = |cycles: Cycles| {
        let (now, spares) = (
            with_below(cycles),
            cycles.on + shorter.on < upper.on + lower.on,
        );
        now < before || now == before && cycles.on <= upper.on && spares
    };
    let (_, own) = registers_touched(&first);
    let behind_from = live_out_of(&func.blocks[from], live, core);
    // In its own register, or in another one that nobody wants.
    let registers = std::iter::once(own).chain(others(func.free, own));
    for register in registers.filter(|_| pays(upper)) {
        let code = match register == own {
            true => Some(func.blocks[from].code.clone()),
            false if live[from] & register == 0 => {
                rename_result(&func.blocks[from].code, own, register, behind_from, core)
            }
            false => None,
        };
        let Some(code) = code.filter(|_| live[other] & register == 0) else {
            continue;
        };
        let tried =
            find_best_place(&func.blocks[block], code[0], core).filter(|(cycles, _)| pays(*cycles));
        if let Some((_, tried)) = tried {
            func.blocks[block] = tried;
            func.blocks[from] = with_code(&func.blocks[from], code[1..].to_vec());
            return true;
        }
    }
    below[from] = was;
    false
}

/// The block with one more instruction near its end, where it costs least.
fn find_best_place(block: &Placed, goes: Fixed, core: &Core) -> Option<(Cycles, Placed)> {
    let mut best: Option<(Cycles, Placed)> = None;
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
        let tried = with_code(block, code);
        let cycles = critical_path::block_cycles(&tried, core);
        if best.as_ref().is_none_or(|(least, _)| cycles.on < least.on) {
            best = Some((cycles, tried));
        }
    }
    best
}

/// The code with the result of its first instruction in another register, as long as that result is
/// wanted; none if it is wanted behind the code, or becomes something else in place.
pub(super) fn rename_result(
    code: &[Fixed],
    from: u32,
    to: u32,
    behind: u32,
    core: &Core,
) -> Option<Vec<Fixed>> {
    let (old, new) = (from.trailing_zeros() as u8, to.trailing_zeros() as u8);
    let mut code = code.to_vec();
    let mut wanted = true;
    for (at, fixed) in code.iter_mut().enumerate() {
        if !wanted {
            break;
        }
        let source = fixed.code.filter(|code| code.tied.is_none())?;
        let (uses, defs) = registers_touched(fixed);
        if (uses | defs) & to != 0 {
            return None;
        }
        for u in source.uses() {
            let register = u.role.of(&mut fixed.inst);
            if *register == old && u.writes == (at == 0) {
                if u.writes && u.reads {
                    return None;
                }
                *register = new;
            } else if *register == old && u.writes {
                if u.reads || source.inst.cond.is_some() || u.operand.old.is_some() {
                    return None;
                }
                wanted = false;
            }
        }
        fixed.inst = fixed.inst.shortest(core.arch).unwrap_or(fixed.inst);
        // What names registers otherwise than by roles.
        if at > 0 && wanted && registers_touched(fixed).0 & from != 0 {
            return None;
        }
    }
    (!wanted || behind & from == 0).then_some(code)
}

/// The block with other code.
fn with_code(block: &Placed, code: Vec<Fixed>) -> Placed {
    Placed {
        code,
        cycles: OnceLock::new(),
        ..block.clone()
    }
}

/// Whether an instruction does no harm where its result is not wanted.
fn is_speculatable(fixed: &Fixed) -> bool {
    let Some(code) = fixed.code else { return false };
    let (inst, flags) = (&fixed.inst, fixed.inst.flags());
    let plain = inst.cond.is_none()
        && !inst.wback
        && !flags.writes.intersects(Flags::NZCV)
        && !flags.reads.intersects(Flags::NZCV);
    // Another address may be right on one side of the branch only.
    let near = [STATE, RECORD, SAMPLES, HISTORY, SP]
        .iter()
        .any(|base| inst.uses().core_bits() == 1 << base);
    let load = near && matches!(code.access, Access::Read(_)) && inst.class() == Class::Load;
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
    plain && (load || code.access == Access::None && computes)
}

/// The registers that an instruction reads and writes.
pub(super) fn registers_touched(fixed: &Fixed) -> (u32, u32) {
    (
        fixed.inst.uses().core_bits().into(),
        fixed.inst.defs().core_bits().into(),
    )
}

/// Whether an instruction must stay before one that goes up.
fn conflicts_with(stays: &Fixed, goes: &Fixed) -> bool {
    let ((uses, defs), (reads, writes)) = (registers_touched(stays), registers_touched(goes));
    let place = |fixed: &Fixed| fixed.code.map(|code| code.access);
    let overwrites = match (place(stays), place(goes)) {
        (Some(Access::Write(to)), Some(Access::Read(from))) => to == from,
        _ => false,
    };
    overwrites || (uses | defs) & writes != 0 || defs & reads != 0
}

/// The registers that hold something where a block begins, by block.
pub(super) fn compute_live_in(func: &Allocated, core: &Core) -> Vec<u32> {
    let mut live = vec![0; func.blocks.len()];
    loop {
        let known = live.clone();
        for block in (0..func.blocks.len()).rev() {
            live[block] = live_in_of(
                &func.blocks[block],
                live_out_of(&func.blocks[block], &live, core),
            );
        }
        // Once is enough but for loops.
        if live == known || func.blocks.iter().all(|block| block.rounds.is_none()) {
            return live;
        }
    }
}

pub(super) fn live_out_of(block: &Placed, live: &[u32], core: &Core) -> u32 {
    let leaves = match block.end {
        Terminator::NextKey(_) => 1 << next_key_register(core.arch),
        _ => 0,
    };
    block
        .end
        .targets()
        .into_iter()
        .fold(leaves, |all, to| all | live[to])
}

fn live_in_of(block: &Placed, behind: u32) -> u32 {
    block
        .code
        .iter()
        .rev()
        .fold(behind, |live, fixed| live_before(fixed, live))
}

/// The registers that hold something that is wanted before an instruction, given those behind it.
pub(super) fn live_before(fixed: &Fixed, behind: u32) -> u32 {
    let (uses, defs) = registers_touched(fixed);
    // What is skipped may be wanted from before.
    uses | if fixed.inst.cond.is_some() {
        behind | defs
    } else {
        behind & !defs
    }
}
