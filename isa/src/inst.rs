//! An instruction with its operands, and what it reads and writes.
//!
//! One flat record serves the emulator, which decodes once and executes by [`Op`] and operands, and
//! the assembler, which fills operands in and asks for bits. What an operand is does not depend on
//! the encoding: `ADDS R1, #5` (T2) has `d` = `n` = 1, `PUSH` has `n` = 13 and writes back, a
//! modified immediate is expanded, a shift is decoded, a branch offset is in bytes. So two
//! encodings of one instruction differ in `encoding` alone, and [`Inst::shortest`] may try them in
//! turn.
//!
//! Roles, for pipelines: `n` and `m` of a load or store form its address and `t`, `t2` or the list
//! is its data; `m` is the operand that is shifted; `a` (with `d`, for long products) is the
//! accumulator of a multiply-add.

use crate::arch::Arch;
use crate::class::Class;
use crate::cond::{Cond, ItState};
use crate::effects::{FlagUse, Flags, Operand, Operands};
use crate::imm::{ShiftType, thumb_imm_carry};
use crate::pattern::Field;
use crate::reg::{self, RegSet};
use crate::row::{Encoding, Row};
use crate::rules::Rule;
use crate::table::Op;

/// An instruction: an encoding and its operands. Operands that the encoding does not have keep the
/// value that [`Inst::new`] gives them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Inst {
    /// The encoding, and so the instruction.
    pub encoding: Encoding,
    /// In an IT block, its condition there (which may be `AL`); of B T1 and T3, the branch's own.
    /// Else nothing.
    pub cond: Option<Cond>,
    /// Sets the flags: the S bit, or what the instruction always does.
    pub s: bool,
    /// The address is the base with the offset; else the base alone, changed afterwards.
    pub index: bool,
    /// The offset is added; else subtracted.
    pub add: bool,
    /// The base register is written back.
    pub wback: bool,
    /// Rd, RdLo, Sd, Dd or CRd.
    pub d: u8,
    /// Rn, Sn or CRn.
    pub n: u8,
    /// Rm, Sm, Dm or CRm.
    pub m: u8,
    /// Ra, RdHi, or the number of a coprocessor.
    pub a: u8,
    /// Rt.
    pub t: u8,
    /// Rt2.
    pub t2: u8,
    /// The type of the shift of Rm (Rn of SSAT and USAT).
    pub shift: ShiftType,
    /// The amount of that shift; the lsb of a bit field; a minor opcode.
    pub amount: u8,
    /// The immediate, meant as the instruction means it: constant, byte offset (signed for a
    /// branch), width, register list (bit n for Rn), number of floating-point registers, bits of a
    /// float.
    pub imm: u32,
}

impl Inst {
    /// The encoding with all operands zero, but for those that it implies (such as `n` = SP of
    /// PUSH).
    pub fn new(encoding: Encoding) -> Self {
        let rules = &encoding.row().rules;
        let sp_if = |rule| if rules.has(rule) { reg::SP } else { 0 };
        Self {
            encoding,
            cond: None,
            s: rules.has(Rule::SetsFlags) || rules.has(Rule::SetsFlagsOutsideIt),
            index: true,
            add: !rules.has(Rule::Subtracts),
            wback: rules.has(Rule::WritesBack),
            d: sp_if(Rule::DIsSp),
            n: sp_if(Rule::NIsSp),
            m: 0,
            a: 0,
            t: 0,
            t2: 0,
            shift: fixed_shift(encoding.row()),
            amount: rules.has(Rule::Rrx) as u8,
            imm: 0,
        }
    }

    /// The instruction.
    pub fn op(&self) -> Op {
        self.encoding.op()
    }

    /// The class.
    pub fn class(&self) -> Class {
        self.encoding.class()
    }

    /// 2 or 4 bytes.
    pub fn size(&self) -> u32 {
        self.encoding.size()
    }

    /// The byte offset of a branch from the instruction's address plus 4.
    pub fn offset(&self) -> i32 {
        self.imm as i32
    }

    /// Whether the instruction may be skipped: its condition is other than `AL`.
    pub fn is_conditional(&self) -> bool {
        let always = self.encoding.row().rules.has(Rule::Unconditional);
        !always && self.cond.is_some_and(|c| c != Cond::AL)
    }

    /// The state of IT behind it, where `it` is that in front of it; nothing behind an IT whose
    /// block is UNPREDICTABLE, which [`crate::decode`] does not give.
    pub fn it_behind(&self, it: ItState) -> Option<ItState> {
        match self.class() {
            Class::It => ItState::after_it((self.imm >> 4) as u8, (self.imm & 15) as u8),
            _ => Some(it.advance()),
        }
    }

    /// The same operands in the first encoding of the instruction, 16-bit ones first, that `arch`
    /// has and that can hold them; nothing when none can. A B keeps its condition where it is, in
    /// itself (T1, T3) or in the block (T2, T4).
    pub fn shortest(&self, arch: Arch) -> Option<Self> {
        let has_cond = |encoding: Encoding| encoding.row().pattern.has(Field::Cond);
        Encoding::of(self.op())
            .filter(|encoding| has_cond(*encoding) == has_cond(self.encoding))
            .map(|encoding| Self { encoding, ..*self })
            .find(|candidate| candidate.may_have_bits() && candidate.encode(arch).is_ok())
    }

    /// The same operands in the 32-bit encoding of the instruction; nothing when none can hold
    /// them.
    pub fn wide(&self, arch: Arch) -> Option<Self> {
        let has_cond = |encoding: Encoding| encoding.row().pattern.has(Field::Cond);
        Encoding::of(self.op())
            .filter(|encoding| has_cond(*encoding) == has_cond(self.encoding))
            .map(|encoding| Self { encoding, ..*self })
            .filter(|candidate| candidate.size() == 4)
            .find(|candidate| candidate.may_have_bits() && candidate.encode(arch).is_ok())
    }

    /// Whether registers and the S bit, taken by themselves, fit the encoding: a quick no to what
    /// [`Inst::encode`] would refuse.
    fn may_have_bits(&self) -> bool {
        let Row { pattern, rules, .. } = self.encoding.row();
        let fits = |field: Field, register: u8| {
            let places = pattern.field(field);
            places == 0 || u32::from(register) >> places.count_ones() == 0
        };
        fits(Field::D, self.d)
            && fits(Field::N, self.n)
            && fits(Field::M, self.m)
            && fits(Field::T, self.t)
            && (self.n == self.d || !rules.has(Rule::NIsD))
            && (self.m == self.d || !rules.has(Rule::MIsD))
            && (self.s == self.cond.is_none() || !rules.has(Rule::SetsFlagsOutsideIt))
    }

    /// The registers it reads when it executes, address and stored data included; PC for a literal.
    ///
    /// A conditional instruction also leaves its [`Inst::defs`] as they were when it is skipped:
    /// whoever follows values must then count them as read.
    pub fn uses(&self) -> RegSet {
        self.registers(self.encoding.row().effects.reads())
    }

    /// The registers it writes, the written-back base included; PC if it branches.
    pub fn defs(&self) -> RegSet {
        let base = if self.wback {
            RegSet::core(self.n)
        } else {
            RegSet::EMPTY
        };
        self.registers(self.encoding.row().effects.writes())
            .union(base)
    }

    fn registers(&self, operands: Operands) -> RegSet {
        let bit = |operand, register: u8| u16::from(operands.has(operand)) << (register & 15);
        let list = bit(Operand::D, self.d) | bit(Operand::N, self.n) | bit(Operand::M, self.m);
        let list =
            list | bit(Operand::A, self.a) | bit(Operand::T, self.t) | bit(Operand::T2, self.t2);
        operands
            .others()
            .fold(RegSet::core_list(list), |set, operand| {
                set.union(self.registers_of(operand))
            })
    }

    fn registers_of(&self, operand: Operand) -> RegSet {
        let count = self.imm.min(32) as u8;
        match operand {
            Operand::D => RegSet::core(self.d),
            Operand::N => RegSet::core(self.n),
            Operand::M => RegSet::core(self.m),
            Operand::A => RegSet::core(self.a),
            Operand::T => RegSet::core(self.t),
            Operand::T2 => RegSet::core(self.t2),
            Operand::List => RegSet::core_list(self.imm as u16),
            Operand::Lr => RegSet::core(reg::LR),
            Operand::Pc => RegSet::core(reg::PC),
            Operand::SingleD => RegSet::singles(self.d, 1),
            Operand::SingleN => RegSet::singles(self.n, 1),
            Operand::SingleM => RegSet::singles(self.m, 1),
            Operand::SinglePairM => RegSet::singles(self.m, 2),
            Operand::DoubleD => RegSet::doubles(self.d, 1),
            Operand::DoubleM => RegSet::doubles(self.m, 1),
            Operand::SingleList => RegSet::singles(self.d, count),
            Operand::DoubleList => RegSet::doubles(self.d, count),
            Operand::SingleAll => RegSet::singles(0, 32),
            Operand::Banked if reg::is_stack_pointer(self.imm as u8) => RegSet::core(reg::SP),
            Operand::Banked => RegSet::EMPTY,
        }
    }

    /// The flags it reads and writes, its condition's included.
    pub fn flags(&self) -> FlagUse {
        let row = self.encoding.row();
        let rrx = self.shift == ShiftType::RRX;
        let mut flags = row.effects.flags(self.s, self.has_shifter_carry(row), rrx);
        if self.is_conditional() {
            flags.reads |= self.cond.map_or(Flags::NONE, condition_flags);
        }
        flags
    }

    fn has_shifter_carry(&self, row: &Row) -> bool {
        let rotated = row.rules.has(Rule::ModifiedImm) && thumb_imm_carry(self.imm).is_some();
        rotated || self.amount != 0
    }
}

/// The type of shift that an encoding implies.
pub(crate) fn fixed_shift(row: &Row) -> ShiftType {
    let implied = [
        (Rule::Lsr, ShiftType::LSR),
        (Rule::Asr, ShiftType::ASR),
        (Rule::Ror, ShiftType::ROR),
        (Rule::Rrx, ShiftType::RRX),
    ];
    implied
        .iter()
        .find(|(rule, _)| row.rules.has(*rule))
        .map_or(ShiftType::LSL, |(_, shift)| *shift)
}

/// The flags a condition looks at.
const fn condition_flags(cond: Cond) -> Flags {
    match cond {
        Cond::EQ | Cond::NE => Flags::Z,
        Cond::CS | Cond::CC => Flags::C,
        Cond::MI | Cond::PL => Flags::N,
        Cond::VS | Cond::VC => Flags::V,
        Cond::HI | Cond::LS => Flags::C.union(Flags::Z),
        Cond::GE | Cond::LT => Flags::N.union(Flags::V),
        Cond::GT | Cond::LE => Flags::N.union(Flags::V).union(Flags::Z),
        Cond::AL => Flags::NONE,
    }
}
