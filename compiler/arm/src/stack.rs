//! How an instruction uses the stack: by how much it moves the stack pointer, and from or to which
//! slots it loads or stores registers.
//!
//! Places are in bytes from wherever the caller counts. Not here: whose values lie there (the
//! bound's `stack`, `image::unwind`).

use whippen_isa::{Class, Inst, Op, reg};

/// By how many bytes an instruction moves the stack pointer; none where nobody can say.
pub fn moved(inst: &Inst) -> Option<i32> {
    let bytes = 4 * i32::from(inst.words());
    match (inst.class(), inst.op()) {
        (_, Op::ADD_SP_plus_immediate) => Some(inst.imm as i32),
        (_, Op::SUB_SP_minus_immediate) => Some(-(inst.imm as i32)),
        (_, Op::PUSH | Op::STMDB | Op::VPUSH | Op::VPUSH_single) => Some(-bytes),
        (_, Op::POP | Op::LDM | Op::VPOP | Op::VPOP_single) => Some(bytes),
        (Class::Load | Class::LoadDual | Class::Store | Class::StoreDual, _)
            if inst.n == reg::SP && inst.wback =>
        {
            Some(inst.displacement())
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
    if inst.n != reg::SP || !inst.class().is_store() {
        return Stored::Nothing;
    }
    let bytes = match inst.op() {
        Op::STRB_immediate | Op::STRBT => 1,
        Op::STRH_immediate | Op::STRHT => 2,
        _ => 4 * i32::from(inst.words()),
    };
    match inst.first_offset() {
        Some(offset) if inst.class() != Class::StoreOrdered => {
            Stored::Bytes(sp + offset, sp + offset + bytes)
        }
        _ => Stored::Somewhere,
    }
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
    let from = sp + inst.first_offset()?;
    match inst.class() {
        Class::StoreMultiple | Class::LoadMultiple if list >> register & 1 == 0 => None,
        Class::StoreMultiple | Class::LoadMultiple => Some(from + below),
        Class::Load | Class::Store if inst.t == register => Some(from),
        Class::StoreDual | Class::LoadDual if inst.t == register => Some(from),
        Class::StoreDual | Class::LoadDual if inst.t2 == register => Some(from + 4),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::{Arch, parse};

    fn inst(text: &str) -> Inst {
        parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
    }

    /// The stack pointer is at -32.
    #[test]
    fn stores_go_where_their_addresses_say() {
        use Stored::*;
        for (text, bytes) in [
            ("push {r4, lr}", Bytes(-40, -32)),
            ("stm sp, {r0, r1}", Bytes(-32, -24)),
            ("str r0, [sp, #8]", Bytes(-24, -20)),
            ("str r0, [sp, #-8]!", Bytes(-40, -36)),
            ("str r0, [sp], #8", Bytes(-32, -28)),
            ("strb r0, [sp, #1]", Bytes(-31, -30)),
            ("strh r0, [sp, #2]", Bytes(-30, -28)),
            ("strd r0, r1, [sp, #8]", Bytes(-24, -16)),
            ("vpush {s0-s2}", Bytes(-44, -32)),
            ("vstmia sp, {d0-d1}", Bytes(-32, -16)),
            // It leaves a word behind what it stores.
            ("fstmdbx sp!, {d0-d1}", Bytes(-52, -36)),
            ("vstr d0, [sp, #8]", Bytes(-24, -16)),
            ("str.w r0, [sp, r1]", Somewhere),
            ("strb.w r0, [sp, r1]", Somewhere),
            ("stl r0, [sp]", Somewhere),
            ("str r0, [r1]", Nothing),
            ("pop {r4}", Nothing),
        ] {
            assert_eq!(stored(&inst(text), -32), bytes, "{text}");
        }
    }

    #[test]
    fn slots_are_those_of_registers() {
        let r4 = |text| {
            let inst = inst(text);
            [stored_slot(&inst, -32, 4), loaded_slot(&inst, -32, 4)]
        };
        for (text, slots) in [
            ("push {r3, r4, lr}", [Some(-40), None]),
            ("stm sp, {r3, r4}", [Some(-28), None]),
            ("stm sp, {r3, r5}", [None, None]),
            ("str.w r4, [sp, #8]", [Some(-24), None]),
            ("strd r3, r4, [sp, #8]", [Some(-20), None]),
            ("pop {r3, r4}", [None, Some(-28)]),
            ("ldmdb sp, {r3, r4, r5}", [None, Some(-40)]),
            ("ldr r4, [sp], #8", [None, Some(-32)]),
            ("ldrd r4, r5, [sp, #8]", [None, Some(-24)]),
            ("ldrb.w r4, [sp, #8]", [None, None]),
            ("ldr.w r4, [sp, r1]", [None, None]),
            ("ldr r4, [r1]", [None, None]),
        ] {
            assert_eq!(r4(text), slots, "{text}");
        }
    }
}
