//! Translation of operators without regions, for keys in lanes: an arm for each.

use super::arithmetic::as_lane;
use super::{Lane, Lanes};
use crate::saturate;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::{FuncInstBuilder, FunctionBuilder};
use whippen_kernel::{Inst, Op, Type, Value as KernelValue};

impl Lanes<'_> {
    /// Translates an operator without regions.
    pub(super) fn operator(&mut self, inst: &Inst) {
        let [a, b, c] =
            std::array::from_fn(|at| inst.args.get(at).copied().unwrap_or(KernelValue(0)));
        let lane = match inst.op {
            Op::Const(value) => Lane::Known(self.t.ty(inst.results[0]), value),
            Op::Add | Op::AddWrap => self.both(a, b, |ins, a, b| ins.iadd(a, b)),
            Op::Sub | Op::SubWrap => self.both(a, b, |ins, a, b| ins.isub(a, b)),
            Op::Mul | Op::MulWrap => self.both(a, b, |ins, a, b| ins.imul(a, b)),
            Op::Min => self.both(a, b, |ins, a, b| ins.smin(a, b)),
            Op::Max => self.both(a, b, |ins, a, b| ins.smax(a, b)),
            Op::And => self.both(a, b, |ins, a, b| ins.band(a, b)),
            Op::Or => self.both(a, b, |ins, a, b| ins.bor(a, b)),
            Op::Not => {
                let mask = self.mask(a);
                Lane::Mask(self.ins().bnot(mask))
            }
            Op::MulWide => self.product(a, b, None),
            Op::MacWide => self.product(b, c, Some(a)),
            Op::MulTop => Lane::Word(self.top_words(a, b)),
            Op::MacTop => {
                let (sum, top) = (self.word(a), self.top_words(b, c));
                Lane::Word(self.ins().iadd(sum, top))
            }
            Op::AddSat => self.saturated(a, b, saturate::add),
            Op::SubSat => self.saturated(a, b, saturate::sub),
            Op::Shl(n) | Op::ShlWrap(n) => {
                self.each_vector(a, |ins, a| ins.ishl_imm_s(a, i64::from(n)))
            }
            Op::Sar(n) if self.t.ty(a) == Type::I64 => Lane::Shifted(n, self.wide(a)),
            Op::Sar(n) => self.each_vector(a, |ins, a| ins.sshr_imm_s(a, i64::from(n))),
            Op::SarRound(n) => self.sar_round(n, a),
            Op::DivRound(n) => self.div_round(n, a, b),
            Op::Quot(n) => self.quot(n, a, b),
            Op::Sqrt => self.sqrt(a),
            Op::Assume(..) => self.lane(a),
            Op::Widen => {
                let word = self.word(a);
                Lane::Wide(self.widened(word))
            }
            Op::Narrow | Op::Low => Lane::Word(self.narrowed(a)),
            Op::Eq => Lane::Mask(self.compared(IntCC::Equal, a, b)),
            Op::Lt => Lane::Mask(self.compared(IntCC::SignedLessThan, a, b)),
            Op::Le => Lane::Mask(self.compared(IntCC::SignedLessThanOrEqual, a, b)),
            Op::Select => {
                let mask = self.mask(a);
                self.chosen(mask, b, c)
            }
            Op::In(port) => self.input(port),
            Op::Live(live) => self.live(live),
            Op::Tick(later) => self.tick(later),
            Op::Keyed(keyed) => self.keyed(keyed),
            Op::Get(cell) => self.get(cell),
            Op::GetAt(cell) => self.get_at(cell, a),
            Op::Delay(line, ticks) => self.delay(line, ticks),
            Op::DelayAt(line) => self.delay_at(line, a),
            Op::Lookup(table, column) => self.lookup(table, column, a),
            Op::Out(port) => return self.output(port, a),
            Op::Set(cell) => return self.set(cell, a),
            Op::SetAt(cell) => return self.set_at(cell, a, b),
            Op::Wave(e, v) => return self.wave(inst, [e, v]),
            Op::Push(line) => return self.push(line, a),
            Op::Emit(event) => return self.emit(event, &inst.args),
            Op::Probe(probe) => return self.probe(probe, a),
            // A line is filled in `init` only.
            Op::Fill(_) | Op::If | Op::Loop(_) => return,
        };
        self.set_lane(inst.results[0], lane);
    }

    /// An operator that vectors have, whatever the width of their lanes.
    fn both(
        &mut self,
        a: KernelValue,
        b: KernelValue,
        op: impl Fn(FuncInstBuilder, Value, Value) -> Value,
    ) -> Lane {
        match self.t.ty(a) {
            Type::I64 => {
                let (a, b) = (self.wide(a), self.wide(b));
                Lane::Wide([0, 1].map(|half| op(self.ins(), a[half], b[half])))
            }
            ty => {
                let (a, b) = (self.word_or_mask(a), self.word_or_mask(b));
                as_lane(ty, op(self.ins(), a, b))
            }
        }
    }

    fn saturated(
        &mut self,
        a: KernelValue,
        b: KernelValue,
        op: fn(&mut FunctionBuilder, Value, Value) -> Value,
    ) -> Lane {
        let (a, b) = (self.word(a), self.word(b));
        Lane::Word(op(&mut self.t.f, a, b))
    }

    fn each_vector(
        &mut self,
        a: KernelValue,
        op: impl Fn(FuncInstBuilder, Value) -> Value,
    ) -> Lane {
        match self.t.ty(a) {
            Type::I64 => Lane::Wide(self.wide(a).map(|half| op(self.ins(), half))),
            ty => {
                let a = self.word_or_mask(a);
                as_lane(ty, op(self.ins(), a))
            }
        }
    }
}
