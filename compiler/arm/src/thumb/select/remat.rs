//! Rematerialization: a value is computed anew, by one instruction, in each block that uses it.
//! Near the last one its result is still in a register.

use super::{Binding, Select};
use crate::thumb::func::BlockId;
use crate::thumb::minst::VReg;
use whippen_kernel::{Op, Value};

impl Select<'_> {
    /// The register of what each block computes for itself.
    pub(super) fn rematerialize(&mut self, value: Value, op: Op, arg: Value) -> VReg {
        let here = self.func.blocks[self.at].code.len();
        if let Some((block, from, reg)) = self.state[value].rematerialized
            && (block != self.at || here - from < self.remat_reach.instructions)
            && self.is_near(block)
        {
            return reg;
        }
        self.select_operator(op, &[arg], Some(value));
        let reg = self.reg(value);
        self.bind(value, Binding::Rematerialize(op, arg));
        self.state[value].rematerialized = Some((self.at, here, reg));
        reg
    }

    /// Whether every way here comes from that block over few decisions.
    pub(super) fn is_near(&mut self, block: BlockId) -> bool {
        let mut at = self.at;
        // Each decision is a block, and one that leads from it.
        for _ in 0..2 * self.remat_reach.decisions {
            match self.only_predecessor(at) {
                Some(above) if at != block => at = above,
                _ => break,
            }
        }
        at == block
    }

    /// The only block that leads to one that code is put into, or was.
    fn only_predecessor(&mut self, at: BlockId) -> Option<BlockId> {
        let blocks = &self.func.blocks;
        *self.predecessors.entry(at).or_insert_with(|| {
            let mut predecessors = blocks
                .ids()
                .filter(|from| blocks[from].end.targets().contains(&at));
            predecessors
                .next()
                .filter(|_| predecessors.next().is_none())
        })
    }
}
