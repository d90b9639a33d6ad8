//! Branches in place: `exec::branch`.

use super::emitter::{At, Emitter};
use super::leave::Target;
use super::memory::Span;
use crate::op::Flow;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::Op as I;

impl Emitter<'_, '_> {
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
            I::TBB | I::TBH => self.table(at),
            I::BX | I::BXNS | I::BLX | I::BLXNS => self.exchange(at),
            _ => return false,
        }
        true
    }

    fn branch_if(&mut self, at: &At, taken: Value) {
        let (out, next) = (self.f.create_block(), self.f.create_block());
        self.f.ins().brif(taken, out, &[], next, &[]);
        let kept = self.kept;
        self.begin(out);
        self.remember_known(true);
        self.branch_always(at);
        self.goes_on = true;
        self.kept = kept;
        self.begin(next);
        self.remember_known(false);
    }

    fn branch_always(&mut self, at: &At) {
        let target = Target::Known(at.op.imm & !1);
        self.leave_to(Flow::Branch, at.index, target);
    }

    fn table(&mut self, at: &At) {
        let (before, slow) = (self.kept, self.f.create_block());
        let (base, index) = (self.register(at.op, at.op.n), self.register(at.op, at.op.m));
        let bytes = if at.inst.op() == I::TBB { 1 } else { 2 };
        let offset = self.f.ins().ishl_imm_u(index, i64::from(bytes - 1));
        let span = Span {
            address: self.f.ins().iadd(base, offset),
            aligned: bytes,
            bytes,
            write: false,
        };
        let place = self.host(span, slow);
        let halfwords = self.part(place.host, bytes, false);
        self.note(at, span.address, 1, place);
        let offset = self.f.ins().ishl_imm_u(halfwords, 1);
        let target = self.f.ins().iadd_imm_u(offset, i64::from(at.op.pc()));
        self.branch_to(at, target);
        self.or_interpret(at, slow, before);
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
