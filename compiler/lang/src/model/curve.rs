//! Curves: functions of one value, which lowering makes tables of: those that a program gives as
//! tables, and what of a law depends on one value alone.

use super::dag::Real;
use super::table::Table;
use super::{Interval, Model, Node, NodeId};
use crate::range;
use std::sync::Arc;

/// A function of one value.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Curve {
    /// How it is computed.
    law: Law,
    /// Where it lies, and where its derivative does.
    reach: [[Real; 2]; 2],
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Law {
    /// What it is made of, operands first; node 0 is the value that it is a function of, and the
    /// first of these is node 1. The last is the outcome.
    Nodes(Arc<[Node]>),
    Table(Arc<Table>),
}

impl Curve {
    /// How finely intervals of a curve are taken.
    const PIECES: u32 = 1024;

    /// The function of `x` that `nodes` compute, over an interval; its derivative is `slope`, made
    /// of nodes alike. `None` where they have no interval.
    pub fn new(model: &Model, nodes: Vec<Node>, slope: &[Node], over: Interval) -> Option<Curve> {
        let reach = [reach(model, &nodes, over)?, reach(model, slope, over)?];
        Some(Curve {
            law: Law::Nodes(nodes.into()),
            reach: reach.map(|of| [Real(of.low), Real(of.high)]),
        })
    }

    /// A table.
    pub fn of_table(table: Arc<Table>) -> Curve {
        let all = Interval {
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
        let reach = [table.values_over(all), table.slopes_over(all)];
        Curve {
            law: Law::Table(table),
            reach: reach.map(|of| [Real(of.low), Real(of.high)]),
        }
    }

    /// The table, if it is one.
    pub fn table(&self) -> Option<&Arc<Table>> {
        match &self.law {
            Law::Table(table) => Some(table),
            Law::Nodes(_) => None,
        }
    }

    /// Its values.
    pub fn reach(&self) -> Interval {
        of_ends(self.reach[0])
    }

    /// Those of its derivative.
    pub fn slopes(&self) -> Interval {
        of_ends(self.reach[1])
    }

    /// Its value; `None` where it has none.
    pub fn value(&self, model: &Model, x: f64) -> Option<f64> {
        if let Law::Table(table) = &self.law {
            return Some(table.value(x));
        }
        let found = self.over(model, Interval::point(x))?;
        Some(0.5 * (found.low + found.high))
    }

    /// Its values over an interval: those of a table there, else all.
    pub fn values_over(&self, x: Interval) -> Interval {
        match &self.law {
            Law::Table(table) => table.values_over(x),
            Law::Nodes(_) => self.reach(),
        }
    }

    /// Its slopes over an interval, which may be wider than they are.
    pub fn slopes_over(&self, x: Interval) -> Interval {
        match &self.law {
            Law::Table(table) => table.slopes_over(x),
            Law::Nodes(_) => self.slopes(),
        }
    }

    /// Whether it changes by no more than such a part of its reach from `half` on, either way.
    pub fn is_flat_beyond(&self, model: &Model, half: f64, over: Interval, part: f64) -> bool {
        let outside =
            [(half, over.high), (over.low, -half)].map(|(low, high)| Interval { low, high });
        let most = part * self.reach().magnitude();
        let flat = |x: Interval| self.over(model, x).is_some_and(|of| of.width() <= most);
        outside.into_iter().all(|x| x.low >= x.high || flat(x))
    }

    /// Its values over an interval, which may be wider than they are.
    pub fn over(&self, model: &Model, x: Interval) -> Option<Interval> {
        match &self.law {
            Law::Nodes(nodes) => over(model, nodes, x),
            Law::Table(table) => Some(table.values_over(x)),
        }
    }
}

fn of_ends([low, high]: [Real; 2]) -> Interval {
    Interval {
        low: low.0,
        high: high.0,
    }
}

fn over(model: &Model, nodes: &[Node], x: Interval) -> Option<Interval> {
    let mut values = vec![x];
    for node in nodes {
        let of = |id: NodeId| values[id.0 as usize];
        values.push(range::transfer(model, node, of).ok()?);
    }
    values.last().copied()
}

/// The values over an interval, piece by piece: operands that depend on each other are not taken as
/// independent over more than a piece.
fn reach(model: &Model, nodes: &[Node], of: Interval) -> Option<Interval> {
    let end = |at: u32| of.low + of.width() * f64::from(at) / f64::from(Curve::PIECES);
    let pieces = (0..Curve::PIECES).map(|at| {
        let piece = Interval {
            low: end(at),
            high: end(at + 1),
        };
        over(model, nodes, piece)
    });
    pieces.reduce(|all, piece| Some(all?.union(piece?)))?
}
