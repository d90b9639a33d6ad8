//! From an instruction to halfwords.
//!
//! The answer is checked by reading it back: bits are packed without asking whether an operand
//! fits, and only those that decode to the same instruction leave this module.

use crate::arch::Arch;
use crate::cond::Cond;
use crate::decode::read;
use crate::imm::{encode_imm_shift, thumb_shrink_imm, vfp_shrink_imm};
use crate::inst::Inst;
use crate::limits::{self, Why};
use crate::pattern::{Field, scatter};
use crate::row::{Encoding, Row};
use crate::rules::Rule;

/// An encoded instruction.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Code {
    /// 16 bits.
    Narrow(u16),
    /// 32 bits: first and second halfword.
    Wide(u16, u16),
}

impl Code {
    /// The halfwords in memory order; the second of a 16-bit instruction is absent.
    pub const fn halfwords(self) -> (u16, Option<u16>) {
        match self {
            Self::Narrow(hw1) => (hw1, None),
            Self::Wide(hw1, hw2) => (hw1, Some(hw2)),
        }
    }

    /// The size in bytes, 2 or 4.
    pub const fn size(self) -> u32 {
        match self {
            Self::Narrow(_) => 2,
            Self::Wide(..) => 4,
        }
    }
}

/// Why an instruction has no bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NotEncoded {
    /// The architecture lacks the encoding.
    Absent,
    /// An operand does not fit the encoding, or one that it does not have is not at rest; as the
    /// encoding would have it, it reads like this.
    DoesNotFit {
        /// The instruction that the nearest bits stand for.
        nearest: Inst,
    },
    /// The bits belong to another encoding, such as ORR with Rn = PC, which is MOV.
    Shadowed {
        /// The encoding that reads them.
        by: Option<Encoding>,
    },
    /// The bits would be UNPREDICTABLE.
    Unpredictable(Why),
}

impl Inst {
    /// The bits of the instruction. In an IT block ([`Inst::cond`]) the position is taken to be the
    /// last, which any instruction that may stand in a block allows; the block itself is the
    /// caller's.
    pub fn encode(&self, arch: Arch) -> Result<Code, NotEncoded> {
        if !self.encoding.exists_in(arch) {
            return Err(NotEncoded::Absent);
        }
        let row = self.encoding.row();
        let word = pack(self, row);
        let it = if row.pattern.has(Field::Cond) {
            None
        } else {
            self.cond
        };
        let nearest = read(self.encoding, word, it);
        if nearest != *self {
            return Err(NotEncoded::DoesNotFit { nearest });
        }
        let by = Encoding::find(word, row.pattern.wide, arch);
        if by != Some(self.encoding) {
            return Err(NotEncoded::Shadowed { by });
        }
        if let Some(why) = limits::check(self, word, arch, it.is_some(), true) {
            return Err(NotEncoded::Unpredictable(why));
        }
        Ok(if row.pattern.wide {
            Code::Wide((word >> 16) as u16, word as u16)
        } else {
            Code::Narrow(word as u16)
        })
    }
}

/// The word that has the operands in their places, cut to fit.
pub(crate) fn pack(inst: &Inst, row: &Row) -> u32 {
    let p = &row.pattern;
    let mut word = p.bits | p.should_bits;
    let mut put = |field, value: u32| word |= scatter(value, p.field(field));
    put(Field::D, inst.d as u32);
    put(Field::N, inst.n as u32);
    put(Field::M, inst.m as u32);
    put(Field::RepeatM, inst.m as u32);
    put(Field::A, inst.a as u32);
    put(Field::T, inst.t as u32);
    put(Field::T2, inst.t2 as u32);
    put(Field::SingleD, rotate_single(inst.d));
    put(Field::SingleN, inst.n as u32);
    put(Field::SingleM, rotate_single(inst.m));
    put(Field::S, inst.s as u32);
    put(Field::P, inst.index as u32);
    put(Field::U, inst.add as u32);
    put(Field::W, inst.wback as u32);
    put(Field::Cond, inst.cond.unwrap_or(Cond::AL).bits() as u32);
    put(Field::Imm, immediate_bits(inst, row));
    let (kind, amount) = shift_bits(inst, row);
    put(Field::ShiftType, kind);
    put(Field::Amount, amount);
    word | list_bits(inst, row)
}

/// The least significant bit first: the inverse of reading Sd or Sm.
fn rotate_single(number: u8) -> u32 {
    (number as u32 & 1) << 4 | number as u32 >> 1 & 15
}

fn immediate_bits(inst: &Inst, row: &Row) -> u32 {
    let (imm, rules) = (inst.imm, &row.rules);
    if rules.has(Rule::Times2) || rules.has(Rule::Relative) {
        imm / 2
    } else if rules.has(Rule::Times4) {
        imm / 4
    } else if rules.has(Rule::ModifiedImm) {
        thumb_shrink_imm(imm).unwrap_or(0)
    } else if rules.has(Rule::Imm16) {
        (imm >> 11 & 1) << 15 | (imm >> 12 & 15) << 11 | imm & 0x7ff
    } else if rules.has(Rule::Relative20) {
        relative20_bits(imm)
    } else if rules.has(Rule::Relative24) {
        relative24_bits(imm)
    } else if rules.has(Rule::Plus1) {
        imm.wrapping_sub(1)
    } else if rules.has(Rule::Msb) {
        imm.wrapping_add(u32::from(inst.amount)).wrapping_sub(1)
    } else if rules.has(Rule::Float) {
        vfp_shrink_imm(imm).unwrap_or(0)
    } else if rules.has(Rule::FractionBits) {
        let size = if inst.amount & 1 == 0 { 16_u32 } else { 32 };
        rotate_single(size.wrapping_sub(imm) as u8)
    } else {
        imm
    }
}

/// `S:J2:J1:imm6:imm11:0` to `S:imm6:J1:J2:imm11`.
fn relative20_bits(offset: u32) -> u32 {
    let (s, j2, j1) = (offset >> 20 & 1, offset >> 19 & 1, offset >> 18 & 1);
    s << 19 | (offset >> 12 & 63) << 13 | j1 << 12 | j2 << 11 | offset >> 1 & 0x7ff
}

/// `S:I1:I2:imm10:imm11:0` to `S:imm10:J1:J2:imm11`.
fn relative24_bits(offset: u32) -> u32 {
    let s = offset >> 24 & 1;
    let (j1, j2) = ((offset >> 23 ^ s ^ 1) & 1, (offset >> 22 ^ s ^ 1) & 1);
    s << 23 | (offset >> 12 & 0x3ff) << 13 | j1 << 12 | j2 << 11 | offset >> 1 & 0x7ff
}

/// The shift's type and amount as the encoding has them.
fn shift_bits(inst: &Inst, row: &Row) -> (u32, u32) {
    if row.rules.has(Rule::Bytes) {
        return (0, inst.amount as u32 / 8);
    }
    let (kind, amount) = encode_imm_shift(inst.shift, inst.amount);
    let one_bit_type = row.pattern.field(Field::ShiftType).count_ones() == 1;
    (kind >> one_bit_type as u32, amount)
}

fn list_bits(inst: &Inst, row: &Row) -> u32 {
    let (places, list) = (row.pattern.field(Field::List), inst.imm);
    let bits = if row.rules.has(Rule::ListLr) {
        list & 0xff | (list >> 14 & 1) << 8
    } else if row.rules.has(Rule::ListPc) {
        list & 0xff | (list >> 15 & 1) << 8
    } else if row.rules.has(Rule::ListOne) {
        (list.trailing_zeros() & 15) << 12
    } else {
        list
    };
    bits & places
}
