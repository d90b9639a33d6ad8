//! One tick of a stiff, lossy string by finite differences: what the operator `wave` means.
//!
//! A string of N parts has N - 1 points between its ends. Two cells of as many words hold them:
//! `U`, twice the displacements in units of the rate's, and `v`, the rates, in displacement a tick.
//! With `U` and `v` 0 at the ends, for each point l from 1 to N - 1
//!
//! ```text
//!   e_l = U_(l+1) - U_l                                                  (wraps)
//!   W_l = sat(e_l - e_(l-1)),  W_0 = sat(left U_1),  W_N = sat(right U_(N-1))
//!   a_l = top(k0 W_l) + top(k1 sat(W_(l-1) + W_(l+1)))
//!       + top(k2 sat(v_(l-1) + v_(l+1))) + top(k3 v_l)                   (wraps)
//!   v_l = sat(v_l + a_l)
//!   U_l = U_l + 2 v_l                                                    (wraps)
//! ```
//!
//! All right sides are those before the tick, but for the last, whose `v_l` is the new one. `top`
//! is the upper word of the product, rounded half up, so a coefficient is in Q32 of a rate; `W`
//! counts halves, so `k0` and `k1` are in Q31 of the displacements' second difference. An end is
//! pinned (0) or clamped (2).
//!
//! **Nothing can go wrong.** `U` alone wraps, and only differences of neighbours are taken of it:
//! they are right while they fit a word themselves, however far the string has wandered. All that
//! has a largest value saturates: bends, rates, and the sums of neighbours' bends and rates.
//! The sum of the four products fits a word wherever the coefficients are stable, that is `2 (K0 +
//! 2 K1) + K3 + 2 K2 <= 2` for their sizes K as real numbers: it is at most `K0/2 + K1/2 + K2 + K3`
//! of 2^31, which that bounds by 1. Elsewhere it wraps, in all engines alike.
//!
//! Not here: where coefficients are from, whether they are stable (nobody asks).

use super::op::Declared;
use super::{Op, OpError, Range, Type, Value, ValueInfo};
use crate::Kernel;
use whippen_ids::IdMap;

/// How many points a string may have between its ends.
pub const POINTS: Range = Range::new(5, 1023);

/// What it costs to hold an end, as a multiple of the outermost `U`: pinned, clamped.
pub const ENDS: [i64; 2] = [0, 2];

/// How both ends are held, by the operands of an instruction.
pub fn ends(values: &IdMap<Value, ValueInfo>, args: &[Value]) -> [i64; 2] {
    [4, 5].map(|at| args.get(at).map_or(0, |end| values[end].range.low))
}

/// Whether two cells are those of a string: words of any value, as many in both.
pub(super) fn check_cells(kernel: &Kernel, op: Op) -> Result<(), OpError> {
    let fault = |message: &'static str| Err(OpError::Cells { op, message });
    let [Some(u), Some(v)] = [0, 1].map(|place| op.declared_by(kernel, place)) else {
        return fault("names a cell that is not declared");
    };
    let holds_any = |cell: &Declared| (cell.ty, cell.range) == (Type::I32, Type::I32.range());
    let [first, second] = op.immediates();
    if first == second {
        return fault("takes two cells");
    }
    if !holds_any(&u) || !holds_any(&v) {
        return fault("takes cells that hold any i32");
    }
    if u.len != v.len || !POINTS.has(u.len as i64) {
        return fault("takes cells of the same 5 to 1023 words");
    }
    Ok(())
}

/// Where the points of a string are held.
pub(super) trait Points {
    /// `U` and `v` of a point, from 0.
    fn get(&self, point: usize) -> [i32; 2];
    /// Changes them.
    fn set(&mut self, point: usize, u: i32, v: i32);
}

/// One tick of so many points, by `k0` to `k3` and how the ends are held.
pub(super) fn tick(points: &mut impl Points, count: usize, k: [i32; 4], [left, right]: [i32; 2]) {
    let at = |points: &dyn Fn(usize) -> [i32; 2], point: usize| {
        if point < count { points(point) } else { [0, 0] }
    };
    let held = |end: i32, u: i32| saturated(i64::from(end) * i64::from(u));
    let [mut here, mut next] = [0, 1].map(|point| points.get(point));
    let mut e = next[0].wrapping_sub(here[0]);
    let (mut w_before, mut w) = (held(left, here[0]), bend(e, here[0]));
    let mut v_before = 0;
    for point in 0..count {
        let after = at(&|point| points.get(point), point + 2);
        let e_after = after[0].wrapping_sub(next[0]);
        let w_after = if point + 1 == count {
            held(right, here[0])
        } else {
            bend(e_after, e)
        };
        let a = [w, sum(w_before, w_after), sum(v_before, next[1]), here[1]];
        let a = k.into_iter().zip(a).map(|(k, x)| top(k, x));
        let a = a.fold(0, i32::wrapping_add);
        let v = here[1].saturating_add(a);
        points.set(point, here[0].wrapping_add(v.wrapping_mul(2)), v);
        (w_before, w, v_before) = (w, w_after, here[1]);
        (e, here, next) = (e_after, next, after);
    }
}

/// The bend between two differences.
fn bend(e: i32, before: i32) -> i32 {
    e.saturating_sub(before)
}

fn sum(a: i32, b: i32) -> i32 {
    a.saturating_add(b)
}

/// `floor(k x / 2^32 + 1/2)`
fn top(k: i32, x: i32) -> i32 {
    ((i64::from(k) * i64::from(x) + (1 << 31)) >> 32) as i32
}

fn saturated(a: i64) -> i32 {
    a.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

#[cfg(test)]
mod tests;
