//! Bit fields, extension, bits and saturation in place: `exec::bits`.

use super::emitter::{At, Emitter};
use crate::cpu::Cpu;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I16, I32, I64};
use cranelift_codegen::ir::{InstBuilder, Value};
use std::mem::offset_of;
use whippen_isa::{Op as I, ShiftType};

impl Emitter<'_, '_> {
    /// Whether it was one of these, and is emitted.
    pub fn bits(&mut self, at: &At) -> bool {
        let Some(value) = self.bits_value(at) else {
            return false;
        };
        self.set_register(at.op.d, value);
        true
    }

    fn bits_value(&mut self, at: &At) -> Option<Value> {
        let op = at.op;
        let n = |e: &mut Self| e.register(op, op.n);
        let m = |e: &mut Self| e.register(op, op.m);
        Some(match at.inst.op() {
            I::MOVT | I::BFC | I::BFI => self.inserted(at),
            I::SBFX | I::UBFX => {
                let value = n(self);
                let above = (32 - op.imm - u32::from(op.amount)) & 31;
                let value = self.f.ins().ishl_imm_u(value, i64::from(above));
                let by = i64::from((32 - op.imm) & 31);
                match at.inst.op() {
                    I::SBFX => self.f.ins().sshr_imm_u(value, by),
                    _ => self.f.ins().ushr_imm_u(value, by),
                }
            }
            I::CLZ => {
                let value = m(self);
                self.f.ins().clz(value)
            }
            I::RBIT => {
                let value = m(self);
                self.f.ins().bitrev(value)
            }
            I::REV => {
                let value = m(self);
                self.f.ins().bswap(value)
            }
            I::SXTB | I::SXTH | I::UXTB | I::UXTH => self.extended(at),
            I::SXTAB | I::SXTAH | I::UXTAB | I::UXTAH => {
                let (x, y) = (n(self), self.extended(at));
                self.f.ins().iadd(x, y)
            }
            I::SSAT | I::USAT => self.saturated(at),
            I::PKHBT | I::PKHTB => {
                let (x, y) = (n(self), m(self));
                let (y, _) = self.shift(y, op.shift, u32::from(op.amount));
                let (low, high) = match at.inst.op() {
                    I::PKHBT => (x, y),
                    _ => (y, x),
                };
                let low = self.f.ins().band_imm_u(low, 0xffff);
                let high = self.f.ins().band_imm_u(high, 0xffff_0000);
                self.f.ins().bor(low, high)
            }
            _ => return None,
        })
    }

    /// Rd with some of its bits replaced.
    fn inserted(&mut self, at: &At) -> Value {
        let op = at.op;
        match at.inst.op() {
            I::MOVT => {
                let low = self.register(op, op.d);
                let low = self.f.ins().band_imm_u(low, 0xffff);
                self.f.ins().bor_imm_u(low, i64::from(op.imm << 16))
            }
            I::BFC => {
                let value = self.register(op, op.d);
                self.f.ins().band_imm_u(value, i64::from(!field(at)))
            }
            _ => {
                let (value, put) = (self.register(op, op.d), self.register(op, op.n));
                let value = self.f.ins().band_imm_u(value, i64::from(!field(at)));
                let put = self.f.ins().ishl_imm_u(put, i64::from(op.amount));
                let put = self.f.ins().band_imm_u(put, i64::from(field(at)));
                self.f.ins().bor(value, put)
            }
        }
    }

    /// Rm rotated and extended.
    fn extended(&mut self, at: &At) -> Value {
        let value = self.register(at.op, at.op.m);
        let value = match at.op.amount {
            0 => value,
            amount => self.f.ins().rotr_imm_u(value, i64::from(amount)),
        };
        match at.inst.op() {
            I::SXTB | I::SXTAB => {
                let byte = self.f.ins().ireduce(I8, value);
                self.f.ins().sextend(I32, byte)
            }
            I::SXTH | I::SXTAH => {
                let half = self.f.ins().ireduce(I16, value);
                self.f.ins().sextend(I32, half)
            }
            I::UXTB | I::UXTAB => self.f.ins().band_imm_u(value, 0xff),
            _ => self.f.ins().band_imm_u(value, 0xffff),
        }
    }

    /// Rn shifted and saturated; Q where it was.
    fn saturated(&mut self, at: &At) -> Value {
        let op = at.op;
        let value = self.register(op, op.n);
        // The shift of SSAT and USAT has no carry in.
        let shift = match op.shift {
            ShiftType::RRX => ShiftType::LSL,
            shift => shift,
        };
        let (value, _) = self.shift(value, shift, u32::from(op.amount));
        let (low, high) = match at.inst.op() {
            I::SSAT => {
                let top = (1_i64 << (op.imm - 1)) - 1;
                (-top - 1, top)
            }
            _ => (0, (1_i64 << op.imm) - 1),
        };
        let wide = self.f.ins().sextend(I64, value);
        let least = self.f.ins().iconst(I64, low);
        let most = self.f.ins().iconst(I64, high);
        let clamped = self.f.ins().smax(wide, least);
        let clamped = self.f.ins().smin(clamped, most);
        self.saturates(clamped, wide);
        self.f.ins().ireduce(I32, clamped)
    }

    /// Sets Q where two values differ.
    pub fn saturates(&mut self, one: Value, other: Value) {
        let differs = self.f.ins().icmp(IntCC::NotEqual, one, other);
        let q = self.field(I8, offset_of!(Cpu, q));
        let q = self.f.ins().bor(q, differs);
        self.set_field(offset_of!(Cpu, q), q);
    }
}

/// The bits of a field, as `exec::bits` has them.
fn field(at: &At) -> u32 {
    (u32::MAX >> ((32 - at.op.imm) & 31)) << at.op.amount
}
