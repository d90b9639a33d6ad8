//! Deferred selection, which folds a value into its only user, and rematerialization, which
//! computes it anew in each block that uses it.

use super::{Binding, DEFER_DEPTH_MAX, Select};
use crate::thumb::minst::VReg;
use whippen_kernel::{Inst, Op, Value};

impl Select<'_> {
    /// Whether a shift of what is loaded again is done again, too.
    pub(super) fn repeats_shift_of_load(&self, inst: &Inst, result: Value) -> bool {
        let is_again = matches!(
            self.bindings[inst.args[0].0 as usize],
            Binding::Rematerialize(..)
        );
        is_again && !self.can_fold_into_user(inst.op, result) && self.may_defer(&inst.args)
    }

    /// Whether a shift becomes a part of every sum that uses it, so that it costs nothing there.
    pub(super) fn folds_into_every_user(&self, inst: &Inst, result: Value) -> bool {
        let is_there = matches!(
            self.bindings[inst.args[0].0 as usize],
            Binding::Word(_) | Binding::Rematerialize(..)
        );
        let (used, summed) = (
            self.use_count[result.0 as usize],
            self.sum_uses[result.0 as usize],
        );
        is_there && used > 1 && used == summed && self.may_defer(&inst.args)
    }

    /// What waits for its user, or a shift that is done in each.
    pub(super) fn foldable(&self, value: Value) -> Option<(Op, [Value; 2])> {
        match self.bindings[value.0 as usize] {
            Binding::Rematerialize(op @ (Op::Shl(_) | Op::Sar(_)), arg) => Some((op, [arg; 2])),
            _ => self.deferred(value),
        }
    }

    /// Whether a value of these may wait for its user: not behind too many others that do, because
    /// going there needs stack.
    pub(super) fn may_defer(&self, args: &[Value]) -> bool {
        args.iter()
            .all(|arg| self.defer_depth[arg.0 as usize] < DEFER_DEPTH_MAX)
    }

    /// The register of what each block computes for itself.
    pub(super) fn rematerialize(&mut self, value: Value, op: Op, arg: Value) -> VReg {
        if let Some((block, reg)) = self.rematerialized[value.0 as usize]
            && self.is_near(block)
        {
            return reg;
        }
        let reg = match op {
            Op::Shl(_) | Op::Sar(_) => self.select_i32(op, &[arg]),
            _ => match self.select_read(op, &[]) {
                Binding::Word(reg) => reg,
                _ => self.load_constant(0),
            },
        };
        self.rematerialized[value.0 as usize] = Some((self.at, reg));
        reg
    }

    /// Whether every way here comes from that block over few decisions.
    pub(super) fn is_near(&mut self, block: usize) -> bool {
        let mut at = self.at;
        // Each decision is a block, and one that leads from it.
        for _ in 0..2 * self.remat_reach {
            match self.only_predecessor(at) {
                Some(above) if at != block => at = above,
                _ => break,
            }
        }
        at == block
    }

    /// The only block that leads to one that code is put into, or was.
    pub(super) fn only_predecessor(&mut self, at: usize) -> Option<usize> {
        let blocks = &self.func.blocks;
        *self.predecessors.entry(at).or_insert_with(|| {
            let mut ways =
                (0..blocks.len()).filter(|from| blocks[*from].end.targets().contains(&at));
            ways.next().filter(|_| ways.next().is_none())
        })
    }

    /// Whether an operator may become a part of what uses its result.
    pub(super) fn can_fold_into_user(&self, op: Op, result: Value) -> bool {
        let part = matches!(
            op,
            Op::Shl(_)
                | Op::Sar(_)
                | Op::SarRound(_)
                | Op::Mul
                | Op::MulTop
                | Op::MulWide
                | Op::Min
                | Op::Max
        );
        part && self.use_count[result.0 as usize] == 1
    }
}
