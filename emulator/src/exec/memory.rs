//! Loads and stores of one and two registers.

use crate::access::Datum;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Class, Inst, Op as I, RegSet};

/// How the address and the base's new value come about.
trait Addressing {
    const WRITES_BACK: bool = false;
    fn address(cpu: &Cpu, op: &Op) -> u32;
    fn base(cpu: &Cpu, op: &Op) -> u32 {
        cpu.rn(op).wrapping_add(op.imm)
    }
}

struct Offset;
impl Addressing for Offset {
    #[inline(always)]
    fn address(cpu: &Cpu, op: &Op) -> u32 {
        cpu.rn(op).wrapping_add(op.imm)
    }
}

struct PreIndexed;
impl Addressing for PreIndexed {
    const WRITES_BACK: bool = true;
    #[inline(always)]
    fn address(cpu: &Cpu, op: &Op) -> u32 {
        cpu.rn(op).wrapping_add(op.imm)
    }
}

struct PostIndexed;
impl Addressing for PostIndexed {
    const WRITES_BACK: bool = true;
    #[inline(always)]
    fn address(cpu: &Cpu, op: &Op) -> u32 {
        cpu.rn(op)
    }
}

/// Base plus a register shifted left by `amount`.
struct RegisterOffset;
impl Addressing for RegisterOffset {
    #[inline(always)]
    fn address(cpu: &Cpu, op: &Op) -> u32 {
        cpu.rn(op).wrapping_add(cpu.rm(op) << (op.amount & 31))
    }
}

/// The address is `imm`.
struct Literal;
impl Addressing for Literal {
    #[inline(always)]
    fn address(_: &Cpu, op: &Op) -> u32 {
        op.imm
    }
}

/// Where a load goes: to a register, to SP, to PC.
const REGISTER: u8 = 0;
const STACK: u8 = 1;
const PROGRAM: u8 = 2;

fn load<T: Datum, A: Addressing, const TO: u8>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match try_load::<T, A, TO>(cpu, bus, op) {
        Ok(flow) | Err(flow) => flow,
    }
}

#[inline(always)]
fn try_load<T: Datum, A: Addressing, const TO: u8>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Result<Flow, Flow> {
    let base = if A::WRITES_BACK {
        cpu.new_base(A::base(cpu, op), op)?
    } else {
        0
    };
    let value = cpu.load::<T>(bus, A::address(cpu, op))?;
    if TO == PROGRAM {
        cpu.check_branch(value)?;
    }
    if A::WRITES_BACK {
        cpu.write(op.n, base);
    }
    match TO {
        PROGRAM => return Ok(cpu.load_write_pc(value)),
        STACK => cpu.r[13] = value & !3,
        _ => cpu.write(op.t, value),
    }
    Ok(Flow::Next)
}

fn store<T: Datum, A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match try_store::<T, A>(cpu, bus, op) {
        Ok(()) => Flow::Next,
        Err(flow) => flow,
    }
}

#[inline(always)]
fn try_store<T: Datum, A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Result<(), Flow> {
    let base = if A::WRITES_BACK {
        cpu.new_base(A::base(cpu, op), op)?
    } else {
        0
    };
    cpu.store::<T>(bus, A::address(cpu, op), cpu.rt(op))?;
    if A::WRITES_BACK {
        cpu.write(op.n, base);
    }
    Ok(())
}

fn load_dual<A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match try_load_dual::<A>(cpu, bus, op) {
        Ok(()) => Flow::Next,
        Err(flow) => flow,
    }
}

fn try_load_dual<A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Result<(), Flow> {
    let base = if A::WRITES_BACK {
        cpu.new_base(A::base(cpu, op), op)?
    } else {
        0
    };
    let address = A::address(cpu, op);
    let first = cpu.load_aligned::<u32>(bus, address)?;
    let second = cpu.load_aligned::<u32>(bus, address.wrapping_add(4))?;
    cpu.write(op.t, first);
    cpu.write(op.a, second);
    if A::WRITES_BACK {
        cpu.write(op.n, base);
    }
    Ok(())
}

fn store_dual<A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match try_store_dual::<A>(cpu, bus, op) {
        Ok(()) => Flow::Next,
        Err(flow) => flow,
    }
}

fn try_store_dual<A: Addressing>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Result<(), Flow> {
    let base = if A::WRITES_BACK {
        cpu.new_base(A::base(cpu, op), op)?
    } else {
        0
    };
    let address = A::address(cpu, op);
    cpu.store_aligned::<u32>(bus, address, cpu.rt(op))?;
    cpu.store_aligned::<u32>(bus, address.wrapping_add(4), cpu.ra(op))?;
    if A::WRITES_BACK {
        cpu.write(op.n, base);
    }
    Ok(())
}

impl Cpu {
    /// What is written back to the base: of SP, if not below its limit.
    #[inline(always)]
    pub(super) fn new_base(&mut self, base: u32, op: &Op) -> Result<u32, Flow> {
        if op.n == 13 {
            self.check_sp(base, op)
        } else {
            Ok(base)
        }
    }
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    use Class::*;
    Some(match (inst.class(), inst.op()) {
        (Load, I::LDR_immediate | I::LDR_literal | I::LDR_register | I::LDRT) => {
            load_of::<u32>(inst)
        }
        (Load, I::LDRB_immediate | I::LDRB_literal | I::LDRB_register | I::LDRBT) => {
            load_of::<u8>(inst)
        }
        (Load, I::LDRH_immediate | I::LDRH_literal | I::LDRH_register | I::LDRHT) => {
            load_of::<u16>(inst)
        }
        (Load, I::LDRSB_immediate | I::LDRSB_literal | I::LDRSB_register | I::LDRSBT) => {
            load_of::<i8>(inst)
        }
        (Load, _) => load_of::<i16>(inst),
        (Store, I::STR_immediate | I::STR_register | I::STRT) => store_of::<u32>(inst),
        (Store, I::STRB_immediate | I::STRB_register | I::STRBT) => store_of::<u8>(inst),
        (Store, _) => store_of::<u16>(inst),
        (LoadDual, I::LDRD_literal) => load_dual::<Literal>,
        (LoadDual, _) => match (inst.index, inst.wback) {
            (true, false) => load_dual::<Offset>,
            (true, true) => load_dual::<PreIndexed>,
            (false, _) => load_dual::<PostIndexed>,
        },
        (StoreDual, _) => match (inst.index, inst.wback) {
            (true, false) => store_dual::<Offset>,
            (true, true) => store_dual::<PreIndexed>,
            (false, _) => store_dual::<PostIndexed>,
        },
        (Preload, _) => super::system::nothing,
        _ => return None,
    })
}

fn load_of<T: Datum>(inst: &Inst) -> Run {
    match inst.t {
        13 => load_to::<T, STACK>(inst),
        15 => load_to::<T, PROGRAM>(inst),
        _ => load_to::<T, REGISTER>(inst),
    }
}

fn load_to<T: Datum, const TO: u8>(inst: &Inst) -> Run {
    match (inst.index, inst.wback) {
        _ if inst.uses().contains(RegSet::core(15)) => load::<T, Literal, TO>,
        _ if inst.is_by_register() => load::<T, RegisterOffset, TO>,
        (true, false) => load::<T, Offset, TO>,
        (true, true) => load::<T, PreIndexed, TO>,
        (false, _) => load::<T, PostIndexed, TO>,
    }
}

fn store_of<T: Datum>(inst: &Inst) -> Run {
    match (inst.index, inst.wback) {
        _ if inst.is_by_register() => store::<T, RegisterOffset>,
        (true, false) => store::<T, Offset>,
        (true, true) => store::<T, PreIndexed>,
        (false, _) => store::<T, PostIndexed>,
    }
}
