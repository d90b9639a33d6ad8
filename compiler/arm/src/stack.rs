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

/// What an instruction stores by the stack pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// It stores nothing, or not there.
    Nothing,
    /// From one place to another one.
    Bytes(i32, i32),
    /// Nobody knows where.
    Somewhere,
}

/// What an instruction stores by the stack pointer, which is at `sp` before it.
pub fn stored(inst: &Inst, sp: i32) -> Stored {
    let words = match inst.class() {
        _ if inst.n != reg::SP => return Stored::Nothing,
        Class::Store => 1,
        Class::StoreDual => 2,
        Class::StoreMultiple => u32::from(inst.imm as u16).count_ones(),
        Class::FloatStore | Class::FloatStoreMultiple => {
            inst.uses().union(inst.defs()).single_bits().count_ones()
        }
        Class::StoreOrdered => return Stored::Somewhere,
        _ => return Stored::Nothing,
    };
    let bytes = match inst.op() {
        Op::STRB_immediate | Op::STRBT => 1,
        Op::STRH_immediate | Op::STRHT => 2,
        _ if inst.op().identifier().ends_with("_register") => return Stored::Somewhere,
        _ => 4 * words as i32,
    };
    let from = match (inst.class(), inst.op()) {
        (Class::StoreMultiple, Op::STM) => sp,
        (Class::FloatStoreMultiple, Op::VSTMIA | Op::VSTMIA_single | Op::FSTMIAX) => sp,
        (Class::StoreMultiple | Class::FloatStoreMultiple, _) => sp - bytes,
        _ if !inst.index => sp,
        _ if inst.add => sp + inst.imm as i32,
        _ => sp - inst.imm as i32,
    };
    Stored::Bytes(from, from + bytes)
}

/// The slot from which an instruction loads a register, the stack pointer being at `sp` before it.
pub fn loaded_slot(inst: &Inst, sp: i32, register: u8) -> Option<i32> {
    slot(inst, sp, register).filter(|_| match inst.class() {
        // Others load a part of a word, or from where a register says.
        Class::Load => inst.op() == Op::LDR_immediate,
        class => matches!(class, Class::LoadDual | Class::LoadMultiple),
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
