//! The walk over a region that every translator of Kernels makes: instructions in order, each by
//! its shape.
//!
//! Not here: what becomes of them. A translator says that for the three shapes there are.

use super::{Inst, Op, Region};

/// What a translator makes of each instruction of a region.
pub trait Walk {
    /// An `if`.
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region);

    /// A `loop`.
    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region);

    /// An instruction without regions.
    fn plain(&mut self, inst: &Inst);

    /// An instruction, by its shape.
    fn inst(&mut self, inst: &Inst) {
        match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => self.if_else(inst, then, other),
            (Op::Loop(rounds), [body]) => self.repeat(inst, rounds, body),
            _ => self.plain(inst),
        }
    }

    /// All instructions of a region, in order.
    fn region(&mut self, region: &Region) {
        region.insts.iter().for_each(|inst| self.inst(inst));
    }
}
