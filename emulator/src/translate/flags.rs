//! Flags as values: additions, shifts and their carries, conditions.

use super::emitter::Emitter;
use super::kept::{CARRY, NEGATIVE, OVERFLOW, ZERO};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::{Cond, ShiftType};

/// A result with its carry and overflow, which are 0 or 1.
#[derive(Clone, Copy)]
pub(super) struct Computed {
    pub value: Value,
    pub carry: Value,
    pub overflow: Value,
}

impl Emitter<'_, '_> {
    /// Sets all four flags.
    pub fn set_flags(&mut self, result: Computed) {
        self.set(NEGATIVE, result.value);
        self.set(ZERO, result.value);
        self.set(CARRY, result.carry);
        self.set(OVERFLOW, result.overflow);
        self.kept.compared = None;
    }

    /// `AddWithCarry` with a carry of 0.
    pub fn add(&mut self, x: Value, y: Value) -> Computed {
        let value = self.f.ins().iadd(x, y);
        let carry = self.f.ins().icmp(IntCC::UnsignedLessThan, value, x);
        let (a, b) = (self.f.ins().bxor(x, value), self.f.ins().bxor(y, value));
        self.with_overflow(value, carry, a, b)
    }

    /// `AddWithCarry` of the complement of `y`, with a carry of 1.
    pub fn subtract(&mut self, x: Value, y: Value) -> Computed {
        let value = self.f.ins().isub(x, y);
        let cc = IntCC::UnsignedGreaterThanOrEqual;
        let carry = self.f.ins().icmp(cc, x, y);
        let (a, b) = (self.f.ins().bxor(x, y), self.f.ins().bxor(x, value));
        self.with_overflow(value, carry, a, b)
    }

    /// `AddWithCarry` with the carry flag.
    pub fn add_carry(&mut self, x: Value, y: Value) -> Computed {
        let carry = self.get(CARRY);
        let mut wide = self.f.ins().uextend(I64, carry);
        for operand in [x, y] {
            let operand = self.f.ins().uextend(I64, operand);
            wide = self.f.ins().iadd(wide, operand);
        }
        let value = self.f.ins().ireduce(I32, wide);
        let carry = self.f.ins().ushr_imm_u(wide, 32);
        let carry = self.f.ins().ireduce(I8, carry);
        let (a, b) = (self.f.ins().bxor(x, value), self.f.ins().bxor(y, value));
        self.with_overflow(value, carry, a, b)
    }

    fn with_overflow(&mut self, value: Value, carry: Value, a: Value, b: Value) -> Computed {
        let both = self.f.ins().band(a, b);
        let overflow = self.bit(both, 31);
        Computed {
            value,
            carry,
            overflow,
        }
    }

    /// A bit of a word.
    pub fn bit(&mut self, word: Value, number: u32) -> Value {
        let word = self.f.ins().ushr_imm_u(word, i64::from(number));
        let bit = self.f.ins().ireduce(I8, word);
        match number {
            31 => bit,
            _ => self.f.ins().band_imm_u(bit, 1),
        }
    }

    /// `Shift_C` by a constant.
    pub fn shift(&mut self, x: Value, shift: ShiftType, amount: u32) -> (Value, Value) {
        if amount == 0 {
            return (x, self.get(CARRY));
        }
        let by = i64::from(amount);
        match shift {
            ShiftType::LSL => (self.f.ins().ishl_imm_u(x, by), self.bit(x, 32 - amount)),
            ShiftType::LSR if amount >= 32 => (self.constant(0), self.bit(x, 31)),
            ShiftType::LSR => (self.f.ins().ushr_imm_u(x, by), self.bit(x, amount - 1)),
            ShiftType::ASR => {
                let carry = self.bit(x, (amount - 1).min(31));
                (self.f.ins().sshr_imm_u(x, by.min(31)), carry)
            }
            ShiftType::ROR => {
                let value = self.f.ins().rotr_imm_u(x, by);
                (value, self.bit(value, 31))
            }
            ShiftType::RRX => {
                let carry = self.get(CARRY);
                let top = self.f.ins().uextend(I32, carry);
                let top = self.f.ins().ishl_imm_u(top, 31);
                let value = self.f.ins().ushr_imm_u(x, 1);
                (self.f.ins().bor(top, value), self.bit(x, 0))
            }
        }
    }

    /// `Shift_C` by the low byte of a register.
    pub fn shift_by(&mut self, x: Value, shift: ShiftType, by: Value) -> (Value, Value) {
        let amount = self.f.ins().band_imm_u(by, 0xff);
        let most = self.constant(63);
        let few = self.f.ins().umin(amount, most);
        let (value, carry) = match shift {
            ShiftType::LSL => {
                let wide = self.f.ins().uextend(I64, x);
                let wide = self.f.ins().ishl(wide, few);
                let carry = self.f.ins().ushr_imm_u(wide, 32);
                (self.f.ins().ireduce(I32, wide), carry)
            }
            ShiftType::LSR | ShiftType::ASR => {
                let wide = match shift {
                    ShiftType::LSR => self.f.ins().uextend(I64, x),
                    _ => self.f.ins().sextend(I64, x),
                };
                let wide = self.f.ins().ishl_imm_u(wide, 32);
                let wide = match shift {
                    ShiftType::LSR => self.f.ins().ushr(wide, few),
                    _ => self.f.ins().sshr(wide, few),
                };
                let value = self.f.ins().ushr_imm_u(wide, 32);
                let carry = self.f.ins().ushr_imm_u(wide, 31);
                (self.f.ins().ireduce(I32, value), carry)
            }
            ShiftType::ROR | ShiftType::RRX => {
                let value = self.f.ins().rotr(x, amount);
                let wide = self.f.ins().uextend(I64, value);
                (value, self.f.ins().ushr_imm_u(wide, 31))
            }
        };
        let carry = self.f.ins().ireduce(I8, carry);
        let carry = self.f.ins().band_imm_u(carry, 1);
        let before = self.get(CARRY);
        let none = self.f.ins().icmp_imm_u(IntCC::Equal, amount, 0);
        (value, self.f.ins().select(none, before, carry))
    }

    /// `ConditionPassed()`: 0 or 1.
    pub fn holds(&mut self, cond: Cond) -> Value {
        if let (Some((x, y)), Some(cc)) = (self.kept.compared, of_difference(cond)) {
            return self.f.ins().icmp(cc, x, y);
        }
        let base = Cond::from_bits(cond.bits() & !1).unwrap_or(cond);
        let holds = match base {
            Cond::EQ => self.is_zero(),
            Cond::CS => self.get(CARRY),
            Cond::MI => {
                let negative = self.get(NEGATIVE);
                self.bit(negative, 31)
            }
            Cond::VS => self.get(OVERFLOW),
            Cond::HI => {
                let (zero, carry) = (self.is_zero(), self.get(CARRY));
                self.f.ins().band_not(carry, zero)
            }
            Cond::GE | Cond::GT => {
                let (negative, overflow) = (self.get(NEGATIVE), self.get(OVERFLOW));
                let negative = self.bit(negative, 31);
                let equal = self.f.ins().icmp(IntCC::Equal, negative, overflow);
                match base {
                    Cond::GE => equal,
                    _ => {
                        let zero = self.is_zero();
                        self.f.ins().band_not(equal, zero)
                    }
                }
            }
            _ => self.f.ins().iconst(I8, 1),
        };
        match base == cond {
            true => holds,
            false => self.f.ins().bxor_imm_u(holds, 1),
        }
    }

    fn is_zero(&mut self) -> Value {
        let zero = self.get(ZERO);
        self.f.ins().icmp_imm_u(IntCC::Equal, zero, 0)
    }
}

/// A condition as a comparison of what was subtracted.
fn of_difference(cond: Cond) -> Option<IntCC> {
    Some(match cond {
        Cond::EQ => IntCC::Equal,
        Cond::NE => IntCC::NotEqual,
        Cond::CS => IntCC::UnsignedGreaterThanOrEqual,
        Cond::CC => IntCC::UnsignedLessThan,
        Cond::HI => IntCC::UnsignedGreaterThan,
        Cond::LS => IntCC::UnsignedLessThanOrEqual,
        Cond::GE => IntCC::SignedGreaterThanOrEqual,
        Cond::LT => IntCC::SignedLessThan,
        Cond::GT => IntCC::SignedGreaterThan,
        Cond::LE => IntCC::SignedLessThanOrEqual,
        _ => return None,
    })
}
