//! Dispatch: which rule selects each operator of the Kernel.
//!
//! The one match over operators in selection, and it names all of them: a new operator does not
//! compile until it has its line here. It is asked wherever an operator is emitted, in place or at
//! a user, so that both ways end in the same rule.

use super::compare::Relation;
use super::{Binding, Select};
use crate::thumb::minst::VReg;
use whippen_isa::Op as Isa;
use whippen_kernel::{Op, Type, Value};

impl From<VReg> for Binding {
    fn from(word: VReg) -> Binding {
        Binding::Word(word)
    }
}

impl From<(VReg, VReg)> for Binding {
    fn from((low, high): (VReg, VReg)) -> Binding {
        Binding::Pair(low, high)
    }
}

impl Select<'_> {
    /// Emits what computes an operator, and binds its result.
    pub(super) fn select_operator(&mut self, op: Op, args: &[Value], result: Option<Value>) {
        let [a, b, c] = std::array::from_fn(|at| args.get(at).copied().unwrap_or(Value(0)));
        self.last_held = None;
        let is_wide = result.is_some_and(|result| self.info(result).ty == Type::I64);
        let bound = match (op, is_wide) {
            (Op::Const(k), _) => Binding::Const(k),
            (Op::Add | Op::AddWrap, false) => self.add_i32(a, b).into(),
            (Op::Add | Op::AddWrap, true) => self.add_i64(a, b).into(),
            (Op::Sub | Op::SubWrap, false) => self.sub_i32(a, b).into(),
            (Op::Sub | Op::SubWrap, true) => self.sub_i64(a, b).into(),
            (Op::Mul | Op::MulWrap, false) => self.mul_i32(a, b).into(),
            (Op::Mul | Op::MulWrap, true) => self.mul_i64(a, b).into(),
            (Op::MulWide, _) => self.mul_wide(a, b).into(),
            (Op::MacWide, _) => self.mac_wide(a, b, c).into(),
            (Op::MulTop, _) => self.mul_top(a, b).into(),
            (Op::MacTop, _) => self.mac_top(a, b, c).into(),
            (Op::Min | Op::Max, false) => self.min_max_i32(op, a, b).into(),
            (Op::Min | Op::Max, true) => self.min_max_i64(op, a, b).into(),
            (Op::AddSat, _) => self.saturating(Isa::QADD, [a, b]).into(),
            (Op::SubSat, _) => self.saturating(Isa::QSUB, [a, b]).into(),
            (Op::Shl(n) | Op::ShlWrap(n), false) => self.shift_i32(Isa::LSL_immediate, a, n).into(),
            (Op::Shl(n) | Op::ShlWrap(n), true) => self.shl_i64(a, n).into(),
            (Op::Sar(n), false) => self.shift_i32(Isa::ASR_immediate, a, n).into(),
            (Op::Sar(n), true) => self.sar_i64(a, n).into(),
            (Op::SarRound(n), false) => self.sar_round_i32(a, n).into(),
            (Op::SarRound(n), true) => self.sar_round_i64(a, n).into(),
            (Op::DivRound(n), _) => self.div_round(a, b, n).into(),
            (Op::Quot(n), _) => self.quot(a, b, n).into(),
            (Op::Sqrt, _) => self.square_root(a).into(),
            (Op::Widen, _) => self.widen(a).into(),
            (Op::Assume(..), false) => self.reg(a).into(),
            (Op::Assume(..), true) => self.pair(a).into(),
            (Op::Narrow | Op::Low, _) => self.select_narrow(a),
            (Op::Eq, _) => Binding::Comparison(Relation::Equal, [a, b]),
            (Op::Lt, _) => Binding::Comparison(Relation::Less, [a, b]),
            (Op::Le, _) => Binding::Comparison(Relation::LessOrEqual, [a, b]),
            (Op::And, _) => self.select_and(a, b).into(),
            (Op::Or, _) => self.select_or(a, b).into(),
            (Op::Not, _) => self.select_not(a).into(),
            (Op::Select, _) => self.select_choice(is_wide, [a, b, c]),
            (Op::In(port), _) => self.read_input(port).into(),
            (Op::Out(port), _) => return self.write_output(port, a),
            (Op::Live(live), _) => self.read_live(live).into(),
            (Op::Tick(later), _) => self.read_tick(later).into(),
            (Op::Keyed(keyed), _) => self.read_keyed(keyed).into(),
            (Op::Get(cell), _) => self.read_cell(cell),
            (Op::Set(cell), _) => return self.write_cell(cell, a),
            (Op::GetAt(cell), _) => self.read_element(cell, a),
            (Op::SetAt(cell), _) => return self.write_element(cell, a, b),
            (Op::Wave(e, v), _) => return self.call_string([e, v], args),
            (Op::Delay(line, ticks), _) => self.read_delay(line, ticks).into(),
            (Op::DelayAt(line), _) => self.read_delay_at(line, a).into(),
            (Op::Push(line), _) => return self.push_line(line, a),
            (Op::Fill(line), _) => return self.fill_line(line, a),
            (Op::Lookup(table, column), _) => self.read_table(table, column, a).into(),
            (Op::Emit(event), _) => return self.emit_event(event, args),
            (Op::Probe(probe), _) => return self.write_probe(probe, a),
            // The walk hands their regions to `control`.
            (Op::If | Op::Loop(_), _) => return,
        };
        if let Some(result) = result {
            self.state[result].held = match op {
                Op::Min | Op::Max => self.last_held,
                _ => self.held_by(op, [a, b]),
            };
            self.bind(result, bound);
        }
    }
}
