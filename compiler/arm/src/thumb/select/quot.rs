//! Quotients for searches: one SDIV of 32 bits by 16, both normalized.
//!
//! What repeats the dividend's sign is as long as the zeros above the highest bit in which the
//! dividend differs from its double; moved up by that, and with the 16 highest bits of the divisor,
//! the quotient has 15 bits or 16 below its sign. What remains is a shift downwards: a word moved
//! by 32 or more is its sign. SDIV by 0 gives 0, as it should.

use super::shift::with_shift;
use super::{Binding, Select};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Cond, Op as Isa, ShiftType};
use whippen_kernel::{Range, Value};

impl Select<'_> {
    pub(super) fn quot(&mut self, a: Value, b: Value, n: u8) -> VReg {
        let (of, by) = (self.info(a).range, self.info(b).range);
        let (dividend, divisor) = (self.reg(a), self.reg(b));
        let changes = MInst::new(Isa::EOR_register)
            .reg(Role::N, dividend)
            .reg(Role::M, dividend);
        let changes = self.result(with_shift(changes, ShiftType::LSL, 1));
        let up = self.result(MInst::new(Isa::CLZ).reg(Role::M, changes));
        let x = self.emit_rrr(Isa::LSL_register, dividend, up);
        let up_divisor = self.result(MInst::new(Isa::CLZ).reg(Role::M, divisor));
        let y = self.emit_rrr(Isa::LSL_register, divisor, up_divisor);
        let y = self.shift_by(Isa::LSR_immediate, y, 16);
        let quotient = self.emit_rrr(Isa::SDIV, x, y);
        let top = self.shift_by(Isa::LSL_immediate, quotient, 15);
        let down = self.emit_rrr(Isa::SUB_register, up, up_divisor);
        let down = self.add_constant(down, 31 - i64::from(n));
        let word = match is_large(of, by, n) {
            true => {
                let down = self.result(MInst::new(Isa::USAT).reg(Role::N, down).imm(5));
                let word = self.emit_rrr(Isa::ASR_register, top, down);
                self.result(MInst::new(Isa::SSAT).reg(Role::N, word).imm(30))
            }
            false => self.emit_rrr(Isa::ASR_register, top, down),
        };
        if by.low >= 0 {
            return word;
        }
        let compared = MInst::new(Isa::CMP_immediate).reg(Role::N, divisor);
        self.emit(compared.imm(0));
        self.move_if(Cond::LT, Binding::Const(0), word)
    }
}

/// Whether the quotient may have more than 30 bits.
fn is_large(of: Range, by: Range, n: u8) -> bool {
    let sign_bits = |a: i64| 31 - (64 - (a ^ (a >> 63)).leading_zeros());
    let up = sign_bits(of.low).min(sign_bits(of.high));
    let up_divisor = (by.low.max(1) as u32).leading_zeros();
    up + 31 < up_divisor + u32::from(n) + 2
}
