//! What instructions do to what is known. An instruction that is not spelled out here leaves its
//! results unknown.

use whippen_isa::{Class, Flags, Inst, Op, ShiftType, reg};

use super::{Facts, Interval, NONE, Name};
use crate::Code;

/// What an instruction computes.
enum Result {
    /// Nothing is known.
    Unknown,
    /// A word between two.
    Within(Interval),
    /// The word that a register holds.
    Copy(u8),
}

impl Facts {
    /// An instruction at an address has executed, its condition met.
    pub fn execute(&mut self, inst: &Inst, at: u32, code: &Code) {
        let sets_flags = inst.flags().writes.intersects(Flags::NZCV);
        let compared = if sets_flags {
            self.compared(inst)
        } else {
            None
        };
        let result = self.result(inst, at, code);
        let counts = inst.op() == Op::CLZ && self.interval(inst.m).low > 0;
        let of = if counts { self.name(inst.m) } else { NONE };
        let name = match result {
            Result::Unknown => NONE,
            Result::Within(interval) => self.new_value(interval),
            Result::Copy(register) => self.name(register),
        };
        let defs = inst.defs().core_bits();
        for register in (0..16).filter(|register| defs >> register & 1 != 0) {
            self.registers[register] = NONE;
        }
        let has_result = name != NONE && defs >> (inst.d & 15) & 1 != 0;
        if has_result || name != NONE && loads(inst) {
            let register = if loads(inst) { inst.t } else { inst.d };
            self.registers[usize::from(register & 15)] = name;
        }
        if counts {
            self.counted = [of, name];
        }
        if sets_flags {
            self.set_flags(inst, compared, name);
        }
        if self.values.len() > 1000 {
            self.keep(!0);
        }
    }

    fn set_flags(&mut self, inst: &Inst, compared: Option<[Name; 2]>, name: Name) {
        let result = match inst.s {
            true if inst.defs().core_bits().count_ones() == 1 => self.name(inst.d),
            true => name,
            false => NONE,
        };
        match compared {
            Some([left, right]) => self.set_compared(left, right, result),
            None => self.set_result(result),
        }
    }

    /// The two values whose difference the flags will show.
    fn compared(&mut self, inst: &Inst) -> Option<[Name; 2]> {
        let constant = |facts: &mut Self| facts.new_value(Interval::point(inst.imm as i32));
        match inst.op() {
            Op::CMP_immediate | Op::SUB_immediate => Some([self.name(inst.n), constant(self)]),
            Op::RSB_immediate => Some([constant(self), self.name(inst.n)]),
            Op::CMP_register | Op::SUB_register if inst.amount == 0 => {
                Some([self.name(inst.n), self.name(inst.m)])
            }
            _ => None,
        }
    }

    /// Whether it moves a value up by its own leading zeros.
    fn is_counted(&self, inst: &Inst) -> bool {
        let names = [inst.n, inst.m].map(|register| self.registers[usize::from(register & 15)]);
        names == self.counted && !names.contains(&NONE)
    }

    fn result(&self, inst: &Inst, at: u32, code: &Code) -> Result {
        let (n, m) = (self.interval(inst.n), self.interval(inst.m));
        let imm = i64::from(inst.imm as i32);
        let within = Result::Within;
        match inst.op() {
            Op::MOV_register if inst.m != reg::PC => Result::Copy(inst.m),
            Op::MOV_immediate => within(Interval::point(inst.imm as i32)),
            Op::MVN_immediate => within(Interval::point(!inst.imm as i32)),
            Op::MOVT => match self.interval(inst.d).as_point() {
                Some(low) => within(Interval::point(
                    (low as u32 & 0xffff | inst.imm << 16) as i32,
                )),
                None => Result::Unknown,
            },
            Op::ADD_immediate => within(Interval::of(n.low + imm, n.high + imm)),
            Op::SUB_immediate => within(Interval::of(n.low - imm, n.high - imm)),
            Op::RSB_immediate => within(Interval::of(imm - n.high, imm - n.low)),
            Op::ADD_register if inst.shift == ShiftType::LSL => within(Interval::of(
                n.low + shifted_left(m.low, inst),
                n.high + shifted_left(m.high, inst),
            )),
            Op::MLA => within(product(n, m).plus(self.interval(inst.a))),
            Op::SUB_register if inst.amount == 0 => {
                within(Interval::of(n.low - m.high, n.high - m.low))
            }
            Op::AND_immediate | Op::TST_immediate => within(masked(n, imm)),
            Op::LSL_immediate => within(Interval::of(
                shifted_left(m.low, inst),
                shifted_left(m.high, inst),
            )),
            Op::CLZ if m.low > 0 => within(Interval {
                low: leading_zeros(m.high),
                high: leading_zeros(m.low),
            }),
            Op::LSL_register if self.is_counted(inst) => within(Interval {
                low: i64::from(i32::MIN),
                high: -1,
            }),
            Op::ASR_immediate => within(shifted_right(m, inst.amount)),
            Op::LSR_immediate => within(shifted_right(m.unsigned(), inst.amount)),
            Op::UBFX if inst.imm < 32 => within(Interval {
                low: 0,
                high: (1 << inst.imm) - 1,
            }),
            Op::SBFX => within(signed_bits(inst.imm)),
            Op::UXTB => extended(inst, m, Interval { low: 0, high: 0xff }),
            Op::UXTH => extended(
                inst,
                m,
                Interval {
                    low: 0,
                    high: 0xffff,
                },
            ),
            Op::SXTB => extended(inst, m, signed_bits(8)),
            Op::SXTH => extended(inst, m, signed_bits(16)),
            Op::SSAT => saturated(inst, n, signed_bits(inst.imm)),
            Op::USAT => saturated(
                inst,
                n,
                Interval {
                    low: 0,
                    high: (1 << inst.imm.min(31)) - 1,
                },
            ),
            Op::LDR_literal => match literal(inst, at, code) {
                Some(word) => within(Interval::point(word as i32)),
                None => Result::Unknown,
            },
            Op::LDRB_immediate | Op::LDRB_register | Op::LDRB_literal => {
                within(Interval { low: 0, high: 0xff })
            }
            Op::LDRH_immediate | Op::LDRH_register | Op::LDRH_literal => within(Interval {
                low: 0,
                high: 0xffff,
            }),
            Op::LDRSB_immediate | Op::LDRSB_register | Op::LDRSB_literal => within(signed_bits(8)),
            Op::LDRSH_immediate | Op::LDRSH_register | Op::LDRSH_literal => within(signed_bits(16)),
            _ => Result::Unknown,
        }
    }
}

/// Zeros before the first one of a word above 0.
fn leading_zeros(word: i64) -> i64 {
    i64::from(word.leading_zeros()) - 32
}

/// Whether the result is in `t`.
fn loads(inst: &Inst) -> bool {
    inst.class() == Class::Load
}

/// Of `bits` bits, read as signed.
fn signed_bits(bits: u32) -> Interval {
    let half = 1 << (bits.clamp(1, 32) - 1);
    Interval {
        low: -half,
        high: half - 1,
    }
}

/// A word of which only the bits of a mask are left.
fn masked(value: Interval, mask: i64) -> Interval {
    match value.as_point() {
        Some(value) => Interval::point((i64::from(value) & mask) as i32),
        None if mask >= 0 => Interval { low: 0, high: mask },
        None => Interval::ALL,
    }
}

/// Shifted left.
fn shifted_left(value: i64, inst: &Inst) -> i64 {
    value << inst.amount
}

/// A product of words.
fn product(n: Interval, m: Interval) -> Interval {
    let corners = [
        n.low * m.low,
        n.low * m.high,
        n.high * m.low,
        n.high * m.high,
    ];
    corners
        .into_iter()
        .map(|at| Interval { low: at, high: at })
        .reduce(Interval::hull)
        .unwrap_or(Interval::ALL)
}

/// Shifted right, the sign kept.
fn shifted_right(value: Interval, amount: u8) -> Interval {
    let by = amount.min(63);
    Interval {
        low: value.low >> by,
        high: value.high >> by,
    }
}

/// The low part of a word, extended: the word itself, if it is in reach.
fn extended(inst: &Inst, value: Interval, reach: Interval) -> Result {
    if inst.amount == 0 && reach.covers(value) {
        Result::Copy(inst.m)
    } else {
        Result::Within(reach)
    }
}

/// A word limited to what is in reach: the word itself, if it is.
fn saturated(inst: &Inst, value: Interval, reach: Interval) -> Result {
    if inst.amount != 0 {
        return Result::Within(reach);
    }
    let limited = |at: i64| at.clamp(reach.low, reach.high);
    match reach.covers(value) {
        true => Result::Copy(inst.n),
        false => Result::Within(Interval {
            low: limited(value.low),
            high: limited(value.high),
        }),
    }
}

/// The word that a load relative to PC reads, where it is among the constant bytes.
fn literal(inst: &Inst, at: u32, code: &Code) -> Option<u32> {
    let base = at.wrapping_add(4) & !3;
    code.word(if inst.add {
        base.wrapping_add(inst.imm)
    } else {
        base.wrapping_sub(inst.imm)
    })
}
