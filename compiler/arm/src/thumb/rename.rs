//! Register renaming to break anti-dependences: results go to registers that were not used a moment
//! ago, so that `reorder` may move more instructions.
//!
//! ```text
//!   ldr lr, a                ldr lr, a
//!   cmp lr, r9               movs r4, 0        What begins anew in a register that was just read
//!   mov lr, 0        =>      cmp lr, r9        cannot go up to where something is waited for.
//!   str lr, b                str r4, b
//! ```

use std::ops::Range;

use super::func::Block;
use super::hoist::rename_result;
use super::liveness::{RegisterSet, step_back};
use super::minst::{MInst, PReg};
use super::registers::others;
use super::tuning::RENAME_HORIZON;
use whippen_isa::timing::Core;

/// The block with other registers; `live_out` is what is read behind it, and a high register loses
/// `high_cost` instructions of distance against a low one. None if nothing can be otherwise.
pub(super) fn rename_registers(
    block: &Block<PReg>,
    live_out: &RegisterSet,
    free: u32,
    core: &Core,
    high_cost: usize,
) -> Option<Vec<MInst<PReg>>> {
    let mut code = block.code.clone();
    let mut known = RegisterUse::of(&code, live_out, high_cost);
    let mut changed = false;
    for at in 0..code.len() {
        let (_, own) = known.touched[at];
        if own & free != own || own.count_ones() != 1 || code[at].inst.cond.is_some() {
            continue;
        }
        let others = others(free, own).filter(|reg| known.may_take(at, own, *reg));
        let than = known.score_register(at, own) + 2;
        let mut better: Vec<(usize, u32)> = others
            .map(|reg| (known.score_register(at, reg), reg))
            .filter(|(worth, _)| *worth > than)
            .collect();
        better.sort_by_key(|(worth, _)| std::cmp::Reverse(*worth));
        let new = better
            .into_iter()
            .find_map(|(_, reg)| rename_result(&code[at..], own, reg, live_out.bits(), core));
        if let Some(new) = new {
            let renamed = at..at + new.len();
            code.splice(renamed.clone(), new);
            known.learn(&code, renamed);
            debug_assert_eq!(known, RegisterUse::of(&code, live_out, high_cost));
            changed = true;
        }
    }
    changed.then_some(code)
}

/// What is known of each instruction.
#[derive(Debug, PartialEq)]
struct RegisterUse {
    /// The registers that it reads and writes.
    touched: Vec<(u32, u32)>,
    /// The registers that hold something that is wanted behind it.
    wanted: Vec<u32>,
    /// What a high register loses.
    high_cost: usize,
}

impl RegisterUse {
    fn of(code: &[MInst<PReg>], live_out: &RegisterSet, high_cost: usize) -> RegisterUse {
        let mut known = RegisterUse {
            touched: vec![(0, 0); code.len()],
            wanted: vec![live_out.bits(); code.len()],
            high_cost,
        };
        known.learn(code, 0..code.len());
        known
    }

    /// Learns instructions that are others now. What is wanted behind the last of them and before
    /// the first is as before.
    fn learn(&mut self, code: &[MInst<PReg>], others: Range<usize>) {
        for at in others.clone() {
            self.touched[at] = code[at].register_bits();
        }
        let last = others.end.saturating_sub(1);
        let mut live = RegisterSet::of_bits(self.wanted.get(last).copied().unwrap_or_default());
        for at in others.skip(1).rev() {
            step_back(&code[at], &mut live);
            self.wanted[at - 1] = live.bits();
        }
    }

    /// Whether another register may be free while the result of an instruction is wanted.
    fn may_take(&self, at: usize, own: u32, register: u32) -> bool {
        let behind = self.touched.iter().zip(&self.wanted).skip(at + 1);
        let mut meanwhile =
            behind.take_while(|((_, defs), wanted)| **wanted & own != 0 && defs & own == 0);
        self.wanted[at] & register == 0
            && !meanwhile.any(|((uses, defs), _)| (uses | defs) & register != 0)
    }

    /// The longer ago a register was touched, the better it is.
    fn score_register(&self, at: usize, register: u32) -> usize {
        let mut before = self.touched[..at].iter().rev().take(RENAME_HORIZON);
        let since = before
            .position(|(uses, defs)| (uses | defs) & register != 0)
            .unwrap_or(RENAME_HORIZON);
        since.saturating_sub(if register < 1 << 8 { 0 } else { self.high_cost })
    }
}
