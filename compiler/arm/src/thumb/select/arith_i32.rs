//! Arithmetic of words.

use super::shift::{ShiftedOperand, with_shift};
use super::{Binding, Select};
use crate::thumb::func::BlockId;
use crate::thumb::literal::Literal;
use crate::thumb::minst::{AliasClass, MInst, Role, VReg};
use crate::thumb::registers::STATE;
use whippen_isa::imm::thumb_shrink_imm;
use whippen_isa::{Cond, Op as Isa};
use whippen_kernel::{Op, Range, Type, Value};

/// Top words of products are rounded half up (SMMULR, SMMLAR).
pub(super) const ROUND: u32 = 1;

/// For how many instructions a constant stays in its register.
const CONSTANT_KEPT: usize = 24;

impl Select<'_> {
    /// A constant in a register, that of a little while ago if there is one.
    pub(super) fn load_constant(&mut self, k: i32) -> VReg {
        let here = self.func.blocks[self.at].code.len();
        let near = |(known, block, from, _): &(i32, BlockId, usize, VReg)| {
            *known == k && *block == self.at && here - from < CONSTANT_KEPT
        };
        if let Some((.., reg)) = self.constants.iter().rev().find(|constant| near(constant)) {
            return *reg;
        }
        let reg = self.new_constant(k);
        self.constants.push((k, self.at, here, reg));
        reg
    }

    fn new_constant(&mut self, k: i32) -> VReg {
        let k = k as u32;
        if thumb_shrink_imm(k).is_some() || k < 0x1_0000 {
            return self.result(MInst::new(Isa::MOV_immediate).imm(k));
        }
        if thumb_shrink_imm(!k).is_some() {
            return self.result(MInst::new(Isa::MVN_immediate).imm(!k));
        }
        if let Some(place) = self.literals.place(Literal::Word(k)) {
            let offset = i64::from(self.layout.literals + 4 * place);
            return self.load(
                Isa::LDR_immediate,
                Self::fixed(STATE),
                offset,
                AliasClass::Constant,
            );
        }
        let low = self.result(MInst::new(Isa::MOV_immediate).imm(k & 0xffff));
        let d = self.func.fresh();
        self.emit(MInst::new(Isa::MOVT).both(Role::D, d, low).imm(k >> 16));
        d
    }

    pub(super) fn mul_i32(&mut self, a: Value, b: Value) -> VReg {
        let a = self.reg(a);
        let b = self.reg(b);
        self.emit_rrr(Isa::MUL, a, b)
    }

    /// The top word of a product; with a power of two it is a rounded shift.
    pub(super) fn mul_top(&mut self, a: Value, b: Value) -> VReg {
        if let Some((of, n)) = self.power_of_two_factor(a, b) {
            return self.sar_round_i32(of, n);
        }
        let a = self.reg(a);
        let b = self.reg(b);
        let code = MInst::new(Isa::SMMUL).imm(ROUND);
        self.result(code.reg(Role::N, a).reg(Role::M, b))
    }

    /// A sum with the top word of a product.
    pub(super) fn mac_top(&mut self, sum: Value, a: Value, b: Value) -> VReg {
        let sum = self.reg(sum);
        if self.constant(a) == Some(0) || self.constant(b) == Some(0) {
            return sum;
        }
        let a = self.reg(a);
        let b = self.reg(b);
        let code = MInst::new(Isa::SMMLA).imm(ROUND).reg(Role::A, sum);
        self.result(code.reg(Role::N, a).reg(Role::M, b))
    }

    /// The factor that is no constant, and how far a product with the other, a power of two, is
    /// shifted down.
    fn power_of_two_factor(&self, a: Value, b: Value) -> Option<(Value, u8)> {
        let (of, k) = self.split_constant(&[a, b])?;
        (k > 1 && k.count_ones() == 1).then(|| (of, 32 - k.trailing_zeros() as u8))
    }

    /// `value + k`
    pub(super) fn add_constant(&mut self, value: VReg, k: i64) -> VReg {
        match k {
            0 => value,
            k if fits_add_immediate(k) => self.result(
                MInst::new(Isa::ADD_immediate)
                    .reg(Role::N, value)
                    .imm(k as u32),
            ),
            k if fits_add_immediate(-k) => self.result(
                MInst::new(Isa::SUB_immediate)
                    .reg(Role::N, value)
                    .imm(-k as u32),
            ),
            k => {
                let k = self.load_constant(k as i32);
                self.emit_rrr(Isa::ADD_register, value, k)
            }
        }
    }

    pub(super) fn add_i32(&mut self, a: Value, b: Value) -> VReg {
        match self.split_constant(&[a, b]) {
            Some((of, k)) => match self.shifted_operand(of) {
                // A constant that takes a register may as well be what a shifted operand is added
                // to.
                Some(shifted) if !fits_add_immediate(k) && !fits_add_immediate(-k) => {
                    let k = self.load_constant(k as i32);
                    self.emit_shifted(Isa::ADD_register, k, shifted)
                }
                _ => {
                    let of = self.reg(of);
                    self.add_constant(of, k)
                }
            },
            _ => match self.fold_into_sum(a, b) {
                Some(sum) => sum,
                None => {
                    let (a, b) = (self.reg(a), self.reg(b));
                    self.emit_rrr(Isa::ADD_register, a, b)
                }
            },
        }
    }

    /// A sum whose one side is a product or shift that nobody else needs.
    fn fold_into_sum(&mut self, a: Value, b: Value) -> Option<VReg> {
        let (sum, part) = match (self.sum_part(a), self.sum_part(b)) {
            (_, Some(part)) => (a, part),
            (Some(part), _) => (b, part),
            _ => return None,
        };
        let sum = self.reg(sum);
        Some(match part {
            SumPart::Shifted(shifted) => self.emit_shifted(Isa::ADD_register, sum, shifted),
            SumPart::Product(product, [n, m]) => {
                let n = self.reg(n);
                let m = self.reg(m);
                let product = product.reg(Role::N, n).reg(Role::M, m);
                self.result(product.reg(Role::A, sum))
            }
        })
    }

    /// What an addition can take in of a value that waits for its user.
    fn sum_part(&self, value: Value) -> Option<SumPart> {
        match self.foldable(value)? {
            (Op::Mul, args) => Some(SumPart::Product(MInst::new(Isa::MLA), args)),
            (Op::MulTop, args) => {
                let code = MInst::new(Isa::SMMLA).imm(ROUND);
                Some(SumPart::Product(code, args))
            }
            _ => self.shifted_operand(value).map(SumPart::Shifted),
        }
    }

    pub(super) fn sub_i32(&mut self, a: Value, b: Value) -> VReg {
        let reversed = self
            .constant(a)
            .and_then(|k| u32::try_from(k).ok())
            .filter(|k| thumb_shrink_imm(*k).is_some());
        if let Some(k) = reversed {
            let b = self.reg(b);
            return self.result(MInst::new(Isa::RSB_immediate).reg(Role::N, b).imm(k));
        }
        if let Some(k) = self.constant(b) {
            let a = self.reg(a);
            return self.add_constant(a, -k);
        }
        if let Some(shifted) = self.shifted_operand(b) {
            let a = self.reg(a);
            return self.emit_shifted(Isa::SUB_register, a, shifted);
        }
        if let Some((Op::Mul, [n, m])) = self.foldable(b) {
            let a = self.reg(a);
            let n = self.reg(n);
            let m = self.reg(m);
            let product = MInst::new(Isa::MLS).reg(Role::N, n).reg(Role::M, m);
            return self.result(product.reg(Role::A, a));
        }
        if let Some(shifted) = self.shifted_operand(a) {
            let b = self.reg(b);
            return self.emit_shifted(Isa::RSB_register, b, shifted);
        }
        let a = self.reg(a);
        let b = self.reg(b);
        self.emit_rrr(Isa::SUB_register, a, b)
    }

    /// A sum or difference that saturates: `op d, a, b`, where A stands in M.
    pub(super) fn saturating(&mut self, op: Isa, operands: [Value; 2]) -> VReg {
        let [a, b] = operands.map(|operand| self.reg(operand));
        self.emit_rrr(op, b, a)
    }

    /// The smaller or larger one; by saturation where that does the same.
    pub(super) fn min_max_i32(&mut self, op: Op, a: Value, b: Value) -> VReg {
        let (mut of, mut bounds) = (None, Type::I32.range());
        if let Some((inner, k)) = self.split_constant(&[a, b]) {
            bounds = narrow_bounds(op, k, bounds);
            of = Some(inner);
            if let Some((inner_op @ (Op::Min | Op::Max), inner_args)) = self.deferred(inner)
                && inner_op != op
                && let Some((innermost, k)) = self.split_constant(&inner_args)
            {
                let both = narrow_bounds(inner_op, k, bounds);
                if both.low <= both.high
                    && let Some(word) = self.saturate(innermost, both)
                {
                    return word;
                }
            }
        }
        if let Some(of) = of
            && let Some(word) = self.saturate(of, bounds)
        {
            return word;
        }
        let word = self.compare_and_move(a, b, if op == Op::Min { Cond::LT } else { Cond::GT });
        // Operands may have been held on the way.
        self.last_held = None;
        word
    }

    /// The operand that is not constant, and the one that is.
    pub(super) fn split_constant(&self, args: &[Value]) -> Option<(Value, i64)> {
        match (self.constant(args[0]), self.constant(args[1])) {
            (None, Some(k)) => Some((args[0], k)),
            (Some(k), None) => Some((args[1], k)),
            _ => None,
        }
    }

    /// A value held in bounds by one instruction, if one can.
    fn saturate(&mut self, value: Value, bounds: Range) -> Option<VReg> {
        let range = self.info(value).range;
        // A saturation to a range does the same if each end is the bound, or is beyond all values
        // and bounds.
        let same = |low: i64, high: i64| {
            let at_low = low == bounds.low || low <= range.low && bounds.low <= range.low;
            let at_high = high == bounds.high || high >= range.high && bounds.high >= range.high;
            at_low && at_high
        };
        let unsigned = (0..32_u32)
            .find(|n| same(0, (1 << n) - 1))
            .map(|n| (Isa::USAT, n));
        let signed = (1..33_u32)
            .find(|n| same(-(1 << (n - 1)), (1 << (n - 1)) - 1))
            .map(|n| (Isa::SSAT, n));
        let (isa, bits) = unsigned.or(signed)?;
        let code = match self.shifted_operand(value) {
            Some(ShiftedOperand { of, shift, amount }) => {
                let n = self.reg(of);
                with_shift(MInst::new(isa).reg(Role::N, n), shift, amount)
            }
            None => {
                let n = self.reg(value);
                MInst::new(isa).reg(Role::N, n)
            }
        };
        self.last_held = Some(match isa {
            Isa::USAT => Range::new(0, (1 << bits) - 1),
            _ => Range::new(-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
        });
        Some(self.result(code.imm(bits)))
    }

    /// The first where the comparison of the first with the second gives `cond`, else the second.
    fn compare_and_move(&mut self, a: Value, b: Value, cond: Cond) -> VReg {
        let (a, b, cond) = if self.constant(a).is_some() {
            (b, a, cond)
        } else {
            (a, b, cond)
        };
        self.compare(a, b);
        let (then, other) = (self.reg(a), self.binding(b));
        // Both are the same where they are equal.
        let beyond = if cond == Cond::LT { Cond::GT } else { Cond::LT };
        match other {
            Binding::Const(k) => self.move_if(beyond, Binding::Const(k), then),
            _ => {
                let other = self.reg(b);
                self.move_if(cond, Binding::Word(then), other)
            }
        }
    }

    /// `old`, or what is bound where the flags say so.
    pub(super) fn move_if(&mut self, cond: Cond, new: Binding, old: VReg) -> VReg {
        let d = self.func.fresh();
        let code = match new {
            Binding::Const(k)
                if thumb_shrink_imm(k as u32).is_some() || (0..0x1_0000).contains(&k) =>
            {
                MInst::new(Isa::MOV_immediate).imm(k as u32)
            }
            Binding::Const(k) if thumb_shrink_imm(!(k as u32)).is_some() => {
                MInst::new(Isa::MVN_immediate).imm(!(k as u32))
            }
            Binding::Const(k) => {
                let new = self.load_constant(k as i32);
                MInst::new(Isa::MOV_register).reg(Role::M, new)
            }
            Binding::Word(new) | Binding::Pair(new, _) => {
                MInst::new(Isa::MOV_register).reg(Role::M, new)
            }
            // Never asked for: callers hand over registers and constants.
            Binding::Unbound
            | Binding::Choice(_)
            | Binding::Comparison(..)
            | Binding::Deferred(..)
            | Binding::Rematerialize(..) => MInst::new(Isa::MOV_immediate),
        };
        self.emit(code.both(Role::D, d, old).only(cond));
        d
    }
}

/// Whether an addition has room for a constant.
fn fits_add_immediate(k: i64) -> bool {
    (0..4096).contains(&k) || u32::try_from(k).is_ok_and(|k| thumb_shrink_imm(k).is_some())
}

/// What an addition can take in.
enum SumPart {
    Shifted(ShiftedOperand),
    /// The instruction that adds a product, and its factors.
    Product(MInst, [Value; 2]),
}

/// The bounds with those of one more operator.
fn narrow_bounds(op: Op, k: i64, bounds: Range) -> Range {
    if op == Op::Min {
        Range {
            high: bounds.high.min(k),
            ..bounds
        }
    } else {
        Range {
            low: bounds.low.max(k),
            ..bounds
        }
    }
}
