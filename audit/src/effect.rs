//! What an instruction does to what is known of registers and flags. What is not spelled out here
//! leaves its results unknown.

use whippen_isa::{Class, Flags, Inst, Op, ShiftType, reg};

use crate::elf::Elf;
use crate::facts::{ALL, Facts, Interval, NONE, holds, unsigned};

/// What an instruction computes.
enum Computed {
    Unknown,
    Within(Interval),
    /// The word that a register holds.
    Copy(u8),
}
use Computed::{Copy, Unknown, Within};

/// An instruction at an address has executed.
pub(crate) fn execute(facts: &mut Facts, inst: &Inst, at: u32, elf: &Elf) {
    let sets_flags = inst.flags().writes.intersects(Flags::NZCV);
    let compared = if sets_flags {
        compared(facts, inst)
    } else {
        None
    };
    let computed = compute(facts, inst, at, elf);
    let counts = inst.op() == Op::CLZ && facts.of(inst.m)[0] > 0;
    let counted = if counts { facts.name_of(inst.m) } else { NONE };
    let name = match computed {
        Unknown => NONE,
        Within(value) => facts.name(value),
        Copy(register) => facts.name_of(register),
    };
    let defs = inst.defs().core_bits();
    for register in (0..16).filter(|register| defs >> register & 1 != 0) {
        facts.names[register] = NONE;
    }
    let into = if inst.class() == Class::Load {
        inst.t
    } else {
        inst.d
    } & 15;
    if name != NONE && defs >> into & 1 != 0 {
        facts.names[usize::from(into)] = name;
    }
    if counts {
        facts.set_counted(counted, name);
    }
    if sets_flags {
        let result = match inst.s {
            true if defs.count_ones() == 1 => facts.name_of(inst.d),
            true => name,
            false => NONE,
        };
        facts.show(compared, result);
    }
}

/// The two words whose difference the flags will show.
fn compared(facts: &mut Facts, inst: &Inst) -> Option<[u16; 2]> {
    let word = i64::from(inst.imm as i32);
    match inst.op() {
        Op::CMP_immediate | Op::SUB_immediate => {
            Some([facts.name_of(inst.n), facts.name([word; 2])])
        }
        Op::RSB_immediate => Some([facts.name([word; 2]), facts.name_of(inst.n)]),
        Op::CMP_register | Op::SUB_register if inst.amount == 0 => {
            Some([facts.name_of(inst.n), facts.name_of(inst.m)])
        }
        _ => None,
    }
}

/// An interval of integers as one of words: any word where the result may have wrapped.
fn wrapped(low: i64, high: i64) -> Computed {
    Within(if holds(ALL, [low, high]) {
        [low, high]
    } else {
        ALL
    })
}

fn compute(facts: &Facts, inst: &Inst, at: u32, elf: &Elf) -> Computed {
    let ([n0, n1], [m0, m1]) = (facts.of(inst.n), facts.of(inst.m));
    let imm = i64::from(inst.imm as i32);
    match inst.op() {
        Op::MOV_register if inst.m != reg::PC => Copy(inst.m),
        Op::MOV_immediate => Within([imm, imm]),
        Op::MVN_immediate => Within([i64::from(!inst.imm as i32); 2]),
        Op::MOVT => match facts.of(inst.d) {
            [low, high] if low == high => {
                Within([i64::from((low as u32 & 0xffff | inst.imm << 16) as i32); 2])
            }
            _ => Unknown,
        },
        Op::ADD_immediate if inst.n != reg::PC => wrapped(n0 + imm, n1 + imm),
        Op::SUB_immediate if inst.n != reg::PC => wrapped(n0 - imm, n1 - imm),
        Op::RSB_immediate => wrapped(imm - n1, imm - n0),
        Op::ADD_register if inst.shift == ShiftType::LSL && inst.amount < 32 => {
            wrapped(n0 + (m0 << inst.amount), n1 + (m1 << inst.amount))
        }
        Op::SUB_register if inst.amount == 0 => wrapped(n0 - m1, n1 - m0),
        Op::MLA => {
            let corners = [n0 * m0, n0 * m1, n1 * m0, n1 * m1];
            let [low, high] = facts.of(inst.a);
            let least = corners.iter().min().copied().unwrap_or(0);
            let most = corners.iter().max().copied().unwrap_or(0);
            // Products of words are at most 2^62.
            wrapped(least + low, most + high)
        }
        Op::AND_immediate | Op::TST_immediate if n0 == n1 => Within([n0 & imm; 2]),
        Op::AND_immediate | Op::TST_immediate if imm >= 0 => Within([0, imm]),
        Op::AND_immediate | Op::TST_immediate => Within(ALL),
        Op::LSL_immediate if inst.amount < 32 => wrapped(m0 << inst.amount, m1 << inst.amount),
        Op::LSL_register if facts.are_counted(inst.n, inst.m) => Within([ALL[0], -1]),
        Op::CLZ if m0 > 0 => Within([m1, m0].map(|word| i64::from(word.leading_zeros()) - 32)),
        Op::ASR_immediate => Within([m0 >> inst.amount.min(63), m1 >> inst.amount.min(63)]),
        Op::LSR_immediate if inst.amount != 0 || m0 >= 0 => {
            Within(unsigned([m0, m1]).map(|word| word >> inst.amount.min(63)))
        }
        Op::UBFX if inst.imm < 32 => Within([0, (1 << inst.imm) - 1]),
        Op::SBFX => Within(signed(inst.imm)),
        _ => narrowed(facts, inst, at, elf),
    }
}

/// Extension, saturation, loads.
fn narrowed(facts: &Facts, inst: &Inst, at: u32, elf: &Elf) -> Computed {
    let extended = |reach: Interval| match inst.amount == 0 && holds(reach, facts.of(inst.m)) {
        true => Copy(inst.m),
        false => Within(reach),
    };
    let limited = |reach: Interval| match inst.amount == 0 {
        true if holds(reach, facts.of(inst.n)) => Copy(inst.n),
        true => Within(facts.of(inst.n).map(|at| at.clamp(reach[0], reach[1]))),
        false => Within(reach),
    };
    match inst.op() {
        Op::UXTB => extended([0, 0xff]),
        Op::UXTH => extended([0, 0xffff]),
        Op::SXTB => extended(signed(8)),
        Op::SXTH => extended(signed(16)),
        Op::SSAT => limited(signed(inst.imm)),
        Op::USAT => limited([0, (1 << inst.imm.min(31)) - 1]),
        Op::LDR_literal => {
            let base = at.wrapping_add(4) & !3;
            let from = match inst.add {
                true => base.wrapping_add(inst.imm),
                false => base.wrapping_sub(inst.imm),
            };
            elf.word(from)
                .map_or(Unknown, |word| Within([i64::from(word as i32); 2]))
        }
        Op::LDRB_immediate | Op::LDRB_register | Op::LDRB_literal => Within([0, 0xff]),
        Op::LDRH_immediate | Op::LDRH_register | Op::LDRH_literal => Within([0, 0xffff]),
        Op::LDRSB_immediate | Op::LDRSB_register | Op::LDRSB_literal => Within(signed(8)),
        Op::LDRSH_immediate | Op::LDRSH_register | Op::LDRSH_literal => Within(signed(16)),
        _ => Unknown,
    }
}

/// Words of so many bits with a sign.
fn signed(bits: u32) -> Interval {
    let half = 1_i64 << (bits.clamp(1, 32) - 1);
    [-half, half - 1]
}
