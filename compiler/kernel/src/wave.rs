//! One tick of a stiff, lossy string by finite differences: what the operator `wave` means.
//!
//! A string of N parts has N - 1 points between its ends. Two cells hold it: of each part its slope
//! `e`, by which the displacement grows from the point before it to the one behind it, and of each
//! point its rate `v`. Rates are displacement a tick, slopes count halves of their unit. With `v` 0
//! at the ends, for each point l from 1 to N - 1
//!
//! ```text
//!   W_l = sat(e_l - e_(l-1)),  W_0 = sat(left e_0),  W_N = sat(right sat(-e_(N-1)))
//!   P_l = top(k1 W_l) + top(k2 v_l)                                      (wraps)
//!   Q_l = P_(l-1) + top(k0 W_l) + top(k3 v_l)                            (wraps)
//!   v_l = sat(v_l + sat(Q_l + P_(l+1)))
//!   e_l = e_l + 2 (v_(l+1) - v_l)                                        (wraps)
//! ```
//!
//! All right sides are those before the tick, but for the last, whose rates are the new ones; that
//! one is also for l = 0. `top` is the upper word of the product, rounded half up, so a coefficient
//! is in Q32 of a rate; the bends `W` count halves, so `k0` and `k1` are in Q31 of the
//! displacements' second difference. An end is pinned (0) or clamped (2).
//!
//! What a point does to both neighbours is one value, `P`: two products, which each of them adds,
//! so that no sums of neighbours are needed before the products.
//!
//! **Nothing can go wrong.** Slopes wrap, and are right whenever they fit a word, however far the
//! string has wandered: no displacement is held. All else that has a largest value saturates:
//! bends, what a point is accelerated by, rates. `P` and `Q` fit their words wherever the
//! coefficients are stable, that is `2 (K0 + 2 K1) + K3 + 2 K2 <= 2` for their sizes K as real
//! numbers, with `K0 >= 2 K1`, `K3 >= 2 K2` and, as `k3` is a word, `K3 <= 1/2`. Of 2^31, `P` is at
//! most `K1/2 + K2`, which is 3/8 at most. `Q` is at most `K0/2 + K1/2 + K2 + K3`; the first two
//! terms are at most `1/2 - K2/2 - K3/4`, so that is at most `1/2 + K2/2 + 3/4 K3`, and so `1/2 +
//! K3`. What four products are rounded by besides is far less than what is kept from `K3 = 1/2`
//! where a string's points are counted. Partial sums of `Q` may be what they like: only the last
//! one counts. With other coefficients they wrap, in all engines alike.
//!
//! Not here: where coefficients are from, whether they are stable (nobody asks).

use super::op::Declared;
use super::{Op, OpError, Range, Type, Value, ValueInfo};
use crate::Kernel;
use whippen_ids::IdMap;

/// How many points a string may have between its ends.
pub const POINTS: Range = Range::new(5, 1023);

/// The bend at an end, as a multiple of the outermost slope away from it: pinned, clamped.
pub const ENDS: [i64; 2] = [0, 2];

/// How both ends are held, by the operands of an instruction.
pub fn ends(values: &IdMap<Value, ValueInfo>, args: &[Value]) -> [i64; 2] {
    [4, 5].map(|at| args.get(at).map_or(0, |end| values[end].range.low))
}

/// Whether two cells are those of a string: words of any value, of slopes one more than of rates.
pub(super) fn check_cells(kernel: &Kernel, op: Op) -> Result<(), OpError> {
    let fault = |message: &'static str| Err(OpError::Cells { op, message });
    let [Some(slopes), Some(rates)] = [0, 1].map(|place| op.declared_by(kernel, place)) else {
        return fault("names a cell that is not declared");
    };
    let holds_any = |cell: &Declared| (cell.ty, cell.range) == (Type::I32, Type::I32.range());
    let [first, second] = op.immediates();
    if first == second {
        return fault("takes two cells");
    }
    if !holds_any(&slopes) || !holds_any(&rates) {
        return fault("takes cells that hold any i32");
    }
    if !POINTS.has(rates.len as i64) {
        return fault("takes 5 to 1023 rates");
    }
    if slopes.len != rates.len + 1 {
        return fault("takes one slope more than rates");
    }
    Ok(())
}

/// Where a string is held.
pub(super) trait Points {
    /// The slope of a part, from 0.
    fn slope(&self, part: usize) -> i32;
    /// The rate of the point behind a part.
    fn rate(&self, point: usize) -> i32;
    /// Changes a slope.
    fn set_slope(&mut self, part: usize, slope: i32);
    /// Changes a rate.
    fn set_rate(&mut self, point: usize, rate: i32);
}

/// One tick of so many points, by `k0` to `k3` and how the ends are held.
pub(super) fn tick(
    points: &mut impl Points,
    count: usize,
    [k0, k1, k2, k3]: [i32; 4],
    [left, right]: [i32; 2],
) {
    let beside = |w: i32, v: i32| top(k1, w).wrapping_add(top(k2, v));
    let mut e = [points.slope(0), points.slope(1)];
    let (mut w, mut v) = (e[1].saturating_sub(e[0]), points.rate(0));
    let (mut p_before, mut p) = (beside(held(left, e[0]), 0), beside(w, v));
    let mut rate_before = 0;
    for point in 0..count {
        let (e_after, w_after, v_after) = if point + 1 == count {
            (0, held(right, 0_i32.saturating_sub(e[1])), 0)
        } else {
            let after = points.slope(point + 2);
            (after, after.saturating_sub(e[1]), points.rate(point + 1))
        };
        let p_after = beside(w_after, v_after);
        let q = p_before.wrapping_add(top(k0, w)).wrapping_add(top(k3, v));
        let rate = v.saturating_add(q.saturating_add(p_after));
        points.set_rate(point, rate);
        points.set_slope(point, moved(e[0], rate_before, rate));
        (e, w, v) = ([e[1], e_after], w_after, v_after);
        (p_before, p, rate_before) = (p, p_after, rate);
    }
    points.set_slope(count, moved(e[0], rate_before, 0));
}

/// A slope between points of such new rates.
fn moved(e: i32, before: i32, after: i32) -> i32 {
    e.wrapping_add(after.wrapping_sub(before).wrapping_mul(2))
}

/// The bend of an end, by the outermost slope away from it.
fn held(end: i32, e: i32) -> i32 {
    end.saturating_mul(e)
}

/// `floor(k x / 2^32 + 1/2)`
fn top(k: i32, x: i32) -> i32 {
    ((i64::from(k) * i64::from(x) + (1 << 31)) >> 32) as i32
}

#[cfg(test)]
mod tests;
