//! Control flow for sixteen keys: if-conversion where an arm is cheap, else a branch around it
//! where no lane wants it.
//!
//! ```text
//!   if c { then } else { other }      results = what `other` yields, where that is cheap
//!                                     [any lane c?] -> then; results of the lanes that want it
//! ```

use super::encoder::{Mask, MaskOp, Operand, Zmm, forms, opcodes};
use super::registers::{Bank, Node};
use super::{Groups, TAIL, Writer};
use crate::lanes::{CHEAP, cost};
use whippen_kernel::{Inst, Region, Walk};

impl Walk for Writer<'_> {
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        self.r.step();
        let condition = self.node(inst.args[0]);
        let results: Vec<Node> = inst.results.iter().map(|value| self.node(*value)).collect();
        self.r.step();
        if cost(other) <= CHEAP {
            self.region(other);
            self.r.step();
            for (result, value) in results.iter().zip(&other.yields) {
                self.copied(*result, self.node(*value));
                self.r.release();
            }
            self.r.settle();
        } else {
            for result in &results {
                self.nothing(*result);
            }
            let not = self.wanted(condition, MaskOp::AndNot);
            self.arm(other, not, &results);
        }
        self.r.step();
        let wanted = self.wanted(condition, MaskOp::And);
        self.arm(then, wanted, &results);
    }

    fn repeat(&mut self, _: &Inst, _: u32, _: &Region) {
        // `supports` says that there is none.
        self.r.has_failed = true;
    }

    fn plain(&mut self, inst: &Inst) {
        self.r.step();
        self.operator(inst);
        self.r.settle();
    }
}

impl Writer<'_> {
    /// The lanes that want an arm, among those that want what is around it: where the condition
    /// holds, or where it does not.
    fn wanted(&mut self, condition: Node, op: MaskOp) -> Node {
        let node = self.r.held(Bank::Masks);
        let condition = self.r.mask(condition);
        let around = match (self.wanted, self.groups) {
            (Some(outer), _) => Some(self.r.mask(outer)),
            (None, Groups::Part) => Some(TAIL),
            (None, Groups::Whole) => None,
        };
        let to = self.r.define(node);
        let (op, second) = match (around, op) {
            (Some(around), op) => (op, around),
            (None, MaskOp::AndNot) => (MaskOp::Not, condition),
            (None, _) => (MaskOp::And, condition),
        };
        self.r.e.mask(op, to, condition, Operand::Mask(second));
        self.r.settle();
        node
    }

    /// Computes an arm where a lane wants it, and gives these lanes its results.
    fn arm(&mut self, region: &Region, wanted: Node, results: &[Node]) {
        let outer = self.wanted.replace(wanted);
        if cost(region) <= CHEAP {
            self.taken(region, wanted, results);
        } else {
            let Mask(any) = self.r.mask(wanted);
            let test = Operand::Mask(Mask(any));
            self.r.e.mask(MaskOp::Test, any, Mask(0), test);
            self.r.release();
            let skip = self.r.e.jump(opcodes::JZ);
            let snapshot = self.r.snapshot();
            self.taken(region, wanted, results);
            self.r.restore(snapshot);
            let after = self.r.e.bytes.len();
            self.r.e.land(skip, after);
        }
        self.wanted = outer;
        self.r.let_go(wanted);
    }

    fn taken(&mut self, region: &Region, wanted: Node, results: &[Node]) {
        self.region(region);
        self.r.step();
        for (result, value) in results.iter().zip(&region.yields) {
            self.blended(wanted, *result, self.node(*value));
            self.r.release();
        }
        self.r.settle();
    }

    /// A node of its own that is the same.
    fn copied(&mut self, to: Node, from: Node) {
        match self.r.facts[to].bank {
            Bank::Masks => {
                let from = self.r.mask(from);
                let to = self.r.define(to);
                self.r.e.mask(MaskOp::Move, to, from, Operand::Mask(from));
            }
            Bank::Words => {
                let from = Operand::Zmm(self.r.word(from));
                let to = Zmm(self.r.define(to));
                self.r.e.vector_of(forms::MOVDQA32, to, from);
            }
        }
    }

    /// What no lane reads, as 0.
    fn nothing(&mut self, node: Node) {
        let to = self.r.define(node);
        match self.r.facts[node].bank {
            Bank::Masks => {
                let same = Mask(to);
                self.r.e.mask(MaskOp::Differ, to, same, Operand::Mask(same));
            }
            Bank::Words => {
                let same = Zmm(to);
                self.r
                    .e
                    .vector(forms::PXORD, same, same, Operand::Zmm(same));
            }
        }
        self.r.settle();
    }

    /// Lanes that want an arm take its result.
    fn blended(&mut self, wanted: Node, result: Node, value: Node) {
        let wanted = self.r.mask(wanted);
        match self.r.facts[result].bank {
            Bank::Words => {
                let (to, value) = (self.r.word(result), self.r.word(value));
                let value = Operand::Zmm(value);
                self.r
                    .e
                    .masked(forms::MOVDQA32, to.0, 0, value, (wanted, true));
            }
            Bank::Masks => {
                let (to, value) = (self.r.mask(result), self.r.mask(value));
                let own = Mask(self.r.temporary(Bank::Masks));
                let e = &mut self.r.e;
                e.mask(MaskOp::And, own.0, wanted, Operand::Mask(value));
                e.mask(MaskOp::AndNot, to.0, wanted, Operand::Mask(to));
                e.mask(MaskOp::Or, to.0, to, Operand::Mask(own));
            }
        }
        self.r.changed(result);
    }
}
