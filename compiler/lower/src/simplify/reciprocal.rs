//! Reciprocals without a quotient, which is dear: of what does not move far, and of exponentials.
//!
//! ```text
//!   1 / (m + m t)  ->  (1 - t) (1 + t^2) (1 + t^4) .. / m        until the next power is too small
//!   1 / exp(y)     ->  exp(-y)
//! ```

use super::linear::Sum;
use super::rewrite::Rewriter;
use whippen_lang::model::{Function, Node, NodeId};

/// What is left out, as a part of the reciprocal: less than words hold.
const LEFT_OUT: f64 = 1.0 / (1_u64 << 33) as f64;
/// Powers of `t` at most.
const POWERS: usize = 3;

impl Rewriter<'_> {
    /// One over a value, where that takes no quotient. One that is the same for all keys costs
    /// none of them anything; what has several ports is played once.
    pub(super) fn reciprocal(&mut self, node: NodeId) -> Option<NodeId> {
        if let Some(chosen) = self.chosen_reciprocal(node) {
            return Some(chosen);
        }
        if self.common[node] && self.model.is_of_key() {
            return None;
        }
        self.narrow_reciprocal(node)
            .or_else(|| self.reciprocal_of_exp(node))
    }

    fn narrow_reciprocal(&mut self, node: NodeId) -> Option<NodeId> {
        let over = self.interval(node);
        let (middle, half) = (0.5 * (over.low + over.high), 0.5 * (over.high - over.low));
        let furthest = half / middle.abs();
        let powers = (1..=POWERS).find(|powers| furthest.powi(2 << powers) <= LEFT_OUT)?;
        let away = self.sum_of(node).scaled(1.0 / middle);
        let away = away.plus(&Sum::constant(-1.0));
        let mut power = self.linear(away.clone());
        let less = Sum::constant(1.0).plus(&away.scaled(-1.0));
        let mut reciprocal = self.linear(less);
        for _ in 0..powers {
            power = self.mul(power, power);
            let more = self.mul(reciprocal, power);
            reciprocal = self.combine(reciprocal, 1.0, more);
        }
        Some(self.linear(self.sum_of(reciprocal).scaled(1.0 / middle)))
    }

    fn reciprocal_of_exp(&mut self, node: NodeId) -> Option<NodeId> {
        let (factor, value) = self.scaled(node);
        let Node::Function(Function::Exp, of) = *self.dag.get(value) else {
            return None;
        };
        let sum = self.sum_of(of).scaled(-1.0);
        let other = self.linear(sum);
        let exp = self.add(Node::Function(Function::Exp, other));
        Some(self.linear(Sum::value(exp).scaled(1.0 / factor)))
    }
}
