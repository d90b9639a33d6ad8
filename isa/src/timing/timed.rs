//! What an instruction alone decides about its cycles.

use super::facts::{Core, Kind, Line, Takers};
use crate::class::Class;
use crate::effects::Flags;
use crate::imm::{ShiftType, thumb_imm_carry};
use crate::inst::Inst;
use crate::reg::{self, RegSet};
use crate::rules::Rule;
use crate::table::Op;

/// An instruction as the timing of one core sees it: [`Core::prepare`] makes it, [`Core::issue`]
/// counts it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Timed {
    pub(super) singles_read: u32,
    /// Those it writes, late where its line says so.
    pub(super) singles_late: u32,
    /// Source operands that are none of the next two.
    pub(super) operands: u16,
    /// Registers that form an address.
    pub(super) addresses: u16,
    /// The accumulator or addend.
    pub(super) sums: u16,
    /// What `sums` are: ACCUMULATOR or ADDEND.
    pub(super) sums_as: Takers,
    /// Core registers whose result is late.
    pub(super) late: u16,
    pub(super) late_for: Takers,
    pub(super) about: u32,
    /// The line of the core's table.
    pub(super) line: u8,
    pub(super) cycles: u8,
    pub(super) float_hold: u8,
    pub(super) float_delay: u8,
}

impl Timed {
    pub(super) const NARROW: u32 = 1;
    /// May write PC.
    pub(super) const BRANCHES: u32 = 2;
    /// Loads PC.
    pub(super) const LOADS_PC: u32 = 4;
    /// NOP, B with or without condition, BX LR.
    pub(super) const FOLDS: u32 = 8;
    /// Has a condition.
    pub(super) const CONDITIONAL: u32 = 16;
    /// NOP or IT of 16 bits: shares its cycle with what follows.
    pub(super) const EMPTY: u32 = 32;
    /// Sets the flags, outside an IT block.
    pub(super) const SETS_FLAGS: u32 = 64;
    pub(super) const READS_FLAGS: u32 = 128;
    /// PUSH or POP.
    pub(super) const STACK: u32 = 256;
    pub(super) const DIVIDES: u32 = 512;
    /// Needs the floating-point unit.
    pub(super) const FLOAT: u32 = 1024;
    /// Its flags are one cycle late.
    pub(super) const LATE_FLAGS: u32 = 2048;
    /// A floating-point multiply-add.
    pub(super) const FLOAT_SUM: u32 = 4096;
    /// Starts under a load before it.
    pub(super) const OVERLAPS: u32 = 8192;
    /// The next may start under it.
    pub(super) const OVERLAPPED: u32 = 16384;
    /// Writes the flags of FPSCR.
    pub(super) const WRITES_FPSCR: u32 = 32768;
    /// Reads them.
    pub(super) const READS_FPSCR: u32 = 65536;
    /// A load or store.
    pub(super) const MEMORY: u32 = 131072;
    pub(super) const IT: u32 = 262144;
    pub(super) const LOADS: u32 = 524288;

    pub(super) const fn is(&self, about: u32) -> bool {
        self.about & about != 0
    }

    /// The number of the line of [`Core::lines`] that counts it.
    pub const fn line(&self) -> usize {
        self.line as usize
    }
}

impl Core {
    /// Everything about `inst` that does not depend on its execution.
    pub fn prepare(&self, inst: &Inst) -> Timed {
        let (number, mut line) = self.line_of(inst);
        let late_flags =
            line.kind == Kind::ShiftedRegisterFlags && self.rules.shifted_register_flags == 1;
        if late_flags {
            line = self.line(&Inst { s: false, ..*inst });
        }
        let (uses, defs) = (inst.uses(), inst.defs());
        let (operands, addresses, sums, sums_as) = sources(inst, uses);
        let late = if line.late_for.is_empty() {
            0
        } else {
            last_results(inst, defs)
                | if line.late_base {
                    written_base(inst)
                } else {
                    0
                }
        };
        let mut timed = Timed {
            singles_read: uses.single_bits(),
            singles_late: defs.single_bits(),
            operands,
            addresses,
            sums,
            sums_as,
            late,
            late_for: if late == 0 {
                Takers::NONE
            } else {
                line.late_for
            },
            about: about(inst, defs) | overlap(&line),
            line: number,
            cycles: line
                .cycles
                .saturating_add(line.each.saturating_mul(count(inst, uses.union(defs))))
                .saturating_add(if self.rules.at_worst { line.worst } else { 0 }),
            float_hold: line.float_hold,
            float_delay: line.float_delay,
        };
        if late_flags {
            timed.about |= Timed::LATE_FLAGS;
        }
        timed
    }

    /// The line that counts an instruction.
    pub fn line(&self, inst: &Inst) -> Line {
        self.line_of(inst).1
    }

    /// It and its number. No line counts what the architecture does not have; one cycle then.
    fn line_of(&self, inst: &Inst) -> (u8, Line) {
        let class = inst.class();
        let fits = |line: &Line| line.classes.contains(&class) && line.kind.fits(inst);
        let number = self
            .lines
            .iter()
            .position(fits)
            .unwrap_or(self.lines.len().saturating_sub(1));
        (
            number as u8,
            self.lines
                .get(number)
                .copied()
                .unwrap_or(Line::new(&[], Kind::Any, 1)),
        )
    }
}

impl Kind {
    fn fits(self, inst: &Inst) -> bool {
        match self {
            Self::Any => true,
            Self::Op(op) => inst.op() == op,
            Self::ShiftedRegister => has_shifted_register(inst),
            Self::ShiftedRegisterFlags => inst.s && has_shifted_register(inst),
            Self::ShiftedConstant => has_shifted_constant(inst),
            Self::ShiftedConstantFlags => inst.s && has_shifted_constant(inst),
            Self::Flags => inst.s,
            Self::RegisterOffset => matches!(
                inst.op(),
                Op::LDR_register
                    | Op::LDRB_register
                    | Op::LDRH_register
                    | Op::LDRSB_register
                    | Op::LDRSH_register
                    | Op::STR_register
                    | Op::STRB_register
                    | Op::STRH_register
            ),
            Self::Double => inst.uses().union(inst.defs()).single_bits().count_ones() == 2,
            Self::WritesPc => inst.defs().contains(RegSet::core(reg::PC)),
        }
    }
}

/// Shifted by other than LSL #0 to #3.
fn has_shifted_register(inst: &Inst) -> bool {
    inst.amount != 0 && (inst.shift != ShiftType::LSL || inst.amount > 3)
}

/// A modified immediate that is a rotated byte.
fn has_shifted_constant(inst: &Inst) -> bool {
    inst.encoding.row().rules.has(Rule::ModifiedImm) && thumb_imm_carry(inst.imm).is_some()
}

/// Core registers read: as operands, as addresses, as accumulator or addend; and which of the last
/// two.
fn sources(inst: &Inst, uses: RegSet) -> (u16, u16, u16, Takers) {
    use Class::*;
    let reads = uses.core_bits();
    let only = |set: RegSet| set.core_bits() & reads;
    let class = inst.class();
    if class.is_load() || class.is_store() || matches!(class, TableBranch | Preload) {
        return (0, only(addresses(inst)), 0, Takers::NONE);
    }
    let (sums, sums_as) = match class {
        MultiplyAdd => (only(RegSet::core(inst.a)), Takers::ACCUMULATOR),
        MultiplyAddLong => (
            only(RegSet::core(inst.a).union(RegSet::core(inst.d))),
            Takers::ACCUMULATOR,
        ),
        ExtendAdd => (only(RegSet::core(inst.n)), Takers::ADDEND),
        _ => (0, Takers::NONE),
    };
    let factors = RegSet::core(inst.m).union(if class == ExtendAdd {
        RegSet::EMPTY
    } else {
        RegSet::core(inst.n)
    });
    let operands = if sums == 0 { reads } else { only(factors) };
    (operands, 0, sums, sums_as)
}

/// The registers of an address: a register offset only where there is one; PC is always there.
fn addresses(inst: &Inst) -> RegSet {
    let indexed = Kind::RegisterOffset.fits(inst)
        || matches!(inst.class(), Class::TableBranch | Class::Preload);
    let index = if indexed {
        RegSet::core(inst.m)
    } else {
        RegSet::EMPTY
    };
    RegSet::core(inst.n)
        .union(index)
        .without(RegSet::core(reg::PC))
}

/// The registers whose result may be late: the last one loaded, or all results but PC and a
/// written-back base.
fn last_results(inst: &Inst, defs: RegSet) -> u16 {
    let not_pc = !RegSet::core(reg::PC).core_bits();
    match inst.class() {
        Class::Load | Class::LoadOrdered => RegSet::core(inst.t).core_bits() & not_pc,
        Class::LoadDual => RegSet::core(inst.t2).core_bits(),
        Class::LoadMultiple => top_of_list(inst.imm as u16) & not_pc,
        _ => defs.core_bits() & not_pc,
    }
}

/// The base that an access writes back.
fn written_base(inst: &Inst) -> u16 {
    if inst.wback {
        RegSet::core(inst.n).core_bits()
    } else {
        0
    }
}

const fn top_of_list(list: u16) -> u16 {
    if list == 0 {
        0
    } else {
        1 << (15 - list.leading_zeros())
    }
}

/// How many registers a list has, of the registers that are touched.
fn count(inst: &Inst, touched: RegSet) -> u8 {
    match inst.class() {
        Class::LoadMultiple | Class::StoreMultiple => (inst.imm as u16).count_ones() as u8,
        Class::FloatLoadMultiple | Class::FloatStoreMultiple => {
            touched.single_bits().count_ones() as u8
        }
        _ => 0,
    }
}

fn overlap(line: &Line) -> u32 {
    let overlaps = if line.overlaps { Timed::OVERLAPS } else { 0 };
    overlaps
        | if line.overlapped {
            Timed::OVERLAPPED
        } else {
            0
        }
}

fn about(inst: &Inst, defs: RegSet) -> u32 {
    let (class, narrow) = (inst.class(), inst.size() == 2);
    let writes_pc = defs.contains(RegSet::core(reg::PC));
    let bx_lr = inst.op() == Op::BX && inst.m == reg::LR;
    let empty = class == Class::It || inst.op() == Op::NOP;
    let flags = inst.flags();
    [
        (narrow, Timed::NARROW),
        (writes_pc, Timed::BRANCHES),
        (writes_pc && class.is_load(), Timed::LOADS_PC),
        (class == Class::TableBranch, Timed::LOADS_PC),
        (
            class == Class::Branch || bx_lr || narrow && empty,
            Timed::FOLDS,
        ),
        (class == Class::It, Timed::IT),
        (inst.is_conditional(), Timed::CONDITIONAL),
        (narrow && empty, Timed::EMPTY),
        (
            inst.cond.is_none() && flags.writes.intersects(Flags::NZCV),
            Timed::SETS_FLAGS,
        ),
        (flags.reads.intersects(Flags::NZCV), Timed::READS_FLAGS),
        (matches!(inst.op(), Op::PUSH | Op::POP), Timed::STACK),
        (class == Class::Divide, Timed::DIVIDES),
        (class.is_floating_point(), Timed::FLOAT),
        (class == Class::FloatMultiplyAdd, Timed::FLOAT_SUM),
        (class.is_load() || class.is_store(), Timed::MEMORY),
        (class.is_load(), Timed::LOADS),
        (flags.writes.intersects(Flags::FPSCR), Timed::WRITES_FPSCR),
        (flags.reads.intersects(Flags::FPSCR), Timed::READS_FPSCR),
    ]
    .iter()
    .fold(
        0,
        |about, (holds, bit)| if *holds { about | bit } else { about },
    )
}
