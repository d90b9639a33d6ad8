//! Bit fields, bits, extension, saturation, packing, selection: one line per instruction.

use crate::alu::{shift_c, signed_sat_q, unsigned_sat_q};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Inst, Op as I};

/// A function that writes the value of an expression to Rd.
macro_rules! rd {
    (|$cpu:ident, $op:ident| $value:expr) => {
        |$cpu: &mut Cpu, _: &mut Bus, $op: &Op| {
            let value = $value;
            $cpu.write($op.d, value);
            Flow::Next
        }
    };
}
pub(super) use rd;

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::BFC => rd!(|cpu, op| cpu.rd(op) & !field(op)),
        I::BFI => rd!(|cpu, op| cpu.rd(op) & !field(op) | cpu.rn(op) << op.amount & field(op)),
        I::SBFX => rd!(|cpu, op| ((cpu.rn(op) << above(op)) as i32 >> ((32 - op.imm) & 31)) as u32),
        I::UBFX => rd!(|cpu, op| cpu.rn(op) << above(op) >> ((32 - op.imm) & 31)),
        I::CLZ => rd!(|cpu, op| cpu.rm(op).leading_zeros()),
        I::RBIT => rd!(|cpu, op| cpu.rm(op).reverse_bits()),
        I::REV => rd!(|cpu, op| cpu.rm(op).swap_bytes()),
        I::REV16 => rd!(|cpu, op| cpu.rm(op).swap_bytes().rotate_left(16)),
        I::REVSH => rd!(|cpu, op| (cpu.rm(op) as u16).swap_bytes() as i16 as u32),
        I::SXTB => rd!(|cpu, op| sxtb(rotated(cpu, op))),
        I::SXTH => rd!(|cpu, op| sxth(rotated(cpu, op))),
        I::UXTB => rd!(|cpu, op| rotated(cpu, op) & 0xff),
        I::UXTH => rd!(|cpu, op| rotated(cpu, op) & 0xffff),
        I::SXTB16 => rd!(|cpu, op| sxtb16(rotated(cpu, op))),
        I::UXTB16 => rd!(|cpu, op| rotated(cpu, op) & 0x00ff_00ff),
        I::SXTAB => rd!(|cpu, op| cpu.rn(op).wrapping_add(sxtb(rotated(cpu, op)))),
        I::SXTAH => rd!(|cpu, op| cpu.rn(op).wrapping_add(sxth(rotated(cpu, op)))),
        I::UXTAB => rd!(|cpu, op| cpu.rn(op).wrapping_add(rotated(cpu, op) & 0xff)),
        I::UXTAH => rd!(|cpu, op| cpu.rn(op).wrapping_add(rotated(cpu, op) & 0xffff)),
        I::SXTAB16 => rd!(|cpu, op| add16(cpu.rn(op), sxtb16(rotated(cpu, op)))),
        I::UXTAB16 => rd!(|cpu, op| add16(cpu.rn(op), rotated(cpu, op) & 0x00ff_00ff)),
        I::SSAT => rd!(|cpu, op| signed(cpu, i64::from(shifted_n(cpu, op) as i32), op.imm)),
        I::USAT => rd!(|cpu, op| unsigned(cpu, i64::from(shifted_n(cpu, op) as i32), op.imm)),
        I::SSAT16 => rd!(|cpu, op| halves(cpu.rn(op), |half| signed(cpu, half, op.imm))),
        I::USAT16 => rd!(|cpu, op| halves(cpu.rn(op), |half| unsigned(cpu, half, op.imm))),
        I::PKHBT => rd!(|cpu, op| cpu.rn(op) & 0xffff | shifted_m(cpu, op) & 0xffff_0000),
        I::PKHTB => rd!(|cpu, op| cpu.rn(op) & 0xffff_0000 | shifted_m(cpu, op) & 0xffff),
        I::SEL => rd!(|cpu, op| cpu.rn(op) & lanes(cpu.ge) | cpu.rm(op) & !lanes(cpu.ge)),
        _ => return None,
    })
}

/// The bits of a field: `imm` is its width, `amount` its least significant bit.
fn field(op: &Op) -> u32 {
    (u32::MAX >> ((32 - op.imm) & 31)) << op.amount
}

/// How many bits are above a field.
fn above(op: &Op) -> u32 {
    (32 - op.imm - u32::from(op.amount)) & 31
}

fn rotated(cpu: &Cpu, op: &Op) -> u32 {
    cpu.rm(op).rotate_right(u32::from(op.amount))
}

fn shifted_n(cpu: &Cpu, op: &Op) -> u32 {
    shift_c(cpu.rn(op), op.shift, u32::from(op.amount), false).0
}

fn shifted_m(cpu: &Cpu, op: &Op) -> u32 {
    shift_c(cpu.rm(op), op.shift, u32::from(op.amount), false).0
}

fn sxtb(value: u32) -> u32 {
    value as i8 as u32
}

fn sxth(value: u32) -> u32 {
    value as i16 as u32
}

fn sxtb16(value: u32) -> u32 {
    sxtb(value) & 0xffff | sxtb(value >> 16) << 16
}

fn add16(x: u32, y: u32) -> u32 {
    x.wrapping_add(y) & 0xffff | (x >> 16).wrapping_add(y >> 16) << 16
}

fn signed(cpu: &mut Cpu, value: i64, bits: u32) -> u32 {
    let (value, saturated) = signed_sat_q(value, bits);
    cpu.q |= saturated;
    value as u32
}

fn unsigned(cpu: &mut Cpu, value: i64, bits: u32) -> u32 {
    let (value, saturated) = unsigned_sat_q(value, bits);
    cpu.q |= saturated;
    value
}

fn halves(value: u32, mut each: impl FnMut(i64) -> u32) -> u32 {
    let (low, high) = (i64::from(value as i16), i64::from((value >> 16) as i16));
    each(low) & 0xffff | each(high) << 16
}

/// All bits of the bytes whose GE flag is set.
fn lanes(ge: u8) -> u32 {
    (0..4)
        .filter(|i| ge >> i & 1 != 0)
        .fold(0, |mask, i| mask | 0xff << (8 * i))
}
