//! What instructions do: one function or one line each, under the manual's name.
//!
//! ```text
//!   Inst --prepare--> Op { run, operands }        once, when code is decoded
//!                      |
//!                 (op.run)(cpu, bus, op) -> Flow   each time
//! ```
//!
//! [`prepare`] picks the function and folds into the operands what never changes: the address of a
//! literal, the sign of an offset, the carry of a constant. A conditional instruction runs through
//! [`conditional`], one that has PC as an operand through [`with_pc`]; the functions themselves
//! know of neither.

mod bits;
mod branch;
mod data;
mod dsp;
mod float;
mod float_memory;
mod memory;
mod multiple;
mod multiply;
mod ordered;
mod system;

use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use crate::stop::{FaultKind, Reason};
use whippen_isa::imm::thumb_imm_carry;
use whippen_isa::{Cond, Inst, ShiftType};

/// The function for a condition, of a function for each of `Cond::ALL`.
macro_rules! by_condition {
    ($cond:expr, $function:ident) => {
        match $cond.map_or(14, whippen_isa::Cond::bits) {
            0 => $function::<0>,
            1 => $function::<1>,
            2 => $function::<2>,
            3 => $function::<3>,
            4 => $function::<4>,
            5 => $function::<5>,
            6 => $function::<6>,
            7 => $function::<7>,
            8 => $function::<8>,
            9 => $function::<9>,
            10 => $function::<10>,
            11 => $function::<11>,
            12 => $function::<12>,
            13 => $function::<13>,
            _ => $function::<14>,
        }
    };
}
use by_condition;

/// Makes an instruction at an address ready to run.
pub(crate) fn prepare(inst: &Inst, address: u32) -> Op {
    let body = select(inst);
    let run = if inst.is_conditional() && !is_branch(inst) {
        by_condition!(inst.cond, conditional)
    } else if reads_pc(inst) {
        with_pc
    } else {
        body
    };
    Op {
        run,
        body,
        imm: constant(inst, address),
        amount: amount(inst),
        ..operands(inst, address)
    }
}

/// What is no instruction: running it raises a fault.
pub(crate) fn absent(address: u32) -> Op {
    let (run, body): (Run, Run) = (undefined, undefined);
    Op {
        run,
        body,
        imm: 0,
        address,
        d: 0,
        n: 0,
        m: 0,
        a: 0,
        t: 0,
        amount: 0,
        shift: ShiftType::LSL,
    }
}

fn operands(inst: &Inst, address: u32) -> Op {
    let a = if inst.t2 == 0 { inst.a } else { inst.t2 };
    let shift = data::named_shift(inst.op()).unwrap_or(inst.shift);
    let (d, n, m, t) = (inst.d, inst.n, inst.m, inst.t);
    Op {
        d,
        n,
        m,
        a,
        t,
        shift,
        ..absent(address)
    }
}

fn select(inst: &Inst) -> Run {
    data::select(inst)
        .or_else(|| bits::select(inst))
        .or_else(|| dsp::select(inst))
        .or_else(|| multiply::select(inst))
        .or_else(|| memory::select(inst))
        .or_else(|| multiple::select(inst))
        .or_else(|| ordered::select(inst))
        .or_else(|| branch::select(inst))
        .or_else(|| float::select(inst))
        .or_else(|| float_memory::select(inst))
        .or_else(|| system::select(inst))
        .unwrap_or(undefined)
}

/// B with a condition tests it itself.
fn is_branch(inst: &Inst) -> bool {
    inst.op() == whippen_isa::Op::B
}

/// Whether a register operand, read by number, is PC. A literal's address is a constant.
fn reads_pc(inst: &Inst) -> bool {
    inst.uses().contains(whippen_isa::RegSet::core(15))
}

/// The immediate as the function wants it: offsets signed, addresses relative to PC absolute.
fn constant(inst: &Inst, address: u32) -> u32 {
    use whippen_isa::Class::*;
    let pc = address.wrapping_add(4);
    let offset = if inst.add {
        inst.imm
    } else {
        inst.imm.wrapping_neg()
    };
    match inst.class() {
        Branch | BranchLink | CompareBranch if inst.op() != whippen_isa::Op::BLX => {
            pc.wrapping_add(inst.imm)
        }
        Load | LoadDual | FloatLoad if inst.uses().contains(whippen_isa::RegSet::core(15)) => {
            (pc & !3).wrapping_add(offset)
        }
        Load | LoadDual | FloatLoad | Store | StoreDual | FloatStore => offset,
        Alu if inst.op() == whippen_isa::Op::ADR => (pc & !3).wrapping_add(offset),
        _ => inst.imm,
    }
}

/// The amount of a shift; of a constant that needs the shifter, 1 or 2 for a carry of 0 or 1; of a
/// list of floating-point registers, whether the base is written back.
fn amount(inst: &Inst) -> u8 {
    use whippen_isa::Class::*;
    if float_memory::is_list(inst) {
        return u8::from(inst.wback);
    }
    match thumb_imm_carry(inst.imm) {
        Some(carry) if matches!(inst.class(), Alu | Move) => 1 + u8::from(carry),
        _ => inst.amount,
    }
}

/// Does it where the condition holds.
fn conditional<const COND: u8>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    if !cpu.passes::<COND>() {
        return Flow::Next;
    }
    cpu.r[15] = op.pc();
    (op.body)(cpu, bus, op)
}

/// Runs with R15 as the operand PC.
fn with_pc(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    cpu.r[15] = op.pc();
    (op.body)(cpu, bus, op)
}

/// UNDEFINED.
pub(crate) fn undefined(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    cpu.fault(FaultKind::UsageFault, Reason::Undefined, op.address)
}

impl Cpu {
    /// Whether a condition of `Cond::ALL` holds, which is remembered for timing.
    #[inline(always)]
    pub(crate) fn passes<const COND: u8>(&mut self) -> bool {
        let holds = self.holds(Cond::ALL[COND as usize]);
        self.remember(holds);
        holds
    }

    /// Remembers for timing whether something was passed.
    #[inline(always)]
    pub(crate) fn remember(&mut self, passed: bool) {
        self.outcomes = self.outcomes << 1 | u64::from(passed);
    }

    #[inline(always)]
    pub(crate) fn rd(&self, op: &Op) -> u32 {
        self.r[(op.d & 15) as usize]
    }

    #[inline(always)]
    pub(crate) fn rn(&self, op: &Op) -> u32 {
        self.r[(op.n & 15) as usize]
    }

    #[inline(always)]
    pub(crate) fn rm(&self, op: &Op) -> u32 {
        self.r[(op.m & 15) as usize]
    }

    #[inline(always)]
    pub(crate) fn ra(&self, op: &Op) -> u32 {
        self.r[(op.a & 15) as usize]
    }

    #[inline(always)]
    pub(crate) fn rt(&self, op: &Op) -> u32 {
        self.r[(op.t & 15) as usize]
    }

    /// Writes a register that is neither SP nor PC.
    #[inline(always)]
    pub(crate) fn write(&mut self, register: u8, value: u32) {
        self.r[(register & 15) as usize] = value;
    }

    /// Leaves a fault in `trap`.
    #[cold]
    pub(crate) fn fault(&mut self, kind: FaultKind, reason: Reason, address: u32) -> Flow {
        self.trap = Some(crate::trap::Trap::Fault {
            kind,
            reason,
            address,
        });
        Flow::Trap
    }

    /// The new value of SP, unless it is below its limit (`RSPCheck`).
    #[inline(always)]
    pub(crate) fn check_sp(&mut self, value: u32, op: &Op) -> Result<u32, Flow> {
        let value = value & !3;
        if value < self.sp_limit() {
            return Err(self.fault(FaultKind::UsageFault, Reason::StackOverflow, op.address));
        }
        Ok(value)
    }
}
