//! Arithmetic of 64 bits, in two registers.

use super::arith_i32::ROUND;
use super::shift::{shift_code, with_shift};
use super::{Binding, Select};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Op as Isa, ShiftType};
use whippen_kernel::{Op, Value};

/// The low and the high word.
type Pair = (VReg, VReg);

impl Select<'_> {
    /// The whole product of two words.
    pub(super) fn mul_wide(&mut self, a: Value, b: Value) -> Pair {
        let a = self.reg(a);
        let b = self.reg(b);
        self.multiply_long(Isa::SMULL, a, b)
    }

    /// A sum with the whole product of two words.
    pub(super) fn mac_wide(&mut self, sum: Value, a: Value, b: Value) -> Pair {
        let sum = self.pair(sum);
        let a = self.reg(a);
        let b = self.reg(b);
        self.multiply_accumulate(Isa::SMLAL, sum, a, b)
    }

    /// A word with its sign.
    pub(super) fn widen(&mut self, word: Value) -> Pair {
        let low = self.reg(word);
        let high = self.sign_mask(low);
        (low, high)
    }

    pub(super) fn shl_i64(&mut self, value: Value, n: u8) -> Pair {
        let pair = self.pair(value);
        self.shl_pair(pair, n)
    }

    pub(super) fn sar_i64(&mut self, value: Value, n: u8) -> Pair {
        let pair = self.pair(value);
        self.sar_pair(pair, n)
    }

    /// The low word; of a shifted sum or product only that is computed.
    pub(super) fn select_narrow(&mut self, value: Value) -> Binding {
        let word = match (self.binding(value), self.deferred(value)) {
            (Binding::Const(k), _) => return Binding::Const(k as i32 as i64),
            (_, Some((Op::Sar(n @ 1..=32), [of, _]))) => {
                let (low, high) = self.pair(of);
                self.low_shifted(low, high, n)
            }
            (_, Some((Op::SarRound(32), [of, _])))
                if matches!(self.deferred(of), Some((Op::MulWide, _))) =>
            {
                self.rounded_product(of)
            }
            (_, Some((Op::SarRound(n @ 1..=32), [of, _]))) => {
                let (low, high) = self.pair(of);
                self.low_rounded(low, high, n)
            }
            _ => self.pair(value).0,
        };
        Binding::Word(word)
    }

    fn low_shifted(&mut self, low: VReg, high: VReg, n: u8) -> VReg {
        if n == 32 {
            return high;
        }
        let down = self.shift_by(Isa::LSR_immediate, low, n);
        let carried = MInst::new(Isa::ORR_register)
            .reg(Role::N, down)
            .reg(Role::M, high);
        self.result(with_shift(carried, ShiftType::LSL, 32 - n))
    }

    /// The bit that is shifted out last is the carry.
    fn low_rounded(&mut self, low: VReg, high: VReg, n: u8) -> VReg {
        if n == 32 {
            self.result(shift_code(Isa::LSL_immediate, 1).reg(Role::M, low).flags());
            return self.result(MInst::new(Isa::ADC_immediate).reg(Role::N, high).imm(0));
        }
        let down = self.result(shift_code(Isa::LSR_immediate, n).reg(Role::M, low).flags());
        let sum = MInst::new(Isa::ADC_register)
            .reg(Role::N, down)
            .reg(Role::M, high);
        self.result(with_shift(sum, ShiftType::LSL, 32 - n))
    }

    /// The top word of a product, rounded half up.
    fn rounded_product(&mut self, product: Value) -> VReg {
        let Some((_, [a, b])) = self.deferred(product) else {
            return self.pair(product).1;
        };
        let (n, m) = (self.reg(a), self.reg(b));
        self.result(
            MInst::new(Isa::SMMUL)
                .reg(Role::N, n)
                .reg(Role::M, m)
                .imm(ROUND),
        )
    }

    /// Both words of a product.
    pub(super) fn multiply_long(&mut self, op: Isa, n: VReg, m: VReg) -> Pair {
        let (low, high) = (self.func.fresh(), self.func.fresh());
        self.emit(
            MInst::new(op)
                .reg(Role::N, n)
                .reg(Role::M, m)
                .reg(Role::D, low)
                .reg(Role::A, high),
        );
        (low, high)
    }

    /// A sum of both words and a product.
    pub(super) fn multiply_accumulate(&mut self, op: Isa, sum: Pair, n: VReg, m: VReg) -> Pair {
        // `regalloc2` mistakes a factor that is also one of two registers to be replaced.
        let own = |select: &mut Self, word| {
            if word == n || word == m {
                select.copy_word(word)
            } else {
                word
            }
        };
        let sum = (own(self, sum.0), own(self, sum.1));
        let (low, high) = (self.func.fresh(), self.func.fresh());
        let code = MInst::new(op).reg(Role::N, n).reg(Role::M, m);
        self.emit(code.both(Role::D, low, sum.0).both(Role::A, high, sum.1));
        (low, high)
    }

    fn copy_word(&mut self, word: VReg) -> VReg {
        self.result(MInst::new(Isa::MOV_register).reg(Role::M, word))
    }

    /// All bits are the sign.
    pub(super) fn sign_mask(&mut self, word: VReg) -> VReg {
        self.shift_by(Isa::ASR_immediate, word, 31)
    }

    pub(super) fn add_i64(&mut self, a: Value, b: Value) -> Pair {
        let a = self.pair(a);
        let b = self.pair(b);
        self.add_pairs(a, b)
    }

    pub(super) fn sub_i64(&mut self, a: Value, b: Value) -> Pair {
        let a = self.pair(a);
        let b = self.pair(b);
        self.sub_pairs(a, b)
    }

    pub(super) fn add_pairs(&mut self, a: Pair, b: Pair) -> Pair {
        let low = self.result(
            MInst::new(Isa::ADD_register)
                .reg(Role::N, a.0)
                .reg(Role::M, b.0)
                .flags(),
        );
        (low, self.emit_rrr(Isa::ADC_register, a.1, b.1))
    }

    pub(super) fn sub_pairs(&mut self, a: Pair, b: Pair) -> Pair {
        let low = self.result(
            MInst::new(Isa::SUB_register)
                .reg(Role::N, a.0)
                .reg(Role::M, b.0)
                .flags(),
        );
        (low, self.emit_rrr(Isa::SBC_register, a.1, b.1))
    }

    pub(super) fn mul_i64(&mut self, a: Value, b: Value) -> Pair {
        let (a, b) = (self.pair(a), self.pair(b));
        let (low, high) = self.multiply_long(Isa::UMULL, a.0, b.0);
        let cross = |select: &mut Self, n, m, sum| {
            select.result(
                MInst::new(Isa::MLA)
                    .reg(Role::N, n)
                    .reg(Role::M, m)
                    .reg(Role::A, sum),
            )
        };
        let high = cross(self, a.0, b.1, high);
        (low, cross(self, a.1, b.0, high))
    }

    pub(super) fn min_max_i64(&mut self, op: Op, a: Value, b: Value) -> Pair {
        let (a, b) = (self.pair(a), self.pair(b));
        let cond = if op == Op::Min {
            self.compare_pairs(a, b)
        } else {
            self.compare_pairs(b, a)
        };
        self.move_pair(cond, a, b)
    }

    /// Shifted left.
    pub(super) fn shl_pair(&mut self, (low, high): Pair, n: u8) -> Pair {
        match n {
            0 => (low, high),
            1..32 => {
                let up = self.shift_by(Isa::LSL_immediate, high, n);
                let carried = MInst::new(Isa::ORR_register)
                    .reg(Role::N, up)
                    .reg(Role::M, low);
                let high = self.result(with_shift(carried, ShiftType::LSR, 32 - n));
                (self.shift_by(Isa::LSL_immediate, low, n), high)
            }
            _ => (
                self.load_constant(0),
                self.shift_by(Isa::LSL_immediate, low, n - 32),
            ),
        }
    }

    /// Shifted right, rounding down.
    pub(super) fn sar_pair(&mut self, (low, high): Pair, n: u8) -> Pair {
        match n {
            0 => (low, high),
            1..32 => {
                let down = self.shift_by(Isa::LSR_immediate, low, n);
                let carried = MInst::new(Isa::ORR_register)
                    .reg(Role::N, down)
                    .reg(Role::M, high);
                let low = self.result(with_shift(carried, ShiftType::LSL, 32 - n));
                (low, self.shift_by(Isa::ASR_immediate, high, n))
            }
            _ => {
                let sign = self.sign_mask(high);
                (self.shift_by(Isa::ASR_immediate, high, n - 32), sign)
            }
        }
    }

    /// Rounding up adds the bit that is shifted out last.
    pub(super) fn sar_round_i64(&mut self, value: Value, n: u8) -> Pair {
        let pair = self.pair(value);
        if n == 0 {
            return pair;
        }
        let (word, lsb) = if n <= 32 {
            (pair.0, n - 1)
        } else {
            (pair.1, n - 33)
        };
        let mut bit = MInst::new(Isa::UBFX).reg(Role::N, word).imm(1);
        bit.inst.amount = lsb;
        let bit = self.result(bit);
        let floor = self.sar_pair(pair, n);
        let low = self.result(
            MInst::new(Isa::ADD_register)
                .reg(Role::N, floor.0)
                .reg(Role::M, bit)
                .flags(),
        );
        (
            low,
            self.result(MInst::new(Isa::ADC_immediate).reg(Role::N, floor.1).imm(0)),
        )
    }
}
