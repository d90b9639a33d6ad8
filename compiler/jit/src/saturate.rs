//! Sums and differences of words that saturate, for words alone and in vectors: no machine at hand
//! has them for 32 bits.

use cranelift_codegen::ir::types::I32;
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::FunctionBuilder;

/// `sat(a + b)`: `b` is held where the sum fits, between `MIN - min(a, 0)` and `MAX - max(a, 0)`.
pub(super) fn add(f: &mut FunctionBuilder, a: Value, b: Value) -> Value {
    let (low, high) = around(f, a, 0);
    let [lowest, highest] = [i32::MIN, i32::MAX].map(|end| constant(f, a, end));
    let (least, most) = (f.ins().isub(lowest, low), f.ins().isub(highest, high));
    let held = f.ins().smax(b, least);
    let held = f.ins().smin(held, most);
    f.ins().iadd(a, held)
}

/// `sat(a - b)`: `b` is held where the difference fits, between `max(a, -1) - MAX` and `min(a, -1)
/// - MIN`.
pub(super) fn sub(f: &mut FunctionBuilder, a: Value, b: Value) -> Value {
    let (low, high) = around(f, a, -1);
    let [lowest, highest] = [i32::MIN, i32::MAX].map(|end| constant(f, a, end));
    let (least, most) = (f.ins().isub(high, highest), f.ins().isub(low, lowest));
    let held = f.ins().smax(b, least);
    let held = f.ins().smin(held, most);
    f.ins().isub(a, held)
}

/// The smaller and the larger of a word and a number.
fn around(f: &mut FunctionBuilder, a: Value, number: i32) -> (Value, Value) {
    let number = constant(f, a, number);
    (f.ins().smin(a, number), f.ins().smax(a, number))
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
