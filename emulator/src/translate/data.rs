//! Data processing in place: `exec::data`.

use super::emitter::{At, Emitter};
use super::flags::Result;
use super::kept::{CARRY, OVERFLOW};
use cranelift_codegen::ir::types::I8;
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::{Class, Op as I, ShiftType};

/// An operation.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Alu {
    Add,
    AddCarry,
    Subtract,
    SubtractCarry,
    ReverseSubtract,
    And,
    BitClear,
    ExclusiveOr,
    OrNot,
    Or,
    Move,
    MoveNot,
}

/// The second operand.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Operand {
    Constant,
    Shifted,
    ShiftedByRegister,
}

/// The operation, its operand, and whether its result is kept.
fn of(op: I) -> Option<(Alu, Operand, bool)> {
    use Operand::{Constant, Shifted, ShiftedByRegister};
    Some(match op {
        I::ADC_immediate => (Alu::AddCarry, Constant, true),
        I::ADC_register => (Alu::AddCarry, Shifted, true),
        I::ADD_immediate | I::ADD_SP_plus_immediate => (Alu::Add, Constant, true),
        I::ADD_register | I::ADD_SP_plus_register => (Alu::Add, Shifted, true),
        I::ADR | I::MOV_immediate => (Alu::Move, Constant, true),
        I::CMN_immediate => (Alu::Add, Constant, false),
        I::CMN_register => (Alu::Add, Shifted, false),
        I::CMP_immediate => (Alu::Subtract, Constant, false),
        I::CMP_register => (Alu::Subtract, Shifted, false),
        I::TEQ_immediate => (Alu::ExclusiveOr, Constant, false),
        I::TEQ_register => (Alu::ExclusiveOr, Shifted, false),
        I::TST_immediate => (Alu::And, Constant, false),
        I::TST_register => (Alu::And, Shifted, false),
        I::RSB_immediate => (Alu::ReverseSubtract, Constant, true),
        I::RSB_register => (Alu::ReverseSubtract, Shifted, true),
        I::SBC_immediate => (Alu::SubtractCarry, Constant, true),
        I::SBC_register => (Alu::SubtractCarry, Shifted, true),
        I::SUB_immediate | I::SUB_SP_minus_immediate => (Alu::Subtract, Constant, true),
        I::SUB_register | I::SUB_SP_minus_register => (Alu::Subtract, Shifted, true),
        I::AND_immediate => (Alu::And, Constant, true),
        I::AND_register => (Alu::And, Shifted, true),
        I::BIC_immediate => (Alu::BitClear, Constant, true),
        I::BIC_register => (Alu::BitClear, Shifted, true),
        I::EOR_immediate => (Alu::ExclusiveOr, Constant, true),
        I::EOR_register => (Alu::ExclusiveOr, Shifted, true),
        I::ORN_immediate => (Alu::OrNot, Constant, true),
        I::ORN_register => (Alu::OrNot, Shifted, true),
        I::ORR_immediate => (Alu::Or, Constant, true),
        I::ORR_register => (Alu::Or, Shifted, true),
        I::MVN_immediate => (Alu::MoveNot, Constant, true),
        I::MVN_register => (Alu::MoveNot, Shifted, true),
        I::MOV_register | I::ASR_immediate | I::LSL_immediate => (Alu::Move, Shifted, true),
        I::LSR_immediate | I::ROR_immediate | I::RRX => (Alu::Move, Shifted, true),
        I::ASR_register | I::LSL_register => (Alu::Move, ShiftedByRegister, true),
        I::LSR_register | I::ROR_register => (Alu::Move, ShiftedByRegister, true),
        _ => return None,
    })
}

impl Emitter<'_, '_> {
    /// Whether it was one of these, and is emitted.
    pub fn data(&mut self, at: &At) -> bool {
        if !matches!(at.inst.class(), Class::Alu | Class::Move | Class::Shift) {
            return false;
        }
        let Some((alu, operand, keeps)) = of(at.inst.op()) else {
            return false;
        };
        let to = keeps.then_some(at.inst.d);
        if to == Some(15) {
            return false;
        }
        let before = self.kept;
        let (y, shifter) = self.operand(at, operand);
        let x = match alu {
            Alu::Move | Alu::MoveNot => y,
            _ => self.register(at.op, at.op.n),
        };
        let result = self.compute(alu, x, y, shifter);
        match to {
            Some(13) => {
                let slow = self.f.create_block();
                let value = self.checked_sp(result.value, slow);
                self.or_fail(at, slow, before);
                self.set_register(13, value);
            }
            Some(register) => self.set_register(register, result.value),
            None => {}
        }
        if at.inst.s || !keeps {
            self.set_flags(result);
            self.kept.compared = (alu == Alu::Subtract).then_some((x, y));
        }
        true
    }

    /// The second operand and the shifter's carry.
    fn operand(&mut self, at: &At, operand: Operand) -> (Value, Value) {
        let op = at.op;
        match operand {
            Operand::Constant => {
                let carry = match op.amount {
                    0 => self.get(CARRY),
                    amount => self.f.ins().iconst(I8, i64::from(amount == 2)),
                };
                (self.constant(op.imm), carry)
            }
            Operand::Shifted => {
                let plain = at.inst.shift == ShiftType::LSL && at.inst.amount == 0;
                let x = self.register(op, op.m);
                let amount = if plain { 0 } else { u32::from(op.amount) };
                self.shift(x, op.shift, amount)
            }
            Operand::ShiftedByRegister => {
                let (x, by) = (self.register(op, op.n), self.register(op, op.m));
                self.shift_by(x, op.shift, by)
            }
        }
    }

    fn compute(&mut self, alu: Alu, x: Value, y: Value, shifter: Value) -> Result {
        let value = match alu {
            Alu::Add => return self.add(x, y),
            Alu::AddCarry => return self.add_carry(x, y),
            Alu::Subtract => return self.subtract(x, y),
            Alu::SubtractCarry => {
                let y = self.f.ins().bnot(y);
                return self.add_carry(x, y);
            }
            Alu::ReverseSubtract => return self.subtract(y, x),
            Alu::And => self.f.ins().band(x, y),
            Alu::BitClear => self.f.ins().band_not(x, y),
            Alu::ExclusiveOr => self.f.ins().bxor(x, y),
            Alu::OrNot => self.f.ins().bor_not(x, y),
            Alu::Or => self.f.ins().bor(x, y),
            Alu::Move => y,
            Alu::MoveNot => self.f.ins().bnot(y),
        };
        let overflow = self.get(OVERFLOW);
        Result {
            value,
            carry: shifter,
            overflow,
        }
    }
}
