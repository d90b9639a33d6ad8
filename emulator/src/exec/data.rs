//! Data processing: an operation, a second operand, flags or not, a destination. Every combination
//! is a function of its own, made from one.

use crate::alu::{add_with_carry, shift_c};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Class, Inst, Op as I, ShiftType};

/// What an operation works on: the operands, the carry flag, the shifter's carry and the overflow
/// flag.
struct Input {
    x: u32,
    y: u32,
    carry: bool,
    shifter: bool,
    overflow: bool,
}

/// An operation: result, carry, overflow.
trait Alu {
    fn compute(input: Input) -> (u32, bool, bool);
}

macro_rules! operations {
    ($($name:ident |$i:ident| $result:expr;)+) => {
        $(struct $name;
        impl Alu for $name {
            #[inline(always)]
            fn compute($i: Input) -> (u32, bool, bool) { $result }
        })+
    };
}

operations! {
    Add |i| add_with_carry(i.x, i.y, false);
    AddCarry |i| add_with_carry(i.x, i.y, i.carry);
    Subtract |i| add_with_carry(i.x, !i.y, true);
    SubtractCarry |i| add_with_carry(i.x, !i.y, i.carry);
    ReverseSubtract |i| add_with_carry(!i.x, i.y, true);
    And |i| (i.x & i.y, i.shifter, i.overflow);
    BitClear |i| (i.x & !i.y, i.shifter, i.overflow);
    ExclusiveOr |i| (i.x ^ i.y, i.shifter, i.overflow);
    OrNot |i| (i.x | !i.y, i.shifter, i.overflow);
    Or |i| (i.x | i.y, i.shifter, i.overflow);
    Move |i| (i.y, i.shifter, i.overflow);
    MoveNot |i| (!i.y, i.shifter, i.overflow);
}

/// The second operand and the shifter's carry.
trait Operand {
    fn get(cpu: &Cpu, op: &Op) -> (u32, bool);
}

/// A constant; `amount` is 1 or 2 where it gives a carry of 0 or 1.
struct Constant;
impl Operand for Constant {
    #[inline(always)]
    fn get(cpu: &Cpu, op: &Op) -> (u32, bool) {
        (
            op.imm,
            if op.amount == 0 {
                cpu.carry
            } else {
                op.amount == 2
            },
        )
    }
}

/// A register.
struct RegisterOperand;
impl Operand for RegisterOperand {
    #[inline(always)]
    fn get(cpu: &Cpu, op: &Op) -> (u32, bool) {
        (cpu.rm(op), cpu.carry)
    }
}

/// A register shifted by a constant.
struct Shifted;
impl Operand for Shifted {
    #[inline(always)]
    fn get(cpu: &Cpu, op: &Op) -> (u32, bool) {
        shift_c(cpu.rm(op), op.shift, u32::from(op.amount), cpu.carry)
    }
}

/// Rn shifted by a register.
struct ShiftedByRegister;
impl Operand for ShiftedByRegister {
    #[inline(always)]
    fn get(cpu: &Cpu, op: &Op) -> (u32, bool) {
        shift_c(cpu.rn(op), op.shift, cpu.rm(op) & 0xff, cpu.carry)
    }
}

/// Where the result goes: nowhere, to Rd, to SP, to PC.
const NONE: u8 = 0;
const REGISTER: u8 = 1;
const STACK: u8 = 2;
const PROGRAM: u8 = 3;

fn data<A: Alu, O: Operand, const S: bool, const TO: u8>(
    cpu: &mut Cpu,
    _: &mut Bus,
    op: &Op,
) -> Flow {
    let (y, shifter) = O::get(cpu, op);
    let input = Input {
        x: cpu.rn(op),
        y,
        carry: cpu.carry,
        shifter,
        overflow: cpu.overflow,
    };
    let (result, carry, overflow) = A::compute(input);
    match TO {
        REGISTER => cpu.write(op.d, result),
        STACK => match cpu.check_sp(result, op) {
            Ok(value) => cpu.r[13] = value,
            Err(flow) => return flow,
        },
        PROGRAM => return cpu.branch_write_pc(result),
        _ => {}
    }
    if S {
        cpu.set_nzcv(result, carry, overflow);
    }
    Flow::Next
}

fn with<A: Alu, O: Operand>(inst: &Inst) -> Run {
    match (inst.d, inst.s) {
        (13, false) => data::<A, O, false, STACK>,
        (13, true) => data::<A, O, true, STACK>,
        (15, _) => data::<A, O, false, PROGRAM>,
        (_, false) => data::<A, O, false, REGISTER>,
        (_, true) => data::<A, O, true, REGISTER>,
    }
}

fn register<A: Alu>(inst: &Inst) -> Run {
    let plain = inst.shift == ShiftType::LSL && inst.amount == 0;
    if plain {
        with::<A, RegisterOperand>(inst)
    } else {
        with::<A, Shifted>(inst)
    }
}

fn compare<A: Alu>(inst: &Inst) -> Run {
    match (is_register(inst.op()), inst.amount) {
        (false, _) => data::<A, Constant, true, NONE>,
        (true, 0) => data::<A, RegisterOperand, true, NONE>,
        (true, _) => data::<A, Shifted, true, NONE>,
    }
}

fn is_register(op: I) -> bool {
    matches!(
        op,
        I::CMN_register | I::CMP_register | I::TEQ_register | I::TST_register
    )
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    if !matches!(inst.class(), Class::Alu | Class::Move | Class::Shift) {
        return None;
    }
    Some(match inst.op() {
        I::ADC_immediate => with::<AddCarry, Constant>(inst),
        I::ADC_register => register::<AddCarry>(inst),
        I::ADD_immediate | I::ADD_SP_plus_immediate => with::<Add, Constant>(inst),
        I::ADD_register | I::ADD_SP_plus_register => register::<Add>(inst),
        I::ADR => with::<Move, Constant>(inst),
        I::CMN_immediate | I::CMN_register => compare::<Add>(inst),
        I::CMP_immediate | I::CMP_register => compare::<Subtract>(inst),
        I::TEQ_immediate | I::TEQ_register => compare::<ExclusiveOr>(inst),
        I::TST_immediate | I::TST_register => compare::<And>(inst),
        I::RSB_immediate => with::<ReverseSubtract, Constant>(inst),
        I::RSB_register => register::<ReverseSubtract>(inst),
        I::SBC_immediate => with::<SubtractCarry, Constant>(inst),
        I::SBC_register => register::<SubtractCarry>(inst),
        I::SUB_immediate | I::SUB_SP_minus_immediate => with::<Subtract, Constant>(inst),
        I::SUB_register | I::SUB_SP_minus_register => register::<Subtract>(inst),
        I::AND_immediate => with::<And, Constant>(inst),
        I::AND_register => register::<And>(inst),
        I::BIC_immediate => with::<BitClear, Constant>(inst),
        I::BIC_register => register::<BitClear>(inst),
        I::EOR_immediate => with::<ExclusiveOr, Constant>(inst),
        I::EOR_register => register::<ExclusiveOr>(inst),
        I::ORN_immediate => with::<OrNot, Constant>(inst),
        I::ORN_register => register::<OrNot>(inst),
        I::ORR_immediate => with::<Or, Constant>(inst),
        I::ORR_register => register::<Or>(inst),
        I::MOV_immediate => with::<Move, Constant>(inst),
        I::MOV_register => register::<Move>(inst),
        I::MOVT => move_top,
        I::MVN_immediate => with::<MoveNot, Constant>(inst),
        I::MVN_register => register::<MoveNot>(inst),
        _ => return select_shift(inst),
    })
}

fn select_shift(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::ASR_immediate | I::LSL_immediate | I::LSR_immediate | I::ROR_immediate | I::RRX => {
            register::<Move>(inst)
        }
        I::ASR_register | I::LSL_register | I::LSR_register | I::ROR_register => {
            with::<Move, ShiftedByRegister>(inst)
        }
        _ => return None,
    })
}

/// The type of the shift that a shift by register is by its name.
pub(super) fn named_shift(op: I) -> Option<ShiftType> {
    Some(match op {
        I::ASR_register => ShiftType::ASR,
        I::LSL_register => ShiftType::LSL,
        I::LSR_register => ShiftType::LSR,
        I::ROR_register => ShiftType::ROR,
        _ => return None,
    })
}

fn move_top(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let value = cpu.rd(op) & 0xffff | op.imm << 16;
    cpu.write(op.d, value);
    Flow::Next
}
