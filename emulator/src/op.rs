//! An instruction made ready to run: a function and its operands.
//!
//! Everything that does not change from one execution to the next is decided when code is decoded:
//! which registers, constants with their carry, the absolute address of a literal, whether flags
//! are set. What remains is a call through one pointer.

use crate::bus::Bus;
use crate::cpu::Cpu;
use whippen_isa::ShiftType;

/// How an instruction ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(u8)]
pub(crate) enum Flow {
    /// The next one in memory follows.
    #[default]
    Next,
    /// It branched: `Cpu::pc` is the address.
    Branch,
    /// The next one follows, but what was decoded may no longer hold.
    Leave,
    /// It did nothing, because it needs the exact cycle (`Cpu::exact`).
    Inexact,
    /// It left a request in `Cpu::trap`.
    Trap,
}

/// What an instruction does.
pub(crate) type Run = fn(&mut Cpu, &mut Bus, &Op) -> Flow;

/// An instruction and its operands. What `imm` and `amount` hold is said where an instruction is
/// decoded (`exec`).
#[derive(Clone, Copy)]
pub(crate) struct Op {
    pub run: Run,
    /// What runs when the condition holds; `run` then tests it.
    pub body: Run,
    pub imm: u32,
    pub address: u32,
    pub d: u8,
    pub n: u8,
    pub m: u8,
    /// Ra, RdHi or Rt2.
    pub a: u8,
    pub t: u8,
    pub amount: u8,
    pub shift: ShiftType,
}

impl Op {
    /// The value of PC as an operand.
    pub fn pc(&self) -> u32 {
        self.address.wrapping_add(4)
    }
}
