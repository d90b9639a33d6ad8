//! Forward differentiation over intervals: partial derivatives of every value by the cells, as they
//! lie over the proven ranges.
//!
//! Choices are open: of two branches both are taken. Not here: derivatives at a place
//! (`stability`), derivatives by time (`model::prime`).

use std::collections::BTreeMap;

use crate::simplify::Step;
use whippen_ids::IdMap;
use whippen_lang::model::{CellId, Interval, Node, NodeId};
use whippen_lang::range::Ranges;

/// Partial derivatives by cell; what is not there is zero.
pub(super) type Gradient = BTreeMap<CellId, Interval>;

/// Stands for a derivative without bound.
const STEEP: f64 = 1e100;

/// The partial derivatives of every value (none of bools).
pub(super) fn gradients(step: &Step, ranges: &Ranges) -> IdMap<NodeId, Gradient> {
    let mut all: IdMap<NodeId, Gradient> = IdMap::new();
    for (_, node) in step.model.dag.nodes() {
        let gradient = gradient(node, &all, |id| ranges.get(id));
        all.push(gradient);
    }
    all
}

fn gradient(
    node: &Node,
    all: &IdMap<NodeId, Gradient>,
    range: impl Fn(NodeId) -> Interval,
) -> Gradient {
    let one = Interval::point(1.0);
    let scaled = |x: NodeId, by: Interval| scaled(&all[x], by);
    let bounded = |slope: Option<Interval>| slope.unwrap_or(Interval::around(STEEP));
    match *node {
        Node::Cell(cell) => Gradient::from([(cell, one)]),
        Node::Linear(_, ref terms) => terms.iter().fold(Gradient::new(), |sum, (c, x)| {
            added(sum, scaled(*x, Interval::point(c.0)))
        }),
        Node::Add(a, b) => added(all[a].clone(), all[b].clone()),
        Node::Sub(a, b) => added(all[a].clone(), scaled(b, -one)),
        Node::Neg(a) => scaled(a, -one),
        Node::Mul(a, b) => added(scaled(a, range(b)), scaled(b, range(a))),
        Node::Div(a, b) | Node::Ratio(a, b, _) => {
            let inverse = bounded(one.quotient(range(b)));
            let quotient = range(a) * inverse;
            added(scaled(a, inverse), scaled(b, -(quotient * inverse)))
        }
        Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) => either(&all[a], &all[b]),
        Node::Abs(a) => either(&all[a], &scaled(a, -one)),
        Node::Power(a, halves) => scaled(a, bounded(range(a).slope_of_power(halves))),
        Node::Function(function, a) => scaled(a, bounded(function.slope(range(a)))),
        Node::Curve(ref curve, x) => scaled(x, curve.slopes_over(range(x))),
        Node::Incline(_, x) => scaled(x, Interval::around(STEEP)),
        Node::Mean(_, ref all) => all.iter().fold(Gradient::new(), |sum, x| {
            added(sum, scaled(*x, Interval::around(STEEP)))
        }),
        Node::Spread(_, place) => scaled(place, Interval::around(STEEP)),
        Node::Read(_, _, place) => scaled(place, Interval::around(STEEP)),
        Node::Tap(_, ticks) | Node::Tuned(_, ticks, _) => scaled(ticks, Interval::around(STEEP)),
        // What depends on no cell, and bools.
        Node::Noise(_)
        | Node::Const(_)
        | Node::Grid(..)
        | Node::Sense(_)
        | Node::Slope(_)
        | Node::Curvature(_)
        | Node::Live(_)
        | Node::Keyed(_)
        // `simplify` leaves none.
        | Node::Trial(..)
        | Node::Slip(_)
        | Node::Bool(_)
        | Node::LiveBool(_)
        | Node::Is(..)
        | Node::Compare(..)
        | Node::And(..)
        | Node::Or(..)
        | Node::Not(_)
        | Node::SelectBool(..) => Gradient::new(),
    }
}

pub(super) fn scaled(gradient: &Gradient, by: Interval) -> Gradient {
    // Products are rounded outwards; what is kept as it is must not grow by that.
    let times = |slope: Interval| match (by.low, by.high) {
        (1.0, 1.0) => slope,
        (-1.0, -1.0) => -slope,
        _ => slope * by,
    };
    let each = |(cell, slope): (&CellId, &Interval)| (*cell, times(*slope));
    gradient.iter().map(each).collect()
}

pub(super) fn added(mut sum: Gradient, more: Gradient) -> Gradient {
    for (cell, slope) in more {
        sum.entry(cell)
            .and_modify(|own| *own = *own + slope)
            .or_insert(slope);
    }
    sum
}

/// The derivatives of one or the other.
fn either(a: &Gradient, b: &Gradient) -> Gradient {
    let zero = Interval::point(0.0);
    let of = |g: &Gradient, cell: &CellId| g.get(cell).copied().unwrap_or(zero);
    let cells = a.keys().chain(b.keys());
    cells
        .map(|cell| (*cell, of(a, cell).union(of(b, cell))))
        .collect()
}
