//! Loads and stores: short positive distances from a low register, else a distance in a register.

use super::Legal;
use crate::thumb::minst::{MInst, Operand, Reg, Role};
use whippen_isa::Op;

impl Legal<'_> {
    /// A load or store with an immediate, whose base may go on: a fixed register in place, any
    /// other as a new word behind the access.
    pub(super) fn access(&mut self, code: &MInst) {
        let operand = code.operands[Role::N as usize];
        let base = operand.map_or(Reg::Fixed(0), |operand| operand.reg);
        if let Some(Operand {
            reg: Reg::Virtual(behind),
            old: Some(old),
        }) = operand
        {
            self.plain(code, Reg::Virtual(old), 0);
            let on = MInst::new(Op::ADD_immediate)
                .reg(Role::D, behind)
                .reg(Role::N, old);
            return self.one(&on.imm(code.inst.imm));
        }
        let offset = if code.inst.add {
            code.inst.imm as i32
        } else {
            -(code.inst.imm as i32)
        };
        match (code.inst.wback, code.inst.index) {
            (false, _) => self.plain(code, base, offset),
            (true, true) => {
                self.walk(base, offset as u32);
                self.plain(code, base, 0);
            }
            (true, false) => {
                self.plain(code, base, 0);
                self.walk(base, offset as u32);
            }
        }
    }

    /// A fixed register goes on by so many bytes.
    pub(super) fn walk(&mut self, base: Reg, by: u32) {
        let by = self.constant(by);
        self.add_to(base, Reg::Virtual(by));
    }

    /// `base += m`, which leaves the flags.
    pub(super) fn add_to(&mut self, base: Reg, m: Reg) {
        self.emit(
            MInst::new(Op::ADD_register)
                .with(Role::D, base)
                .with(Role::N, base)
                .with(Role::M, m),
        );
    }

    /// A load or store at a distance from a register.
    pub(super) fn plain(&mut self, code: &MInst, base: Reg, offset: i32) {
        let base = match base {
            Reg::Fixed(reg) if reg >= 8 => Reg::Virtual(self.copy(base)),
            low => low,
        };
        let halfword = matches!(code.inst.op(), Op::LDRH_immediate | Op::STRH_immediate);
        let unit = if halfword { 2 } else { 4 };
        let mut access = *code;
        access.operands[Role::N as usize] = Some(Operand {
            reg: base,
            old: None,
        });
        if (0..32 * unit).contains(&offset) && offset % unit == 0 {
            (
                access.inst.imm,
                access.inst.add,
                access.inst.wback,
                access.inst.index,
            ) = (offset as u32, true, false, true);
            return self.emit(access);
        }
        let op = match code.inst.op() {
            Op::LDRH_immediate => Op::LDRH_register,
            Op::STRH_immediate => Op::STRH_register,
            Op::STR_immediate => Op::STR_register,
            _ => Op::LDR_register,
        };
        let distance = self.constant(offset as u32);
        access.inst = MInst::new(op).inst;
        self.emit(access.reg(Role::M, distance));
    }

    /// A load or store at the sum of two registers, the second of them shifted.
    pub(super) fn indexed(&mut self, code: &MInst) {
        let (base, index) = (self.low(code, Role::N), self.shifted(code, Role::M));
        let mut access = *code;
        access.inst = MInst::new(code.inst.op()).inst;
        self.emit(access.with(Role::N, base).with(Role::M, index));
    }
}
