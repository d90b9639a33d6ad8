//! Translation of operators without regions, for one key: an arm for each.

use super::Translator;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_kernel::{Inst, Op};

impl Translator<'_> {
    /// Translates an operator without regions.
    pub(super) fn operator(&mut self, inst: &Inst) {
        let [a, b, c] = std::array::from_fn(|at| {
            inst.args
                .get(at)
                .map_or(Value::from_u32(0), |arg| self.value(*arg))
        });
        let result = match inst.op {
            Op::Const(value) => self.constant(self.ty(inst.results[0]), value),
            Op::Add => self.f.ins().iadd(a, b),
            Op::Sub => self.f.ins().isub(a, b),
            Op::Mul | Op::MulWide => self.f.ins().imul(a, b),
            Op::MacWide => self.multiply_add(a, b, c),
            Op::MulTop => self.top_word(a, b),
            Op::MacTop => self.add_top_word(a, b, c),
            Op::Min => self.f.ins().smin(a, b),
            Op::Max => self.f.ins().smax(a, b),
            Op::Shl(n) => self.f.ins().ishl_imm_s(a, i64::from(n)),
            Op::Sar(n) => self.f.ins().sshr_imm_s(a, i64::from(n)),
            Op::SarRound(n) => self.sar_round(n, a, self.range(inst.args[0])),
            Op::DivRound(n) => self.div_round(n, a, b, self.range(inst.args[1])),
            Op::Quot(n) => self.quot(n, a, b),
            Op::Sqrt => self.sqrt(a),
            Op::Widen | Op::Narrow | Op::Assume(..) => a,
            Op::Low => self.low_word(a),
            Op::AddWrap => self.wrapped(|ins| ins.iadd(a, b)),
            Op::SubWrap => self.wrapped(|ins| ins.isub(a, b)),
            Op::MulWrap => self.wrapped(|ins| ins.imul(a, b)),
            Op::AddSat => self.held(|ins| ins.iadd(a, b)),
            Op::SubSat => self.held(|ins| ins.isub(a, b)),
            Op::ShlWrap(n) => self.wrapped(|ins| ins.ishl_imm_s(a, i64::from(n))),
            Op::Eq => self.f.ins().icmp(IntCC::Equal, a, b),
            Op::Lt => self.f.ins().icmp(IntCC::SignedLessThan, a, b),
            Op::Le => self.f.ins().icmp(IntCC::SignedLessThanOrEqual, a, b),
            Op::And => self.f.ins().band(a, b),
            Op::Or => self.f.ins().bor(a, b),
            Op::Not => self.f.ins().icmp_imm_s(IntCC::Equal, a, 0),
            Op::Select => self.f.ins().select(a, b, c),
            Op::In(port) => self.input(port),
            Op::Live(live) => self.live(live),
            Op::Tick(later) => self.tick(later),
            Op::Keyed(keyed) => self.keyed(keyed),
            Op::Get(cell) => self.get(cell, None),
            Op::GetAt(cell) => self.get(cell, Some(a)),
            Op::Delay(line, ticks) => self.delay(line, ticks),
            Op::DelayAt(line) => self.delay_at(line, a),
            Op::Lookup(table, column) => self.lookup(table, column, a),
            Op::Out(port) => return self.output(port, a),
            Op::Set(cell) => return self.set(cell, None, a),
            Op::SetAt(cell) => return self.set(cell, Some(a), b),
            Op::Wave(e, v) => return self.wave(inst, [e, v]),
            Op::Push(line) => return self.push(line, a),
            Op::Fill(line) => return self.fill(line, a),
            Op::Emit(event) => return self.emit(event, &inst.args),
            Op::Probe(probe) => return self.probe(probe, a),
            Op::If | Op::Loop(_) => return,
        };
        self.values[inst.results[0]] = result;
    }
    /// Accumulator plus the top word of a product.
    fn add_top_word(&mut self, a: Value, b: Value, c: Value) -> Value {
        let top = self.top_word(b, c);
        self.f.ins().iadd(a, top)
    }
}
