//! Instruction builders of the prologue and epilogue: moves, sums, constants, loads and stores.
//!
//! What a core lacks is made here of what it has, with R4 and R5 for what must be in a low register
//! for a moment.

use super::EntryWriter;
use crate::thumb::minst::template;
use crate::thumb::registers::STATE;
use crate::thumb::v6m::{self, Step};
use whippen_isa::{Cond, Encoding, Form, Inst, Op};

impl EntryWriter<'_> {
    pub(super) fn mov(&mut self, d: u8, m: u8) {
        self.op(Inst {
            d,
            m,
            ..template(Op::MOV_register)
        });
    }

    /// `d += m`
    pub(super) fn add(&mut self, d: u8, m: u8) {
        self.op(Inst {
            d,
            n: d,
            m,
            ..template(Op::ADD_register)
        });
    }

    pub(super) fn plus_one(&mut self, d: u8) {
        self.op(Inst {
            d,
            n: d,
            imm: 1,
            s: !self.features.keeps_flags,
            ..template(Op::ADD_immediate)
        });
    }

    /// `d = n * m + a`; without MLA `n` or `m` may be `d` and all are low.
    pub(super) fn multiply_add(&mut self, d: u8, n: u8, m: u8, a: u8) {
        if self.features.multiply_accumulate {
            return self.op(Inst {
                d,
                n,
                m,
                a,
                ..template(Op::MLA)
            });
        }
        if d != m {
            self.mov(d, n);
        }
        self.op(Inst {
            d,
            n: if d == m { n } else { m },
            m: d,
            s: true,
            ..template(Op::MUL)
        });
        self.add(d, a);
    }

    /// An offset in a register.
    pub(super) fn offset(&mut self, d: u8, offset: u32) {
        if !self.features.wide_moves {
            return self.steps(d, offset);
        }
        let low = Encoding::new(Op::MOV_immediate, Form::T3)
            .map_or_else(|| template(Op::MOV_immediate), Inst::new);
        self.op(Inst {
            d,
            imm: offset & 0xffff,
            ..low
        });
        if offset >> 16 != 0 {
            self.op(Inst {
                d,
                imm: offset >> 16,
                ..template(Op::MOVT)
            });
        }
    }

    pub(super) fn load(&mut self, t: u8, at: u32) {
        self.access(Op::LDR_immediate, t, STATE, at);
    }

    pub(super) fn store(&mut self, t: u8, at: u32) {
        self.access(Op::STR_immediate, t, STATE, at);
    }

    /// A word at a distance from a register.
    pub(super) fn access(&mut self, op: Op, t: u8, n: u8, at: u32) {
        if at <= self.features.load_offset_max {
            return self.op(Inst {
                t,
                n,
                imm: at,
                ..template(op)
            });
        }
        self.offset(5, at);
        let op = if op == Op::LDR_immediate {
            Op::LDR_register
        } else {
            Op::STR_register
        };
        self.op(Inst {
            t,
            n,
            m: 5,
            ..template(op)
        });
    }

    /// A word in a register, from bytes, shifts and sums.
    fn steps(&mut self, d: u8, word: u32) {
        let low = if d < 8 { d } else { 4 };
        for step in v6m::steps(word) {
            let inst = match step {
                Step::Byte(byte) => Inst {
                    imm: byte.into(),
                    ..template(Op::MOV_immediate)
                },
                Step::Shift(amount) => Inst {
                    m: low,
                    amount,
                    ..template(Op::LSL_immediate)
                },
                Step::Add(byte) => Inst {
                    n: low,
                    imm: byte.into(),
                    ..template(Op::ADD_immediate)
                },
                Step::Not => Inst {
                    m: low,
                    ..template(Op::MVN_register)
                },
                Step::Negate => Inst {
                    n: low,
                    ..template(Op::RSB_immediate)
                },
            };
            self.op(Inst {
                d: low,
                s: true,
                ..inst
            });
        }
        if low != d {
            self.mov(d, low);
        }
    }
}

/// The instruction IT with one condition.
pub(super) fn it(cond: Cond) -> Inst {
    Inst {
        imm: u32::from(cond.bits()) << 4 | 8,
        ..template(Op::IT)
    }
}
