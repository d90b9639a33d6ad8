//! Sums, logic, moves and shifts, with their flags.

use whippen_isa::imm::thumb_imm_carry;
use whippen_isa::{Inst, Op, ShiftType};

use crate::flags::{Flags, Status};
use crate::machine::Machine;
use crate::stop::{Told, unproven};
use crate::term::{Function, Term, Terms};

/// A second operand, and the carry of its shift, where it gives one.
type Operand = (Term, Option<Term>);

/// What a sum is made of: `a + b + carry`, or `a - b - 1 + carry`.
struct Addends {
    a: Term,
    b: Term,
    subtracts: bool,
    carry: Term,
}

impl Machine<'_> {
    /// Whether it was such an instruction.
    pub fn alu(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        if self.sum(terms, inst)? {
            return Ok(true);
        }
        let is_logic = matches!(
            inst.op(),
            Op::AND_immediate
                | Op::AND_register
                | Op::TST_immediate
                | Op::TST_register
                | Op::EOR_immediate
                | Op::EOR_register
                | Op::TEQ_immediate
                | Op::TEQ_register
                | Op::BIC_immediate
                | Op::BIC_register
                | Op::ORR_immediate
                | Op::ORR_register
                | Op::ORN_immediate
                | Op::ORN_register
        );
        let (value, carry) = if is_logic {
            let n = self.register(terms, inst.n)?;
            let (m, carry) = self.second(terms, inst)?;
            (logic(terms, inst.op(), n, m)?, carry)
        } else if let Some(found) = self.moved(terms, inst)? {
            found
        } else {
            return Ok(false);
        };
        let value = terms.word(value)?;
        if !matches!(
            inst.op(),
            Op::TST_immediate | Op::TST_register | Op::TEQ_immediate | Op::TEQ_register
        ) {
            self.write(terms, inst.d, value)?;
        }
        if inst.s {
            self.flags.change(&|flags| {
                (flags.result, flags.is_of_exact) = (Some(value), false);
                if carry.is_some() {
                    (flags.carry, flags.unsigned) = (carry, None);
                }
            });
        }
        Ok(true)
    }

    fn moved(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Operand>> {
        Ok(Some(match inst.op() {
            Op::MOV_immediate | Op::MOV_register => self.second(terms, inst)?,
            Op::LSL_immediate | Op::LSR_immediate | Op::ASR_immediate | Op::ROR_immediate => {
                self.second(terms, inst)?
            }
            Op::MVN_immediate | Op::MVN_register => {
                let (m, carry) = self.second(terms, inst)?;
                (complement(terms, m)?, carry)
            }
            Op::MOVT => {
                let old = self.register(terms, inst.d)?;
                let low = terms.low_bits(old, 16)?;
                (terms.plus(low, i128::from(inst.imm) << 16)?, None)
            }
            Op::LSL_register | Op::LSR_register | Op::ASR_register => {
                let (n, m) = (self.register(terms, inst.n)?, self.register(terms, inst.m)?);
                return self.shifted_by(terms, inst, n, m).map(Some);
            }
            _ => return Ok(None),
        }))
    }

    /// Shifted by a register.
    fn shifted_by(&mut self, terms: &mut Terms, inst: &Inst, n: Term, m: Term) -> Told<Operand> {
        if let Some(by) = terms.number(m) {
            let by = (by & 0xff) as u32;
            let kind = match inst.op() {
                Op::LSL_register => ShiftType::LSL,
                Op::LSR_register => ShiftType::LSR,
                _ => ShiftType::ASR,
            };
            return match by {
                0 => Ok((n, None)),
                1..=31 => shift(terms, n, kind, by),
                _ if kind == ShiftType::ASR => shift(terms, n, kind, 32),
                _ => {
                    self.forget_carry(inst);
                    Ok((terms.constant(0), None))
                }
            };
        }
        self.forget_carry(inst);
        let function = match inst.op() {
            Op::LSL_register => Function::ShiftLeft,
            Op::LSR_register => Function::ShiftRight,
            _ => Function::ShiftRightSigned,
        };
        Ok((terms.apply(function, vec![n, m]), None))
    }

    /// The carry of a shift is not known; whoever asks for it is not followed.
    fn forget_carry(&mut self, inst: &Inst) {
        if inst.s {
            self.flags
                .change(&|flags| (flags.carry, flags.unsigned) = (None, None));
        }
    }

    fn is_register(inst: &Inst) -> bool {
        matches!(
            inst.op(),
            Op::ADC_register
                | Op::ADD_register
                | Op::ADD_SP_plus_register
                | Op::CMN_register
                | Op::CMP_register
                | Op::RSB_register
                | Op::SBC_register
                | Op::SUB_register
                | Op::SUB_SP_minus_register
                | Op::AND_register
                | Op::BIC_register
                | Op::EOR_register
                | Op::ORN_register
                | Op::ORR_register
                | Op::TEQ_register
                | Op::TST_register
                | Op::MOV_register
                | Op::MVN_register
                | Op::ASR_immediate
                | Op::LSL_immediate
                | Op::LSR_immediate
                | Op::ROR_immediate
        )
    }

    fn second(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Operand> {
        if !Self::is_register(inst) {
            let value = terms.constant(i128::from(inst.imm as i32));
            let carry = thumb_imm_carry(inst.imm).map(i128::from);
            return Ok((value, carry.map(|carry| terms.constant(carry))));
        }
        let m = self.register(terms, inst.m)?;
        match (inst.shift, inst.amount) {
            (ShiftType::RRX, _) => unproven("RRX"),
            (_, 0) => Ok((m, None)),
            (kind, by) => shift(terms, m, kind, by.into()),
        }
    }

    fn sum(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        let (one, zero) = (terms.constant(1), terms.constant(0));
        let (subtracts, reversed, with_carry, writes) = match inst.op() {
            Op::ADD_immediate | Op::ADD_register => (false, false, false, true),
            Op::ADD_SP_plus_immediate | Op::ADD_SP_plus_register => (false, false, false, true),
            Op::CMN_immediate | Op::CMN_register => (false, false, false, false),
            Op::ADC_immediate | Op::ADC_register => (false, false, true, true),
            Op::SUB_immediate | Op::SUB_register => (true, false, false, true),
            Op::SUB_SP_minus_immediate | Op::SUB_SP_minus_register => (true, false, false, true),
            Op::CMP_immediate | Op::CMP_register => (true, false, false, false),
            Op::SBC_immediate | Op::SBC_register => (true, false, true, true),
            Op::RSB_immediate | Op::RSB_register => (true, true, false, true),
            _ => return Ok(false),
        };
        let n = self.register(terms, inst.n)?;
        let (m, _) = self.second(terms, inst)?;
        let carry = match (with_carry, subtracts) {
            (true, _) => self.flags.carry(terms)?,
            (false, true) => one,
            (false, false) => zero,
        };
        let (a, b) = if reversed { (m, n) } else { (n, m) };
        let addends = Addends {
            a,
            b,
            subtracts,
            carry,
        };
        let exact = addends.exact(terms)?;
        let result = terms.word(exact)?;
        if inst.s {
            self.flags = Status::Of(addends.flags(terms, exact, result)?);
        }
        if writes {
            self.write(terms, inst.d, result)?;
        }
        Ok(true)
    }
}

impl Addends {
    fn exact(&self, terms: &mut Terms) -> Told<Term> {
        self.combine(terms, self.a, self.b)
    }

    fn combine(&self, terms: &mut Terms, a: Term, b: Term) -> Told<Term> {
        let sum = terms.add_scaled(a, b, if self.subtracts { -1 } else { 1 })?;
        let sum = terms.add(sum, self.carry)?;
        let sum = terms.plus(sum, if self.subtracts { -1 } else { 0 })?;
        let [a, b, carry] = [a, b, self.carry].map(|own| terms.bounds(own));
        let all = match self.subtracts {
            true => (a.0 - b.1 + carry.0 - 1, a.1 - b.0 + carry.1 - 1),
            false => (a.0 + b.0 + carry.0, a.1 + b.1 + carry.1),
        };
        // What is known of the operands may be of more than their parts.
        terms.learn(sum, all)?;
        Ok(sum)
    }

    fn flags(&self, terms: &mut Terms, exact: Term, result: Term) -> Told<Flags> {
        let (a, b) = (terms.unsigned(self.a)?, terms.unsigned(self.b)?);
        let sum = self.combine(terms, a, b)?;
        let over = terms.floor(sum, 32)?;
        let carry = if self.subtracts {
            terms.plus(over, 1)?
        } else {
            over
        };
        Ok(Flags {
            result: Some(result),
            exact: Some(exact),
            is_of_exact: true,
            carry: Some(carry),
            unsigned: self.subtracts.then_some(sum),
        })
    }
}

/// All bits turned.
fn complement(terms: &mut Terms, a: Term) -> Told<Term> {
    let negative = terms.scale(a, -1)?;
    terms.plus(negative, -1)
}

/// A word shifted, and the bit that left it last.
pub(crate) fn shift(terms: &mut Terms, m: Term, kind: ShiftType, by: u32) -> Told<Operand> {
    if by == 0 {
        return Ok((m, None));
    }
    let bit_of = |terms: &mut Terms, at: u32| -> Told<Term> {
        let up = terms.plus(m, 1 << at)?;
        let (up, down) = (terms.floor(up, at + 1)?, terms.floor(m, at + 1)?);
        terms.sub(up, down)
    };
    match kind {
        ShiftType::LSL => {
            let up = terms.scale(m, 1 << by)?;
            let word = terms.word(up)?;
            Ok((word, Some(bit_of(terms, 32 - by)?)))
        }
        ShiftType::LSR => {
            let unsigned = terms.unsigned(m)?;
            let down = terms.floor(unsigned, by)?;
            terms.learn(down, (0, (1 << (32 - by.min(32))) - 1))?;
            let down = terms.word(down)?;
            Ok((down, Some(bit_of(terms, by - 1)?)))
        }
        ShiftType::ASR => {
            let down = terms.floor(m, by)?;
            Ok((down, Some(bit_of(terms, by.min(32) - 1)?)))
        }
        ShiftType::ROR => {
            let unsigned = terms.unsigned(m)?;
            let down = terms.floor(unsigned, by)?;
            let low = terms.low_bits(m, by)?;
            let turned = terms.add_scaled(down, low, 1 << (32 - by))?;
            let turned = terms.word(turned)?;
            Ok((turned, Some(bit_of(terms, by - 1)?)))
        }
        ShiftType::RRX => unproven("RRX"),
    }
}

fn logic(terms: &mut Terms, op: Op, n: Term, m: Term) -> Told<Term> {
    match op {
        Op::AND_immediate | Op::AND_register | Op::TST_immediate | Op::TST_register => {
            and(terms, n, m)
        }
        Op::BIC_immediate | Op::BIC_register => {
            let both = and(terms, n, m)?;
            terms.sub(n, both)
        }
        Op::ORR_immediate | Op::ORR_register => or(terms, n, m),
        Op::ORN_immediate | Op::ORN_register => {
            let m = complement(terms, m)?;
            or(terms, n, m)
        }
        _ => exclusive_or(terms, n, m),
    }
}

/// Where a word is all bits or none: whether it is none.
fn mask(terms: &mut Terms, a: Term) -> Told<Option<crate::truth::Truth>> {
    let (low, high) = terms.bounds(a);
    if low < -1 || high > 0 {
        return Ok(None);
    }
    terms.at_least(a, 0).map(Some)
}

/// Where a word is 0 or 1: whether it is 1.
fn bit(terms: &mut Terms, a: Term) -> Told<Option<crate::truth::Truth>> {
    let (low, high) = terms.bounds(a);
    if low < 0 || high > 1 {
        return Ok(None);
    }
    terms.at_least(a, 1).map(Some)
}

pub(crate) fn and(terms: &mut Terms, n: Term, m: Term) -> Told<Term> {
    let zero = terms.constant(0);
    for (a, b) in [(n, m), (m, n)] {
        if let Some(none) = mask(terms, b)? {
            return terms.select(none, zero, a);
        }
        if let Some(one) = bit(terms, b)? {
            let low = terms.low_bits(a, 1)?;
            return terms.select(one, low, zero);
        }
        let Some(number) = terms.number(b) else {
            continue;
        };
        let number = number as i32 as u32;
        let (low, bits) = (
            number.trailing_zeros(),
            (!(number >> number.trailing_zeros())).trailing_zeros(),
        );
        if number.count_ones() == bits {
            let down = terms.floor(a, low)?;
            let field = terms.low_bits(down, bits)?;
            let up = terms.scale(field, 1 << low)?;
            return terms.word(up);
        }
    }
    Ok(commuting(terms, Function::And, [n, m]))
}

pub(crate) fn or(terms: &mut Terms, n: Term, m: Term) -> Told<Term> {
    let all = terms.constant(-1);
    for (a, b) in [(n, m), (m, n)] {
        if let Some(none) = mask(terms, b)? {
            return terms.select(none, a, all);
        }
        if let (Some(one), Some(_)) = (bit(terms, b)?, bit(terms, a)?) {
            return terms.select(one, b, a);
        }
        let sum = terms.sum(a);
        let zeros = sum.parts.iter().map(|(_, by)| by.trailing_zeros());
        let zeros = zeros
            .chain([sum.constant.trailing_zeros()])
            .min()
            .unwrap_or(0);
        let (low, high) = terms.bounds(b);
        if low >= 0 && high < 1 << zeros.min(32) {
            return terms.add(a, b);
        }
    }
    Ok(commuting(terms, Function::Or, [n, m]))
}

pub(crate) fn exclusive_or(terms: &mut Terms, n: Term, m: Term) -> Told<Term> {
    for (a, b) in [(n, m), (m, n)] {
        if let Some(none) = mask(terms, b)? {
            let turned = complement(terms, a)?;
            return terms.select(none, a, turned);
        }
        if let (Some(one), Some(_)) = (bit(terms, b)?, bit(terms, a)?) {
            let negative = terms.scale(a, -1)?;
            let other = terms.plus(negative, 1)?;
            return terms.select(one, other, a);
        }
    }
    Ok(commuting(terms, Function::ExclusiveOr, [n, m]))
}

/// What is the same whichever operand comes first.
fn commuting(terms: &mut Terms, function: Function, mut both: [Term; 2]) -> Term {
    both.sort();
    terms.apply(function, both.to_vec())
}
