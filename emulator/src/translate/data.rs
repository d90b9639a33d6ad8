//! Data processing in place: `exec::data`.

use super::emitter::{At, Emitter};
use super::flags::Computed;
use super::kept::{CARRY, OVERFLOW};
use cranelift_codegen::ir::types::I8;
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::{Class, Op as I, ShiftType};

/// An operation.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Operation {
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
enum Second {
    Constant,
    Shifted,
    ShiftedByRegister,
}

/// The operation, its operand, and whether its result is kept.
fn of(op: I) -> Option<(Operation, Second, bool)> {
    use Second::{Constant, Shifted, ShiftedByRegister};
    Some(match op {
        I::ADC_immediate => (Operation::AddCarry, Constant, true),
        I::ADC_register => (Operation::AddCarry, Shifted, true),
        I::ADD_immediate | I::ADD_SP_plus_immediate => (Operation::Add, Constant, true),
        I::ADD_register | I::ADD_SP_plus_register => (Operation::Add, Shifted, true),
        I::ADR | I::MOV_immediate => (Operation::Move, Constant, true),
        I::CMN_immediate => (Operation::Add, Constant, false),
        I::CMN_register => (Operation::Add, Shifted, false),
        I::CMP_immediate => (Operation::Subtract, Constant, false),
        I::CMP_register => (Operation::Subtract, Shifted, false),
        I::TEQ_immediate => (Operation::ExclusiveOr, Constant, false),
        I::TEQ_register => (Operation::ExclusiveOr, Shifted, false),
        I::TST_immediate => (Operation::And, Constant, false),
        I::TST_register => (Operation::And, Shifted, false),
        I::RSB_immediate => (Operation::ReverseSubtract, Constant, true),
        I::RSB_register => (Operation::ReverseSubtract, Shifted, true),
        I::SBC_immediate => (Operation::SubtractCarry, Constant, true),
        I::SBC_register => (Operation::SubtractCarry, Shifted, true),
        I::SUB_immediate | I::SUB_SP_minus_immediate => (Operation::Subtract, Constant, true),
        I::SUB_register | I::SUB_SP_minus_register => (Operation::Subtract, Shifted, true),
        I::AND_immediate => (Operation::And, Constant, true),
        I::AND_register => (Operation::And, Shifted, true),
        I::BIC_immediate => (Operation::BitClear, Constant, true),
        I::BIC_register => (Operation::BitClear, Shifted, true),
        I::EOR_immediate => (Operation::ExclusiveOr, Constant, true),
        I::EOR_register => (Operation::ExclusiveOr, Shifted, true),
        I::ORN_immediate => (Operation::OrNot, Constant, true),
        I::ORN_register => (Operation::OrNot, Shifted, true),
        I::ORR_immediate => (Operation::Or, Constant, true),
        I::ORR_register => (Operation::Or, Shifted, true),
        I::MVN_immediate => (Operation::MoveNot, Constant, true),
        I::MVN_register => (Operation::MoveNot, Shifted, true),
        I::MOV_register | I::ASR_immediate | I::LSL_immediate => (Operation::Move, Shifted, true),
        I::LSR_immediate | I::ROR_immediate | I::RRX => (Operation::Move, Shifted, true),
        I::ASR_register | I::LSL_register => (Operation::Move, ShiftedByRegister, true),
        I::LSR_register | I::ROR_register => (Operation::Move, ShiftedByRegister, true),
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
            Operation::Move | Operation::MoveNot => y,
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
            self.kept.compared = (alu == Operation::Subtract).then_some((x, y));
        }
        true
    }

    /// The second operand and the shifter's carry.
    fn operand(&mut self, at: &At, operand: Second) -> (Value, Value) {
        let op = at.op;
        match operand {
            Second::Constant => {
                let carry = match op.amount {
                    0 => self.get(CARRY),
                    amount => self.f.ins().iconst(I8, i64::from(amount == 2)),
                };
                (self.constant(op.imm), carry)
            }
            Second::Shifted => {
                let plain = at.inst.shift == ShiftType::LSL && at.inst.amount == 0;
                let x = self.register(op, op.m);
                let amount = if plain { 0 } else { u32::from(op.amount) };
                self.shift(x, op.shift, amount)
            }
            Second::ShiftedByRegister => {
                let (x, by) = (self.register(op, op.n), self.register(op, op.m));
                self.shift_by(x, op.shift, by)
            }
        }
    }

    fn compute(&mut self, alu: Operation, x: Value, y: Value, shifter: Value) -> Computed {
        let value = match alu {
            Operation::Add => return self.add(x, y),
            Operation::AddCarry => return self.add_carry(x, y),
            Operation::Subtract => return self.subtract(x, y),
            Operation::SubtractCarry => {
                let y = self.f.ins().bnot(y);
                return self.add_carry(x, y);
            }
            Operation::ReverseSubtract => return self.subtract(y, x),
            Operation::And => self.f.ins().band(x, y),
            Operation::BitClear => self.f.ins().band_not(x, y),
            Operation::ExclusiveOr => self.f.ins().bxor(x, y),
            Operation::OrNot => self.f.ins().bor_not(x, y),
            Operation::Or => self.f.ins().bor(x, y),
            Operation::Move => y,
            Operation::MoveNot => self.f.ins().bnot(y),
        };
        let overflow = self.get(OVERFLOW);
        Computed {
            value,
            carry: shifter,
            overflow,
        }
    }
}
