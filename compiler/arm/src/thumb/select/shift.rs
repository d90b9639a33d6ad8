//! Shifts of words: an instruction of their own, or a part of the instruction that reads them.

use super::Select;
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Op as Isa, ShiftType};
use whippen_kernel::{Op, Value};

/// An operand with its shift.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShiftedOperand {
    pub of: Value,
    pub shift: ShiftType,
    pub amount: u8,
}

impl Select<'_> {
    /// The shift that a user of the value can take in.
    pub(super) fn shifted_operand(&self, value: Value) -> Option<ShiftedOperand> {
        let (op, [of, _]) = self.foldable(value)?;
        let (shift, amount) = operand_shift(op)?;
        Some(ShiftedOperand { of, shift, amount })
    }

    /// An instruction of two operands, the second of them shifted.
    pub(super) fn emit_shifted(&mut self, isa: Isa, n: VReg, shifted: ShiftedOperand) -> VReg {
        let m = self.reg(shifted.of);
        let code = MInst::new(isa).reg(Role::N, n).reg(Role::M, m);
        self.result(with_shift(code, shifted.shift, shifted.amount))
    }

    pub(super) fn shift_i32(&mut self, op: Isa, value: Value, n: u8) -> VReg {
        let value = self.reg(value);
        self.shift_by(op, value, n)
    }

    /// Shifted by an immediate, which may be zero.
    pub(super) fn shift_by(&mut self, op: Isa, value: VReg, n: u8) -> VReg {
        if n == 0 {
            return value;
        }
        let code = shift_code(op, n).reg(Role::M, value);
        self.result(code)
    }

    /// The bit that is shifted out last is the carry, and rounding up adds it.
    pub(super) fn sar_round_i32(&mut self, value: Value, n: u8) -> VReg {
        if n == 0 {
            return self.reg(value);
        }
        let value = self.reg(value);
        let floor = self.result(
            shift_code(Isa::ASR_immediate, n)
                .reg(Role::M, value)
                .flags(),
        );
        self.result(MInst::new(Isa::ADC_immediate).reg(Role::N, floor).imm(0))
    }
}

/// A shift of the Kernel as that of an operand, if it can be one.
pub(super) fn operand_shift(op: Op) -> Option<(ShiftType, u8)> {
    match op {
        Op::Sar(n) => Some((ShiftType::ASR, n)),
        Op::Shl(n) | Op::ShlWrap(n) => Some((ShiftType::LSL, n)),
        _ => None,
    }
}

/// A shift by an immediate.
pub(super) fn shift_code(op: Isa, n: u8) -> MInst {
    let mut code = MInst::new(op);
    code.inst.amount = n;
    code
}

/// An instruction whose operand M is shifted.
pub(super) fn with_shift(mut code: MInst, shift: ShiftType, n: u8) -> MInst {
    (code.inst.shift, code.inst.amount) = if n == 0 {
        (ShiftType::LSL, 0)
    } else {
        (shift, n)
    };
    code
}
