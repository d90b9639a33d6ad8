//! Deferred selection: values that take no instruction where they stand, because their users fold
//! them or compute them.

use super::shift::operand_shift;
use super::{Binding, Select};
use whippen_kernel::{Inst, Op, Range, Type, Value};
use whippen_target_info::{Selected, row};

/// How many values may be deferred one to the other.
const DEFER_DEPTH_MAX: u8 = 32;

impl Select<'_> {
    /// The binding of a value that takes no instruction where it stands: it is constant, or emitted
    /// where the target's table says and this value allows.
    pub(super) fn bind_without_code(&mut self, inst: &Inst, result: Value) -> Option<Binding> {
        let Range { low, high } = self.info(result).range;
        if low == high && inst.op.row().effect.is_pure() {
            return Some(Binding::Const(low));
        }
        if self.plan[result].index.is_some() {
            // Accesses take what it is the sum of.
            return Some(Binding::Unbound);
        }
        match row(inst.op).selected {
            Selected::InPlace | Selected::AtDecisions => None,
            Selected::AtOnlyUser => self.bind_at_users(inst, result),
            Selected::AtStore => self.bind_at_store(inst, result),
            Selected::WithOperand => self.bind_as_operand(inst, result),
            Selected::Reload => self.plan[result]
                .may_reload
                .then_some(Binding::Rematerialize(inst.op, result)),
        }
    }

    /// What waits for its only user; a shift may be done in each of several.
    fn bind_at_users(&self, inst: &Inst, result: Value) -> Option<Binding> {
        let is_shift = operand_shift(inst.op).is_some();
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
        let operand = self.binding(inst.args[0]);
        let is_whole = self.info(inst.args[0]).ty == self.info(result).ty;
        let has_one_use = self.plan[result].uses == 1;
        let may_wait = has_one_use || !matches!(operand, Binding::Deferred(..));
        (is_whole && may_wait).then_some(operand)
    }

    /// Behind how many deferred values, one made of the other, a value comes.
    pub(super) fn depth_of(&self, inst: &Inst, result: Value) -> u8 {
        let waits = matches!(
            self.binding(result),
            Binding::Deferred(..) | Binding::Comparison(..) | Binding::Rematerialize(..)
        );
        let depths = inst.args.iter().map(|arg| self.state[arg].defer_depth);
        let deepest = depths.max().unwrap_or(0);
        if waits { deepest.saturating_add(1) } else { 0 }
    }

    /// Whether a shift of what is loaded again is done again, too.
    fn repeats_shift_of_load(&self, inst: &Inst, result: Value) -> bool {
        let is_again = matches!(self.binding(inst.args[0]), Binding::Rematerialize(..));
        is_again && !self.can_fold_into_user(inst.op, result) && self.may_defer(&inst.args)
    }

    /// Whether a shift becomes a part of every sum that uses it, so that it costs nothing there.
    fn folds_into_every_user(&self, inst: &Inst, result: Value) -> bool {
        let is_there = matches!(
            self.binding(inst.args[0]),
            Binding::Word(_) | Binding::Rematerialize(..)
        );
        let plan = &self.plan[result];
        let is_summed = plan.uses > 1 && plan.uses == plan.sum_uses;
        is_there && is_summed && self.may_defer(&inst.args)
    }

    /// What waits for its user, or a shift that is done in each.
    pub(super) fn foldable(&self, value: Value) -> Option<(Op, [Value; 2])> {
        match self.binding(value) {
            Binding::Rematerialize(op, arg) if operand_shift(op).is_some() => Some((op, [arg; 2])),
            _ => self.deferred(value),
        }
    }

    /// Whether a value of these may wait for its user: not behind too many others that do, because
    /// going there needs stack.
    fn may_defer(&self, args: &[Value]) -> bool {
        args.iter()
            .all(|arg| self.state[arg].defer_depth < DEFER_DEPTH_MAX)
    }

    /// Whether an operator may become a part of what uses its result.
    fn can_fold_into_user(&self, op: Op, result: Value) -> bool {
        row(op).selected == Selected::AtOnlyUser && self.plan[result].uses == 1
    }
}
