//! Frictions, written out: damped Newton steps from the last slip, held between 0 and the slip
//! without the friction (rule 21).
//!
//! ```text
//!   r = v + gain F(v) - free        d = max(1 + gain F'(v), 1/16)        v <- v - r / d
//! ```
//!
//! Each step writes the law anew, with the slip that it tries in the place of the trial.

use super::rewrite::Rewriter;
use whippen_lang::model::dag::Real;
use whippen_lang::model::{Balance, Node, NodeId};

/// Steps in a tick: three from the last slip never failed where a force was found to jump.
const STEPS: usize = 3;
/// Least slope that a step is made by: where the law falls with the slip, Newton's own is too
/// long or goes backwards.
const LEAST_SLOPE: f64 = 1.0 / 16.0;
/// A step is held to so many times what the slip may be: it goes no further in any case.
const FURTHEST: f64 = 4.0;

impl Rewriter<'_> {
    /// The slip of a friction.
    pub(super) fn balanced(&mut self, old: NodeId, balance: Balance) -> NodeId {
        let [free, gain, last] =
            [balance.free, balance.gain, balance.last].map(|operand| self.node(operand));
        let zero = self.constant(0.0);
        let ends = [self.min(free, zero), self.max(free, zero)];
        let furthest = Real(FURTHEST * self.interval(free).magnitude());
        let mut slip = self.held(last, ends);
        let (one, least) = (self.constant(1.0), self.constant(LEAST_SLOPE));
        for _ in 0..STEPS {
            self.mark(old);
            self.try_slip(balance, slip);
            let [law, slope] = [balance.law, balance.slope].map(|part| self.node(part));
            let (push, steep) = (self.mul(gain, law), self.mul(gain, slope));
            let sum = self.combine(slip, 1.0, push);
            let rest = self.combine(sum, -1.0, free);
            let steep = self.combine(one, 1.0, steep);
            let steep = self.max(steep, least);
            let step = self.add(Node::Ratio(rest, steep, furthest));
            let next = self.combine(slip, -1.0, step);
            slip = self.held(next, ends);
        }
        // What of the law has a name is shown at the slip that was found.
        self.try_slip(balance, slip);
        self.slips.push(slip);
        slip
    }

    fn held(&mut self, slip: NodeId, [low, high]: [NodeId; 2]) -> NodeId {
        let above = self.max(slip, low);
        self.min(above, high)
    }

    fn constant(&mut self, value: f64) -> NodeId {
        self.add(Node::Const(Real(value)))
    }

    /// Forgets what the law and its slope were for another slip.
    fn try_slip(&mut self, balance: Balance, slip: NodeId) {
        for root in [balance.law, balance.slope] {
            for id in self.model.dag.between(balance.trial, root) {
                self.map[id] = None;
            }
        }
        self.map[balance.trial] = Some(slip);
    }
}
