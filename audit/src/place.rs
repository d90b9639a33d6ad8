//! The stack, and what registers and slots of it hold of pointers: where the stack pointer is,
//! return addresses, pointers into sections.

#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

use whippen_isa::{Inst, Op, RegSet, ShiftType, Stored, reg};

/// Where the stack pointer may be, in bytes from where it was when the function was entered: what
/// is above that is the caller's. No stack is that large.
const STACK: RangeInclusive<i32> = -(1 << 24)..=0;

/// What a register or a slot holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Tag {
    /// The return address of a call, by its number, and where the stack pointer was.
    Return(u32, i32),
    /// An address in the section that begins there.
    Section(u32),
}

/// See the module.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// Bytes from where the stack pointer is when the function is entered; negative below.
    pub sp: i32,
    /// Of each register.
    pub registers: [Option<Tag>; 16],
    /// Of words of the stack, by distance from the same place.
    pub slots: Vec<(i32, Tag)>,
}

impl Place {
    /// Where a function is entered: LR holds its return address.
    pub fn entered() -> Self {
        let mut place = Self::default();
        place.registers[usize::from(reg::LR)] = Some(Tag::Return(0, 0));
        place
    }

    /// Whether there is such a stack: everything in it lies below its caller's.
    pub(crate) fn is_possible(&self) -> bool {
        let slots = self.slots.iter().all(|(at, _)| STACK.contains(at));
        STACK.contains(&self.sp) && slots
    }

    /// What a register holds.
    pub fn tag(&self, register: u8) -> Option<Tag> {
        self.registers[usize::from(register & 15)]
    }

    /// Whether everything that is claimed here holds there; `derived` tells more of a register
    /// there.
    pub(crate) fn covers(&self, other: &Self, derived: impl Fn(u8) -> Option<Tag>) -> bool {
        let known = |register: u8| other.tag(register).or_else(|| derived(register));
        let registers = (0..16).all(|r| self.tag(r).is_none_or(|tag| known(r) == Some(tag)));
        let slots = self.slots.iter().all(|slot| other.slots.contains(slot));
        self.sp == other.sp && registers && slots
    }

    /// An instruction executes, its condition met. `points`: what else is known of the register of
    /// an index' base, where nothing is known here.
    ///
    /// # Errors
    /// Nobody can say where it leaves the stack pointer.
    pub(crate) fn execute(
        &mut self,
        inst: &Inst,
        points: impl Fn() -> Option<Tag>,
    ) -> Result<(), &'static str> {
        let (before, sp, defs) = (self.registers, self.sp, inst.defs());
        let tag = |register: u8| before[usize::from(register & 15)];
        for register in (0..15).filter(|r| *r != reg::SP && defs.contains(RegSet::core(*r))) {
            let tag = match () {
                () if inst.op() == Op::MOV_register && inst.amount == 0 => tag(inst.m),
                () if inst.steps(register) => tag(register).filter(is_section),
                () if adds_index(inst) => tag(inst.n).or_else(&points).filter(is_section),
                () => inst.loaded_slot(sp, register).and_then(|at| self.at(at)),
            };
            self.registers[usize::from(register)] = tag;
        }
        if defs.contains(RegSet::core(reg::SP)) {
            // It is rounded down to a word.
            let moved = inst.sp_change_bytes().filter(|moved| moved % 4 == 0);
            let moved = moved.ok_or("moves the stack pointer nobody knows where")?;
            self.sp = sp + moved;
            if !self.is_possible() {
                return Err("moves the stack pointer out of its stack");
            }
        }
        self.store(inst, sp, &before)?;
        let sp = self.sp;
        self.slots.retain(|(at, _)| *at >= sp);
        Ok(())
    }

    /// What a slot holds.
    pub(crate) fn at(&self, slot: i32) -> Option<Tag> {
        let found = self.slots.iter().find(|(at, _)| *at == slot);
        found.map(|(_, tag)| *tag)
    }

    /// What PC is loaded from the stack with.
    pub(crate) fn loaded_pc(&self, inst: &Inst) -> Option<Tag> {
        inst.loaded_slot(self.sp, reg::PC)
            .and_then(|at| self.at(at))
    }

    /// A store by the stack pointer, which was at `sp`: what was in the slots is gone.
    fn store(
        &mut self,
        inst: &Inst,
        sp: i32,
        before: &[Option<Tag>; 16],
    ) -> Result<(), &'static str> {
        let (from, end) = match inst.stored(sp) {
            Stored::Nothing => return Ok(()),
            Stored::Bytes(from, end) => (from, end),
            Stored::Somewhere => {
                self.slots.clear();
                return Ok(());
            }
        };
        if end > 0 {
            return Err("stores into its caller's stack");
        }
        if from < self.sp {
            return Err("stores below its stack");
        }
        self.slots.retain(|(at, _)| at + 4 <= from || end <= *at);
        for register in (0..16).filter(|_| end - from >= 4) {
            let slot = inst.stored_slot(sp, register);
            let tag = before[usize::from(register)];
            self.slots.extend(slot.zip(tag));
        }
        self.slots.sort_unstable();
        Ok(())
    }
}

fn is_section(tag: &Tag) -> bool {
    matches!(tag, Tag::Section(_))
}

/// Whether an instruction adds a shifted index to a register.
pub(crate) fn adds_index(inst: &Inst) -> bool {
    inst.op() == Op::ADD_register && inst.shift == ShiftType::LSL && inst.amount > 0
}
