//! Branches in place: `exec::branch`.

use super::emitter::{At, Emitter};
use crate::cpu::Cpu;
use crate::op::Flow;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value};
use std::mem::offset_of;
use whippen_isa::Op as I;

impl Emitter<'_> {
    /// Whether it was one of these, and is emitted.
    pub fn branch(&mut self, at: &At) -> bool {
        let op = at.op;
        match at.inst.op() {
            I::B if at.inst.is_conditional() => {
                let Some(cond) = at.inst.cond else {
                    return false;
                };
                let holds = self.holds(cond);
                self.branch_if(at, holds);
            }
            I::B => self.branch_always(at),
            I::BL => {
                let link = self.constant(op.pc() | 1);
                self.set_register(14, link);
                self.branch_always(at);
            }
            I::CBZ | I::CBNZ => {
                let value = self.register(op, op.n);
                let cc = match at.inst.op() {
                    I::CBZ => IntCC::Equal,
                    _ => IntCC::NotEqual,
                };
                let taken = self.f.ins().icmp_imm_u(cc, value, 0);
                self.branch_if(at, taken);
            }
            I::BX | I::BXNS | I::BLX | I::BLXNS => self.exchange(at),
            _ => return false,
        }
        true
    }

    fn branch_if(&mut self, at: &At, taken: Value) {
        self.remember(taken);
        let (out, next) = (self.f.create_block(), self.f.create_block());
        self.f.ins().brif(taken, out, &[], next, &[]);
        self.begin(out);
        self.branch_always(at);
        self.goes_on = true;
        self.begin(next);
    }

    fn branch_always(&mut self, at: &At) {
        let pc = self.constant(at.op.imm & !1);
        self.set_field(offset_of!(Cpu, pc), pc);
        self.leave_with(Flow::Branch, at.index);
    }

    fn exchange(&mut self, at: &At) {
        let (before, slow) = (self.kept, self.f.create_block());
        let target = self.register(at.op, at.op.m);
        self.check_branch(target, slow);
        if matches!(at.inst.op(), I::BLX | I::BLXNS) {
            let link = self.constant(at.op.address.wrapping_add(2) | 1);
            self.set_register(14, link);
        }
        self.branch_to(at, target);
        self.or_interpret(at, slow, before);
    }
}
