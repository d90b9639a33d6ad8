//! Primes against difference quotients, and what has none.

use super::*;
use crate::model::{CellKind, Interval, MachineId};
use crate::units::Dim;
use whippen_source::Span;

/// The value of a node where every leaf has the value that `leaf` gives it.
fn evaluate(dag: &Dag, root: NodeId, leaf: impl Fn(&Node) -> Node) -> f64 {
    let mut constants = Dag::default();
    let mut values: IdMap<NodeId, NodeId> = IdMap::new();
    for (_, node) in dag.nodes().take(root.0 as usize + 1) {
        let mut node = if node.operands().is_empty() {
            leaf(node)
        } else {
            node.clone()
        };
        node.map_operands(|o| values[o]);
        values.push(constants.add_folded(node));
    }
    constants.real(values[root]).unwrap_or(f64::NAN)
}

/// A world in which the sensed value and the coordinate move smoothly.
fn at(t: f64) -> impl Fn(&Node) -> Node {
    move |node| {
        let value = match node {
            Node::Sense(0) => t.sin(),
            Node::Slope(0) => t.cos(),
            Node::Curvature(0) => -t.sin(),
            Node::Cell(CellId(0)) => 2.0 + (3.0 * t).cos(),
            Node::Cell(CellId(1)) => -3.0 * (3.0 * t).sin(),
            Node::Live(0) => 0.7,
            Node::Is(..) => return Node::Bool(true),
            other => return other.clone(),
        };
        Node::Const(crate::model::dag::Real(value))
    }
}

fn cells() -> IdMap<CellId, Cell> {
    let cell = |kind| Cell {
        name: String::new(),
        kind,
        dim: Dim::NUMBER,
        range: Interval {
            low: 0.0,
            high: 1.0,
        },
        init: 0.0,
        span: Span::default(),
    };
    [
        CellKind::Coordinate,
        CellKind::Rate,
        CellKind::State,
        CellKind::Pulse,
    ]
    .map(cell)
    .into_iter()
    .collect()
}

fn bodies() -> Vec<Body> {
    vec![Body {
        friction: None,
        name: String::new(),
        coordinate: CellId(0),
        rate: CellId(1),
        acceleration: NodeId(0),
        hold: None,
        span: Span::default(),
    }]
}

fn prime_of(dag: &mut Dag, root: NodeId) -> Result<Prime, Vec<NoPrime>> {
    prime(dag, &cells(), &bodies(), root)
}

/// Compares the prime of a value with a difference quotient at several instants.
fn agrees(dag: &mut Dag, root: NodeId) {
    let derivative = prime_of(dag, root).expect("has a prime").value;
    for t in [0.1, 0.7, 1.3, 2.9, 4.4, 5.8] {
        let step = 1e-6;
        let quotient =
            (evaluate(dag, root, at(t + step)) - evaluate(dag, root, at(t - step))) / (2.0 * step);
        let exact = evaluate(dag, derivative, at(t));
        assert!(
            (quotient - exact).abs() <= 1e-6 * (1.0 + exact.abs()),
            "at {t}: {quotient} and {exact}"
        );
    }
}

#[test]
fn every_operator_agrees_with_the_difference_quotient() {
    let mut dag = Dag::default();
    let (x, v) = (dag.add(Node::Sense(0)), dag.add(Node::Slope(0)));
    let (phi, k) = (dag.add(Node::Cell(CellId(0))), dag.add(Node::Live(0)));
    let (half, mode) = (dag.constant(0.5), dag.add(Node::Is(MachineId(0), 0)));
    let sum = dag.add(Node::Add(x, k));
    let product = dag.add(Node::Mul(sum, phi));
    let quotient = dag.add(Node::Div(product, phi));
    let squares: Vec<NodeId> = [4, 5, 6].map(|n| dag.add(Node::Power(phi, n))).to_vec();
    let plain = dag.add(Node::Power(product, 2));
    let minus = dag.add(Node::Neg(product));
    let mut values = vec![x, v, phi, sum, product, quotient, plain, minus];
    values.extend(squares);
    values.push(dag.add(Node::Sub(product, v)));
    values.push(dag.add(Node::Div(v, phi)));
    values.push(dag.add(Node::Min(product, phi)));
    values.push(dag.add(Node::Max(product, half)));
    values.push(dag.add(Node::Abs(product)));
    values.push(dag.add(Node::Select(mode, product, phi)));
    values.push(dag.add(Node::Linear(
        crate::model::dag::Real(3.0),
        vec![(crate::model::dag::Real(2.0), product)],
    )));
    for value in values {
        agrees(&mut dag, value);
    }
}

#[test]
fn random_expressions_agree_with_the_difference_quotient() {
    let mut seed = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = |n: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed % n as u64) as usize
    };
    for _ in 0..200 {
        let mut dag = Dag::default();
        let mut nodes = vec![
            dag.add(Node::Sense(0)),
            dag.add(Node::Cell(CellId(0))),
            dag.add(Node::Live(0)),
        ];
        nodes.push(dag.constant(0.3));
        for _ in 0..6 {
            let (a, b) = (nodes[random(nodes.len())], nodes[random(nodes.len())]);
            let node = match random(8) {
                0 => Node::Add(a, b),
                1 => Node::Sub(a, b),
                2 | 3 => Node::Mul(a, b),
                4 => Node::Neg(a),
                5 => Node::Power(a, 4),
                6 => Node::Div(a, nodes[1]),
                _ => Node::Linear(
                    crate::model::dag::Real(-1.0),
                    vec![(crate::model::dag::Real(0.25), b)],
                ),
            };
            nodes.push(dag.add_folded(node));
        }
        let root = nodes[nodes.len() - 1];
        let size = [0.1, 0.7, 1.3, 2.9, 4.4, 5.8].map(|t| evaluate(&dag, root, at(t)).abs());
        if size.iter().all(|s| *s < 1e3) {
            agrees(&mut dag, root);
        }
    }
}

#[test]
fn constants_cost_nothing() {
    let mut dag = Dag::default();
    let (k, x) = (dag.add(Node::Live(0)), dag.add(Node::Sense(0)));
    let zero = dag.constant(0.0);
    let product = dag.add(Node::Mul(k, k));
    assert_eq!(
        prime_of(&mut dag, product),
        Ok(Prime {
            value: zero,
            jumps: vec![]
        })
    );
    let scaled = dag.add(Node::Mul(k, x));
    let slope = dag.add(Node::Slope(0));
    let expected = dag.add(Node::Mul(k, slope));
    assert_eq!(
        prime_of(&mut dag, scaled),
        Ok(Prime {
            value: expected,
            jumps: vec![]
        })
    );
}

#[test]
fn jumps_between_modes_are_told() {
    let mut dag = Dag::default();
    let (x, k) = (dag.add(Node::Sense(0)), dag.add(Node::Live(0)));
    let mode = dag.add(Node::Is(MachineId(0), 0));
    let jump = dag.add(Node::Select(mode, x, k));
    assert_eq!(prime_of(&mut dag, jump).map(|p| p.jumps), Ok(vec![jump]));
    let same = dag.add(Node::Select(mode, x, x));
    assert_eq!(prime_of(&mut dag, same).map(|p| p.jumps), Ok(vec![]));
    let never = dag.add(Node::Bool(false));
    let settled = dag.add(Node::Select(never, x, k));
    assert_eq!(prime_of(&mut dag, settled).map(|p| p.jumps), Ok(vec![]));
}

#[test]
fn what_has_no_prime() {
    let mut dag = Dag::default();
    let (x, third) = (dag.add(Node::Sense(0)), dag.add(Node::Curvature(0)));
    let cells = [1, 2, 3].map(|c| dag.add(Node::Cell(CellId(c))));
    let test = dag.add(Node::Compare(Cmp::Gt, x, third));
    let mode = dag.add(Node::Is(MachineId(0), 0));
    let both = dag.add(Node::And(mode, test));
    let choice = dag.add(Node::Select(both, x, cells[0]));
    let wanted = [
        (third, NoPrimeKind::Third),
        (cells[0], NoPrimeKind::Rate),
        (cells[1], NoPrimeKind::State),
        (cells[2], NoPrimeKind::Pulse),
        (test, NoPrimeKind::Bool),
    ];
    for (node, kind) in wanted {
        assert_eq!(prime_of(&mut dag, node), Err(vec![NoPrime { kind, node }]));
    }
    let inner = [
        (cells[0], NoPrimeKind::Rate),
        (choice, NoPrimeKind::Comparison),
    ];
    assert_eq!(
        prime_of(&mut dag, choice),
        Err(inner.map(|(node, kind)| NoPrime { kind, node }).to_vec())
    );
}
