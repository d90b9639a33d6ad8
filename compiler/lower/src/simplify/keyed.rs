//! What follows from values per key and constants alone is a value per key itself: it is worked out
//! here, once for each key, and no tick computes it.
//!
//! ```text
//!   a / I         ->  a * (1 / I)              a product instead of a quotient
//!   x + 3 m + 1   ->  x + (3 m + 1)            one word to load instead of a product and a sum
//! ```

use std::collections::HashMap;

use super::interval_of;
use super::linear::Sum;
use super::rewrite::Rewriter;
use whippen_lang::model::dag::Real;
use whippen_lang::model::{Interval, Keyed, Node, NodeId};
use whippen_lang::units::Dim;

/// How wide the interval of a known value may be, as a part of it: what rounding outwards makes.
const ROUNDING: f64 = 1e-12;

/// The values per key: those of the program, and those that were worked out.
pub(super) struct PerKey {
    /// All, by the numbers that nodes have for them.
    pub all: Vec<Keyed>,
    /// Those that were worked out, by what they are.
    made: HashMap<Node, NodeId>,
    /// What a sum of values per key was, so that sums it stands in still see its terms.
    sums: HashMap<NodeId, Sum>,
}

impl PerKey {
    pub fn new(of_program: &[Keyed]) -> PerKey {
        PerKey {
            all: of_program.to_vec(),
            made: HashMap::new(),
            sums: HashMap::new(),
        }
    }

    /// A value per key as the sum that it was.
    pub fn sum_of(&self, id: NodeId) -> Sum {
        self.sums
            .get(&id)
            .cloned()
            .unwrap_or_else(|| Sum::value(id))
    }
}

impl Rewriter<'_> {
    pub(super) fn is_keyed(&self, id: NodeId) -> bool {
        matches!(self.dag.get(id), Node::Keyed(_))
    }

    /// A new node within these bounds as a value per key, if it is one.
    pub(super) fn worked_out(&mut self, node: &Node, bounds: Interval) -> Option<NodeId> {
        let operands = node.operands();
        let is_known = |id: &NodeId| self.is_keyed(*id) || self.constant_of(*id).is_some();
        let first = operands.iter().find(|id| self.is_keyed(**id))?;
        if node.is_bool() || !operands.iter().all(is_known) || !bounds.magnitude().is_finite() {
            return None;
        }
        if let Some(&made) = self.per_key.made.get(node) {
            return Some(made);
        }
        let keys = operands
            .iter()
            .filter_map(|id| self.values(*id))
            .map(<[f64]>::len);
        let value = |key| known(interval_of(self.model, node, |id| self.at(id, key)), bounds);
        let values = (0..keys.max()?).map(value).collect::<Option<Vec<f64>>>()?;
        let Node::Keyed(first) = *self.dag.get(*first) else {
            return None;
        };
        let first = &self.per_key.all[first as usize];
        let (name, span) = (
            first.name.split(".param").next().unwrap_or_default(),
            first.span,
        );
        let number = self.per_key.all.len();
        let own = Keyed {
            // No name of a program ends in a keyword.
            name: format!("{name}.param{number}"),
            dim: Dim::NUMBER,
            values,
            range: bounds,
            span,
        };
        self.per_key.all.push(own);
        let id = self.add_within(Node::Keyed(number as u32), bounds, false);
        self.per_key.made.insert(node.clone(), id);
        if let Node::Linear(c0, terms) = node {
            let sum = terms.iter().fold(Sum::constant(c0.0), |sum, (c, x)| {
                sum.plus(&self.per_key.sum_of(*x).scaled(c.0))
            });
            self.per_key.sums.insert(id, sum);
        }
        Some(id)
    }

    fn values(&self, id: NodeId) -> Option<&[f64]> {
        match *self.dag.get(id) {
            Node::Keyed(keyed) => Some(&self.per_key.all[keyed as usize].values),
            _ => None,
        }
    }

    /// What a value per key, or a constant, is for a key.
    fn at(&self, id: NodeId, key: usize) -> Interval {
        let values = self.values(id);
        let of_key = values.and_then(|values| values.get(key).or(values.last()).copied());
        Interval::point(of_key.or(self.constant_of(id)).unwrap_or_default())
    }

    /// A sum whose values per key, and constant, are one value per key where that spares something.
    pub(super) fn with_keyed_together(&mut self, sum: Sum) -> Sum {
        let is_keyed = |id: &NodeId| self.is_keyed(*id);
        let keyed: Vec<f64> = (sum.terms.iter())
            .filter(|(id, _)| is_keyed(id))
            .map(|(_, c)| *c)
            .collect();
        let is_plain = keyed.len() == 1 && keyed[0].abs() == 1.0 && sum.constant == 0.0;
        if keyed.is_empty() || keyed.len() == sum.terms.len() || is_plain {
            return sum;
        }
        let (own, others) = sum.terms.iter().partition(|(id, _)| is_keyed(id));
        let own = Sum {
            constant: sum.constant,
            terms: own,
        };
        let together = self.linear(own);
        match self.is_keyed(together) {
            true => Sum {
                constant: 0.0,
                terms: others,
            }
            .plus(&Sum::value(together)),
            false => sum,
        }
    }

    /// One over a value per key, if it is never zero.
    pub(super) fn keyed_reciprocal(&mut self, id: NodeId) -> Option<NodeId> {
        if !self.is_keyed(id) {
            return None;
        }
        let one = self.add(Node::Const(Real(1.0)));
        let reciprocal = self.add(Node::Div(one, id));
        self.is_keyed(reciprocal).then_some(reciprocal)
    }
}

/// The value that an interval has room for, if it is hardly more than a point.
fn known(at: Interval, bounds: Interval) -> Option<f64> {
    let middle = 0.5 * (at.low + at.high);
    let is_point = at.width() <= ROUNDING * middle.abs();
    is_point.then(|| middle.clamp(bounds.low, bounds.high))
}
