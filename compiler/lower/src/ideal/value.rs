//! Evaluation of the graph in f64, for one tick.

use super::{KeyState, sense::SenseState};
use whippen_ids::IdMap;
use whippen_lang::model::fold::{compare, power};
use whippen_lang::model::{Model, Node, NodeId};

/// Computes every node, operands first; bools are 0 or 1.
pub(super) fn evaluate(
    model: &Model,
    lives: &[f64],
    key: usize,
    state: &KeyState,
    senses: &[SenseState],
    values: &mut IdMap<NodeId, f64>,
) {
    for (id, node) in model.dag.nodes() {
        let of = |n: &NodeId| values[n];
        let is = |n: &NodeId| values[n] != 0.0;
        values[id] = match node {
            Node::Const(c) => c.0,
            Node::Bool(b) => f64::from(*b),
            Node::Sense(s) => senses[*s as usize].value(),
            Node::Slope(s) => senses[*s as usize].slope(),
            Node::Curvature(s) => senses[*s as usize].curvature(),
            Node::Live(l) | Node::LiveBool(l) => lives[*l as usize],
            Node::Keyed(k) => *model.keyed[*k as usize].values.get(key).unwrap_or(&0.0),
            Node::Cell(c) => state.cells[c],
            Node::Is(m, s) => f64::from(state.machines[m] == *s),
            Node::Linear(c0, terms) => terms.iter().fold(c0.0, |sum, (c, x)| sum + c.0 * of(x)),
            Node::Add(a, b) => of(a) + of(b),
            Node::Sub(a, b) => of(a) - of(b),
            Node::Mul(a, b) => of(a) * of(b),
            Node::Div(a, b) => of(a) / of(b),
            Node::Neg(a) => -of(a),
            Node::Min(a, b) => of(a).min(of(b)),
            Node::Max(a, b) => of(a).max(of(b)),
            Node::Abs(a) => of(a).abs(),
            Node::Power(a, halves) => power(of(a), *halves),
            Node::Function(function, a) => function.value(of(a)),
            Node::Compare(cmp, a, b) => f64::from(compare(*cmp, of(a), of(b))),
            Node::And(a, b) => f64::from(is(a) && is(b)),
            Node::Or(a, b) => f64::from(is(a) || is(b)),
            Node::Not(a) => f64::from(!is(a)),
            Node::Select(c, a, b) | Node::SelectBool(c, a, b) => {
                if is(c) {
                    of(a)
                } else {
                    of(b)
                }
            }
        };
    }
}
