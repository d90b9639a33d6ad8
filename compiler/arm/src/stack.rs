//! How an instruction uses the stack: by how much it moves the stack pointer, and from or to which
//! slots it loads or stores registers.
//!
//! Places are in bytes from wherever the caller counts. Not here: whose values lie there (the
//! bound's `stack`, `image::unwind`).

use whippen_isa::{Class, Inst, Op, reg};

/// By how many bytes an instruction moves the stack pointer; none where nobody can say.
pub fn moved(inst: &Inst) -> Option<i32> {
    let offset = if inst.add {
        inst.imm as i32
    } else {
        -(inst.imm as i32)
    };
    let words = |count: u32| 4 * count as i32;
    let list = words(u32::from(inst.imm as u16).count_ones());
    let singles = words(inst.uses().union(inst.defs()).single_bits().count_ones());
    match (inst.class(), inst.op()) {
        (_, Op::ADD_SP_plus_immediate) => Some(inst.imm as i32),
        (_, Op::SUB_SP_minus_immediate) => Some(-(inst.imm as i32)),
        (_, Op::PUSH | Op::STMDB) => Some(-list),
        (_, Op::POP | Op::LDM) => Some(list),
        (_, Op::VPUSH | Op::VPUSH_single) => Some(-singles),
        (_, Op::VPOP | Op::VPOP_single) => Some(singles),
        (Class::Load | Class::LoadDual | Class::Store | Class::StoreDual, _)
            if inst.n == reg::SP && inst.wback =>
        {
            Some(offset)
        }
        _ => None,
    }
}

/// The slot from which an instruction loads a register, the stack pointer being at `sp` before it.
pub fn loaded_slot(inst: &Inst, sp: i32, register: u8) -> Option<i32> {
    slot(inst, sp, register).filter(|_| {
        matches!(
            inst.class(),
            Class::Load | Class::LoadDual | Class::LoadMultiple
        )
    })
}

/// The slot to which an instruction stores a register, the stack pointer being at `sp` before it.
pub fn stored_slot(inst: &Inst, sp: i32, register: u8) -> Option<i32> {
    slot(inst, sp, register).filter(|_| {
        matches!(
            inst.class(),
            Class::Store | Class::StoreDual | Class::StoreMultiple
        )
    })
}

fn slot(inst: &Inst, sp: i32, register: u8) -> Option<i32> {
    if inst.n != reg::SP {
        return None;
    }
    let list = inst.imm as u16;
    let below = 4 * (list & ((1_u32 << register) - 1) as u16).count_ones() as i32;
    let offset = match (inst.index, inst.add) {
        (false, _) => 0,
        (true, true) => inst.imm as i32,
        (true, false) => -(inst.imm as i32),
    };
    match inst.class() {
        Class::StoreMultiple | Class::LoadMultiple if list >> register & 1 == 0 => None,
        Class::StoreMultiple if inst.op() == Op::STM => Some(sp + below),
        Class::StoreMultiple => Some(sp - 4 * list.count_ones() as i32 + below),
        Class::LoadMultiple => Some(sp + below),
        Class::Load | Class::Store if inst.t == register => Some(sp + offset),
        Class::StoreDual | Class::LoadDual if inst.t == register => Some(sp + offset),
        Class::StoreDual | Class::LoadDual if inst.t2 == register => Some(sp + offset + 4),
        _ => None,
    }
}
