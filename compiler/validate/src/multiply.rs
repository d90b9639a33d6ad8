//! Products, quotients, bit fields, extension, saturation.

use whippen_isa::{Inst, Op};

use crate::alu::shift;
use crate::machine::Machine;
use crate::stop::{Told, unproven};
use crate::term::{Function, Term, Terms};

/// A half of a word, signed.
fn half(terms: &mut Terms, word: Term, top: bool) -> Told<Term> {
    if top {
        terms.floor(word, 16)
    } else {
        terms.wrap(word, 16)
    }
}

impl Machine<'_> {
    /// Whether it was such an instruction.
    pub fn bits(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        let value = match inst.op() {
            Op::UBFX | Op::SBFX => {
                let n = self.register(terms, inst.n)?;
                let down = terms.floor(n, inst.amount.into())?;
                match inst.op() {
                    Op::UBFX => terms.low_bits(down, inst.imm)?,
                    _ => terms.wrap(down, inst.imm)?,
                }
            }
            Op::BFI | Op::BFC => self.insert_field(terms, inst)?,
            Op::CLZ => {
                let m = self.register(terms, inst.m)?;
                terms.apply(Function::LeadingZeros, vec![m])
            }
            Op::SSAT | Op::USAT => {
                let n = self.register(terms, inst.n)?;
                let (n, _) = shift(terms, n, inst.shift, inst.amount.into())?;
                let range = match inst.op() {
                    Op::SSAT => (-(1 << (inst.imm - 1)), (1 << (inst.imm - 1)) - 1),
                    _ => (0, (1 << inst.imm) - 1),
                };
                terms.clamp(n, range)?
            }
            Op::QADD | Op::QSUB | Op::QDADD | Op::QDSUB => self.saturating(terms, inst)?,
            Op::PKHBT | Op::PKHTB => {
                let (n, m) = (self.register(terms, inst.n)?, self.register(terms, inst.m)?);
                let (m, _) = shift(terms, m, inst.shift, inst.amount.into())?;
                let (low_n, low_m) = (terms.low_bits(n, 16)?, terms.low_bits(m, 16)?);
                match inst.op() {
                    Op::PKHBT => {
                        let top = terms.sub(m, low_m)?;
                        terms.add(low_n, top)?
                    }
                    _ => {
                        let top = terms.sub(n, low_n)?;
                        terms.add(top, low_m)?
                    }
                }
            }
            _ => return self.extend(terms, inst),
        };
        self.write(terms, inst.d, value)?;
        Ok(true)
    }

    fn insert_field(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Term> {
        let (low, bits) = (u32::from(inst.amount), inst.imm);
        let old = self.register(terms, inst.d)?;
        let down = terms.floor(old, low)?;
        let field = terms.low_bits(down, bits)?;
        let rest = terms.add_scaled(old, field, -(1 << low))?;
        if inst.op() == Op::BFC {
            return Ok(rest);
        }
        let n = self.register(terms, inst.n)?;
        let new = terms.low_bits(n, bits)?;
        terms.add_scaled(rest, new, 1 << low)
    }

    fn saturating(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Term> {
        let (n, m) = (self.register(terms, inst.n)?, self.register(terms, inst.m)?);
        let n = match inst.op() {
            Op::QDADD | Op::QDSUB => {
                let twice = terms.scale(n, 2)?;
                terms.saturate(twice)?
            }
            _ => n,
        };
        let sum = match inst.op() {
            Op::QADD | Op::QDADD => terms.add(m, n)?,
            _ => terms.sub(m, n)?,
        };
        terms.saturate(sum)
    }

    fn extend(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        let (bits, signed, adds) = match inst.op() {
            Op::SXTB => (8, true, false),
            Op::SXTH => (16, true, false),
            Op::UXTB => (8, false, false),
            Op::UXTH => (16, false, false),
            Op::SXTAB => (8, true, true),
            Op::SXTAH => (16, true, true),
            Op::UXTAB => (8, false, true),
            Op::UXTAH => (16, false, true),
            _ => return Ok(false),
        };
        let turn = u32::from(inst.amount);
        if turn + bits > 32 {
            return unproven("an extension of what is turned around");
        }
        let m = self.register(terms, inst.m)?;
        let down = terms.floor(m, turn)?;
        let mut value = match signed {
            true => terms.wrap(down, bits)?,
            false => terms.low_bits(down, bits)?,
        };
        if adds {
            let n = self.register(terms, inst.n)?;
            value = terms.add(n, value)?;
        }
        self.write(terms, inst.d, value)?;
        Ok(true)
    }

    /// Whether it was such an instruction.
    pub fn multiply(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        if !matches!(
            inst.class(),
            whippen_isa::Class::Multiply
                | whippen_isa::Class::MultiplyAdd
                | whippen_isa::Class::MultiplyLong
                | whippen_isa::Class::MultiplyAddLong
                | whippen_isa::Class::Divide
        ) {
            return Ok(false);
        }
        let (n, m) = (self.register(terms, inst.n)?, self.register(terms, inst.m)?);
        if self.long(terms, inst, n, m)? {
            return Ok(true);
        }
        let Some(value) = self.product(terms, inst, n, m)? else {
            return Ok(false);
        };
        let value = terms.word(value)?;
        self.write(terms, inst.d, value)?;
        if inst.s {
            self.flags
                .change(&|flags| (flags.result, flags.is_of_exact) = (Some(value), false));
        }
        Ok(true)
    }

    fn product(&mut self, terms: &mut Terms, inst: &Inst, n: Term, m: Term) -> Told<Option<Term>> {
        let t = terms;
        Ok(Some(match inst.op() {
            Op::MUL => t.mul(n, m)?,
            Op::MLA | Op::MLS => {
                let (a, product) = (self.register(t, inst.a)?, t.mul(n, m)?);
                t.add_scaled(a, product, if inst.op() == Op::MLA { 1 } else { -1 })?
            }
            Op::SMMUL => {
                let product = t.mul(n, m)?;
                top(t, product, inst)?
            }
            Op::SMMLA | Op::SMMLS => {
                let (a, product) = (self.register(t, inst.a)?, t.mul(n, m)?);
                let a = t.scale(a, 1 << 32)?;
                let by = if inst.op() == Op::SMMLA { 1 } else { -1 };
                let sum = t.add_scaled(a, product, by)?;
                top(t, sum, inst)?
            }
            Op::SMULxy | Op::SMLAxy => {
                let (n, m) = (
                    half(t, n, inst.imm & 2 != 0)?,
                    half(t, m, inst.imm & 1 != 0)?,
                );
                let product = t.mul(n, m)?;
                self.accumulated(t, inst, product, Op::SMLAxy)?
            }
            Op::SMULWy | Op::SMLAWy => {
                let m = half(t, m, inst.imm != 0)?;
                let product = t.mul(n, m)?;
                let product = t.floor(product, 16)?;
                self.accumulated(t, inst, product, Op::SMLAWy)?
            }
            Op::SDIV => t.apply(Function::DivideSigned, vec![n, m]),
            Op::UDIV => t.apply(Function::DivideUnsigned, vec![n, m]),
            _ => return Ok(None),
        }))
    }

    fn accumulated(
        &mut self,
        terms: &mut Terms,
        inst: &Inst,
        product: Term,
        adds: Op,
    ) -> Told<Term> {
        if inst.op() != adds {
            return Ok(product);
        }
        let a = self.register(terms, inst.a)?;
        terms.add(a, product)
    }

    fn long(&mut self, terms: &mut Terms, inst: &Inst, n: Term, m: Term) -> Told<bool> {
        let t = terms;
        let signed = match inst.op() {
            Op::SMULL | Op::SMLAL => true,
            Op::UMULL | Op::UMLAL | Op::UMAAL => false,
            _ => return Ok(false),
        };
        let mut all = if signed {
            t.mul(n, m)?
        } else {
            let (n, m) = (t.unsigned(n)?, t.unsigned(m)?);
            t.mul(n, m)?
        };
        if !matches!(inst.op(), Op::SMULL | Op::UMULL) {
            let (low, high) = (self.register(t, inst.d)?, self.register(t, inst.a)?);
            let (low, high) = (
                t.unsigned(low)?,
                if signed { high } else { t.unsigned(high)? },
            );
            all = t.add(all, low)?;
            let up = if inst.op() == Op::UMAAL { 1 } else { 1 << 32 };
            all = t.add_scaled(all, high, up)?;
        }
        let (low, high) = (t.word(all)?, t.floor(all, 32)?);
        self.write(t, inst.d, low)?;
        self.write(t, inst.a, high)?;
        Ok(true)
    }
}

/// The top word, rounded where the instruction says so.
fn top(terms: &mut Terms, product: Term, inst: &Inst) -> Told<Term> {
    let half = if inst.imm != 0 { 1 << 31 } else { 0 };
    let product = terms.plus(product, half)?;
    terms.floor(product, 32)
}
