//! Loads and stores of lists of registers. `imm` is the list.

use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Class, Inst, Op as I};

/// LDM, LDMDB, POP: registers change only when all of them are there.
fn load<const DOWN: bool, const BACK: bool, const PROGRAM: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Flow {
    match try_load::<DOWN, BACK, PROGRAM>(cpu, bus, op) {
        Ok(flow) | Err(flow) => flow,
    }
}

#[inline(always)]
fn try_load<const DOWN: bool, const BACK: bool, const PROGRAM: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Result<Flow, Flow> {
    let (mut address, base) = range::<DOWN>(cpu, op);
    let base = if BACK { cpu.new_base(base, op)? } else { base };
    let mut values = [0; 16];
    for register in registers(op.imm) {
        values[register & 15] = cpu.load_aligned::<u32>(bus, address)?;
        address = address.wrapping_add(4);
    }
    if PROGRAM {
        cpu.check_branch(values[15])?;
    }
    for register in registers(op.imm & 0x7fff) {
        cpu.r[register & 15] = values[register & 15];
    }
    if BACK {
        cpu.write(op.n, base);
    }
    if PROGRAM {
        Ok(cpu.load_write_pc(values[15]))
    } else {
        Ok(Flow::Next)
    }
}

/// STM, STMDB, PUSH.
fn store<const DOWN: bool, const BACK: bool>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match try_store::<DOWN, BACK>(cpu, bus, op) {
        Ok(()) => Flow::Next,
        Err(flow) => flow,
    }
}

#[inline(always)]
fn try_store<const DOWN: bool, const BACK: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Result<(), Flow> {
    let (mut address, base) = range::<DOWN>(cpu, op);
    let base = if BACK { cpu.new_base(base, op)? } else { base };
    for register in registers(op.imm) {
        cpu.store_aligned::<u32>(bus, address, cpu.r[register & 15])?;
        address = address.wrapping_add(4);
    }
    if BACK {
        cpu.write(op.n, base);
    }
    Ok(())
}

/// The lowest address and the base afterwards.
fn range<const DOWN: bool>(cpu: &Cpu, op: &Op) -> (u32, u32) {
    let (base, bytes) = (cpu.rn(op), 4 * op.imm.count_ones());
    match DOWN {
        true => (base.wrapping_sub(bytes), base.wrapping_sub(bytes)),
        false => (base, base.wrapping_add(bytes)),
    }
}

/// The members of a list, lowest first.
#[inline(always)]
fn registers(mut list: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let register = list.trailing_zeros();
        list &= list.wrapping_sub(1);
        (register < 32).then_some(register as usize)
    })
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    let down = matches!(inst.op(), I::LDMDB | I::STMDB | I::PUSH);
    let program = inst.imm >> 15 & 1 != 0;
    Some(match (inst.class(), down, inst.wback, program) {
        (Class::LoadMultiple, false, false, false) => load::<false, false, false>,
        (Class::LoadMultiple, false, false, true) => load::<false, false, true>,
        (Class::LoadMultiple, false, true, false) => load::<false, true, false>,
        (Class::LoadMultiple, false, true, true) => load::<false, true, true>,
        (Class::LoadMultiple, true, false, false) => load::<true, false, false>,
        (Class::LoadMultiple, true, false, true) => load::<true, false, true>,
        (Class::LoadMultiple, true, true, false) => load::<true, true, false>,
        (Class::LoadMultiple, true, true, true) => load::<true, true, true>,
        (Class::StoreMultiple, false, false, _) => store::<false, false>,
        (Class::StoreMultiple, false, true, _) => store::<false, true>,
        (Class::StoreMultiple, true, false, _) => store::<true, false>,
        (Class::StoreMultiple, true, true, _) => store::<true, true>,
        _ => return None,
    })
}
