//! Translation of operators on values, for keys in lanes.

use super::{Lane, Lanes, WIDTH};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I32X4, I64, I64X2};
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_kernel::{Range, Type, Value as KernelValue};

impl Lanes<'_> {
    /// `a * b` in 64 bits, plus `c`.
    pub(super) fn product(
        &mut self,
        a: KernelValue,
        b: KernelValue,
        c: Option<KernelValue>,
    ) -> Lane {
        let sum = c.map(|c| self.wide(c));
        let power = |lane| {
            if let Lane::Known(_, number) = lane {
                power_of_two(number)
            } else {
                None
            }
        };
        let (minus, product) = match (power(self.lane(a)), power(self.lane(b))) {
            (Some((n, minus)), _) => (minus, self.doubled(b, n)),
            (_, Some((n, minus))) => (minus, self.doubled(a, n)),
            _ => (false, self.multiplied(a, b)),
        };
        Lane::Wide(match (sum, minus) {
            (Some(sum), false) => [0, 1].map(|half| self.ins().iadd(sum[half], product[half])),
            (Some(sum), true) => [0, 1].map(|half| self.ins().isub(sum[half], product[half])),
            (None, false) => product,
            (None, true) => product.map(|half| self.ins().ineg(half)),
        })
    }

    /// The whole products of words.
    fn multiplied(&mut self, a: KernelValue, b: KernelValue) -> [Value; 2] {
        let (a, b) = (self.word(a), self.word(b));
        let (low_a, low_b) = (self.ins().swiden_low(a), self.ins().swiden_low(b));
        let (high_a, high_b) = (self.ins().swiden_high(a), self.ins().swiden_high(b));
        [
            self.ins().imul(low_a, low_b),
            self.ins().imul(high_a, high_b),
        ]
    }

    /// The top words of the products of words, rounded half up.
    pub(super) fn top_words(&mut self, a: KernelValue, b: KernelValue) -> Value {
        let half = self.splat_wide(1 << 31);
        let rounded = self
            .multiplied(a, b)
            .map(|products| self.ins().iadd(products, half));
        self.words_of(rounded, [1, 3, 5, 7])
    }

    /// Words times `2^n`, in 64 bits.
    fn doubled(&mut self, a: KernelValue, n: u8) -> [Value; 2] {
        let word = self.word(a);
        self.widened(word)
            .map(|half| self.ins().ishl_imm_s(half, i64::from(n)))
    }

    /// Each word in 64 bits.
    pub(super) fn widened(&mut self, word: Value) -> [Value; 2] {
        [self.ins().swiden_low(word), self.ins().swiden_high(word)]
    }

    /// The low words.
    pub(super) fn narrowed(&mut self, value: KernelValue) -> Value {
        match self.lane(value) {
            Lane::Shifted(32, pair) => self.words_of(pair, [1, 3, 5, 7]),
            Lane::Shifted(n, pair) if n < 32 => {
                // Only the low words count, so no sign needs to come in.
                let pair = pair.map(|half| self.ins().ushr_imm_u(half, i64::from(n)));
                self.words_of(pair, [0, 2, 4, 6])
            }
            Lane::Shifted(n, pair) => {
                let high = self.words_of(pair, [1, 3, 5, 7]);
                self.ins().sshr_imm_s(high, i64::from(n) - 32)
            }
            _ => {
                let pair = self.wide(value);
                self.words_of(pair, [0, 2, 4, 6])
            }
        }
    }

    /// `floor(a / 2^n + 1/2)`
    pub(super) fn sar_round(&mut self, n: u8, a: KernelValue) -> Lane {
        let (ty, range) = (self.t.ty(a), self.t.range(a));
        if n == 0 {
            return self.lane(a);
        }
        let half = 1_i64 << (n - 1);
        let fits = range.high <= ty.range().high - half;
        match (ty, fits) {
            (Type::I64, true) => {
                let sum = self.wide(a).map(|a| {
                    let half = self.splat_wide(half);
                    self.ins().iadd(a, half)
                });
                Lane::Shifted(n, sum)
            }
            (Type::I64, false) => Lane::Wide(self.wide(a).map(|a| {
                let one = self.splat_wide(1);
                self.carried(n, a, one)
            })),
            (_, true) => {
                let (a, half) = (self.word(a), self.splat(half));
                let sum = self.ins().iadd(a, half);
                Lane::Word(self.ins().sshr_imm_s(sum, i64::from(n)))
            }
            (_, false) => {
                let (a, one) = (self.word(a), self.splat(1));
                Lane::Word(self.carried(n, a, one))
            }
        }
    }

    /// The shifted value plus the bit below, where the sum with a half need not fit.
    fn carried(&mut self, n: u8, a: Value, one: Value) -> Value {
        let floor = self.ins().sshr_imm_s(a, i64::from(n));
        let below = self.ins().sshr_imm_s(a, i64::from(n) - 1);
        let carry = self.ins().band(below, one);
        self.ins().iadd(floor, carry)
    }

    /// A mask where the comparison holds.
    pub(super) fn compared(&mut self, cc: IntCC, a: KernelValue, b: KernelValue) -> Value {
        match self.t.ty(a) {
            Type::I1 => {
                let (a, b) = (self.mask(a), self.mask(b));
                self.ins().icmp(cc, a, b)
            }
            Type::I32 => self.compared_words(cc, a, b),
            Type::I64 => {
                let (a, b) = (self.wide(a), self.wide(b));
                let halves = [0, 1].map(|half| self.ins().icmp(cc, a[half], b[half]));
                self.words_of(halves, [0, 2, 4, 6])
            }
        }
    }

    /// Machines compare with `>`, and constants are at hand: `a <= 7` is `8 > a`.
    fn compared_words(&mut self, cc: IntCC, a: KernelValue, b: KernelValue) -> Value {
        let greater =
            |lanes: &mut Self, a: Value, b: Value| lanes.ins().icmp(IntCC::SignedGreaterThan, a, b);
        match (cc, self.lane(a), self.lane(b)) {
            (IntCC::SignedLessThanOrEqual, Lane::Known(_, a), _) if a > i32::MIN.into() => {
                let (b, a) = (self.word(b), self.splat(a - 1));
                greater(self, b, a)
            }
            (IntCC::SignedLessThanOrEqual, _, Lane::Known(_, b)) if b < i32::MAX.into() => {
                let (b, a) = (self.splat(b + 1), self.word(a));
                greater(self, b, a)
            }
            (IntCC::SignedLessThan, ..) => {
                let (a, b) = (self.word(a), self.word(b));
                greater(self, b, a)
            }
            _ => {
                let (a, b) = (self.word(a), self.word(b));
                self.ins().icmp(cc, a, b)
            }
        }
    }

    /// `a` where the mask holds, else `b`.
    pub(super) fn chosen(&mut self, mask: Value, a: KernelValue, b: KernelValue) -> Lane {
        match (self.t.ty(a), self.lane(a), self.lane(b)) {
            (Type::I64, ..) => {
                let (a, b) = (self.wide(a), self.wide(b));
                Lane::Wide(self.chosen_wide(mask, a, b))
            }
            (ty, Lane::Known(_, 0), _) => {
                let b = self.word_or_mask(b);
                let kept = self.ins().band_not(b, mask);
                as_lane(ty, kept)
            }
            (ty, _, Lane::Known(_, 0)) => {
                let a = self.word_or_mask(a);
                let kept = self.ins().band(a, mask);
                as_lane(ty, kept)
            }
            (ty, ..) => {
                let (a, b) = (self.word_or_mask(a), self.word_or_mask(b));
                let chosen = self.ins().bitselect(mask, a, b);
                as_lane(ty, chosen)
            }
        }
    }

    pub(super) fn chosen_wide(&mut self, mask: Value, a: [Value; 2], b: [Value; 2]) -> [Value; 2] {
        let masks = [[0, 0, 1, 1], [2, 2, 3, 3]].map(|places| {
            let mask = self.words_of([mask; 2], places);
            self.reinterpreted(I64X2, mask)
        });
        [0, 1].map(|half| self.ins().bitselect(masks[half], a[half], b[half]))
    }

    /// An `i1` as a mask, an `i32` as words.
    pub(super) fn word_or_mask(&mut self, value: KernelValue) -> Value {
        if self.t.ty(value) == Type::I1 {
            self.mask(value)
        } else {
            self.word(value)
        }
    }

    /// One key's value as single keys have it: a bool as 0 or 1 in 64 bits, a word with its sign.
    pub(super) fn one(&mut self, value: KernelValue, lane: usize) -> Value {
        match self.t.ty(value) {
            Type::I64 => {
                let half = self.wide(value)[lane / 2];
                self.ins().extractlane(half, (lane % 2) as u8)
            }
            Type::I32 => {
                let words = self.word(value);
                let word = self.ins().extractlane(words, lane as u8);
                self.ins().sextend(I64, word)
            }
            Type::I1 => {
                let mask = self.mask(value);
                let word = self.ins().extractlane(mask, lane as u8);
                let bit = self.ins().band_imm_s(word, 1);
                self.ins().uextend(I64, bit)
            }
        }
    }

    /// Puts together what each lane is by itself, held as single keys hold it.
    pub(super) fn each(
        &mut self,
        ty: Type,
        mut one: impl FnMut(&mut Self, usize) -> Value,
    ) -> Lane {
        let all: [Value; WIDTH] = std::array::from_fn(|lane| one(self, lane));
        match ty {
            Type::I64 => Lane::Wide([0, 2].map(|low| {
                let first = self.ins().splat(I64X2, all[low]);
                self.ins().insertlane(first, all[low + 1], 1)
            })),
            Type::I1 | Type::I32 => {
                let words = all.map(|value| self.ins().ireduce(I32, value));
                let first = self.ins().splat(I32X4, words[0]);
                let words = (1..WIDTH).fold(first, |all, lane| {
                    self.ins().insertlane(all, words[lane], lane as u8)
                });
                if ty == Type::I1 {
                    Lane::Mask(self.ins().ineg(words))
                } else {
                    Lane::Word(words)
                }
            }
        }
    }

    /// A quotient, lane by lane.
    pub(super) fn div_round(&mut self, n: u8, a: KernelValue, b: KernelValue) -> Lane {
        let divisor: Range = self.t.range(b);
        self.each(Type::I32, |lanes, lane| {
            let (a, b) = (lanes.one(a, lane), lanes.one(b, lane));
            lanes.t.div_round(n, a, b, divisor)
        })
    }

    /// A quotient with 16 significant bits, lane by lane.
    pub(super) fn quot(&mut self, n: u8, a: KernelValue, b: KernelValue) -> Lane {
        self.each(Type::I32, |lanes, lane| {
            let (a, b) = (lanes.one(a, lane), lanes.one(b, lane));
            lanes.t.quot(n, a, b)
        })
    }

    /// A square root, lane by lane.
    pub(super) fn sqrt(&mut self, a: KernelValue) -> Lane {
        self.each(Type::I32, |lanes, lane| {
            let a = lanes.one(a, lane);
            lanes.t.sqrt(a)
        })
    }
}

/// A vector of 32-bit lanes as a value of this type.
pub(super) fn as_lane(ty: Type, vector: Value) -> Lane {
    if ty == Type::I1 {
        Lane::Mask(vector)
    } else {
        Lane::Word(vector)
    }
}

/// `n` and whether it is negative, where a number is plus or minus `2^n`.
fn power_of_two(number: i64) -> Option<(u8, bool)> {
    let magnitude = number.unsigned_abs();
    magnitude
        .is_power_of_two()
        .then(|| (magnitude.trailing_zeros() as u8, number < 0))
}
