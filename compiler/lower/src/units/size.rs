//! Units made coarser where that pays: states that must not drift, and sums of which a term would
//! be value and product.

use super::ties::Chooser;
use crate::format::{TOP, exp2};
use crate::linear::HALF;
use crate::real::power_of_two;
use whippen_lang::model::{Action, CellId, CellKind, Node, NodeId};
use whippen_lang::range::Ranges;

/// Bits of a pulse's level, at least.
const FINE: i32 = 18;
/// So many bits of a state may be given up for the sums that it stands in.
const COARSER: i32 = 4;

impl Chooser<'_> {
    /// States as coarse as the sums that take them as they are: what is kept by adding and
    /// subtracting does not drift then.
    pub(super) fn coarsen_states(&mut self) {
        for (id, node) in self.nodes_with_preferences() {
            let Node::Linear(_, terms) = node else {
                continue;
            };
            for (c, x) in terms {
                let ratio =
                    self.unit(self.var_of_node(id)) / (c.0.abs() * self.unit(self.var_of_node(*x)));
                if self.state(*x).is_some()
                    && let Some(n @ 1..=COARSER) = power_of_two(ratio)
                {
                    let cluster = self.representative(self.var_of_node(*x));
                    self.bounds[cluster].largest = self.unit(self.var_of_node(*x)) * exp2(n);
                }
            }
        }
    }

    /// Levels of pulses in units in which what they are fired at fits, too: it is clamped and not
    /// moved then.
    pub(super) fn coarsen_pulses(&mut self, ranges: &Ranges) {
        let model = &self.step.model;
        for action in model.rules.iter().flat_map(|rule| &rule.actions) {
            let Action::Fire { pulse, value, .. } = action else {
                continue;
            };
            let level = model.pulses[pulse].level;
            let need = ranges.get(*value).magnitude() / TOP;
            if need * exp2(FINE) <= model.cells[level].range.magnitude() {
                let cluster = self.representative(self.var_of_cell(level));
                self.bounds[cluster].largest = self.bounds[cluster].largest.max(need);
            }
        }
    }

    /// The `state` that a node reads.
    pub(super) fn state(&self, node: NodeId) -> Option<CellId> {
        match *self.step.model.dag.get(node) {
            Node::Cell(cell) if self.step.model.cells[cell].kind == CellKind::State => Some(cell),
            _ => None,
        }
    }

    /// Coarser units for sums that stand alone, where that turns a term from value and product into
    /// a product.
    pub(super) fn widen(&mut self) {
        for (id, node) in self.nodes_with_preferences() {
            let Node::Linear(_, terms) = node else {
                continue;
            };
            let own = self.var_of_node(id);
            let mut others = self.bounds.ids().filter(|var| *var != own);
            let alone = others.all(|var| self.representative(var) != own);
            if self.representative(own) != own || !alone {
                continue;
            }
            let unit = self.unit(own);
            let gains = terms.iter().map(|(c, x)| self.gain(c.0, *x) / unit);
            let largest = gains
                .filter(|g| (HALF..2.0).contains(g) && power_of_two(*g).is_none())
                .fold(0.0, f64::max);
            if largest > 0.0 {
                self.bounds[own].largest = unit * if largest < 2.0 * HALF { 2.0 } else { 4.0 };
            }
        }
    }

    /// What a unit of `x` counts in `c * x`, at most; chosen constants are factors.
    fn gain(&self, c: f64, x: NodeId) -> f64 {
        let dag = &self.step.model.dag;
        let choice = |node: NodeId| match *dag.get(node) {
            Node::Select(_, a, b) => Some(dag.real(a)?.abs().max(dag.real(b)?.abs())),
            _ => None,
        };
        match *dag.get(x) {
            Node::Mul(a, b) => match (choice(a), choice(b)) {
                (_, Some(factor)) => c.abs() * factor * self.unit(self.var_of_node(a)),
                (Some(factor), _) => c.abs() * factor * self.unit(self.var_of_node(b)),
                _ => 0.0,
            },
            Node::Select(..) if choice(x).is_some() => 0.0,
            _ => c.abs() * self.unit(self.var_of_node(x)),
        }
    }
}
