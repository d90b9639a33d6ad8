//! `if` over sums: what both arms share is computed once, what differs is chosen between constants
//! where that is possible.

use super::linear::Sum;
use super::rewrite::Rewriter;
use whippen_lang::model::dag::Real;
use whippen_lang::model::{Interval, Node, NodeId};

/// How much wider than the arms' intervals that of the merged value may be, as a part of their
/// reach: intervals do not see that one condition chooses all its constants.
const WIDER: f64 = 0.25;

impl Rewriter<'_> {
    /// `if c then a else b`
    pub(super) fn chosen(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        let (mut first, mut second) = (self.sum_of(a), self.sum_of(b));
        let shared = first.taken_from_both(&mut second);
        let rest = match self.one_factor(c, &first, &second) {
            Some(rest) => rest,
            None if shared.terms.is_empty() => return self.add(Node::Select(c, a, b)),
            None => {
                let (first, second) = (self.linear(first), self.linear(second));
                self.either(c, first, second)
            }
        };
        let merged = self.linear(shared.plus(&rest));
        let arms = self.interval(a).union(self.interval(b));
        if suits(self.interval(merged), arms) {
            merged
        } else {
            self.add(Node::Select(c, a, b))
        }
    }

    /// Two multiples of one value, plus constants: the value times a chosen factor, plus a chosen
    /// constant.
    fn one_factor(&mut self, c: NodeId, a: &Sum, b: &Sum) -> Option<Sum> {
        let ((x, first), (y, second)) = (a.single()?, b.single()?);
        if x != y {
            return None;
        }
        let factor = self.constants(c, first, second);
        let scaled = self.mul(x, factor);
        let constant = self.constants(c, a.constant, b.constant);
        Some(self.sum_of(scaled).plus(&self.sum_of(constant)))
    }

    fn constants(&mut self, c: NodeId, a: f64, b: f64) -> NodeId {
        let (a, b) = (
            self.add(Node::Const(Real(a + 0.0))),
            self.add(Node::Const(Real(b + 0.0))),
        );
        if a == b {
            a
        } else {
            self.add(Node::Select(c, a, b))
        }
    }

    fn either(&mut self, c: NodeId, a: NodeId, b: NodeId) -> Sum {
        let node = if a == b {
            a
        } else {
            self.add(Node::Select(c, a, b))
        };
        self.sum_of(node)
    }

    /// One over a choice of constants and values per key, as a choice of such.
    pub(super) fn chosen_reciprocal(&mut self, node: NodeId) -> Option<NodeId> {
        let Node::Select(c, a, b) = *self.dag.get(node) else {
            return None;
        };
        let (a, b) = (self.known_reciprocal(a)?, self.known_reciprocal(b)?);
        Some(self.add(Node::Select(c, a, b)))
    }

    fn known_reciprocal(&mut self, node: NodeId) -> Option<NodeId> {
        match self.constant_of(node) {
            Some(0.0) => None,
            Some(constant) => Some(self.add(Node::Const(Real(1.0 / constant + 0.0)))),
            None => self.keyed_reciprocal(node),
        }
    }

    /// `min` (or `max`) of a scaled differentiator and a constant: the scale moves out, what is
    /// limited is its integer.
    pub(super) fn limited(&mut self, a: NodeId, b: NodeId, least: bool) -> Option<NodeId> {
        let (limit, value) = match (self.constant_of(a), self.constant_of(b)) {
            (Some(limit), None) => (limit, b),
            (None, Some(limit)) => (limit, a),
            _ => return None,
        };
        let sum = self.sum_of(value);
        let (x, scale) = sum
            .single()
            .filter(|&(x, scale)| sum.constant == 0.0 && scale != 1.0 && self.raw(x))?;
        let limit = self.add(Node::Const(Real(limit / scale + 0.0)));
        let (x, limit) = (x.min(limit), x.max(limit));
        let node = if least == (scale > 0.0) {
            Node::Min(x, limit)
        } else {
            Node::Max(x, limit)
        };
        let limited = self.add(node);
        let scaled = self.sum_of(limited).scaled(scale);
        Some(self.linear(scaled))
    }

    /// A differentiator, limited or not.
    fn raw(&self, mut x: NodeId) -> bool {
        while let Node::Min(a, b) | Node::Max(a, b) = *self.dag.get(x) {
            x = match (self.constant_of(a), self.constant_of(b)) {
                (Some(_), None) => b,
                (None, Some(_)) => a,
                _ => return false,
            };
        }
        matches!(self.dag.get(x), Node::Slope(_) | Node::Curvature(_))
    }
}

/// Whether a merged value may stand for its arms: hardly wider, and nowhere zero if they are not.
fn suits(merged: Interval, arms: Interval) -> bool {
    let slack = WIDER * arms.magnitude();
    let inside = merged.low >= arms.low - slack && merged.high <= arms.high + slack;
    let zero = |i: Interval| i.low <= 0.0 && i.high >= 0.0;
    let negative = |i: Interval| i.low < 0.0;
    inside && (zero(arms) || !zero(merged)) && (negative(arms) || !negative(merged))
}
