//! What a write may store, path by path: a linear form for every way to decide `min`, `max` and
//! `if`.
//!
//! A form tells what an interval does not: a bristle that sticks, `x - clamp(x - foot, -g, g)`, is
//! `foot` itself between the limits and knows nothing of it beyond. And what is a whole number of
//! the cell's units is stored exactly where less than a unit is rounded, for it differs from its
//! integer by a whole number of them.
//!
//! Not here: which way is taken.

use std::collections::BTreeMap;

use super::gradient::{Gradient, added, scaled};
use super::real::Scale;
use whippen_ids::IdMap;
use whippen_lang::model::{CellId, Dag, Interval, Node, NodeId};

/// So many ways are told apart.
const MOST: usize = 64;
/// Of what is less than a unit, but for what f64 rounds.
const LESS: f64 = 1.0 - 1e-9;

/// One of the values that a write may store: `constant + sum c_i x_i`.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// What is added to the terms (SI).
    pub constant: f64,
    /// The values and their factors; none is a sum, a choice or a constant.
    pub terms: BTreeMap<NodeId, f64>,
    /// Bound on what roundings make of it (SI).
    pub error: f64,
    /// Of that, what the errors of this tick's values make that know nothing of the cell (SI).
    pub followed: f64,
}

impl Path {
    /// Its partial derivatives.
    pub(super) fn gradient(&self, of: &IdMap<NodeId, Gradient>) -> Gradient {
        let terms = self.terms.iter();
        terms.fold(Gradient::new(), |sum, (x, c)| {
            added(sum, scaled(&of[*x], Interval::point(*c)))
        })
    }

    /// Whether it is a whole number of a cell's units.
    fn is_whole(&self, dag: &Dag, units: &impl Fn(CellId) -> Scale, unit: Scale) -> bool {
        let counts = |part: f64| (part / unit.lsb).fract() == 0.0;
        let whole = |(x, c): (&NodeId, &f64)| match *dag.get(*x) {
            Node::Cell(cell) => units(cell).offset == 0.0 && counts(c * units(cell).lsb),
            _ => false,
        };
        unit.offset == 0.0 && counts(self.constant) && self.terms.iter().all(whole)
    }
}

/// The values that a write to a cell may store; roundings make at most `error` of each.
pub(super) fn paths(
    dag: &Dag,
    units: impl Fn(CellId) -> Scale,
    cell: CellId,
    value: NodeId,
    error: f64,
) -> Vec<Path> {
    let unit = units(cell);
    let mut all = forms(dag, value, error);
    for path in &mut all {
        if error < unit.lsb * LESS && path.is_whole(dag, &units, unit) {
            path.error = 0.0;
        }
    }
    all
}

/// The forms of all ways; the value alone where there are too many.
fn forms(dag: &Dag, value: NodeId, error: f64) -> Vec<Path> {
    let whole = |terms| Path {
        constant: 0.0,
        terms,
        error,
        followed: 0.0,
    };
    let mut open = vec![whole(BTreeMap::from([(value, 1.0)]))];
    let mut found = Vec::new();
    while let Some(mut path) = open.pop() {
        // Operands have smaller numbers: once a node is taken apart it does not come back.
        let composed = |x: &&NodeId| !is_leaf(dag.get(**x));
        let Some(node) = path.terms.keys().rev().find(composed).copied() else {
            found.push(path);
            continue;
        };
        let factor = path.terms.remove(&node).unwrap_or(0.0);
        match *dag.get(node) {
            Node::Const(c) => path.constant += factor * c.0,
            Node::Linear(c0, ref terms) => {
                path.constant += factor * c0.0;
                terms.iter().for_each(|(c, x)| path.add(*x, factor * c.0));
            }
            Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) => {
                let mut other = path.clone();
                other.add(b, factor);
                open.push(other);
                path.add(a, factor);
            }
            _ => {}
        }
        open.push(path);
        if open.len() + found.len() > MOST {
            return vec![whole(BTreeMap::from([(value, 1.0)]))];
        }
    }
    found
}

impl Path {
    fn add(&mut self, x: NodeId, factor: f64) {
        let own = self.terms.entry(x).or_insert(0.0);
        *own += factor;
        if *own == 0.0 {
            self.terms.remove(&x);
        }
    }
}

fn is_leaf(node: &Node) -> bool {
    use Node::*;
    !matches!(node, Const(_) | Linear(..) | Min(..) | Max(..) | Select(..))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_lang::model::dag::Real;

    const FOOT: CellId = CellId(0);

    /// The ways of `x - clamp(x - foot, -1, 1)`, in units of a quarter.
    fn of_bristle(error: f64) -> Vec<Path> {
        let mut dag = Dag::default();
        let (x, foot) = (dag.add(Node::Sense(0)), dag.add(Node::Cell(FOOT)));
        let (one, minus) = (dag.constant(1.0), dag.constant(-1.0));
        let less = |y| Node::Linear(Real(0.0), vec![(Real(1.0), x), (Real(-1.0), y)]);
        let stretch = dag.add(less(foot));
        let low = dag.add(Node::Max(minus, stretch));
        let bend = dag.add(Node::Min(one, low));
        let next = dag.add(less(bend));
        paths(&dag, |_| Scale::plain(0.25), FOOT, next, error)
    }

    #[test]
    fn a_bristle_that_sticks_is_stored_exactly_if_less_than_a_unit_is_rounded() {
        let foot = NodeId(1);
        let sticks = |error: f64| {
            let all = of_bristle(error);
            assert_eq!(all.len(), 3);
            all.into_iter().find(|p| p.terms.contains_key(&foot))
        };
        let exact = sticks(0.2).expect("one way keeps the foot");
        assert_eq!((exact.terms.len(), exact.error), (1, 0.0));
        assert_eq!(sticks(0.25).map(|p| p.error), Some(0.25));
    }

    #[test]
    fn a_bristle_that_slides_rounds_once_and_forgets_its_foot() {
        let x = NodeId(0);
        let slides = of_bristle(0.2);
        let slides = slides.iter().filter(|p| p.terms.contains_key(&x));
        let all: Vec<(f64, f64)> = slides.map(|p| (p.constant.abs(), p.error)).collect();
        assert_eq!(all, [(1.0, 0.2); 2]);
    }
}
