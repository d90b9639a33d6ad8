//! Instruction by instruction: what does the same on ARMv6-M.

use super::Legal;
use crate::thumb::literal::Literal;
use crate::thumb::minst::{Access, MInst, Operand, Reg, Relocation, Role, VReg};
use crate::thumb::routine::{OF_STRINGS, Routine};
use whippen_isa::{Cond, Op};

impl Legal<'_> {
    /// One instruction of selection.
    pub(super) fn one(&mut self, code: &MInst) {
        let Some(cond) = code.inst.cond else {
            return self.always(code);
        };
        if code.writes().next().is_none() && code.access == Access::None {
            // A comparison that counts only where another one gives the condition.
            let before = self.flags.clone();
            self.always(code);
            return self.flags_made_only(before, cond);
        }
        self.where_holds(cond, code);
    }

    /// A branch around an instruction, whose result is what it was where the condition fails.
    fn where_holds(&mut self, cond: Cond, code: &MInst) {
        let [yes, no, after] = [(); 3].map(|()| self.out.block());
        let flags = self.flags.clone();
        self.branch(cond, yes, no, None);
        let result = code.operands[Role::D as usize];
        let old = result.and_then(|operand| operand.old);
        let mut once = *code;
        once.inst.cond = None;
        self.at = yes;
        let new = result.map(|_| self.out.fresh());
        if let (Some(new), Some(d)) = (new, &mut once.operands[Role::D as usize]) {
            *d = Operand {
                reg: Reg::Virtual(new),
                old: None,
            };
        }
        self.always(&once);
        self.jump(after, new.into_iter().collect());
        self.at = no;
        self.jump(
            after,
            old.into_iter().filter(|_| result.is_some()).collect(),
        );
        if let Some(Operand {
            reg: Reg::Virtual(d),
            ..
        }) = result
        {
            self.out.blocks[after].params = vec![d];
        }
        (self.at, self.flags) = (after, flags);
    }

    fn always(&mut self, code: &MInst) {
        let inst = &code.inst;
        match inst.op() {
            Op::LDR_immediate | Op::STR_immediate | Op::LDRH_immediate | Op::STRH_immediate => {
                self.access(code)
            }
            Op::LDR_register | Op::STR_register | Op::LDRH_register | Op::STRH_register => {
                self.indexed(code)
            }
            Op::CMP_immediate | Op::CMN_immediate | Op::CMP_register => self.compare(code),
            Op::ADD_immediate | Op::ADD_register if is_fixed(code, Role::D) => self.walks(code),
            Op::SMULL | Op::UMULL | Op::SMLAL => self.long(code),
            Op::BL => self.call_string(code),
            _ => {
                let result = self.word(code);
                if inst.s {
                    self.flags_made(matches!(inst.op(), Op::ADC_register | Op::SBC_register));
                }
                self.name(code, Role::D, result);
                if inst.s {
                    self.flags_left(code);
                }
            }
        }
    }

    /// The tick of a string; its operands in low registers, its flags nobody's.
    fn call_string(&mut self, code: &MInst) {
        let mut call = *code;
        for role in OF_STRINGS.reads {
            call = call.reg(*role, self.value(code, *role));
        }
        self.emit(call);
    }

    /// A fixed register that goes on.
    fn walks(&mut self, code: &MInst) {
        let base = self.fixed(code);
        if code.inst.op() == Op::ADD_immediate {
            return self.walk(base, code.inst.imm);
        }
        let m = self.shifted(code, Role::M);
        self.add_to(base, m);
    }

    fn fixed(&self, code: &MInst) -> Reg {
        code.operands[Role::D as usize].map_or(Reg::Fixed(0), |operand| operand.reg)
    }

    fn compare(&mut self, code: &MInst) {
        let (n, imm) = (self.low(code, Role::N), code.inst.imm);
        let code = match code.inst.op() {
            Op::CMP_immediate if imm < 256 => MInst::new(Op::CMP_immediate).imm(imm),
            Op::CMP_immediate => {
                let m = self.constant(imm);
                MInst::new(Op::CMP_register).reg(Role::M, m)
            }
            Op::CMN_immediate => {
                let m = self.constant(imm);
                MInst::new(Op::CMN_register).reg(Role::M, m)
            }
            _ => {
                let m = self.low(code, Role::M);
                MInst::new(Op::CMP_register).with(Role::M, m)
            }
        };
        self.emit(code.with(Role::N, n));
        self.flags_made(false);
    }

    /// An instruction with one result. Where it sets the flags, the last one that is emitted does.
    fn word(&mut self, code: &MInst) -> VReg {
        let (inst, op) = (&code.inst, code.inst.op());
        match op {
            Op::MOV_immediate => match code.address {
                // There is room for every address; rows are named where moves are wide.
                Some(Relocation::Low(row)) => {
                    self.literal(Literal::Table(row.table)).unwrap_or(VReg(0))
                }
                _ => self.constant(inst.imm),
            },
            Op::MVN_immediate => self.constant(!inst.imm),
            Op::MOVT => self.top_half(code),
            Op::MOV_register => {
                let m = self.low(code, Role::M);
                self.copy(m)
            }
            Op::ADD_immediate | Op::SUB_immediate => self.plus(code),
            Op::ADD_register | Op::SUB_register => {
                let (n, m) = (self.low(code, Role::N), self.shifted(code, Role::M));
                self.three(op, n, m)
            }
            Op::RSB_immediate if inst.imm == 0 => {
                let n = self.low(code, Role::N);
                self.result(MInst::new(op).flags().with(Role::N, n).imm(0))
            }
            Op::RSB_immediate => {
                let (k, n) = (self.constant(inst.imm), self.low(code, Role::N));
                self.three(Op::SUB_register, Reg::Virtual(k), n)
            }
            Op::RSB_register => {
                let (n, m) = (self.low(code, Role::N), self.shifted(code, Role::M));
                self.three(Op::SUB_register, m, n)
            }
            Op::ADC_immediate | Op::ADC_register | Op::SBC_register => self.with_carry(code),
            Op::AND_register | Op::ORR_register | Op::EOR_register | Op::BIC_register => {
                let (n, m) = (self.value(code, Role::N), self.shifted(code, Role::M));
                let m = self.free(m);
                self.tied(op, n, Some(m))
            }
            Op::EOR_immediate => {
                let (n, k) = (self.value(code, Role::N), self.constant(inst.imm));
                self.tied(Op::EOR_register, n, Some(k))
            }
            Op::LSL_immediate | Op::LSR_immediate | Op::ASR_immediate => {
                let m = self.low(code, Role::M);
                self.shift(op, m, inst.amount)
            }
            Op::LSL_register | Op::LSR_register | Op::ASR_register => {
                let (n, m) = (self.value(code, Role::N), self.value(code, Role::M));
                self.tied(op, n, Some(m))
            }
            Op::UXTH => {
                let m = self.low(code, Role::M);
                self.result(MInst::new(op).with(Role::M, m))
            }
            Op::UBFX => self.field(code),
            Op::SSAT | Op::USAT => self.saturated(code),
            _ => self.product(code),
        }
    }

    /// A register that is not fixed.
    fn free(&mut self, reg: Reg) -> VReg {
        match reg {
            Reg::Virtual(reg) => reg,
            fixed => self.copy(fixed),
        }
    }

    /// The upper half of a constant, whose lower one is there; of an address the whole is there.
    fn top_half(&mut self, code: &MInst) -> VReg {
        let old = code.operands[Role::D as usize]
            .and_then(|operand| operand.old)
            .unwrap_or(VReg(0));
        if code.address.is_some() {
            return self.copy(Reg::Virtual(old));
        }
        let top = self.constant(code.inst.imm << 16);
        self.three(Op::ADD_register, Reg::Virtual(old), Reg::Virtual(top))
    }

    fn plus(&mut self, code: &MInst) -> VReg {
        let (op, imm) = (code.inst.op(), code.inst.imm);
        let n = self.low(code, Role::N);
        match imm {
            0..8 => self.result(MInst::new(op).flags().with(Role::N, n).imm(imm)),
            8..256 => {
                let n = self.free(n);
                self.tied_to(Role::N, op, n, None, imm)
            }
            _ => {
                let k = self.constant(imm);
                let op = if op == Op::ADD_immediate {
                    Op::ADD_register
                } else {
                    Op::SUB_register
                };
                self.three(op, n, Reg::Virtual(k))
            }
        }
    }

    fn with_carry(&mut self, code: &MInst) -> VReg {
        let n = self.value(code, Role::N);
        let (op, m) = match code.inst.op() {
            // The only constant that is added so is zero.
            Op::ADC_immediate => (Op::ADC_register, self.constant(code.inst.imm)),
            op => {
                let m = self.shifted(code, Role::M);
                (op, self.free(m))
            }
        };
        self.want_flags();
        self.tied(op, n, Some(m))
    }

    /// Bits of a word.
    fn field(&mut self, code: &MInst) -> VReg {
        let n = self.low(code, Role::N);
        let (lsb, width) = (code.inst.amount, code.inst.imm as u8);
        let up = 32 - lsb - width;
        let top = if up == 0 {
            n
        } else {
            Reg::Virtual(self.shift(Op::LSL_immediate, n, up))
        };
        self.shift(Op::LSR_immediate, top, 32 - width)
    }

    /// Held in the range of so many bits, after a shift. The comparisons that this takes are no
    /// part of what selection asked for: flags made before are what the next reader wants.
    fn saturated(&mut self, code: &MInst) -> VReg {
        let bits = code.inst.imm;
        let (low, high) = match code.inst.op() {
            Op::USAT => (0, (1_i64 << bits) - 1),
            _ => (-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1),
        };
        let flags = self.flags.clone();
        let shifted = self.shifted(code, Role::N);
        let mut held = self.free(shifted);
        for (bound, beyond) in [(low, Cond::LT), (high, Cond::GT)] {
            if bound == i64::from(i32::MIN) || bound == i64::from(i32::MAX) {
                continue;
            }
            let (k, d) = (self.constant(bound as u32), self.out.fresh());
            self.emit(
                MInst::new(Op::CMP_register)
                    .reg(Role::N, held)
                    .reg(Role::M, k),
            );
            self.flags_made(false);
            self.where_holds(
                beyond,
                &MInst::new(Op::MOV_register)
                    .reg(Role::M, k)
                    .both(Role::D, d, held),
            );
            held = d;
        }
        self.flags = flags;
        held
    }

    /// A product of words, or something else that takes two and is no instruction.
    fn product(&mut self, code: &MInst) -> VReg {
        let (n, m) = (self.value(code, Role::N), self.value(code, Role::M));
        match code.inst.op() {
            Op::MUL => self.multiply(n, m),
            Op::MLA => {
                let (product, a) = (self.multiply(n, m), self.low(code, Role::A));
                self.three(Op::ADD_register, a, Reg::Virtual(product))
            }
            Op::MLS => {
                let (product, a) = (self.multiply(n, m), self.low(code, Role::A));
                self.three(Op::SUB_register, a, Reg::Virtual(product))
            }
            // A gain of at most 65536 times 16 bits is a word.
            Op::SMULWy => {
                let product = self.multiply(n, m);
                self.shift(Op::ASR_immediate, Reg::Virtual(product), 16)
            }
            Op::SMMUL => self.call(Routine::MulTop, n, m),
            Op::SMMLA => {
                let (top, a) = (self.call(Routine::MulTop, n, m), self.low(code, Role::A));
                self.three(Op::ADD_register, a, Reg::Virtual(top))
            }
            // The first operand stands in M.
            Op::QADD => self.call(Routine::AddSat, m, n),
            Op::QSUB => self.call(Routine::SubSat, m, n),
            Op::CLZ => self.call(Routine::LeadingZeros, m, m),
            // By what is not negative.
            Op::SDIV => {
                let size = self.with_sign_of(n, n);
                let quotient = self.call(Routine::Divide, size, m);
                self.with_sign_of(quotient, n)
            }
            _ => self.call(Routine::Divide, n, m),
        }
    }

    /// A word, negated where `of` is negative.
    fn with_sign_of(&mut self, word: VReg, of: VReg) -> VReg {
        let sign = self.shift(Op::ASR_immediate, Reg::Virtual(of), 31);
        let flipped = self.tied(Op::EOR_register, sign, Some(word));
        self.three(Op::SUB_register, Reg::Virtual(flipped), Reg::Virtual(sign))
    }

    fn multiply(&mut self, n: VReg, m: VReg) -> VReg {
        // A square's factor is read and replaced at once.
        let n = if n == m {
            self.copy(Reg::Virtual(n))
        } else {
            n
        };
        self.tied_to(Role::M, Op::MUL, m, Some(n), 0)
    }

    /// Both words of a product, or of a sum with one.
    fn long(&mut self, code: &MInst) {
        let (n, m) = (self.value(code, Role::N), self.value(code, Role::M));
        let low = self.multiply(n, m);
        let routine = if code.inst.op() == Op::UMULL {
            Routine::UmulHigh
        } else {
            Routine::MulHigh
        };
        let high = self.call(routine, n, m);
        let old = |role: Role| code.operands[role as usize].and_then(|operand| operand.old);
        let (low, high) = match (old(Role::D), old(Role::A)) {
            (Some(sum_low), Some(sum_high)) => {
                let low = self.three(Op::ADD_register, Reg::Virtual(sum_low), Reg::Virtual(low));
                (low, self.tied(Op::ADC_register, sum_high, Some(high)))
            }
            _ => (low, high),
        };
        self.name(code, Role::D, low);
        self.name(code, Role::A, high);
    }
}

fn is_fixed(code: &MInst, role: Role) -> bool {
    matches!(
        code.operands[role as usize],
        Some(Operand {
            reg: Reg::Fixed(_),
            ..
        })
    )
}
