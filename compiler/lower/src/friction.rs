//! What a friction takes off its slip, which needs no clamps where integers are exact.
//!
//! ```text
//!   slip   = min(max(tried, min(free, 0)), max(free, 0))
//!   taken  = min(max(free - slip, min(free, 0)), max(free, 0))
//! ```
//!
//! The first is between 0 and `free`, so their difference is as well, without the second line's
//! clamps: those are for differences that are rounded, where units differ.

use super::Lowerer;
use super::real::Real;
use whippen_kernel::{Op, OpError};
use whippen_lang::model::{Dag, Node, NodeId};

/// A value that is held between two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    value: NodeId,
    low: NodeId,
    high: NodeId,
}

impl Lowerer<'_> {
    /// The smaller of two values, where that is what a friction takes off its slip and integers
    /// are exact.
    pub(super) fn held_difference(
        &mut self,
        a: NodeId,
        b: NodeId,
    ) -> Result<Option<Real>, OpError> {
        let dag = &self.step.model.dag;
        let Some((taken, free)) = held(dag, a, b) else {
            return Ok(None);
        };
        let Some(slip) = rest(dag, taken.value, free).filter(|slip| is_held(dag, *slip, taken))
        else {
            return Ok(None);
        };
        let all = [taken.value, free, slip, taken.low, taken.high].map(|node| self.real(node));
        let [difference, free, slip, low, high] = all;
        let (difference, low, high) = (difference?, low?, high?);
        let exact = [free?, slip?, low, high]
            .iter()
            .all(|real| real.offset == 0.0 && real.lsb == difference.lsb);
        if !exact || difference.offset != 0.0 {
            return Ok(None);
        }
        let [low, high] = [low, high].map(|end| self.b.range(end.value));
        let known = self.b.range(difference.value);
        let inside = Op::Assume(known.low.max(low.low), known.high.min(high.high));
        let value = self.b.op(inside, &[difference.value])?;
        Ok(Some(Real {
            value,
            ..difference
        }))
    }
}

/// What is held between 0 and something, and that.
fn held(dag: &Dag, a: NodeId, b: NodeId) -> Option<(Held, NodeId)> {
    let ends = |high: NodeId, inner: NodeId| {
        let Node::Max(c, d) = *dag.get(high) else {
            return None;
        };
        let free = beside_zero(dag, c, d)?;
        let Node::Max(c, d) = *dag.get(inner) else {
            return None;
        };
        let low = |node: NodeId| match *dag.get(node) {
            Node::Min(e, f) => beside_zero(dag, e, f) == Some(free),
            _ => false,
        };
        let (low, value) = match (low(c), low(d)) {
            (true, _) => (c, d),
            (_, true) => (d, c),
            _ => return None,
        };
        Some((Held { value, low, high }, free))
    };
    ends(a, b).or_else(|| ends(b, a))
}

/// The operand beside a zero.
fn beside_zero(dag: &Dag, a: NodeId, b: NodeId) -> Option<NodeId> {
    match (dag.real(a), dag.real(b)) {
        (Some(0.0), None) => Some(b),
        (None, Some(0.0)) => Some(a),
        _ => None,
    }
}

/// What is subtracted from `free`, where a value is that difference.
fn rest(dag: &Dag, difference: NodeId, free: NodeId) -> Option<NodeId> {
    let Node::Linear(c0, terms) = dag.get(difference) else {
        return None;
    };
    let [(c, x), (d, y)] = terms[..] else {
        return None;
    };
    match (c0.0, c.0, d.0) {
        (0.0, 1.0, -1.0) if x == free => Some(y),
        (0.0, -1.0, 1.0) if y == free => Some(x),
        _ => None,
    }
}

/// Whether a value is held between the same ends.
fn is_held(dag: &Dag, value: NodeId, ends: Held) -> bool {
    match *dag.get(value) {
        Node::Min(a, b) => held(dag, a, b)
            .is_some_and(|(found, _)| (found.low, found.high) == (ends.low, ends.high)),
        _ => false,
    }
}
