//! Hints, barriers, special registers, calls of the supervisor and the host.

use crate::board::CoreKind;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use crate::stop::{FaultKind, Reason};
use crate::trap::Trap;
use whippen_isa::{Class, Inst, Op as I};

pub(super) fn nothing(_: &mut Cpu, _: &mut Bus, _: &Op) -> Flow {
    Flow::Next
}

/// ISB: what was decoded before may have changed.
fn synchronize(_: &mut Cpu, _: &mut Bus, _: &Op) -> Flow {
    Flow::Leave
}

fn trap(cpu: &mut Cpu, trap: Trap) -> Flow {
    cpu.trap = Some(trap);
    Flow::Trap
}

fn mrs(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let value = cpu.special(op.imm as u8);
    if op.d == 13 {
        cpu.r[13] = value & !3;
    } else {
        cpu.write(op.d, value);
    }
    Flow::Next
}

/// MSR to APSR; `amount` bit 1 is NZCVQ, bit 0 GE.
fn msr_apsr(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let value = cpu.rn(op);
    if op.amount & 2 != 0 {
        cpu.set_nzcv_bits(value);
        cpu.q = value >> 27 & 1 != 0 && cpu.kind != CoreKind::CortexM0Plus;
    }
    if op.amount & 1 != 0 {
        cpu.ge = (value >> 16 & 15) as u8;
    }
    Flow::Next
}

fn msr(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    if !cpu.exact {
        return Flow::Inexact;
    }
    cpu.set_special(op.imm as u8, cpu.rn(op));
    cpu.system.changed = true;
    Flow::Next
}

/// CPS: `imm` disables, `amount` bit 1 is PRIMASK, bit 0 FAULTMASK.
fn cps(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    if !cpu.exact {
        return Flow::Inexact;
    }
    if !cpu.is_privileged() {
        return Flow::Next;
    }
    let disable = op.imm != 0;
    if op.amount & 2 != 0 {
        cpu.primask = disable;
    }
    if op.amount & 1 != 0 && (!disable || cpu.priority() > -1) {
        cpu.faultmask = disable;
    }
    cpu.system.changed = true;
    Flow::Next
}

fn no_coprocessor(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    cpu.fault(FaultKind::UsageFault, Reason::NoCoprocessor, op.address)
}

/// TT without a security extension or an MPU in use: everything may be read and written.
fn test_target(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    const READ_WRITE_OK: u32 = 1 << 18 | 1 << 19;
    cpu.write(op.d, READ_WRITE_OK);
    Flow::Next
}

impl Cpu {
    /// The special register of MRS.
    fn special(&self, number: u8) -> u32 {
        let privileged = |value: u32| if self.is_privileged() { value } else { 0 };
        match number & 0x7f {
            0..=7 => self.special_psr(number),
            8 => privileged(self.msp()),
            9 => privileged(self.psp()),
            10 => privileged(self.msplim),
            11 => privileged(self.psplim),
            16 => privileged(u32::from(self.primask)),
            17 | 18 => privileged(self.basepri),
            19 => privileged(u32::from(self.faultmask)),
            20 => self.control,
            24 => privileged(self.r[13]),
            _ => 0,
        }
    }

    /// APSR unless bit 2 of the number is set, IPSR if bit 0 is; EPSR reads as zero.
    fn special_psr(&self, number: u8) -> u32 {
        let apsr = if number & 4 == 0 { self.apsr() } else { 0 };
        apsr | if number & 1 != 0 { self.ipsr } else { 0 }
    }

    /// MSR; without privilege it does nothing.
    fn set_special(&mut self, number: u8, value: u32) {
        if !self.is_privileged() {
            return;
        }
        let levels = self.system.priority_mask();
        match number & 0x7f {
            8 => self.set_msp(value),
            9 => self.set_psp(value),
            10 => self.msplim = value & !7,
            11 => self.psplim = value & !7,
            16 => self.primask = value & 1 != 0,
            17 => self.basepri = value & levels,
            18 => self.raise_basepri(value & levels),
            19 if self.priority() > -1 || value & 1 == 0 => self.faultmask = value & 1 != 0,
            20 => self.set_control(value),
            24 => self.r[13] = value & !3,
            _ => {}
        }
    }

    /// BASEPRI_MAX: only to a higher priority.
    fn raise_basepri(&mut self, value: u32) {
        if value != 0 && (value < self.basepri || self.basepri == 0) {
            self.basepri = value;
        }
    }

    fn set_control(&mut self, value: u32) {
        let kept = match self.kind {
            CoreKind::CortexM0Plus => 3,
            CoreKind::CortexM4 => 7,
            CoreKind::CortexM33 => 15,
        };
        let spsel = if self.in_handler() {
            self.control & 2
        } else {
            value & 2
        };
        self.change_mode(self.ipsr, value & kept & !2 | spsel);
    }
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match (inst.class(), inst.op()) {
        (_, I::WFI) => |cpu, _, _| trap(cpu, Trap::WaitForInterrupt),
        (_, I::WFE) => |cpu, _, _| trap(cpu, Trap::WaitForEvent),
        (_, I::SEV) => |cpu, _, _| trap(cpu, Trap::SendEvent),
        (_, I::SVC) => |cpu, _, _| trap(cpu, Trap::SupervisorCall),
        (_, I::BKPT) => |cpu, _, op| trap(cpu, Trap::Breakpoint(op.imm as u8)),
        (_, I::ISB) => synchronize,
        (Class::Nop | Class::Wait | Class::Barrier | Class::It, _) => nothing,
        (_, I::MRS) => mrs,
        (_, I::MSR_APSR) => msr_apsr,
        (_, I::MSR) => msr,
        (_, I::CPS) => cps,
        (_, I::SG) => nothing,
        (_, I::TT | I::TTT | I::TTA | I::TTAT) => test_target,
        (Class::Coprocessor, _) => no_coprocessor,
        _ => return None,
    })
}
