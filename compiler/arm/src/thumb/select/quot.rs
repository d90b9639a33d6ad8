//! Quotients with 16 significant bits: one UDIV of 32 bits by 16, both normalized.
//!
//! With the dividend's size `x` and the divisor shifted up until their top bits are set, and the 16
//! highest bits `y` of the divisor, `x / y` has 16 bits or 17. Of 17 the last is dropped, so that
//! what is left depends on the quotient alone and not on who was shifted how far: the operator is
//! monotone. What remains is a shift. UDIV by 0 gives 0, as it should.

use super::shift::with_shift;
use super::{Binding, Select};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Cond, Op as Isa, ShiftType};
use whippen_kernel::{Op, Type, Value};

impl Select<'_> {
    pub(super) fn quot(&mut self, a: Value, b: Value, n: u8) -> VReg {
        let (of, by) = (self.info(a).range, self.info(b).range);
        let (dividend, divisor) = (self.reg(a), self.reg(b));
        let size = if of.low < 0 {
            self.with_sign_of(dividend, dividend)
        } else {
            dividend
        };
        let up = self.result(MInst::new(Isa::CLZ).reg(Role::M, size));
        let x = self.emit_rrr(Isa::LSL_register, size, up);
        let up_divisor = self.result(MInst::new(Isa::CLZ).reg(Role::M, divisor));
        let y = self.emit_rrr(Isa::LSL_register, divisor, up_divisor);
        let y = self.shift_by(Isa::LSR_immediate, y, 16);
        let quotient = self.emit_rrr(Isa::UDIV, x, y);
        let drop = MInst::new(Isa::BIC_register)
            .reg(Role::N, quotient)
            .reg(Role::M, quotient);
        let kept = self.result(with_shift(drop, ShiftType::LSR, 16));
        let top = self.shift_by(Isa::LSL_immediate, kept, 15);
        let down = self.emit_rrr(Isa::SUB_register, up, up_divisor);
        let down = self.add_constant(down, 31 - i64::from(n));
        let mut word = self.emit_rrr(Isa::LSR_register, top, down);
        let furthest = [of.low.min(-of.high), by.low.max(1), 0];
        let saturates = Op::Quot(n).evaluate(Type::I32, furthest) == Some(-i64::from(i32::MAX));
        if saturates {
            word = self.saturate_quotient(word, down);
        }
        if of.low < 0 {
            word = self.with_sign_of(word, dividend);
        }
        // Saturated is what a divisor of 0 gives, too.
        if by.low > 0 || by.low == 0 && !saturates {
            return word;
        }
        let compared = MInst::new(Isa::CMP_immediate).reg(Role::N, divisor);
        self.emit(compared.imm(0));
        self.move_if(Cond::LE, Binding::Const(0), word)
    }

    /// The largest word where the quotient, moved down by so many bits, has 32 bits or more.
    fn saturate_quotient(&mut self, word: VReg, down: VReg) -> VReg {
        self.emit(MInst::new(Isa::CMP_immediate).reg(Role::N, down).imm(0));
        let word = self.move_if(Cond::LT, Binding::Const(-1), word);
        self.emit(MInst::new(Isa::CMP_immediate).reg(Role::N, word).imm(0));
        self.move_if(Cond::LT, Binding::Const(i32::MAX.into()), word)
    }

    /// A word, negated where `of` is negative.
    fn with_sign_of(&mut self, word: VReg, of: VReg) -> VReg {
        let sign_applied = |isa, n| {
            let code = MInst::new(isa).reg(Role::N, n).reg(Role::M, of);
            with_shift(code, ShiftType::ASR, 31)
        };
        let flipped = self.result(sign_applied(Isa::EOR_register, word));
        self.result(sign_applied(Isa::SUB_register, flipped))
    }
}
