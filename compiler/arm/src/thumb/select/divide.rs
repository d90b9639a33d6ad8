//! Quotients in fixed point, exact: `floor(a * 2^n / b + 1/2)`, and 0 where `b` is 0.
//!
//! With `b` made positive that is `floor((a * 2^n + b / 2) / b)`, and for a negative dividend `y`
//! the floor is `!(!y / b)`. What the intervals say of signs and of the divisor's highest bit is
//! not asked again. What remains is to divide up to 63 bits by 32, with a quotient that fits a word
//! because it was proven to: two digits of 16 bits, as in Knuth's algorithm D, each guessed by UDIV
//! from the divisor's upper half and taken back at most twice.

use super::shift::with_shift;
use super::{Binding, Select};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Cond, Op as Isa, ShiftType};
use whippen_kernel::{Range, Value};

impl Select<'_> {
    pub(super) fn div_round(&mut self, a: Value, b: Value, n: u8) -> VReg {
        let (of, by) = (self.info(a).range, self.info(b).range);
        let (a, b) = (self.reg(a), self.reg(b));
        let zero = self.load_constant(0);
        let (divisor, dividend) = match by.low < 0 {
            true => self.make_divisor_positive(a, b),
            false if of.low < 0 => (b, (a, self.sign_mask(a))),
            false => (b, (a, zero)),
        };
        let dividend = self.shl_pair(dividend, n);
        let half = self.shift_by(Isa::LSR_immediate, divisor, 1);
        let dividend = self.add_pairs(dividend, (half, zero));
        let quotient = if of.low < 0 || by.low < 0 {
            let sign = self.sign_mask(dividend.1);
            let low = self.emit_rrr(Isa::EOR_register, dividend.0, sign);
            let high = self.emit_rrr(Isa::EOR_register, dividend.1, sign);
            let quotient = self.divide_wide((low, high), divisor, by);
            self.emit_rrr(Isa::EOR_register, quotient, sign)
        } else {
            self.divide_wide(dividend, divisor, by)
        };
        if !by.has(0) {
            return quotient;
        }
        self.emit(MInst::new(Isa::CMP_immediate).reg(Role::N, b).imm(0));
        self.move_if(Cond::EQ, Binding::Const(0), quotient)
    }

    /// `b` made positive, and the 33 bits of `a` with the same sign taken from it.
    fn make_divisor_positive(&mut self, a: VReg, b: VReg) -> (VReg, (VReg, VReg)) {
        let sign_b = self.sign_mask(b);
        let flipped = self.emit_rrr(Isa::EOR_register, b, sign_b);
        let divisor = self.emit_rrr(Isa::SUB_register, flipped, sign_b);
        // The dividend needs its 33rd bit where it was the smallest word.
        let sign_a = self.sign_mask(a);
        let low = self.emit_rrr(Isa::EOR_register, a, sign_b);
        let high = self.emit_rrr(Isa::EOR_register, sign_a, sign_b);
        (divisor, self.sub_pairs((low, high), (sign_b, sign_b)))
    }

    /// Dividend over divisor, unsigned, where the dividend's upper word is less than the divisor.
    fn divide_wide(&mut self, dividend: (VReg, VReg), divisor: VReg, by: Range) -> VReg {
        let zeros = |word: i64| (word as u32).leading_zeros() as u8;
        let (divisor, (low, high)) = if by.low > 0 && zeros(by.low) == zeros(by.high) {
            let up = zeros(by.low);
            (
                self.shift_by(Isa::LSL_immediate, divisor, up),
                self.shl_pair(dividend, up),
            )
        } else {
            self.normal(dividend, divisor)
        };
        let upper = self.shift_by(Isa::LSR_immediate, low, 16);
        let (first, remainder) = self.digit(high, upper, divisor);
        let lower = self.result(MInst::new(Isa::UXTH).reg(Role::M, low));
        let (second, _) = self.digit(remainder, lower, divisor);
        let sum = MInst::new(Isa::ADD_register)
            .reg(Role::N, second)
            .reg(Role::M, first);
        self.result(with_shift(sum, ShiftType::LSL, 16))
    }

    /// Both shifted left until the divisor's top bit is set.
    fn normal(&mut self, (low, high): (VReg, VReg), divisor: VReg) -> (VReg, (VReg, VReg)) {
        let shift = self.result(MInst::new(Isa::CLZ).reg(Role::M, divisor));
        let divisor = self.emit_rrr(Isa::LSL_register, divisor, shift);
        let rest = self.result(MInst::new(Isa::RSB_immediate).reg(Role::N, shift).imm(32));
        let up = self.emit_rrr(Isa::LSL_register, high, shift);
        let carried = self.emit_rrr(Isa::LSR_register, low, rest);
        let high = self.emit_rrr(Isa::ORR_register, up, carried);
        (
            divisor,
            (self.emit_rrr(Isa::LSL_register, low, shift), high),
        )
    }

    /// One digit of 16 bits and what remains, of `(high << 16) + next` by a divisor whose top bit
    /// is set.
    fn digit(&mut self, high: VReg, next: VReg, divisor: VReg) -> (VReg, VReg) {
        let upper = self.shift_by(Isa::LSR_immediate, divisor, 16);
        let lower = self.result(MInst::new(Isa::UXTH).reg(Role::M, divisor));
        let mut digit = self.emit_rrr(Isa::UDIV, high, upper);
        let guess = MInst::new(Isa::MLS)
            .reg(Role::N, digit)
            .reg(Role::M, upper)
            .reg(Role::A, high);
        let mut rest = self.result(guess);
        for _ in 0..2 {
            (digit, rest) = self.correct(digit, rest, next, upper, lower);
        }
        let shifted = MInst::new(Isa::ADD_register)
            .reg(Role::N, next)
            .reg(Role::M, high);
        let dividend = self.result(with_shift(shifted, ShiftType::LSL, 16));
        let remainder = MInst::new(Isa::MLS)
            .reg(Role::N, digit)
            .reg(Role::M, divisor)
            .reg(Role::A, dividend);
        (digit, self.result(remainder))
    }

    /// Takes one back where `digit` is more than 16 bits or `digit * lower > (rest << 16) + next`,
    /// as long as `rest` has 16 bits.
    fn correct(
        &mut self,
        digit: VReg,
        rest: VReg,
        next: VReg,
        upper: VReg,
        lower: VReg,
    ) -> (VReg, VReg) {
        // (rest << 16) + next in 48 bits, less digit * lower in 33: all in 64.
        let have_low = MInst::new(Isa::ADD_register)
            .reg(Role::N, next)
            .reg(Role::M, rest);
        let have_low = self.result(with_shift(have_low, ShiftType::LSL, 16));
        let have_high = self.shift_by(Isa::LSR_immediate, rest, 16);
        let (need_low, need_high) = self.multiply_long(Isa::UMULL, digit, lower);
        self.emit(
            MInst::new(Isa::CMP_register)
                .reg(Role::N, have_low)
                .reg(Role::M, need_low),
        );
        self.result(
            MInst::new(Isa::SBC_register)
                .reg(Role::N, have_high)
                .reg(Role::M, need_high)
                .flags(),
        );
        let less = self.func.fresh();
        self.emit(
            MInst::new(Isa::SUB_immediate)
                .reg(Role::N, digit)
                .imm(1)
                .both(Role::D, less, digit)
                .only(Cond::CC),
        );
        let more = self.func.fresh();
        let sum = MInst::new(Isa::ADD_register)
            .reg(Role::N, rest)
            .reg(Role::M, upper);
        self.emit(sum.both(Role::D, more, rest).only(Cond::CC));
        (less, more)
    }
}
