//! Pointers at the first key: records, samples, the rows of histories; rings that go on after a
//! tick.

use super::EntryWriter;
use super::arithmetic::it;
use crate::thumb::minst::template;
use crate::thumb::promote::TickConstant;
use crate::thumb::registers::{HISTORY, RECORD, SAMPLES, STATE};
use crate::thumb::state_layout::{Pointer, ROW};
use whippen_isa::{Cond, Inst, Op, ShiftType};

impl EntryWriter<'_> {
    /// RECORD, SAMPLES and HISTORY at the first key.
    pub(super) fn registers(&mut self) {
        let words = self
            .layout
            .caller
            .is_none()
            .then_some((SAMPLES, self.layout.inputs));
        for (register, offset) in [Some((RECORD, self.layout.records)), words]
            .into_iter()
            .flatten()
        {
            self.offset(register, offset);
            self.add(register, STATE);
        }
        if self.layout.first_line.is_some() {
            let low = if self.features.high_registers {
                HISTORY
            } else {
                4
            };
            self.load(low, ROW);
            if low != HISTORY {
                self.mov(HISTORY, low);
            }
        }
    }

    /// What stays in registers from key to key.
    pub(super) fn load_promoted(&mut self) {
        for (word, reg) in self.layout.promoted.iter() {
            match word {
                TickConstant::InState(offset) => self.load(reg, offset),
                TickConstant::Immediate(number) if number >> 16 == 0 => self.offset(reg, number),
                TickConstant::Immediate(number) => self.op(Inst {
                    d: reg,
                    imm: number,
                    ..template(Op::MOV_immediate)
                }),
            }
        }
    }

    /// Every ring index goes on.
    pub(super) fn rings(&mut self) {
        for (at, len) in &self.layout.rings {
            self.load(0, *at);
            self.plus_one(0);
            self.offset(1, *len);
            self.wrap_index();
            self.store(0, *at);
        }
    }

    /// An index in R0 that has come to the length in R1 begins at 0 again.
    fn wrap_index(&mut self) {
        if self.features.conditional_instructions {
            self.op(Inst {
                n: 0,
                m: 1,
                ..template(Op::CMP_register)
            });
            self.op(it(Cond::EQ));
            self.op(Inst {
                d: 0,
                imm: 0,
                cond: Some(Cond::EQ),
                ..template(Op::MOV_immediate)
            });
            return;
        }
        // All bits where it is less than the length, none where it is that.
        self.op(Inst {
            d: 1,
            n: 0,
            m: 1,
            s: true,
            ..template(Op::SUB_register)
        });
        self.op(Inst {
            d: 1,
            m: 1,
            amount: 31,
            s: true,
            ..template(Op::ASR_immediate)
        });
        self.op(Inst {
            d: 0,
            n: 0,
            m: 1,
            s: true,
            ..template(Op::AND_register)
        });
    }

    /// The row of the first line, and all pointers relative to it. R3 keeps the row.
    pub(super) fn pointers(&mut self) {
        let layout = self.layout;
        let Some(first) = layout.first_line else {
            return;
        };
        let base = self.apart();
        self.row(base, 3, first, 0);
        self.store(3, ROW);
        for Pointer { line, ticks, at } in &layout.pointers {
            self.row(base, 0, *line, *ticks);
            self.subtract_row(layout.scale(*line));
            self.store(0, *at);
        }
    }

    /// Takes the row in R3, shifted left, from R0.
    fn subtract_row(&mut self, scale: u8) {
        if self.features.shifted_operands || scale == 0 {
            return self.op(Inst {
                d: 0,
                n: 0,
                m: 3,
                shift: ShiftType::LSL,
                amount: scale,
                s: !self.features.keeps_flags,
                ..template(Op::SUB_register)
            });
        }
        self.op(Inst {
            d: 4,
            m: 3,
            amount: scale,
            s: true,
            ..template(Op::LSL_immediate)
        });
        self.op(Inst {
            d: 0,
            n: 0,
            m: 4,
            s: true,
            ..template(Op::SUB_register)
        });
    }

    /// The register from which histories are counted; R12 where they lie apart.
    pub(super) fn apart(&mut self) -> u8 {
        let Some(at) = self.layout.apart else {
            return STATE;
        };
        if self.features.high_registers {
            self.load(12, at);
        } else {
            self.load(4, at);
            self.mov(12, 4);
        }
        12
    }

    /// The address of the row of a line that was written so many ticks ago, or is written now. Uses
    /// R1 and R2.
    pub(super) fn row(&mut self, base: u8, d: u8, line: u32, ticks: u32) {
        let line = &self.layout.lines[line as usize];
        self.load(d, line.ring);
        if ticks != 0 {
            self.offset(1, ticks);
            self.op(Inst {
                d,
                n: d,
                m: 1,
                s: true,
                ..template(Op::SUB_register)
            });
            self.offset(1, line.len);
            self.add_if_negative(d);
        }
        self.offset(1, line.row);
        self.offset(2, line.at);
        self.add(2, base);
        self.multiply_add(d, d, 1, 2);
    }

    /// Adds the length in R1 to an index that the flags say is negative. Uses R2.
    fn add_if_negative(&mut self, d: u8) {
        if self.features.conditional_instructions {
            self.op(it(Cond::MI));
            return self.op(Inst {
                d,
                n: d,
                m: 1,
                cond: Some(Cond::MI),
                ..template(Op::ADD_register)
            });
        }
        // The length where it is negative, else nothing.
        self.op(Inst {
            d: 2,
            m: d,
            amount: 31,
            s: true,
            ..template(Op::ASR_immediate)
        });
        self.op(Inst {
            d: 1,
            n: 1,
            m: 2,
            s: true,
            ..template(Op::AND_register)
        });
        self.add(d, 1);
    }
}
