//! Values that wait for their user, and those that are computed anew wherever they are used.

use super::{Bound, LATE, Select};
use crate::thumb::minst::VReg;
use whippen_kernel::{Inst, Op, Value};

impl Select<'_> {
    /// Whether a shift of what is loaded again is done again, too.
    pub(super) fn repeats(&self, inst: &Inst, result: Value) -> bool {
        let is_again = matches!(self.bound[inst.args[0].0 as usize], Bound::Again(..));
        is_again && !self.waits(inst.op, result) && self.may_wait(&inst.args)
    }

    /// Whether a shift becomes a part of every sum that uses it, so that it costs nothing there.
    pub(super) fn is_part_of_all(&self, inst: &Inst, result: Value) -> bool {
        let is_there = matches!(
            self.bound[inst.args[0].0 as usize],
            Bound::One(_) | Bound::Again(..)
        );
        let (used, summed) = (self.used[result.0 as usize], self.summed[result.0 as usize]);
        is_there && used > 1 && used == summed && self.may_wait(&inst.args)
    }

    /// What waits for its user, or a shift that is done in each.
    pub(super) fn part(&self, value: Value) -> Option<(Op, [Value; 2])> {
        match self.bound[value.0 as usize] {
            Bound::Again(op @ (Op::Shl(_) | Op::Sar(_)), arg) => Some((op, [arg; 2])),
            _ => self.later(value),
        }
    }

    /// Whether a value of these may wait for its user: not behind too many others that do, because
    /// going there needs stack.
    pub(super) fn may_wait(&self, args: &[Value]) -> bool {
        args.iter().all(|arg| self.late[arg.0 as usize] < LATE)
    }

    /// The register of what each block computes for itself.
    pub(super) fn once_more(&mut self, value: Value, op: Op, arg: Value) -> VReg {
        if let Some((block, reg)) = self.done[value.0 as usize]
            && self.is_near(block)
        {
            return reg;
        }
        let reg = match op {
            Op::Shl(_) | Op::Sar(_) => self.word(op, &[arg]),
            _ => match self.read(op, &[]) {
                Bound::One(reg) => reg,
                _ => self.load_constant(0),
            },
        };
        self.done[value.0 as usize] = Some((self.at, reg));
        reg
    }

    /// Whether every way here comes from that block over few decisions.
    pub(super) fn is_near(&mut self, block: usize) -> bool {
        let mut at = self.at;
        // Each decision is a block, and one that leads from it.
        for _ in 0..2 * self.near {
            match self.above(at) {
                Some(above) if at != block => at = above,
                _ => break,
            }
        }
        at == block
    }

    /// The only block that leads to one that code is put into, or was.
    pub(super) fn above(&mut self, at: usize) -> Option<usize> {
        let blocks = &self.func.blocks;
        *self.above.entry(at).or_insert_with(|| {
            let mut ways =
                (0..blocks.len()).filter(|from| blocks[*from].end.targets().contains(&at));
            ways.next().filter(|_| ways.next().is_none())
        })
    }

    /// Whether an operator may become a part of what uses its result.
    pub(super) fn waits(&self, op: Op, result: Value) -> bool {
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
        part && self.used[result.0 as usize] == 1
    }
}
