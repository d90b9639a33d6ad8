//! Sums of scaled values: the normal form `c0 + sum c_i * x_i`.

use std::collections::BTreeMap;

use whippen_lang::model::NodeId;

/// A sum under construction; values in increasing order, so equal sums are equal nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Sum {
    pub constant: f64,
    pub terms: BTreeMap<NodeId, f64>,
}

impl Sum {
    pub fn constant(value: f64) -> Sum {
        Sum {
            constant: value,
            terms: BTreeMap::new(),
        }
    }

    pub fn value(node: NodeId) -> Sum {
        Sum {
            constant: 0.0,
            terms: BTreeMap::from([(node, 1.0)]),
        }
    }

    pub fn scaled(mut self, factor: f64) -> Sum {
        self.constant *= factor;
        self.terms.values_mut().for_each(|c| *c *= factor);
        self.terms.retain(|_, c| *c != 0.0);
        self
    }

    pub fn plus(mut self, other: &Sum) -> Sum {
        self.constant += other.constant;
        for (&node, c) in &other.terms {
            *self.terms.entry(node).or_default() += c;
        }
        self.terms.retain(|_, c| *c != 0.0);
        self
    }

    /// What stands in both with equal coefficients, taken out of both; constants stay.
    pub fn taken_from_both(&mut self, other: &mut Sum) -> Sum {
        let equal = |x: &NodeId, c: f64| other.terms.get(x) == Some(&c);
        let terms: BTreeMap<NodeId, f64> = self
            .terms
            .iter()
            .filter(|(x, c)| equal(x, **c))
            .map(|(&x, &c)| (x, c))
            .collect();
        for x in terms.keys() {
            self.terms.remove(x);
            other.terms.remove(x);
        }
        Sum {
            constant: 0.0,
            terms,
        }
    }

    /// The only term, if there is exactly one: value and coefficient.
    pub fn single(&self) -> Option<(NodeId, f64)> {
        let (&node, &c) = self.terms.first_key_value()?;
        (self.terms.len() == 1).then_some((node, c))
    }
}
