//! Interval differentiation: how far each value of the graph moves when a sensed value, its
//! derivatives or a cell moves.
//!
//! Forward, one row of partial derivatives per node, each an interval over the place that is looked
//! at. A choice (`if`, `min`, `max`, `abs`) that is open there and whose branches differ has no
//! row: whoever asks splits the place, or takes both at once.

use std::collections::HashMap;

use whippen_ids::IdMap;
use whippen_lang::model::{CellId, Cmp, Interval, Model, Node, NodeId};

/// Partial derivatives smaller than this share of what they are the difference of are rounding.
const ROUNDING: f64 = 1e-9;

/// What a value may depend on, as a number: `x`, `x'`, `x''` of each sense, then the cells.
pub(super) fn cell_variable(model: &Model, cell: CellId) -> u32 {
    3 * model.senses.len() as u32 + cell.0
}

/// Partial derivatives by variable, in rising order; what is not there is zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Row(Vec<(u32, Interval)>);

impl Row {
    /// Depends on one variable, with slope 1.
    pub fn unit(variable: u32) -> Row {
        Row(vec![(variable, Interval::point(1.0))])
    }

    /// The derivative by a variable.
    pub fn get(&self, variable: u32) -> Interval {
        let found = self.0.iter().find(|(v, _)| *v == variable);
        found.map_or(Interval::point(0.0), |(_, slope)| *slope)
    }

    /// Times a factor.
    pub fn scaled(&self, factor: Interval) -> Row {
        Row(self
            .0
            .iter()
            .map(|(v, slope)| (*v, *slope * factor))
            .filter(|(_, s)| s.magnitude() > 0.0)
            .collect())
    }

    /// Sum of two.
    pub fn plus(&self, other: &Row) -> Row {
        self.merged(other, |a, b| {
            let sum = a + b;
            let least = ROUNDING * a.magnitude().max(b.magnitude());
            (sum.magnitude() > least).then_some(sum)
        })
    }

    /// What holds both.
    fn hull(&self, other: &Row) -> Row {
        self.merged(other, |a, b| Some(a.union(b)))
    }

    fn merged(&self, other: &Row, both: impl Fn(Interval, Interval) -> Option<Interval>) -> Row {
        let (zero, mut all) = (
            Interval::point(0.0),
            Vec::with_capacity(self.0.len() + other.0.len()),
        );
        let (mut mine, mut theirs) = (self.0.iter().peekable(), other.0.iter().peekable());
        while let Some(variable) = mine
            .peek()
            .into_iter()
            .chain(theirs.peek())
            .map(|(variable, _)| *variable)
            .min()
        {
            let a = mine
                .next_if(|(own, _)| *own == variable)
                .map_or(zero, |(_, slope)| *slope);
            let b = theirs
                .next_if(|(own, _)| *own == variable)
                .map_or(zero, |(_, slope)| *slope);
            all.extend(both(a, b).map(|slope| (variable, slope)));
        }
        Row(all)
    }

    /// Whether all derivatives are the same numbers.
    fn same(&self, other: &Row) -> bool {
        let close = |a: Interval, b: Interval| is_point(a) && is_point(b) && is_point(a.union(b));
        self.0.len() == other.0.len()
            && self
                .0
                .iter()
                .zip(&other.0)
                .all(|(a, b)| a.0 == b.0 && close(a.1, b.1))
    }
}

/// Whether an interval is one number, up to rounding.
pub(super) fn is_point(interval: Interval) -> bool {
    interval.width() <= ROUNDING * interval.magnitude()
}

/// Which bool decides the branch of each `min`, `max` and `abs`.
pub(super) type Deciders = HashMap<NodeId, NodeId>;

/// Adds the comparisons by which `min`, `max` and `abs` choose.
pub(super) fn add_deciders(model: &mut Model) -> Deciders {
    let nodes: Vec<(NodeId, Node)> = model
        .dag
        .nodes()
        .map(|(id, node)| (id, node.clone()))
        .collect();
    let zero = model.dag.constant(0.0);
    let mut deciders = Deciders::new();
    for (id, node) in nodes {
        let comparison = match node {
            Node::Min(a, b) => Node::Compare(Cmp::Le, a, b),
            Node::Max(a, b) => Node::Compare(Cmp::Ge, a, b),
            Node::Abs(a) => Node::Compare(Cmp::Ge, a, zero),
            _ => continue,
        };
        deciders.insert(id, model.dag.add(comparison));
    }
    deciders
}

/// What a bool is where these intervals hold.
pub(super) fn decided(at: &IdMap<NodeId, Interval>, node: NodeId) -> Option<bool> {
    let own = at[node];
    if own.low == 1.0 {
        Some(true)
    } else if own.high == 0.0 {
        Some(false)
    } else {
        None
    }
}

/// The graph at a place.
pub(super) struct Gradient<'a> {
    pub model: &'a Model,
    pub deciders: &'a Deciders,
    /// Where every value lies.
    pub at: &'a IdMap<NodeId, Interval>,
    /// Takes both branches of what is open.
    pub coarse: bool,
}

impl Gradient<'_> {
    /// The rows of `nodes` (operands first), by node number.
    ///
    /// # Errors
    /// The bool that must be decided first.
    pub fn rows(&self, nodes: &[NodeId]) -> Result<IdMap<NodeId, Row>, NodeId> {
        let mut rows = IdMap::filled(Row::default(), self.model.dag.len());
        for &id in nodes {
            let node = self.model.dag.get(id);
            if !node.is_bool() {
                rows[id] = self.row(id, node, &rows)?;
            }
        }
        Ok(rows)
    }

    fn of(&self, id: NodeId) -> Interval {
        self.at[id]
    }

    fn row(&self, id: NodeId, node: &Node, rows: &IdMap<NodeId, Row>) -> Result<Row, NodeId> {
        let row = |n: &NodeId| &rows[n];
        Ok(match node {
            Node::Sense(s) => Row::unit(3 * s),
            Node::Slope(s) => Row::unit(3 * s + 1),
            Node::Curvature(s) => Row::unit(3 * s + 2),
            Node::Cell(c) => Row::unit(cell_variable(self.model, *c)),
            Node::Linear(_, terms) => terms.iter().fold(Row::default(), |sum, (factor, x)| {
                sum.plus(&row(x).scaled(Interval::point(factor.0)))
            }),
            Node::Add(a, b) => row(a).plus(row(b)),
            Node::Sub(a, b) => row(a).plus(&row(b).scaled(Interval::point(-1.0))),
            Node::Mul(a, b) => row(a).scaled(self.of(*b)).plus(&row(b).scaled(self.of(*a))),
            Node::Div(a, b) => {
                let one = Interval::point(1.0)
                    .quotient(self.of(*b))
                    .unwrap_or(Interval::point(0.0));
                row(a)
                    .scaled(one)
                    .plus(&row(b).scaled(-(self.of(id) * one)))
            }
            Node::Neg(a) => row(a).scaled(Interval::point(-1.0)),
            Node::Power(a, halves) => row(a).scaled(power_slope(self.of(*a), *halves)),
            Node::Function(function, a) => {
                row(a).scaled(function.slope(self.of(*a)).unwrap_or(Interval {
                    low: -STEEP,
                    high: STEEP,
                }))
            }
            Node::Curve(curve, a) => row(a).scaled(curve.slopes_over(self.of(*a))),
            Node::Abs(a) => self.chosen(
                self.deciders[&id],
                row(a),
                &row(a).scaled(Interval::point(-1.0)),
            )?,
            Node::Min(a, b) | Node::Max(a, b) => self.chosen(self.deciders[&id], row(a), row(b))?,
            Node::Select(c, a, b) => self.chosen(*c, row(a), row(b))?,
            _ => Row::default(),
        })
    }

    fn chosen(&self, condition: NodeId, yes: &Row, no: &Row) -> Result<Row, NodeId> {
        match decided(self.at, condition) {
            Some(true) => Ok(yes.clone()),
            Some(false) => Ok(no.clone()),
            None if yes.same(no) => Ok(yes.clone()),
            None if self.coarse => Ok(yes.hull(no)),
            None => Err(condition),
        }
    }
}

/// Larger than any slope that matters (SI): what is not bounded.
const STEEP: f64 = 1e15;

/// `n a^(n-1)` with `n` in halves.
fn power_slope(base: Interval, halves: u8) -> Interval {
    let base = if halves % 2 == 1 {
        base.max(Interval::point(0.0))
    } else {
        base
    };
    base.slope_of_power(halves).unwrap_or(Interval {
        low: 0.5 / base.power(1).high.max(1.0 / STEEP),
        high: STEEP,
    })
}
