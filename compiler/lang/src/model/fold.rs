//! Constant folding: what a node is worth when all its operands are constants.
//!
//! Only complete folding is done here; algebra with partly known operands belongs to the
//! simplifier. A result that is not finite is left unfolded, so that the division that caused it
//! keeps its place in the source.

use super::dag::Real;
use super::{Cmp, Dag, Node, NodeId};

/// The constant node that `node` equals, if all its operands are constants and the result is
/// finite.
pub fn fold(dag: &Dag, node: &Node) -> Option<Node> {
    let real = |id: NodeId| dag.real(id);
    let bool = |id: NodeId| dag.bool(id);
    let value = match *node {
        Node::Add(a, b) => real(a)? + real(b)?,
        Node::Sub(a, b) => real(a)? - real(b)?,
        Node::Mul(a, b) => real(a)? * real(b)?,
        Node::Div(a, b) => real(a)? / real(b)?,
        Node::Neg(a) => -real(a)?,
        Node::Min(a, b) => real(a)?.min(real(b)?),
        Node::Max(a, b) => real(a)?.max(real(b)?),
        Node::Abs(a) => real(a)?.abs(),
        Node::Power(a, halves) => power(real(a)?, halves),
        Node::Function(function, a) => function.value(real(a)?),
        Node::Curve(ref curve, x) => curve.table()?.value(real(x)?),
        Node::Incline(ref curve, x) => curve.table()?.slope(real(x)?),
        Node::Linear(c0, ref terms) => terms
            .iter()
            .try_fold(c0.0, |sum, (c, x)| Some(sum + c.0 * real(*x)?))?,
        Node::Select(c, a, b) => return Some(dag.get(if bool(c)? { a } else { b }).clone()),
        _ => return fold_bool(dag, node),
    };
    value
        .is_finite()
        .then_some(Node::Const(Real(if value == 0.0 { 0.0 } else { value })))
}

fn fold_bool(dag: &Dag, node: &Node) -> Option<Node> {
    let bool = |id: NodeId| dag.bool(id);
    let value = match *node {
        Node::Compare(cmp, a, b) => compare(cmp, dag.real(a)?, dag.real(b)?),
        Node::And(a, b) => bool(a)? && bool(b)?,
        Node::Or(a, b) => bool(a)? || bool(b)?,
        Node::Not(a) => !bool(a)?,
        Node::SelectBool(c, a, b) => return Some(dag.get(if bool(c)? { a } else { b }).clone()),
        _ => return None,
    };
    Some(Node::Bool(value))
}

/// `a cmp b`.
pub fn compare(cmp: Cmp, a: f64, b: f64) -> bool {
    match cmp {
        Cmp::Lt => a < b,
        Cmp::Le => a <= b,
        Cmp::Gt => a > b,
        Cmp::Ge => a >= b,
    }
}

/// `a ^ (halves / 2)` by multiplications and one square root, so that every machine gives the same
/// bits. Not a number where `a` is negative and `halves` odd.
pub fn power(a: f64, halves: u8) -> f64 {
    let whole = (0..halves / 2).fold(1.0, |product, _| product * a);
    if halves % 2 == 1 {
        whole * a.sqrt()
    } else {
        whole
    }
}

impl Dag {
    /// The value of a node that is a real constant.
    pub fn real(&self, id: NodeId) -> Option<f64> {
        match self.get(id) {
            Node::Const(value) => Some(value.0),
            _ => None,
        }
    }

    /// The value of a node that is a constant bool.
    pub fn bool(&self, id: NodeId) -> Option<bool> {
        match self.get(id) {
            Node::Bool(value) => Some(*value),
            _ => None,
        }
    }

    /// Adds a node, or the constant it equals.
    pub fn add_folded(&mut self, node: Node) -> NodeId {
        let node = fold(self, &node).unwrap_or(node);
        self.add(node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_fold_and_infinities_do_not() {
        let mut dag = Dag::default();
        let (two, zero) = (dag.constant(2.0), dag.constant(0.0));
        let sum = dag.add_folded(Node::Add(two, two));
        assert_eq!(dag.real(sum), Some(4.0));
        let quotient = dag.add_folded(Node::Div(two, zero));
        assert_eq!(dag.get(quotient), &Node::Div(two, zero));
        let test = dag.add_folded(Node::Compare(Cmp::Gt, two, zero));
        let choice = dag.add_folded(Node::Select(test, two, quotient));
        assert_eq!(choice, two);
    }

    #[test]
    fn powers_in_halves() {
        assert_eq!(power(4.0, 3), 8.0);
        assert_eq!(power(4.0, 5), 32.0);
        assert_eq!(power(-3.0, 6), -27.0);
        assert!(power(-1.0, 3).is_nan());
    }
}
