//! Floating point: arithmetic, comparison, conversion, moves. One line per instruction.

use crate::board::CoreKind;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::exception::{FPCA, SFPA};
use crate::float::{self, Rounding, SIGN, Status};
use crate::op::{Flow, Op, Run};
use crate::stop::{FaultKind, Reason};
use whippen_isa::{Cond, Inst, Op as I};

impl Cpu {
    /// `ExecuteFPCheck`: floating point may be used, a saved context is saved, this one is active.
    #[inline(always)]
    pub(super) fn float_check(&mut self, bus: &mut Bus, op: &Op) -> Result<(), Flow> {
        if self.float_ready {
            Ok(())
        } else {
            self.prepare_float(bus, op)
        }
    }

    #[cold]
    fn prepare_float(&mut self, bus: &mut Bus, op: &Op) -> Result<(), Flow> {
        const ASPEN: u32 = 1 << 31;
        if !self.exact {
            return Err(Flow::Inexact);
        }
        if !self.system.allows_float(self.is_privileged()) {
            return Err(self.fault(FaultKind::UsageFault, Reason::NoCoprocessor, op.address));
        }
        let address = self.system.fpcar;
        self.preserve_float(bus)
            .map_err(|(kind, reason)| self.fault(kind, reason, address))?;
        if self.system.fpccr & ASPEN != 0 && self.control & FPCA == 0 {
            self.control |= FPCA
                | if self.kind == CoreKind::CortexM33 {
                    SFPA
                } else {
                    0
                };
            self.fpscr = self.system.fpdscr;
        }
        self.float_ready = true;
        Ok(())
    }

    #[inline(always)]
    fn sd(&self, op: &Op) -> u32 {
        self.s[(op.d & 31) as usize]
    }

    #[inline(always)]
    fn sn(&self, op: &Op) -> u32 {
        self.s[(op.n & 31) as usize]
    }

    #[inline(always)]
    fn sm(&self, op: &Op) -> u32 {
        self.s[(op.m & 31) as usize]
    }

    /// Runs an operation that reads and changes FPSCR.
    #[inline(always)]
    fn with_status(&mut self, operation: impl FnOnce(&mut Status) -> u32) -> u32 {
        let mut status = Status(self.fpscr);
        let result = operation(&mut status);
        self.fpscr = status.0;
        result
    }
}

/// A function that does something once floating point is ready.
macro_rules! ready {
    (|$cpu:ident, $op:ident| $action:expr) => {
        |$cpu: &mut Cpu, bus: &mut Bus, $op: &Op| {
            if let Err(flow) = $cpu.float_check(bus, $op) {
                return flow;
            }
            $action;
            Flow::Next
        }
    };
}

/// A function that writes Sd.
macro_rules! sd {
    (|$cpu:ident, $op:ident| $value:expr) => {
        ready!(|$cpu, $op| $cpu.s[($op.d & 31) as usize] = $value)
    };
}

/// A function that writes Sd with a value that depends on FPSCR: of D, N, M.
macro_rules! arithmetic {
    (|$d:ident, $n:ident, $m:ident, $status:ident| $value:expr) => {
        sd!(|cpu, op| {
            #[allow(unused_variables, reason = "not every operation has three operands")]
            let ($d, $n, $m) = (cpu.sd(op), cpu.sn(op), cpu.sm(op));
            cpu.with_status(|$status| $value)
        })
    };
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::VABS => sd!(|cpu, op| cpu.sm(op) & !SIGN),
        I::VNEG => sd!(|cpu, op| cpu.sm(op) ^ SIGN),
        I::VADD => arithmetic!(|d, n, m, s| float::add(n, m, false, s)),
        I::VSUB => arithmetic!(|d, n, m, s| float::add(n, m, true, s)),
        I::VMUL => arithmetic!(|d, n, m, s| float::multiply(n, m, s)),
        I::VNMUL => arithmetic!(|d, n, m, s| float::multiply(n, m, s) ^ SIGN),
        I::VDIV => arithmetic!(|d, n, m, s| float::divide(n, m, s)),
        I::VSQRT => arithmetic!(|d, n, m, s| float::square_root(m, s)),
        I::VMLA => arithmetic!(|d, n, m, s| float::add(d, float::multiply(n, m, s), false, s)),
        I::VMLS => {
            arithmetic!(|d, n, m, s| float::add(d, float::multiply(n, m, s) ^ SIGN, false, s))
        }
        I::VNMLA => arithmetic!(|d, n, m, s| float::add(
            d ^ SIGN,
            float::multiply(n, m, s) ^ SIGN,
            false,
            s
        )),
        I::VNMLS => {
            arithmetic!(|d, n, m, s| float::add(d ^ SIGN, float::multiply(n, m, s), false, s))
        }
        I::VFMA => arithmetic!(|d, n, m, s| float::multiply_add(d, n, m, s)),
        I::VFMS => arithmetic!(|d, n, m, s| float::multiply_add(d, n ^ SIGN, m, s)),
        I::VFNMA => arithmetic!(|d, n, m, s| float::multiply_add(d ^ SIGN, n ^ SIGN, m, s)),
        I::VFNMS => arithmetic!(|d, n, m, s| float::multiply_add(d ^ SIGN, n, m, s)),
        I::VMAXNM => arithmetic!(|d, n, m, s| float::max_number(n, m, s)),
        I::VMINNM => arithmetic!(|d, n, m, s| float::min_number(n, m, s)),
        I::VRINTX => arithmetic!(|d, n, m, s| float::round_to_integral(m, s.rounding(), true, s)),
        I::VRINTR => arithmetic!(|d, n, m, s| float::round_to_integral(m, s.rounding(), false, s)),
        I::VRINTZ => {
            arithmetic!(|d, n, m, s| float::round_to_integral(m, Rounding::Zero, false, s))
        }
        I::VRINT_directed => sd!(|cpu, op| {
            let value = cpu.sm(op);
            cpu.with_status(|s| float::round_to_integral(value, directed(op), false, s))
        }),
        _ => return select_conversion(inst).or_else(|| select_move(inst)),
    })
}

/// Comparison and conversion. `imm` tells signed or the fraction bits, `amount` the rest of the
/// opcode.
fn select_conversion(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::VCMP => ready!(|cpu, op| compare(cpu, cpu.sm(op), op)),
        I::VCMP_zero => ready!(|cpu, op| compare(cpu, 0, op)),
        I::VCVT_integer_to_single => sd!(|cpu, op| {
            let value = extended(cpu.sm(op), 32, op.imm != 0);
            cpu.with_status(|s| float::fixed_to_single(value, 0, s.rounding(), s))
        }),
        I::VCVT_single_to_integer => sd!(|cpu, op| to_integer(cpu, op, Rounding::Zero)),
        I::VCVTR => sd!(|cpu, op| to_integer(cpu, op, Status(cpu.fpscr).rounding())),
        I::VCVT_directed => sd!(|cpu, op| to_integer(cpu, op, directed(op))),
        I::VCVT_fixed_to_single => sd!(|cpu, op| {
            let value = extended(cpu.sd(op), fixed_bits(op), op.amount & 2 == 0);
            cpu.with_status(|s| float::fixed_to_single(value, op.imm, Rounding::Nearest, s))
        }),
        I::VCVT_single_to_fixed => sd!(|cpu, op| {
            let (value, is_signed) = (cpu.sd(op), op.amount & 2 == 0);
            cpu.with_status(|s| {
                float::single_to_fixed(value, op.imm, fixed_bits(op), is_signed, Rounding::Zero, s)
            })
        }),
        I::VCVT_half_to_single => sd!(|cpu, op| {
            let half = cpu.sm(op) >> (16 * (op.imm & 1)) & 0xffff;
            cpu.with_status(|s| float::half_to_single(half, s))
        }),
        I::VCVT_single_to_half => sd!(|cpu, op| {
            let (value, place) = (cpu.sm(op), 16 * (op.imm & 1));
            let half = cpu.with_status(|s| float::single_to_half(value, s));
            cpu.sd(op) & !(0xffff << place) | half << place
        }),
        _ => return None,
    })
}

fn select_move(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::VMOV_immediate => sd!(|_cpu, op| op.imm),
        I::VMOV_register => sd!(|cpu, op| cpu.sm(op)),
        I::VSEL => sd!(|cpu, op| if cpu.holds(SELECT[(op.imm & 3) as usize]) {
            cpu.sn(op)
        } else {
            cpu.sm(op)
        }),
        I::VMOV_core_to_single => ready!(|cpu, op| cpu.s[(op.n & 31) as usize] = cpu.rt(op)),
        I::VMOV_single_to_core => ready!(|cpu, op| cpu.write(op.t, cpu.sn(op))),
        I::VMOV_core_to_half => sd!(|cpu, op| cpu.rt(op)),
        I::VMOV_half_to_core => ready!(|cpu, op| cpu.write(op.t, cpu.sm(op))),
        I::VMOV_core_to_singles => ready!(|cpu, op| put_pair(cpu, u32::from(op.m), op)),
        I::VMOV_singles_to_core => ready!(|cpu, op| get_pair(cpu, u32::from(op.m), op)),
        I::VMOV_core_to_double => ready!(|cpu, op| put_pair(cpu, 2 * u32::from(op.m), op)),
        I::VMOV_double_to_core => ready!(|cpu, op| get_pair(cpu, 2 * u32::from(op.m), op)),
        I::VMRS => ready!(|cpu, op| cpu.write(op.t, cpu.fpscr)),
        I::VMRS_APSR => ready!(|cpu, _op| cpu.set_nzcv_bits(cpu.fpscr)),
        I::VMSR => ready!(|cpu, op| cpu.fpscr = cpu.rt(op) & float::FPSCR_BITS),
        _ => return None,
    })
}

const SELECT: [Cond; 4] = [Cond::EQ, Cond::VS, Cond::GE, Cond::GT];

/// The rounding of VCVTA, N, P, M and VRINTA, N, P, M.
fn directed(op: &Op) -> Rounding {
    [
        Rounding::Away,
        Rounding::Nearest,
        Rounding::Up,
        Rounding::Down,
    ][(op.amount & 3) as usize]
}

fn compare(cpu: &mut Cpu, other: u32, op: &Op) {
    let mut status = Status(cpu.fpscr);
    let flags = float::compare(cpu.sd(op), other, op.amount != 0, &mut status);
    cpu.fpscr = status.0 & 0x0fff_ffff | flags;
}

fn to_integer(cpu: &mut Cpu, op: &Op, rounding: Rounding) -> u32 {
    let value = cpu.sm(op);
    cpu.with_status(|s| float::single_to_fixed(value, 0, 32, op.imm != 0, rounding, s))
}

fn fixed_bits(op: &Op) -> u32 {
    if op.amount & 1 == 0 { 16 } else { 32 }
}

/// The low bits as an integer.
fn extended(word: u32, bits: u32, is_signed: bool) -> i64 {
    let top = 64 - bits;
    let word = u64::from(word) << top;
    if is_signed {
        word as i64 >> top
    } else {
        (word >> top) as i64
    }
}

fn put_pair(cpu: &mut Cpu, first: u32, op: &Op) {
    cpu.s[(first & 31) as usize] = cpu.rt(op);
    cpu.s[((first + 1) & 31) as usize] = cpu.ra(op);
}

fn get_pair(cpu: &mut Cpu, first: u32, op: &Op) {
    let (low, high) = (
        cpu.s[(first & 31) as usize],
        cpu.s[((first + 1) & 31) as usize],
    );
    cpu.write(op.t, low);
    cpu.write(op.a, high);
}
