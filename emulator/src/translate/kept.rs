//! Where registers, flags and outcomes are while translated code runs: in values, read once and
//! written through, flags and outcomes written where the block is left.

use super::RunMode;
use super::emitter::Emitter;
use crate::cpu::Cpu;
use crate::op::Op;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Type, Value};
use std::mem::offset_of;

/// What is kept in values: registers by number, then these.
pub(super) const NEGATIVE: usize = 16;
pub(super) const ZERO: usize = 17;
pub(super) const CARRY: usize = 18;
pub(super) const OVERFLOW: usize = 19;
pub(super) const OUTCOMES: usize = 20;
pub(super) const KEPT: usize = 21;
/// R0 to R14, and the flags.
pub(super) const REGISTERS: u32 = 0x7fff;
pub(super) const FLAGS: u32 = 0xf << NEGATIVE;

/// What is known when code is emitted.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// What is in a value, a bit each.
    pub known: u32,
    /// What the core's memory does not hold yet.
    pub dirty: u32,
    /// All flags are those of this difference.
    pub compared: Option<(Value, Value)>,
    /// The outcomes, where they are the same on every way.
    pub outcomes: Option<u64>,
}

/// Fields of the core: whole, in this computer's order.
pub(super) fn fixed() -> MemFlagsData {
    MemFlagsData::trusted()
}

/// Where something that is kept stands in the core, and its type.
pub(super) fn place(slot: usize) -> (i32, Type) {
    let (offset, of) = match slot {
        NEGATIVE => (offset_of!(Cpu, negative), I32),
        ZERO => (offset_of!(Cpu, zero), I32),
        CARRY => (offset_of!(Cpu, carry), I8),
        OVERFLOW => (offset_of!(Cpu, overflow), I8),
        OUTCOMES => (offset_of!(Cpu, outcomes), I64),
        register => (offset_of!(Cpu, r) + 4 * register, I32),
    };
    (offset as i32, of)
}

impl Emitter<'_, '_> {
    /// What is in values between blocks: for the only core, whose units are loops most often, the
    /// registers.
    pub fn in_values(&self) -> u32 {
        match self.mode {
            RunMode::Alone => REGISTERS,
            RunMode::Apart => 0,
        }
    }

    /// Reads what is to be in values between blocks.
    pub fn know_registers(&mut self) {
        self.know(self.in_values());
    }

    /// Reads what is not in values, of those.
    pub fn know(&mut self, slots: u32) {
        for slot in members(slots & !self.kept.known) {
            self.read(slot);
        }
    }

    /// What is kept.
    pub fn get(&mut self, slot: usize) -> Value {
        self.know(1 << slot);
        self.f.use_var(self.variables[slot])
    }

    /// Reads what the core's memory holds.
    pub fn read(&mut self, slot: usize) {
        let (offset, of) = place(slot);
        let value = self.f.ins().load(of, fixed(), self.cpu, offset);
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
    }

    /// Changes what is written when the block is left.
    pub fn set(&mut self, slot: usize, value: Value) {
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
        self.kept.dirty |= 1 << slot;
    }

    /// A register as an operand.
    pub fn register(&mut self, op: &Op, number: u8) -> Value {
        match number & 15 {
            15 => self.constant(op.pc()),
            number => self.get(number as usize),
        }
    }

    /// Writes a register, at once.
    pub fn set_register(&mut self, number: u8, value: Value) {
        let slot = (number & 15) as usize;
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
        let (offset, _) = place(slot);
        self.f.ins().store(fixed(), value, self.cpu, offset);
    }

    pub fn constant(&mut self, word: u32) -> Value {
        self.f.ins().iconst(I32, i64::from(word))
    }

    /// A field of the core.
    pub fn field(&mut self, of: Type, offset: usize) -> Value {
        self.f.ins().load(of, fixed(), self.cpu, offset as i32)
    }

    /// Sets a field of the core.
    pub fn set_field(&mut self, offset: usize, value: Value) {
        self.f.ins().store(fixed(), value, self.cpu, offset as i32);
    }

    /// Remembers for timing whether something was passed.
    pub fn remember(&mut self, passed: Value) {
        self.kept.outcomes = None;
        let outcomes = self.get(OUTCOMES);
        let moved = self.f.ins().ishl_imm_u(outcomes, 1);
        let bit = self.f.ins().uextend(I64, passed);
        let outcomes = self.f.ins().bor(moved, bit);
        self.set(OUTCOMES, outcomes);
    }

    /// Remembers what is passed on every way that goes on.
    pub fn remember_known(&mut self, passed: bool) {
        let outcomes = self
            .kept
            .outcomes
            .map(|known| known << 1 | u64::from(passed));
        let value = match outcomes {
            Some(known) => self.f.ins().iconst(I64, known as i64),
            None => {
                let moved = self.get(OUTCOMES);
                let moved = self.f.ins().ishl_imm_u(moved, 1);
                self.f.ins().bor_imm_u(moved, i64::from(passed))
            }
        };
        self.set(OUTCOMES, value);
        self.kept.outcomes = outcomes;
    }

    /// Writes what the core's memory does not hold yet, of those.
    pub fn flush(&mut self, slots: u32) {
        for slot in members(slots & self.kept.dirty) {
            let (offset, _) = place(slot);
            let value = self.f.use_var(self.variables[slot]);
            self.f.ins().store(fixed(), value, self.cpu, offset);
        }
        self.kept.dirty &= !slots;
    }
}

/// The members of a set, lowest first.
pub(super) fn members(set: u32) -> impl Iterator<Item = usize> {
    (0..32).filter(move |slot| set >> slot & 1 != 0)
}
