//! Comparisons, bools and what they choose.

use super::{Binding, Select};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::imm::{thumb_imm_carry, thumb_shrink_imm};
use whippen_isa::{Cond, Flags, Op as Isa};
use whippen_kernel::{Op, Type, Value};

/// What a comparison asks of two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Relation {
    Less,
    LessOrEqual,
    Equal,
}

impl Select<'_> {
    /// Makes a comparison the word that it is needed as, where it does not only steer.
    pub(super) fn bind_comparison_as_word(&mut self, value: Value) {
        if let Binding::Comparison(..) = self.binding(value) {
            let word = self.bool_as_word(value);
            self.bind(value, Binding::Word(word));
        }
    }

    /// 0 or 1.
    pub(super) fn bool_as_word(&mut self, value: Value) -> VReg {
        if let Some(word) = self.sign_as_bool(value) {
            return word;
        }
        let cond = self.condition(value);
        let zero = self.load_constant(0);
        self.move_if(cond, Binding::Const(1), zero)
    }

    /// 0 or 1 as the sign of a difference, where that cannot overflow.
    fn sign_as_bool(&mut self, value: Value) -> Option<VReg> {
        let Binding::Comparison(relation, [a, b]) = self.binding(value) else {
            return None;
        };
        let (of, from) = (self.info(a), self.info(b));
        let word = |low: i64, high: i64| Type::I32.range().has(low) && Type::I32.range().has(high);
        // a < b where a - b is negative, a <= b where a - b - 1 is.
        let less = i64::from(relation == Relation::LessOrEqual);
        if of.ty != Type::I32
            || !word(
                of.range.low - from.range.high - less,
                of.range.high - from.range.low - less,
            )
        {
            return None;
        }
        let difference = match (relation, self.constant(a), self.constant(b)) {
            (Relation::Equal, ..) => return None,
            (_, _, Some(k)) => {
                let a = self.reg(a);
                self.add_constant(a, -k - less)
            }
            (_, Some(k), _) if thumb_shrink_imm((k - less) as u32).is_some() => {
                let b = self.reg(b);
                self.result(
                    MInst::new(Isa::RSB_immediate)
                        .reg(Role::N, b)
                        .imm((k - less) as u32),
                )
            }
            (_, Some(k), _) => {
                let (k, b) = (self.load_constant((k - less) as i32), self.reg(b));
                self.emit_rrr(Isa::SUB_register, k, b)
            }
            (Relation::Less, ..) => {
                let (a, b) = (self.reg(a), self.reg(b));
                self.emit_rrr(Isa::SUB_register, a, b)
            }
            (Relation::LessOrEqual, ..) => return None,
        };
        Some(self.shift_by(Isa::LSR_immediate, difference, 31))
    }

    /// Sets the flags; the bool holds where the condition does.
    pub(super) fn condition(&mut self, value: Value) -> Cond {
        match self.binding(value) {
            Binding::Comparison(relation, [a, b]) if self.info(a).ty == Type::I64 => {
                self.condition_i64(relation, a, b)
            }
            Binding::Comparison(relation, [a, b]) => {
                if let Some(cond) = self.compare_with_zero(relation, a, b) {
                    return cond;
                }
                // A constant is compared with from the right.
                let turned = self.constant(a).is_some();
                if turned {
                    self.compare(b, a)
                } else {
                    self.compare(a, b)
                }
                match (relation, turned) {
                    (Relation::Less, false) => Cond::LT,
                    (Relation::Less, true) => Cond::GT,
                    (Relation::LessOrEqual, false) => Cond::LE,
                    (Relation::LessOrEqual, true) => Cond::GE,
                    (Relation::Equal, _) => Cond::EQ,
                }
            }
            _ => {
                let word = self.reg(value);
                if !self.set_flags_of_result(word, is_logic) {
                    self.emit(MInst::new(Isa::CMP_immediate).reg(Role::N, word).imm(0));
                }
                Cond::NE
            }
        }
    }

    /// A comparison with zero by the flags of what computes the word.
    fn compare_with_zero(&mut self, relation: Relation, a: Value, b: Value) -> Option<Cond> {
        let (of, cond) = match (relation, self.constant(a), self.constant(b)) {
            (Relation::Less, _, Some(0)) | (Relation::LessOrEqual, _, Some(-1)) => (a, Cond::MI),
            (Relation::LessOrEqual, Some(0), _) | (Relation::Less, Some(-1), _) => (b, Cond::PL),
            _ => return None,
        };
        let word = self.reg(of);
        self.set_flags_of_result(word, is_sum).then_some(cond)
    }

    /// Lets the instruction that computes a word say in the flags whether it is negative or zero,
    /// if it is one of the class asked for and nothing behind it has to do with flags.
    fn set_flags_of_result(&mut self, word: VReg, class: fn(&MInst) -> bool) -> bool {
        for code in self.func.blocks[self.at].code.iter_mut().rev() {
            if code.writes().eq([word]) {
                let sets = class(code) && code.inst.cond.is_none() && code.tied.is_none();
                code.inst.s |= sets;
                return sets;
            }
            let flags = code.inst.flags();
            if (flags.writes | flags.reads).intersects(Flags::NZCV) {
                return false;
            }
        }
        false
    }

    /// Flags of `a - b`.
    pub(super) fn compare(&mut self, a: Value, b: Value) {
        let code = self.compare_code(a, b);
        self.emit_compare(code);
    }

    /// What gives the flags of `a - b`.
    fn compare_code(&mut self, a: Value, b: Value) -> MInst {
        let n = self.reg(a);
        if let Some(k) = self.constant(b) {
            let (k, minus) = (k as i32 as u32, (k as i32).unsigned_abs());
            if is_free_comparand(k) {
                return MInst::new(Isa::CMP_immediate).reg(Role::N, n).imm(k);
            }
            if (k as i32) < 0 && k as i32 != i32::MIN && is_free_comparand(minus) {
                return MInst::new(Isa::CMN_immediate).reg(Role::N, n).imm(minus);
            }
        }
        let m = self.reg(b);
        MInst::new(Isa::CMP_register)
            .reg(Role::N, n)
            .reg(Role::M, m)
    }

    /// A comparison, if its flags are not there still.
    fn emit_compare(&mut self, code: MInst) {
        let sets = |code: &&MInst| code.inst.flags().writes.intersects(Flags::NZCV);
        let last = self.func.blocks[self.at].code.iter().rev().find(sets);
        if last.is_none_or(|last| (last.inst, last.operands) != (code.inst, code.operands)) {
            self.emit(code);
        }
    }

    fn condition_i64(&mut self, relation: Relation, a: Value, b: Value) -> Cond {
        let (a, b) = (self.pair(a), self.pair(b));
        match relation {
            Relation::Less => self.compare_pairs(a, b),
            Relation::LessOrEqual => {
                self.compare_pairs(b, a);
                Cond::GE
            }
            Relation::Equal => {
                self.emit(
                    MInst::new(Isa::CMP_register)
                        .reg(Role::N, a.0)
                        .reg(Role::M, b.0),
                );
                self.emit(
                    MInst::new(Isa::CMP_register)
                        .reg(Role::N, a.1)
                        .reg(Role::M, b.1)
                        .only(Cond::EQ),
                );
                Cond::EQ
            }
        }
    }

    /// Whether 64 bits are less than others.
    pub(super) fn compare_pairs(&mut self, a: (VReg, VReg), b: (VReg, VReg)) -> Cond {
        self.emit(
            MInst::new(Isa::CMP_register)
                .reg(Role::N, a.0)
                .reg(Role::M, b.0),
        );
        self.result(
            MInst::new(Isa::SBC_register)
                .reg(Role::N, a.1)
                .reg(Role::M, b.1)
                .flags(),
        );
        Cond::LT
    }

    /// Both bools, as words; one that does not hold is cleared.
    pub(super) fn select_and(&mut self, a: Value, b: Value) -> VReg {
        for (one, other) in [(a, b), (b, a)] {
            if let Some((Op::Not, [not, _])) = self.deferred(other) {
                let n = self.reg(one);
                let m = self.reg(not);
                return self.emit_rrr(Isa::BIC_register, n, m);
            }
        }
        let a = self.reg(a);
        let b = self.reg(b);
        self.emit_rrr(Isa::AND_register, a, b)
    }

    pub(super) fn select_or(&mut self, a: Value, b: Value) -> VReg {
        let a = self.reg(a);
        let b = self.reg(b);
        self.emit_rrr(Isa::ORR_register, a, b)
    }

    pub(super) fn select_not(&mut self, a: Value) -> VReg {
        let a = self.reg(a);
        self.result(MInst::new(Isa::EOR_immediate).reg(Role::N, a).imm(1))
    }

    pub(super) fn select_choice(&mut self, is_wide: bool, args: [Value; 3]) -> Binding {
        if let Some(known) = self.constant(args[0]) {
            let chosen = args[if known == 0 { 2 } else { 1 }];
            return if is_wide {
                self.pair(chosen).into()
            } else {
                self.reg(chosen).into()
            };
        }
        if is_wide {
            let (then, other) = (self.pair(args[1]), self.pair(args[2]));
            let cond = self.condition(args[0]);
            return self.move_pair(cond, then, other).into();
        }
        if let Some(word) = self.chosen_limit(args) {
            return word.into();
        }
        let other = self.reg(args[2]);
        let then = match self.binding(args[1]) {
            Binding::Const(k) if thumb_shrink_imm(k as u32).is_some() => Binding::Const(k),
            _ => Binding::Word(self.reg(args[1])),
        };
        let cond = self.condition(args[0]);
        Binding::Word(self.move_if(cond, then, other))
    }

    /// A value that is held within a limit only where a bool says so: the comparison with the limit
    /// is conditional, too.
    fn chosen_limit(&mut self, args: [Value; 3]) -> Option<VReg> {
        let limit_of = |select: &Self, held: Value, of: Value| {
            let (op, [a, b]) = select
                .deferred(held)
                .filter(|(op, _)| matches!(op, Op::Min | Op::Max))?;
            let limit = if a == of { b } else { a };
            ((a == of || b == of) && select.constant(of).is_none()).then_some((op, limit))
        };
        let (where_it_holds, of, (op, limit)) = match (
            limit_of(self, args[1], args[2]),
            limit_of(self, args[2], args[1]),
        ) {
            (Some(limit), _) => (true, args[2], limit),
            (_, Some(limit)) => (false, args[1], limit),
            _ => return None,
        };
        let beyond = if op == Op::Max { Cond::LT } else { Cond::GT };
        let (first, cond) = match self.binding(args[0]) {
            // A constant is compared with from the right.
            Binding::Comparison(Relation::Less, [a, b])
                if self.constant(a).is_none() && self.info(a).ty != Type::I64 =>
            {
                ([a, b], if where_it_holds { Cond::LT } else { Cond::GE })
            }
            _ => return None,
        };
        // Where the first comparison fails, its own flags must say that nothing is beyond the
        // limit.
        if !matches!((cond, beyond), (Cond::LT, Cond::LT) | (Cond::GE, Cond::GT)) {
            return None;
        }
        let (old, new) = (self.reg(of), self.binding(limit));
        let compare = self.compare_code(of, limit);
        let new = match new {
            Binding::Const(k) if thumb_shrink_imm(k as u32).is_some() => new,
            _ => Binding::Word(self.reg(limit)),
        };
        self.compare(first[0], first[1]);
        self.emit(compare.only(cond));
        Some(self.move_if(beyond, new, old))
    }

    /// Both words where the flags say so.
    pub(super) fn move_pair(
        &mut self,
        cond: Cond,
        then: (VReg, VReg),
        other: (VReg, VReg),
    ) -> (VReg, VReg) {
        let low = self.move_if(cond, Binding::Word(then.0), other.0);
        let high = self.move_if(cond, Binding::Word(then.1), other.1);
        (low, high)
    }
}

/// Whether an instruction is a sum that sets flags at no cost.
fn is_sum(code: &MInst) -> bool {
    match code.inst.op() {
        Isa::ADD_register | Isa::SUB_register | Isa::RSB_register => true,
        Isa::ADD_immediate | Isa::SUB_immediate | Isa::RSB_immediate => {
            thumb_shrink_imm(code.inst.imm).is_some()
        }
        _ => false,
    }
}

/// Whether an instruction computes a bool from two others.
fn is_logic(code: &MInst) -> bool {
    matches!(
        code.inst.op(),
        Isa::AND_register | Isa::ORR_register | Isa::BIC_register
    )
}

/// Whether comparing with such a constant costs no more than with a register: one that must be
/// shifted takes a cycle more.
fn is_free_comparand(k: u32) -> bool {
    thumb_shrink_imm(k).is_some() && thumb_imm_carry(k).is_none()
}
