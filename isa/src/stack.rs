//! How an instruction uses the stack: by how much it moves the stack pointer, from or to which
//! slots it loads or stores registers, and whether it hands out an address of the stack.
//!
//! Places are in bytes from wherever the caller counts. Not here: whose values lie there (the
//! bound's `stack`, the checker's `place`, the linker's `unwind`).

use crate::class::Class;
use crate::inst::Inst;
use crate::reg::{self, RegSet};
use crate::table::Op;

/// What an instruction stores by the stack pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// It stores nothing, or not there.
    Nothing,
    /// From one place to another one.
    Bytes(i32, i32),
    /// Nobody knows where.
    Somewhere,
}

impl Inst {
    /// By how many bytes it moves the stack pointer; none where nobody can say.
    pub fn sp_change_bytes(&self) -> Option<i32> {
        use Class::*;
        let bytes = 4 * i32::from(self.words());
        match (self.class(), self.op()) {
            (_, Op::ADD_SP_plus_immediate) => Some(self.imm as i32),
            (_, Op::SUB_SP_minus_immediate) => Some(-(self.imm as i32)),
            (_, Op::PUSH | Op::VPUSH | Op::VPUSH_single) => Some(-bytes),
            (_, Op::POP | Op::VPOP | Op::VPOP_single) => Some(bytes),
            (Load | LoadDual | Store | StoreDual, _) if self.n == reg::SP && self.wback => {
                Some(self.displacement())
            }
            _ => None,
        }
    }

    /// What it stores by the stack pointer, which is at `sp` before it.
    pub fn stored(&self, sp: i32) -> Stored {
        if self.n != reg::SP || !self.class().is_store() {
            return Stored::Nothing;
        }
        let bytes = match self.op() {
            Op::STRB_immediate | Op::STRBT => 1,
            Op::STRH_immediate | Op::STRHT => 2,
            _ => 4 * i32::from(self.words()),
        };
        match self.first_offset() {
            Some(offset) if self.class() != Class::StoreOrdered => {
                Stored::Bytes(sp + offset, sp + offset + bytes)
            }
            _ => Stored::Somewhere,
        }
    }

    /// The slot from which it loads a register, the stack pointer being at `sp` before it.
    pub fn loaded_slot(&self, sp: i32, register: u8) -> Option<i32> {
        self.slot(sp, register).filter(|_| match self.class() {
            // Others load a part of a word, or from where a register says.
            Class::Load => self.op() == Op::LDR_immediate,
            class => matches!(class, Class::LoadDual | Class::LoadMultiple),
        })
    }

    /// The slot to which it stores a register, the stack pointer being at `sp` before it.
    pub fn stored_slot(&self, sp: i32, register: u8) -> Option<i32> {
        use Class::*;
        self.slot(sp, register)
            .filter(|_| matches!(self.class(), Store | StoreDual | StoreMultiple))
    }

    fn slot(&self, sp: i32, register: u8) -> Option<i32> {
        use Class::*;
        if self.n != reg::SP {
            return None;
        }
        let list = self.imm as u16;
        let below = 4 * (list & ((1_u32 << register) - 1) as u16).count_ones() as i32;
        let from = sp + self.first_offset()?;
        match self.class() {
            StoreMultiple | LoadMultiple if list >> register & 1 == 0 => None,
            StoreMultiple | LoadMultiple => Some(from + below),
            Load | Store if self.t == register => Some(from),
            StoreDual | LoadDual if self.t == register => Some(from),
            StoreDual | LoadDual if self.t2 == register => Some(from + 4),
            _ => None,
        }
    }

    /// Whether it leaves in a register that it writes what was there, some constant further.
    pub fn steps(&self, register: u8) -> bool {
        use Class::*;
        use Op::{ADD_SP_plus_immediate, ADD_immediate, SUB_SP_minus_immediate, SUB_immediate};
        let by_constant = match self.class() {
            // None loads the base that it moves.
            Load | LoadDual => self.wback,
            LoadMultiple => self.imm >> register & 1 == 0,
            Store | StoreDual | StoreMultiple => true,
            _ => matches!(
                self.op(),
                ADD_immediate | SUB_immediate | ADD_SP_plus_immediate | SUB_SP_minus_immediate
            ),
        };
        by_constant && self.n == register
    }

    /// Whether it may put an address of the stack elsewhere than into SP: it reads SP, and not only
    /// as the base of what it accesses or to move it.
    pub fn hands_stack(&self) -> bool {
        let sp = RegSet::core(reg::SP);
        let (uses, accesses) = (self.uses().contains(sp), self.words() > 0);
        let stored = self.t == reg::SP || self.t2 == reg::SP;
        let moved = self.defs().core_bits() == sp.core_bits();
        uses && !(accesses && self.n == reg::SP && !stored || moved && !accesses)
    }
}
