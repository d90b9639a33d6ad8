//! Multiplication and division: one line per instruction. `imm` has the halves, the exchange or the
//! rounding.

use super::bits::rd;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use crate::stop::{FaultKind, Reason};
use whippen_isa::timing::Outcome;
use whippen_isa::{Inst, Op as I};

/// A function that writes a 64-bit value to RdHi (`a`) and RdLo (`d`).
macro_rules! rd_long {
    (|$cpu:ident, $op:ident| $value:expr) => {
        |$cpu: &mut Cpu, _: &mut Bus, $op: &Op| {
            let value: u64 = $value;
            $cpu.write($op.d, value as u32);
            $cpu.write($op.a, (value >> 32) as u32);
            Flow::Next
        }
    };
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::MUL if inst.s => multiply_flags,
        I::MUL => rd!(|cpu, op| cpu.rn(op).wrapping_mul(cpu.rm(op))),
        I::MLA => rd!(|cpu, op| cpu.ra(op).wrapping_add(cpu.rn(op).wrapping_mul(cpu.rm(op)))),
        I::MLS => rd!(|cpu, op| cpu.ra(op).wrapping_sub(cpu.rn(op).wrapping_mul(cpu.rm(op)))),
        I::SMULxy => rd!(|cpu, op| halves(cpu, op) as u32),
        I::SMLAxy => rd!(|cpu, op| accumulate(cpu, halves(cpu, op), op)),
        I::SMUAD => rd!(|cpu, op| saturating(cpu, dual(cpu, op, 1))),
        I::SMUSD => rd!(|cpu, op| dual(cpu, op, -1) as u32),
        I::SMLAD => rd!(|cpu, op| accumulate(cpu, dual(cpu, op, 1), op)),
        I::SMLSD => rd!(|cpu, op| accumulate(cpu, dual(cpu, op, -1), op)),
        I::SMULWy => rd!(|cpu, op| word_half(cpu, op) as u32),
        I::SMLAWy => rd!(|cpu, op| accumulate(cpu, word_half(cpu, op), op)),
        I::SMMUL => rd!(|cpu, op| top(signed(cpu, op), op)),
        I::SMMLA => rd!(|cpu, op| top(top_accumulator(cpu, op).wrapping_add(signed(cpu, op)), op)),
        I::SMMLS => rd!(|cpu, op| top(top_accumulator(cpu, op).wrapping_sub(signed(cpu, op)), op)),
        I::USAD8 => rd!(|cpu, op| differences(cpu, op)),
        I::USADA8 => rd!(|cpu, op| cpu.ra(op).wrapping_add(differences(cpu, op))),
        I::SDIV => divide::<true>,
        I::UDIV => divide::<false>,
        _ => return select_long(inst),
    })
}

fn select_long(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::SMULL => rd_long!(|cpu, op| signed(cpu, op) as u64),
        I::UMULL => rd_long!(|cpu, op| unsigned(cpu, op)),
        I::SMLAL => rd_long!(|cpu, op| long(cpu, op).wrapping_add(signed(cpu, op) as u64)),
        I::UMLAL => rd_long!(|cpu, op| long(cpu, op).wrapping_add(unsigned(cpu, op))),
        I::UMAAL => {
            rd_long!(|cpu, op| unsigned(cpu, op) + u64::from(cpu.rd(op)) + u64::from(cpu.ra(op)))
        }
        I::SMLALxy => rd_long!(|cpu, op| long(cpu, op).wrapping_add(halves(cpu, op) as u64)),
        I::SMLALD => rd_long!(|cpu, op| long(cpu, op).wrapping_add(dual(cpu, op, 1) as u64)),
        I::SMLSLD => rd_long!(|cpu, op| long(cpu, op).wrapping_add(dual(cpu, op, -1) as u64)),
        _ => return None,
    })
}

/// N and Z only: C and V stay.
fn multiply_flags(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let result = cpu.rn(op).wrapping_mul(cpu.rm(op));
    cpu.write(op.d, result);
    cpu.set_nzcv(result, cpu.carry, cpu.overflow);
    Flow::Next
}

fn signed(cpu: &Cpu, op: &Op) -> i64 {
    i64::from(cpu.rn(op) as i32) * i64::from(cpu.rm(op) as i32)
}

fn unsigned(cpu: &Cpu, op: &Op) -> u64 {
    u64::from(cpu.rn(op)) * u64::from(cpu.rm(op))
}

fn long(cpu: &Cpu, op: &Op) -> u64 {
    u64::from(cpu.ra(op)) << 32 | u64::from(cpu.rd(op))
}

fn half(value: u32, top: bool) -> i64 {
    i64::from((value >> if top { 16 } else { 0 }) as i16)
}

/// The product of one half each: bit 1 of `imm` picks Rn's, bit 0 Rm's.
fn halves(cpu: &Cpu, op: &Op) -> i64 {
    half(cpu.rn(op), op.imm & 2 != 0) * half(cpu.rm(op), op.imm & 1 != 0)
}

/// The products of the halves, added or subtracted; `imm` exchanges Rm's.
fn dual(cpu: &Cpu, op: &Op, sign: i64) -> i64 {
    let (n, m) = (
        cpu.rn(op),
        cpu.rm(op).rotate_left(if op.imm != 0 { 16 } else { 0 }),
    );
    half(n, false) * half(m, false) + sign * half(n, true) * half(m, true)
}

/// Bits 47 to 16 of Rn times a half of Rm.
fn word_half(cpu: &Cpu, op: &Op) -> i64 {
    (i64::from(cpu.rn(op) as i32) * half(cpu.rm(op), op.imm != 0)) >> 16
}

/// A product plus Ra; Q when that overflows.
fn accumulate(cpu: &mut Cpu, product: i64, op: &Op) -> u32 {
    let sum = product + i64::from(cpu.ra(op) as i32);
    saturating(cpu, sum)
}

/// The low word; Q when it is not all.
fn saturating(cpu: &mut Cpu, sum: i64) -> u32 {
    cpu.q |= i64::from(sum as i32) != sum;
    sum as u32
}

fn top_accumulator(cpu: &Cpu, op: &Op) -> i64 {
    i64::from(cpu.ra(op) as i32) << 32
}

/// The top word, rounded when `imm` says so.
fn top(value: i64, op: &Op) -> u32 {
    let half = if op.imm != 0 { 1 << 31 } else { 0 };
    (value.wrapping_add(half) >> 32) as u32
}

fn differences(cpu: &Cpu, op: &Op) -> u32 {
    let (n, m) = (cpu.rn(op).to_le_bytes(), cpu.rm(op).to_le_bytes());
    n.iter().zip(m).map(|(x, y)| u32::from(x.abs_diff(y))).sum()
}

fn divide<const SIGNED: bool>(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let (n, m) = (cpu.rn(op), cpu.rm(op));
    if m == 0 && cpu.system.traps_division_by_zero() {
        return cpu.fault(FaultKind::UsageFault, Reason::DivideByZero, op.address);
    }
    let result = match (m, SIGNED) {
        (0, _) => 0,
        (_, true) => (n as i32).wrapping_div(m as i32) as u32,
        (_, false) => n / m,
    };
    let bits = Outcome::quotient_bits(n, m, SIGNED);
    cpu.outcomes = cpu.outcomes << crate::outcome::DIVIDE_BITS | (bits + 32) as u64 & 63;
    cpu.write(op.d, result);
    Flow::Next
}
