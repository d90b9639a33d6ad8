//! Multiplication in place: `exec::multiply`.

use super::emitter::{At, Emitter};
use super::kept::{NEGATIVE, ZERO};
use cranelift_codegen::ir::types::{I32, I64};
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::Op as I;

impl Emitter<'_, '_> {
    /// Whether it was one of these, and is emitted.
    pub fn multiply(&mut self, at: &At) -> bool {
        self.multiply_word(at) || self.multiply_top(at) || self.multiply_long(at)
    }

    fn multiply_word(&mut self, at: &At) -> bool {
        let op = at.op;
        if !matches!(at.inst.op(), I::MUL | I::MLA | I::MLS) {
            return false;
        }
        let (n, m) = (self.register(op, op.n), self.register(op, op.m));
        let mut value = self.f.ins().imul(n, m);
        if at.inst.op() != I::MUL {
            let a = self.register(op, op.a);
            value = match at.inst.op() {
                I::MLA => self.f.ins().iadd(a, value),
                _ => self.f.ins().isub(a, value),
            };
        }
        self.set_register(op.d, value);
        if at.inst.s {
            self.set(NEGATIVE, value);
            self.set(ZERO, value);
            self.kept.compared = None;
        }
        true
    }

    /// The upper word of a product, with Ra in the upper word before, and rounding.
    fn multiply_top(&mut self, at: &At) -> bool {
        let op = at.op;
        if !matches!(at.inst.op(), I::SMMUL | I::SMMLA | I::SMMLS) {
            return false;
        }
        let mut value = self.product(at, true);
        if at.inst.op() != I::SMMUL {
            let a = self.register(op, op.a);
            let a = self.f.ins().uextend(I64, a);
            let a = self.f.ins().ishl_imm_u(a, 32);
            value = match at.inst.op() {
                I::SMMLA => self.f.ins().iadd(a, value),
                _ => self.f.ins().isub(a, value),
            };
        }
        if op.imm != 0 {
            let half = self.f.ins().iconst(I64, 1 << 31);
            value = self.f.ins().iadd(value, half);
        }
        let top = self.f.ins().ushr_imm_u(value, 32);
        let top = self.f.ins().ireduce(I32, top);
        self.set_register(op.d, top);
        true
    }

    fn multiply_long(&mut self, at: &At) -> bool {
        let op = at.op;
        let (signed, adds) = match at.inst.op() {
            I::SMULL => (true, false),
            I::UMULL => (false, false),
            I::SMLAL => (true, true),
            I::UMLAL => (false, true),
            _ => return false,
        };
        let mut value = self.product(at, signed);
        if adds {
            let (low, high) = (self.register(op, op.d), self.register(op, op.a));
            let (low, high) = (
                self.f.ins().uextend(I64, low),
                self.f.ins().uextend(I64, high),
            );
            let high = self.f.ins().ishl_imm_u(high, 32);
            let sum = self.f.ins().bor(high, low);
            value = self.f.ins().iadd(sum, value);
        }
        let low = self.f.ins().ireduce(I32, value);
        let high = self.f.ins().ushr_imm_u(value, 32);
        let high = self.f.ins().ireduce(I32, high);
        self.set_register(op.d, low);
        self.set_register(op.a, high);
        true
    }

    /// The whole product of Rn and Rm.
    fn product(&mut self, at: &At, signed: bool) -> Value {
        let mut wide = |number: u8| {
            let word = self.register(at.op, number);
            match signed {
                true => self.f.ins().sextend(I64, word),
                false => self.f.ins().uextend(I64, word),
            }
        };
        let (n, m) = (wide(at.op.n), wide(at.op.m));
        self.f.ins().imul(n, m)
    }
}
