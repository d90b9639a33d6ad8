//! Selection of delay lines: slots at HISTORY, by a pointer in STATE, or at an index.

use super::Select;
use super::memory::post_increment;
use super::shift::with_shift;
use crate::thumb::minst::{Access, AliasClass, MInst, Reg, Role, VReg};
use crate::thumb::registers::{HISTORY, STATE};
use whippen_isa::{Op as Isa, ShiftType};
use whippen_kernel::Value;

impl Select<'_> {
    /// A load or store of a line, at HISTORY or by a pointer in STATE.
    fn access_line(&mut self, line: u32, ticks: u32, ops: [[Isa; 2]; 2]) -> MInst {
        let place = &self.layout.lines[line as usize];
        let [at_h, by_pointer] = ops[usize::from(!place.narrow)];
        match self.layout.pointer(line, ticks) {
            None => MInst::new(at_h).with(Role::N, Self::fixed(HISTORY)),
            Some(at) => {
                let pointer = self.load(
                    Isa::LDR_immediate,
                    Self::fixed(STATE),
                    at.into(),
                    AliasClass::Constant,
                );
                let code = MInst::new(by_pointer)
                    .reg(Role::N, pointer)
                    .with(Role::M, Self::fixed(HISTORY));
                with_shift(code, ShiftType::LSL, self.layout.scale(line))
            }
        }
    }

    pub(super) fn read_delay(&mut self, line: u32, ticks: u32) -> VReg {
        let ticks = if self.layout.lines[line as usize].len == ticks {
            0
        } else {
            ticks
        };
        let t = self.func.fresh();
        let narrow = [Isa::LDRH_immediate, Isa::LDRH_register];
        let code = self.access_line(
            line,
            ticks,
            [narrow, [Isa::LDR_immediate, Isa::LDR_register]],
        );
        self.emit(
            code.reg(Role::T, t)
                .access(Access::Read(AliasClass::Line(line))),
        );
        t
    }

    /// Counted from the slot that is written in this tick, whose number the ring index is.
    pub(super) fn read_delay_at(&mut self, line: u32, before: Value) -> VReg {
        let place = &self.layout.lines[line as usize];
        let (len, row, ring, narrow) = (place.len, place.row, place.ring, place.narrow);
        let before = self.clamp_index(before, len);
        let state = Self::fixed(STATE);
        let now = self.load(Isa::LDR_immediate, state, ring.into(), AliasClass::Constant);
        let gone = self.emit_rrr(Isa::SUB_register, now, before);
        let slot = self.add_constant(gone, -1);
        // All bits where it is below the first slot, none where it is not.
        let below = self.shift_by(Isa::ASR_immediate, slot, 31);
        let len = self.load_constant(len as i32);
        let around = self.emit_rrr(Isa::AND_register, below, len);
        let back = self.emit_rrr(Isa::SUB_register, around, before);
        let slots = self.add_constant(back, -1);
        let row = self.load_constant(row as i32);
        let bytes = self.emit_rrr(Isa::MUL, slots, row);
        let here = self.slot_address(line);
        let t = self.func.fresh();
        let isa = match narrow {
            true => Isa::LDRH_register,
            false => Isa::LDR_register,
        };
        self.emit(
            MInst::new(isa)
                .with(Role::N, here)
                .reg(Role::M, bytes)
                .reg(Role::T, t)
                .access(Access::Read(AliasClass::Line(line))),
        );
        t
    }

    /// The address of this key's slot that is written in this tick.
    fn slot_address(&mut self, line: u32) -> Reg {
        let Some(at) = self.layout.pointer(line, 0) else {
            return Self::fixed(HISTORY);
        };
        let state = Self::fixed(STATE);
        let pointer = self.load(Isa::LDR_immediate, state, at.into(), AliasClass::Constant);
        let sum = MInst::new(Isa::ADD_register)
            .reg(Role::N, pointer)
            .with(Role::M, Self::fixed(HISTORY));
        Reg::Virtual(self.result(with_shift(sum, ShiftType::LSL, self.layout.scale(line))))
    }

    pub(super) fn push_line(&mut self, line: u32, value: Value) {
        let word = self.reg(value);
        let narrow = [Isa::STRH_immediate, Isa::STRH_register];
        let code = self.access_line(line, 0, [narrow, [Isa::STR_immediate, Isa::STR_register]]);
        let code = code
            .reg(Role::T, word)
            .access(Access::Write(AliasClass::Line(line)));
        let walks = self.push_walks && self.layout.first_line == Some(line);
        let slot = 1 << self.layout.lines[line as usize].log2();
        self.emit(if walks {
            post_increment(code, slot).with(Role::N, Self::fixed(HISTORY))
        } else {
            code
        });
    }

    /// Where histories are counted from.
    pub(super) fn histories_base(&mut self) -> Reg {
        let state = Self::fixed(STATE);
        match self.layout.apart {
            None => state,
            Some(at) => {
                Reg::Virtual(self.load(Isa::LDR_immediate, state, at.into(), AliasClass::Constant))
            }
        }
    }

    /// The address of this key's slot in a line's first row. Only `init` fills, and its rings stand
    /// at 0.
    pub(super) fn first_slot_address(&mut self, line: u32) -> VReg {
        let layout = self.layout;
        let scale = layout.scale(line);
        let first = layout
            .first_line
            .map_or(0, |first| i64::from(layout.lines[first as usize].at));
        let base = self.histories_base();
        let offset = self.result(
            MInst::new(Isa::SUB_register)
                .with(Role::N, Self::fixed(HISTORY))
                .with(Role::M, base),
        );
        let sum = MInst::new(Isa::ADD_register)
            .with(Role::N, base)
            .reg(Role::M, offset);
        let sum = self.result(with_shift(sum, ShiftType::LSL, scale));
        self.add_constant(
            sum,
            i64::from(layout.lines[line as usize].at) - (first << scale),
        )
    }
}
