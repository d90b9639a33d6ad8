//! Frictions, written out: damped Newton steps from the last slip, held between 0 and the slip
//! without the friction (rule 21).
//!
//! ```text
//!   r = v + gain F(v) - free        d = max(1 + gain F'(v), 1/16)        v <- v - r / d
//! ```
//!
//! Each step writes the law anew, with the slip that it tries in the place of the trial.

use super::rewrite::Rewriter;
use std::collections::HashSet;
use whippen_lang::model::dag::Real;
use whippen_lang::model::{Balance, Node, NodeId};

/// Steps in a tick: three from the last slip never failed where a force was found to jump.
const STEPS: usize = 3;
/// Least slope that a step is made by: where the law falls with the slip, Newton's own is too
/// long or goes backwards.
const LEAST_SLOPE: f64 = 1.0 / 16.0;
/// A step is held to so many times what the slip may be: from one end of where it is held to the
/// other it goes no further.
const FURTHEST: f64 = 1.001;

impl Rewriter<'_> {
    /// The slip of a friction.
    pub(super) fn balanced(&mut self, old: NodeId, balance: Balance) -> NodeId {
        let [free, gain, last] =
            [balance.free, balance.gain, balance.last].map(|operand| self.node(operand));
        let zero = self.constant(0.0);
        let ends = [self.min(free, zero), self.max(free, zero)];
        let furthest = Real(FURTHEST * self.interval(free).magnitude());
        let mut slip = self.held(last, ends);
        let curved = self.curved.get(&old).copied();
        let [law, slope] = curved.unwrap_or([balance.law, balance.slope]);
        let tried = Balance {
            law,
            slope,
            ..balance
        };
        let (least, above) = (self.constant(LEAST_SLOPE), self.constant(1.0 - LEAST_SLOPE));
        for _ in 0..STEPS {
            self.mark(old);
            self.try_slip(tried, slip);
            let [law, slope] = [law, slope].map(|part| self.node(part));
            let (push, steep) = (self.times(gain, law, slip), self.times(gain, slope, slip));
            let sum = self.combine(slip, 1.0, push);
            let rest = self.combine(sum, -1.0, free);
            // What is limited at zero takes one saturation.
            let steep = self.combine(above, 1.0, steep);
            let steep = self.max(steep, zero);
            let steep = self.combine(least, 1.0, steep);
            let step = self.add(Node::Ratio(rest, steep, furthest));
            let next = self.combine(slip, -1.0, step);
            slip = self.held(next, ends);
        }
        // What of the law has a name is shown at the slip that was found.
        self.try_slip(balance, slip);
        self.slips.push(slip);
        slip
    }

    /// A product in which the factors that do not depend on the slip stand together: they are the
    /// same in every step.
    fn times(&mut self, gain: NodeId, value: NodeId, slip: NodeId) -> NodeId {
        let depends = self.depending_on(slip);
        let (mut same, mut tried) = (gain, value);
        loop {
            let apart = match *self.dag.get(tried) {
                Node::Mul(a, b) if !depends.contains(&a) => Some((a, b)),
                Node::Mul(a, b) if !depends.contains(&b) => Some((b, a)),
                Node::Linear(c0, ref terms) if c0.0 == 0.0 && terms.len() == 1 => {
                    let (factor, x) = terms[0];
                    Some((self.constant(factor.0), x))
                }
                _ => None,
            };
            let Some((factor, rest)) = apart else {
                return self.mul(same, tried);
            };
            same = self.mul(same, factor);
            tried = rest;
        }
    }

    fn depending_on(&self, slip: NodeId) -> HashSet<NodeId> {
        let mut depends = HashSet::from([slip]);
        for (id, node) in self.dag.nodes().skip(slip.0 as usize) {
            if node
                .operands()
                .iter()
                .any(|operand| depends.contains(operand))
            {
                depends.insert(id);
            }
        }
        depends
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
