//! Deferred selection, which folds a value into its only user, and rematerialization, which
//! computes it anew in each block that uses it.

use super::{Binding, DEFER_DEPTH_MAX, Select};
use crate::thumb::minst::VReg;
use whippen_kernel::{Inst, Op, Range, Type, Value};
use whippen_target_info::{Selected, row};

impl Select<'_> {
    /// The binding of a value that takes no instruction where it stands: it is constant, or emitted
    /// where the target's table says and this value allows.
    pub(super) fn bind_without_code(&mut self, inst: &Inst, result: Value) -> Option<Binding> {
        let Range { low, high } = self.info(result).range;
        if low == high && inst.op.row().effect.is_pure() {
            return Some(Binding::Const(low));
        }
        match row(inst.op).selected {
            Selected::InPlace | Selected::AtDecisions => None,
            Selected::AtOnlyUser => self.bind_at_users(inst, result),
            Selected::AtStore => self.defers_to_store(inst).then_some(Binding::Unbound),
            Selected::WithOperand => self.bind_as_operand(inst, result),
            Selected::Reload => self.rematerializable[result.0 as usize]
                .then_some(Binding::Rematerialize(inst.op, result)),
        }
    }

    /// What waits for its only user; a shift may be done in each of several.
    fn bind_at_users(&self, inst: &Inst, result: Value) -> Option<Binding> {
        let is_shift = matches!(inst.op, Op::Shl(_) | Op::Sar(_));
        if is_shift
            && self.info(result).ty == Type::I32
            && (self.repeats_shift_of_load(inst, result)
                || self.folds_into_every_user(inst, result))
        {
            return Some(Binding::Rematerialize(inst.op, inst.args[0]));
        }
        let args = [inst.args[0], *inst.args.get(1).unwrap_or(&inst.args[0])];
        let waits = self.can_fold_into_user(inst.op, result) && self.may_defer(&inst.args);
        waits.then_some(Binding::Deferred(inst.op, args))
    }

    /// Another name for the operand. What waits for one user is computed where a second name
    /// stands: several users may stand in blocks that do not meet.
    fn bind_as_operand(&self, inst: &Inst, result: Value) -> Option<Binding> {
        let operand = self.bindings[inst.args[0].0 as usize];
        let is_whole = self.info(inst.args[0]).ty == self.info(result).ty;
        let has_one_use = self.use_count[result.0 as usize] == 1;
        let may_wait = has_one_use || !matches!(operand, Binding::Deferred(..));
        (is_whole && may_wait).then_some(operand)
    }

    /// Behind how many deferred values, one made of the other, a value comes.
    pub(super) fn depth_of(&self, inst: &Inst, result: Value) -> u8 {
        let waits = matches!(
            self.bindings[result.0 as usize],
            Binding::Deferred(..) | Binding::Comparison(..) | Binding::Rematerialize(..)
        );
        let depths = inst.args.iter().map(|arg| self.defer_depth[arg.0 as usize]);
        let deepest = depths.max().unwrap_or(0);
        if waits { deepest.saturating_add(1) } else { 0 }
    }

    /// Whether a shift of what is loaded again is done again, too.
    fn repeats_shift_of_load(&self, inst: &Inst, result: Value) -> bool {
        let is_again = matches!(
            self.bindings[inst.args[0].0 as usize],
            Binding::Rematerialize(..)
        );
        is_again && !self.can_fold_into_user(inst.op, result) && self.may_defer(&inst.args)
    }

    /// Whether a shift becomes a part of every sum that uses it, so that it costs nothing there.
    fn folds_into_every_user(&self, inst: &Inst, result: Value) -> bool {
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
    fn may_defer(&self, args: &[Value]) -> bool {
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
        self.select_operator(op, &[arg], Some(value));
        let reg = self.reg(value);
        self.bind(value, Binding::Rematerialize(op, arg));
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
    fn can_fold_into_user(&self, op: Op, result: Value) -> bool {
        row(op).selected == Selected::AtOnlyUser && self.use_count[result.0 as usize] == 1
    }
}
