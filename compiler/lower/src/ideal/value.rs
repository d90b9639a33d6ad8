//! Evaluation of the graph in f64, for one tick.

use super::friction::balanced;
use super::line::RealLine;
use super::{KeyState, sense::SenseState};
use whippen_ids::IdMap;
use whippen_lang::model::fold::{compare, power};
use whippen_lang::model::{Balance, DelayId, Model, Node, NodeId, Noise, Strand};

/// What a tick's values are made of.
pub(super) struct Tick<'a> {
    pub model: &'a Model,
    pub lives: &'a [f64],
    pub key: usize,
    pub state: &'a KeyState,
    pub senses: &'a [SenseState],
    pub lines: &'a IdMap<DelayId, RealLine>,
}

impl Tick<'_> {
    /// Computes every node, operands first; bools are 0 or 1.
    pub(super) fn evaluate(&self, values: &mut IdMap<NodeId, f64>) {
        for (id, node) in self.model.dag.nodes() {
            values[id] = match node {
                Node::Slip(balance) => self.slip(balance, values),
                node => self.value(node, values),
            };
        }
    }

    /// The slip of a friction; its law is evaluated for each slip that is tried.
    fn slip(&self, balance: &Balance, values: &mut IdMap<NodeId, f64>) -> f64 {
        let dag = &self.model.dag;
        let mut order = dag.between(balance.trial, balance.law);
        order.extend(dag.between(balance.trial, balance.slope));
        order.sort_unstable();
        order.dedup();
        let [free, gain, last] = [balance.free, balance.gain, balance.last].map(|n| values[n]);
        balanced(free, gain, last, |slip| {
            values[balance.trial] = slip;
            for id in order.iter().filter(|id| **id != balance.trial) {
                values[id] = self.value(dag.get(*id), values);
            }
            (values[balance.law], values[balance.slope])
        })
    }

    /// The value of a node from those of its operands.
    fn value(&self, node: &Node, values: &IdMap<NodeId, f64>) -> f64 {
        let Tick {
            model,
            lives,
            key,
            state,
            senses,
            lines,
        } = *self;
        let of = |n: &NodeId| values[n];
        let is = |n: &NodeId| values[n] != 0.0;
        match node {
            Node::Const(c) => c.0,
            Node::Bool(b) => f64::from(*b),
            Node::Sense(s) => senses[*s as usize].value(),
            Node::Slope(s) => senses[*s as usize].slope(),
            Node::Curvature(s) => senses[*s as usize].curvature(),
            Node::Live(l) | Node::LiveBool(l) => lives[*l as usize],
            Node::Keyed(k) => *model.keyed[*k as usize].values.get(key).unwrap_or(&0.0),
            Node::Cell(c) => state.cells[c],
            Node::Noise(n) => Noise::value(state.noises[n]),
            Node::Tap(d, ticks) => lines[d].at(of(ticks)),
            Node::Tuned(d, ticks, own) => lines[d].tuned(of(ticks), state.tuned[own]),
            Node::Read(..) | Node::Mean(..) | Node::Spread(..) | Node::Grid(..) => {
                self.of_string(node, values)
            }
            Node::Is(m, s) => f64::from(state.machines[m] == *s),
            Node::Linear(c0, terms) => terms.iter().fold(c0.0, |sum, (c, x)| sum + c.0 * of(x)),
            Node::Add(a, b) => of(a) + of(b),
            Node::Sub(a, b) => of(a) - of(b),
            Node::Mul(a, b) => of(a) * of(b),
            Node::Div(a, b) => of(a) / of(b),
            // Until its law is solved nothing slips.
            Node::Trial(..) | Node::Slip(_) => 0.0,
            Node::Ratio(a, b, limit) => (of(a) / of(b)).clamp(-limit.0, limit.0),
            Node::Curve(curve, x) => curve.value(model, of(x)).unwrap_or(f64::NAN),
            // No search is left where there are curves that are no tables.
            Node::Incline(curve, x) => curve.table().map_or(0.0, |table| table.slope(of(x))),
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
        }
    }

    /// What a string gives.
    fn of_string(&self, node: &Node, values: &IdMap<NodeId, f64>) -> f64 {
        let Tick { model, state, .. } = *self;
        let of = |n: &NodeId| values[n];
        match node {
            Node::Read(s, reading, place) => {
                let strand = &model.strands[s];
                state.strands[s].read(strand, *reading, of(place), model.rate_hz)
            }
            Node::Mean(s, all) => {
                let all: Vec<f64> = all.iter().map(of).collect();
                state.strands[s].mean(&model.strands[s], model.rate_hz, &all)
            }
            Node::Spread(s, place) => Strand::spread(model.strands[s].cell(of(place)).1),
            Node::Grid(s, number) => model.strands[s].number(*number),
            _ => 0.0,
        }
    }
}
