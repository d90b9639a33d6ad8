//! From halfwords to an instruction, or to the reason why there is none.

use crate::arch::Arch;
use crate::cond::{Cond, ItState};
use crate::imm::{ShiftType, decode_imm_shift, thumb_expand_imm, vfp_expand_imm};
use crate::inst::{Inst, fixed_shift};
use crate::limits::{self, Why};
use crate::pattern::{Field, Pattern, gather};
use crate::row::{Encoding, Row};
use crate::rules::Rule;

/// Why halfwords are not an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NotDecoded {
    /// UNDEFINED: the architecture has no such instruction, and raises an exception.
    Undefined,
    /// UNPREDICTABLE: an instruction that may do anything.
    Unpredictable {
        /// What the words say, taken at their word.
        reading: Inst,
        /// The first reason found.
        why: Why,
    },
}

/// Whether a first halfword belongs to a 32-bit instruction.
pub const fn is_wide(hw1: u16) -> bool {
    hw1 >> 11 >= 0b11101
}

/// Decodes the instruction that starts with `hw1` (`hw2` is only looked at when [`is_wide`]) in
/// state `it`.
pub fn decode(hw1: u16, hw2: u16, arch: Arch, it: ItState) -> Result<Inst, NotDecoded> {
    let wide = is_wide(hw1);
    let word = if wide {
        (hw1 as u32) << 16 | hw2 as u32
    } else {
        hw1 as u32
    };
    let encoding = Encoding::find(word, wide, arch).ok_or(NotDecoded::Undefined)?;
    let reading = read(encoding, word, it.cond());
    let last = !it.inside() || it.last();
    match limits::check(&reading, word, arch, it.inside(), last) {
        None => Ok(reading),
        Some(why) => Err(NotDecoded::Unpredictable { reading, why }),
    }
}

/// Reads the operands of `word`, which `encoding` matches, in an IT block with condition `it`.
pub(crate) fn read(encoding: Encoding, word: u32, it: Option<Cond>) -> Inst {
    let row = encoding.row();
    let mut inst = Inst {
        cond: it,
        ..Inst::new(encoding)
    };
    read_registers(&mut inst, row, word);
    read_bits(&mut inst, row, word);
    inst.imm = immediate(row, word, &inst);
    read_shift(&mut inst, row, word);
    if row.rules.has(Rule::SetsFlagsOutsideIt) {
        inst.s = it.is_none();
    }
    if row.rules.has(Rule::WritesBackUnlessListed) {
        inst.wback = inst.imm >> inst.n & 1 == 0;
    }
    inst
}

fn read_registers(inst: &mut Inst, row: &Row, word: u32) {
    let p = &row.pattern;
    for (field, single, slot) in [
        (Field::D, Field::SingleD, &mut inst.d),
        (Field::N, Field::SingleN, &mut inst.n),
        (Field::M, Field::SingleM, &mut inst.m),
    ] {
        if p.has(field) {
            *slot = p.extract(word, field) as u8;
        } else if p.has(single) {
            *slot = single_number(p.extract(word, single), single);
        }
    }
    inst.a = p.extract(word, Field::A) as u8;
    inst.t = p.extract(word, Field::T) as u8;
    inst.t2 = p.extract(word, Field::T2) as u8;
    if row.rules.has(Rule::NIsD) {
        inst.n = inst.d;
    }
    if row.rules.has(Rule::MIsD) {
        inst.m = inst.d;
    }
}

/// Sd and Sm have their least significant bit first.
fn single_number(bits: u32, field: Field) -> u8 {
    let rotated = bits << 1 & 31 | bits >> 4;
    (if field == Field::SingleN {
        bits
    } else {
        rotated
    }) as u8
}

fn read_bits(inst: &mut Inst, row: &Row, word: u32) {
    let p = &row.pattern;
    for (field, bit) in [
        (Field::S, &mut inst.s),
        (Field::P, &mut inst.index),
        (Field::U, &mut inst.add),
        (Field::W, &mut inst.wback),
    ] {
        if p.has(field) {
            *bit = p.extract(word, field) != 0;
        }
    }
    if p.has(Field::Cond) {
        inst.cond = Cond::from_bits(p.extract(word, Field::Cond) as u8);
    }
}

fn immediate(row: &Row, word: u32, inst: &Inst) -> u32 {
    let (p, rules) = (&row.pattern, &row.rules);
    let bits = p.extract(word, Field::Imm);
    let sign = 32 - p.field(Field::Imm).count_ones();
    if p.has(Field::List) {
        list(row, word)
    } else if !p.has(Field::Imm) {
        inst.imm
    } else if rules.has(Rule::Times2) {
        bits * 2
    } else if rules.has(Rule::Times4) {
        bits * 4
    } else if rules.has(Rule::ModifiedImm) {
        thumb_expand_imm(bits)
    } else if rules.has(Rule::Imm16) {
        gather_imm16(bits)
    } else if rules.has(Rule::Relative) {
        (((bits << sign) as i32 >> sign) * 2) as u32
    } else if rules.has(Rule::Relative20) {
        relative20(bits)
    } else if rules.has(Rule::Relative24) {
        relative24(bits)
    } else if rules.has(Rule::Plus1) {
        bits + 1
    } else if rules.has(Rule::Msb) {
        (bits + 1).wrapping_sub(p.extract(word, Field::Amount))
    } else if rules.has(Rule::Float) {
        vfp_expand_imm(bits)
    } else if rules.has(Rule::FractionBits) {
        let size = if p.extract(word, Field::Amount) & 1 == 0 {
            16_u32
        } else {
            32
        };
        size.wrapping_sub(u32::from(single_number(bits, Field::SingleM)))
    } else {
        bits
    }
}

fn list(row: &Row, word: u32) -> u32 {
    let bits = word & row.pattern.field(Field::List);
    let (low, bit8) = (bits & 0xff, bits >> 8 & 1);
    if row.rules.has(Rule::ListLr) {
        low | bit8 << 14
    } else if row.rules.has(Rule::ListPc) {
        low | bit8 << 15
    } else if row.rules.has(Rule::ListOne) {
        1 << (bits >> 12)
    } else {
        bits
    }
}

/// `i:imm4:imm3:imm8`, as the picture has it, to `imm4:i:imm3:imm8`.
fn gather_imm16(bits: u32) -> u32 {
    (bits >> 11 & 15) << 12 | (bits >> 15 & 1) << 11 | bits & 0x7ff
}

/// `S:imm6:J1:J2:imm11`, as the picture has it, to the offset `S:J2:J1:imm6:imm11:0`.
fn relative20(bits: u32) -> u32 {
    let value = (bits >> 19) << 19
        | gather(bits, 1 << 11) << 18
        | gather(bits, 1 << 12) << 17
        | (bits >> 13 & 63) << 11
        | bits & 0x7ff;
    (((value << 12) as i32) >> 11) as u32
}

/// `S:imm10:J1:J2:imm11`, as the picture has it, to the offset `S:I1:I2:imm10:imm11:0`, where I is
/// J if S, else not J.
fn relative24(bits: u32) -> u32 {
    let s = bits >> 23;
    let (i1, i2) = ((bits >> 12 ^ s ^ 1) & 1, (bits >> 11 ^ s ^ 1) & 1);
    let value = s << 23 | i1 << 22 | i2 << 21 | (bits >> 13 & 0x3ff) << 11 | bits & 0x7ff;
    (((value << 8) as i32) >> 7) as u32
}

fn read_shift(inst: &mut Inst, row: &Row, word: u32) {
    let p: &Pattern = &row.pattern;
    if !p.has(Field::Amount) {
        return;
    }
    let amount = p.extract(word, Field::Amount);
    if row.rules.has(Rule::Bytes) {
        inst.shift = if amount == 0 {
            ShiftType::LSL
        } else {
            ShiftType::ROR
        };
        inst.amount = amount as u8 * 8;
        return;
    }
    let one_bit_type = p.field(Field::ShiftType).count_ones() == 1;
    let kind = match p.has(Field::ShiftType) {
        true => p.extract(word, Field::ShiftType) << one_bit_type as u32,
        false => fixed_shift(row) as u32,
    };
    (inst.shift, inst.amount) = decode_imm_shift(kind, amount);
}
