//! Sums and differences of words that saturate, for words alone and in vectors: no machine at hand
//! has them for 32 bits.

use cranelift_codegen::ir::types::I32;
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::FunctionBuilder;

/// `sat(a + b)`: a sum that overflowed has another sign than both.
pub(super) fn add(f: &mut FunctionBuilder, a: Value, b: Value) -> Value {
    let sum = f.ins().iadd(a, b);
    let differ = [a, b].map(|operand| f.ins().bxor(sum, operand));
    let over = f.ins().band(differ[0], differ[1]);
    nearest(f, sum, over)
}

/// `sat(a - b)`: where it overflowed, the first has another sign than the second and than the
/// difference.
pub(super) fn sub(f: &mut FunctionBuilder, a: Value, b: Value) -> Value {
    let difference = f.ins().isub(a, b);
    let differ = [b, difference].map(|operand| f.ins().bxor(a, operand));
    let over = f.ins().band(differ[0], differ[1]);
    nearest(f, difference, over)
}

/// A word, or words that are all the same, like this one.
pub(super) fn constant(f: &mut FunctionBuilder, like: Value, number: i32) -> Value {
    let ty = f.func.dfg.value_type(like);
    let word = f.ins().iconst(I32, i64::from(number as u32));
    if ty == I32 {
        word
    } else {
        f.ins().splat(ty, word)
    }
}

/// The result, or, where the sign of `over` is set, the end of the type on its other side.
fn nearest(f: &mut FunctionBuilder, result: Value, over: Value) -> Value {
    let over = f.ins().sshr_imm_s(over, 31);
    let sign = f.ins().sshr_imm_s(result, 31);
    let lowest = constant(f, result, i32::MIN);
    let end = f.ins().bxor(sign, lowest);
    f.ins().bitselect(over, end, result)
}
