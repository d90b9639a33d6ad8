//! Branches, and what writing PC means.

use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use crate::trap::Trap;
use whippen_isa::{Inst, Op as I};

impl Cpu {
    /// `BranchWritePC`: bit 0 is ignored.
    #[inline(always)]
    pub(super) fn branch_write_pc(&mut self, address: u32) -> Flow {
        self.pc = address & !1;
        Flow::Branch
    }

    /// Whether a branch to `address` is more than a branch, and so needs to run exactly: a return
    /// from an exception, or to an even address.
    #[inline(always)]
    pub(super) fn check_branch(&self, address: u32) -> Result<(), Flow> {
        let special = address & 1 == 0 || address >> 28 == 15;
        if special && !self.exact {
            Err(Flow::Inexact)
        } else {
            Ok(())
        }
    }

    /// `BXWritePC` and `LoadWritePC`, after [`Cpu::check_branch`].
    #[inline(always)]
    pub(super) fn load_write_pc(&mut self, address: u32) -> Flow {
        if address >> 28 == 15
            && self.in_handler()
            && crate::exception::is_return(self.kind, address)
        {
            self.trap = Some(Trap::ExceptionReturn(address));
            return Flow::Trap;
        }
        self.thumb = address & 1 != 0;
        self.branch_write_pc(address)
    }
}

/// B with a condition: whether it is taken is remembered for timing.
fn conditional<const COND: u8>(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    if cpu.passes::<COND>() {
        cpu.branch_write_pc(op.imm)
    } else {
        Flow::Next
    }
}

fn always(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    cpu.branch_write_pc(op.imm)
}

fn link(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    cpu.r[14] = op.pc() | 1;
    cpu.branch_write_pc(op.imm)
}

fn compare<const ZERO: bool>(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let taken = (cpu.rn(op) == 0) == ZERO;
    cpu.remember(taken);
    if taken {
        cpu.branch_write_pc(op.imm)
    } else {
        Flow::Next
    }
}

fn exchange<const LINK: bool>(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let target = cpu.rm(op);
    if let Err(flow) = cpu.check_branch(target) {
        return flow;
    }
    if LINK {
        cpu.r[14] = op.address.wrapping_add(2) | 1;
        cpu.thumb = target & 1 != 0;
        return cpu.branch_write_pc(target);
    }
    cpu.load_write_pc(target)
}

fn table<const HALFWORDS: bool>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    let (base, index) = (cpu.rn(op), cpu.rm(op));
    let entry = match HALFWORDS {
        false => cpu.load::<u8>(bus, base.wrapping_add(index)),
        true => cpu.load::<u16>(bus, base.wrapping_add(index << 1)),
    };
    match entry {
        Ok(halfwords) => cpu.branch_write_pc(op.pc().wrapping_add(2 * halfwords)),
        Err(flow) => flow,
    }
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::B if inst.is_conditional() => super::by_condition!(inst.cond, conditional),
        I::B => always,
        I::BL => link,
        I::CBZ => compare::<true>,
        I::CBNZ => compare::<false>,
        I::BX | I::BXNS => exchange::<false>,
        I::BLX | I::BLXNS => exchange::<true>,
        I::TBB => table::<false>,
        I::TBH => table::<true>,
        _ => return None,
    })
}
