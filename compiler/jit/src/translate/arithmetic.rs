//! Translation of operators on values, for one key.

use super::Translator;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F64, I8, I32, I64};
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::FuncInstBuilder;
use whippen_kernel::{Range, Type};

impl Translator<'_> {
    /// Where a value of the kernel stays.
    pub(crate) fn range(&self, value: whippen_kernel::Value) -> Range {
        self.kernel.values[value].range
    }

    pub(crate) fn constant(&mut self, ty: Type, value: i64) -> Value {
        self.f
            .ins()
            .iconst(if ty == Type::I1 { I8 } else { I64 }, value)
    }

    /// `a + b * c`
    pub(crate) fn multiply_add(&mut self, a: Value, b: Value, c: Value) -> Value {
        let product = self.f.ins().imul(b, c);
        self.f.ins().iadd(a, product)
    }

    /// `floor(a * b / 2^32)`
    pub(crate) fn top_word(&mut self, a: Value, b: Value) -> Value {
        let product = self.f.ins().imul(a, b);
        let rounded = self.f.ins().iadd_imm_s(product, 1 << 31);
        self.f.ins().sshr_imm_s(rounded, 32)
    }

    /// `floor(a / 2^n + 1/2)`
    pub(crate) fn sar_round(&mut self, n: u8, a: Value, range: Range) -> Value {
        if n == 0 {
            return a;
        }
        let half = 1_i64 << (n - 1);
        if range.high.checked_add(half).is_some() {
            let sum = self.f.ins().iadd_imm_s(a, half);
            return self.f.ins().sshr_imm_s(sum, i64::from(n));
        }
        // The sum need not fit; what it carries into the result is the bit below.
        let floor = self.f.ins().sshr_imm_s(a, i64::from(n));
        let below = self.f.ins().sshr_imm_s(a, i64::from(n) - 1);
        let carry = self.f.ins().band_imm_s(below, 1);
        self.f.ins().iadd(floor, carry)
    }

    /// `floor(a * 2^n / b + 1/2)`, 0 where `b` is 0; the dividend fits since `a` has 32 bits and
    /// `n` is at most 31.
    pub(crate) fn div_round(&mut self, n: u8, a: Value, b: Value, divisor: Range) -> Value {
        // The division must not trap, even where an assumption that is wrong gave it other
        // operands.
        let a = if self.assumes { self.low_word(a) } else { a };
        let b = if self.assumes { self.low_word(b) } else { b };
        let zero_occurs = self.assumes || divisor.has(0);
        let dividend = self.f.ins().ishl_imm_s(a, i64::from(n));
        let zero = self.f.ins().icmp_imm_s(IntCC::Equal, b, 0);
        let one = self.f.ins().iconst(I64, 1);
        let safe = if zero_occurs {
            self.f.ins().select(zero, one, b)
        } else {
            b
        };
        let toward_zero = self.f.ins().sdiv(dividend, safe);
        let product = self.f.ins().imul(toward_zero, safe);
        let rest = self.f.ins().isub(dividend, product);

        // To the floor: the rest takes the divisor's sign.
        let signs = self.f.ins().bxor(rest, safe);
        let differ = self.f.ins().icmp_imm_s(IntCC::SignedLessThan, signs, 0);
        let some = self.f.ins().icmp_imm_s(IntCC::NotEqual, rest, 0);
        let below = self.f.ins().band(differ, some);
        let lower = self.f.ins().iadd_imm_s(toward_zero, -1);
        let raised = self.f.ins().iadd(rest, safe);
        let floor = self.f.ins().select(below, lower, toward_zero);
        let rest = self.f.ins().select(below, raised, rest);

        // Up where the rest is at least half of the divisor.
        let [rest, whole] = [rest, safe].map(|value| self.f.ins().iabs(value));
        let twice = self.f.ins().ishl_imm_s(rest, 1);
        let up = self
            .f
            .ins()
            .icmp(IntCC::SignedGreaterThanOrEqual, twice, whole);
        let up = self.f.ins().uextend(I64, up);
        let rounded = self.f.ins().iadd(floor, up);
        let nothing = self.f.ins().iconst(I64, 0);
        if zero_occurs {
            self.f.ins().select(zero, nothing, rounded)
        } else {
            rounded
        }
    }

    /// About `a * 2^n / b`, held to 30 bits, 0 where `b` is not positive.
    pub(crate) fn quot(&mut self, n: u8, a: Value, b: Value) -> Value {
        let [a, b] = [a, b].map(|wide| self.f.ins().ireduce(I32, wide));
        let one = self.f.ins().iconst(I32, 1);
        let positive = self.f.ins().smax(b, one);
        // Bits that repeat the sign, but one. Of nothing there are 32, and shifts take five bits.
        let doubled = self.f.ins().ishl_imm_s(a, 1);
        let changes = self.f.ins().bxor(a, doubled);
        let up = self.f.ins().clz(changes);
        let dividend = self.f.ins().ishl(a, up);
        let up_divisor = self.f.ins().clz(positive);
        let divisor = self.f.ins().ishl(positive, up_divisor);
        let divisor = self.f.ins().ushr_imm_u(divisor, 16);
        let quotient = self.f.ins().sdiv(dividend, divisor);
        let top = self.f.ins().ishl_imm_s(quotient, 15);

        let down = self.f.ins().isub(up, up_divisor);
        let down = self.f.ins().iadd_imm_s(down, 31 - i64::from(n));
        let [none, all] = [0, 31].map(|end| self.f.ins().iconst(I32, end));
        let down = self.f.ins().smax(down, none);
        let down = self.f.ins().smin(down, all);
        let moved = self.f.ins().sshr(top, down);
        let [low, high] = [-(1 << 29), (1 << 29) - 1].map(|end| self.f.ins().iconst(I32, end));
        let held = self.f.ins().smax(moved, low);
        let held = self.f.ins().smin(held, high);
        let is_positive = self.f.ins().icmp_imm_s(IntCC::SignedGreaterThan, b, 0);
        let word = self.f.ins().select(is_positive, held, none);
        self.f.ins().sextend(I64, word)
    }

    /// The low 32 bits of a result, with their sign.
    pub(crate) fn wrapped(&mut self, op: impl FnOnce(FuncInstBuilder) -> Value) -> Value {
        let exact = op(self.f.ins());
        self.low_word(exact)
    }

    /// The word nearest to a result.
    pub(crate) fn held(&mut self, op: impl FnOnce(FuncInstBuilder) -> Value) -> Value {
        let exact = op(self.f.ins());
        let [low, high] = [i32::MIN, i32::MAX].map(|end| self.f.ins().iconst(I64, i64::from(end)));
        let raised = self.f.ins().smax(exact, low);
        self.f.ins().smin(raised, high)
    }

    /// The low 32 bits, with their sign.
    pub(crate) fn low_word(&mut self, a: Value) -> Value {
        let word = self.f.ins().ireduce(I32, a);
        self.f.ins().sextend(I64, word)
    }

    /// `floor(sqrt(a))`, 0 where `a` is negative. The machine's square root, cut to an integer, may
    /// be one too large where `a` was rounded up on the way. It is never too small: rounding is
    /// monotone and the exact root is representable.
    pub(crate) fn sqrt(&mut self, a: Value) -> Value {
        let zero = self.f.ins().iconst(I64, 0);
        let a = self.f.ins().smax(a, zero);
        let real = self.f.ins().fcvt_from_sint(F64, a);
        let root = self.f.ins().sqrt(real);
        let root = self.f.ins().fcvt_to_sint_sat(I64, root);
        let square = self.f.ins().imul(root, root);
        let over = self.f.ins().icmp(IntCC::SignedGreaterThan, square, a);
        let over = self.f.ins().uextend(I64, over);
        self.f.ins().isub(root, over)
    }
}
