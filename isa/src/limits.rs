//! What is UNPREDICTABLE: every limit of the manual, checked in one place on the way in and out.
//!
//! The limits are those of the ARMv7-M manual and, for what is new there, of the ARMv8-M manual.
//! Where architectures differ (special registers, CPS, no IT in ARMv6-M), `arch` decides. The GNU
//! assembler refuses the same, but for what `tests/oracle/binutils.rs` lists.

use crate::arch::Arch;
use crate::cond::ItState;
use crate::imm::ShiftType;
use crate::inst::Inst;
use crate::pattern::Field;
use crate::reg::{self, LR, PC, SP};
use crate::row::Row;
use crate::rules::Rule;
use crate::table::Op;

/// Why an instruction is UNPREDICTABLE.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Why {
    /// A should-be-zero or should-be-one bit is not.
    ShouldBe,
    /// SP where it may not be.
    Sp,
    /// PC where it may not be.
    Pc,
    /// Two registers that must differ are the same, or two fields that must agree do not.
    SameRegister,
    /// Its place in an IT block, or the block itself.
    It,
    /// The list of registers.
    List,
    /// The immediate, bit field or floating-point list leaves its range.
    Range,
    /// A special register, or a part of it, that does not exist.
    SpecialRegister,
}

/// The first limit that `inst`, encoded as `word`, breaks.
pub(crate) fn check(
    inst: &Inst,
    word: u32,
    arch: Arch,
    in_it: bool,
    last_in_it: bool,
) -> Option<Why> {
    let row = inst.encoding.row();
    let broken = [
        (should_be(row, word), Why::ShouldBe),
        (names(inst, row.rules.not_sp, SP), Why::Sp),
        (
            names(inst, row.rules.not_pc, PC) || bad_sp_or_pc(inst, row),
            Why::Pc,
        ),
        (repeated(inst, row, word), Why::SameRegister),
        (
            place_in_it(inst, row, in_it, last_in_it) || (in_it && arch == Arch::V6M),
            Why::It,
        ),
        (bad_list(inst, row), Why::List),
        (out_of_range(inst, row, word), Why::Range),
        (special(inst, row, arch), Why::SpecialRegister),
    ];
    broken
        .iter()
        .find(|(is_broken, _)| *is_broken)
        .map(|(_, why)| *why)
}

fn should_be(row: &Row, word: u32) -> bool {
    word & row.pattern.should_mask != row.pattern.should_bits
}

/// Whether one of the limited registers is `number`.
fn names(inst: &Inst, slots: u8, number: u8) -> bool {
    let registers = [inst.d, inst.n, inst.m, inst.a, inst.t, inst.t2];
    (0..registers.len()).any(|i| slots >> i & 1 != 0 && registers[i] == number)
}

fn bad_sp_or_pc(inst: &Inst, row: &Row) -> bool {
    let rules = &row.rules;
    let is = |number| (inst.d == number, inst.m == number);
    let bad_mov = || match (inst.s, is(SP), is(PC)) {
        (true, sp, pc) => sp.0 || sp.1 || pc.0 || pc.1,
        (false, sp, pc) => (sp.0 && sp.1) || pc.0 || pc.1,
    };
    let far_shift = || inst.shift != ShiftType::LSL || inst.amount > 3;
    (rules.has(Rule::MovSp) && bad_mov())
        || (rules.has(Rule::SpLsl3) && inst.d == SP && far_shift())
        || (rules.has(Rule::PcPlusPc) && inst.d == PC && inst.m == PC)
        || (rules.has(Rule::NoWritebackOfPc) && inst.n == PC && (inst.wback || !inst.index))
        || (rules.has(Rule::NoWriteback) && inst.wback)
}

fn repeated(inst: &Inst, row: &Row, word: u32) -> bool {
    let rules = &row.rules;
    let repeat = row.pattern.has(Field::RepeatM)
        && row.pattern.extract(word, Field::RepeatM) != inst.m as u32;
    let has_second = row.pattern.has(Field::T2);
    let base_is_data = || inst.n == inst.t || (has_second && inst.n == inst.t2);
    repeat
        || (rules.has(Rule::DistinctDN) && inst.d == inst.n)
        || (rules.has(Rule::DistinctDT) && inst.d == inst.t)
        || (rules.has(Rule::DistinctDA) && inst.d == inst.a)
        || (rules.has(Rule::DistinctT) && inst.t == inst.t2)
        || (rules.has(Rule::NoWritebackOfT) && inst.wback && base_is_data())
        || (rules.has(Rule::NotBothLow) && inst.n < 8 && inst.m < 8)
}

fn place_in_it(inst: &Inst, row: &Row, in_it: bool, last: bool) -> bool {
    let rules = &row.rules;
    let writes_pc = || inst.defs().contains(reg::RegSet::core(PC));
    let no_block = || inst.it_behind(ItState::OUTSIDE).is_none();
    (in_it && rules.has(Rule::NotInIt))
        || (in_it && !last && rules.has(Rule::LastInIt))
        || (in_it && !last && rules.has(Rule::LastInItIfPc) && writes_pc())
        || (rules.has(Rule::ItBlock) && no_block())
}

fn bad_list(inst: &Inst, row: &Row) -> bool {
    let (rules, list) = (&row.rules, inst.imm);
    let has = |number: u8| list >> number & 1 != 0;
    (rules.has(Rule::List1) && list == 0)
        || (rules.has(Rule::List2) && list.count_ones() < 2)
        || (rules.has(Rule::ListNotPcAndLr) && has(PC) && has(LR))
        || (rules.has(Rule::ListWithoutN) && inst.wback && has(inst.n))
        || (rules.has(Rule::ListWithoutSp) && has(SP))
        || (rules.has(Rule::ListWithoutPc) && has(PC))
}

fn out_of_range(inst: &Inst, row: &Row, word: u32) -> bool {
    let (rules, count, first) = (&row.rules, inst.imm, inst.d as u32);
    let zero_replicated = || inst.imm == 0 && row.pattern.extract(word, Field::Imm) != 0;
    let no_field = || inst.imm == 0 || inst.imm > 32 || inst.amount as u32 + inst.imm > 32;
    (rules.has(Rule::ModifiedImm) && zero_replicated())
        || (rules.has(Rule::FieldInside) && no_field())
        || (rules.has(Rule::Singles) && (count == 0 || first + count > 32))
        || (rules.has(Rule::Doubles) && (count == 0 || first + count > 16))
        || (rules.has(Rule::FractionBits) && inst.imm > 32)
        || (rules.has(Rule::AlignedIfPc) && inst.t == PC && !inst.imm.is_multiple_of(4))
        || (rules.has(Rule::M31) && inst.m == 31)
}

fn special(inst: &Inst, row: &Row, arch: Arch) -> bool {
    let rules = &row.rules;
    // Bit 1 of the mask selects NZCVQ, bit 0 the GE bits, which only APSR has, and only with the
    // DSP extension.
    let has_ge = inst.op() == Op::MSR_APSR && arch != Arch::V6M;
    let bad_mask = || inst.amount == 0 || (inst.amount != 2 && !has_ge);
    let bad_cps = || inst.amount == 0 || (arch == Arch::V6M && inst.amount != 2);
    (rules.has(Rule::SpecialRegister) && !reg::has_special(arch, inst.imm as u8))
        || (rules.has(Rule::SpecialMask) && bad_mask())
        || (rules.has(Rule::CpsMasks) && bad_cps())
}
