//! Values limited to as much one way as the other: in a unit that makes the limits powers of two,
//! where saturation is one instruction.

use super::Lowerer;
use super::format::exp2;
use super::real::Real;
use whippen_kernel::{OpError, Range};
use whippen_lang::model::{Dag, Node, NodeId};

/// The limits are `2^n` units, if the value fits.
const LIMIT: i32 = 16;

/// The differentiator that a node limits to `-limit .. limit`, and the limit.
pub(super) fn symmetric(dag: &Dag, node: NodeId) -> Option<(NodeId, f64)> {
    let constant_and = |a: NodeId, b: NodeId| match (dag.real(a), dag.real(b)) {
        (Some(limit), None) => Some((limit, b)),
        (None, Some(limit)) => Some((limit, a)),
        _ => None,
    };
    let ends = |outer: (NodeId, NodeId), least: bool| {
        let (end, inner) = constant_and(outer.0, outer.1)?;
        let (other, x) = match *dag.get(inner) {
            Node::Max(a, b) if least => constant_and(a, b)?,
            Node::Min(a, b) if !least => constant_and(a, b)?,
            _ => return None,
        };
        let raw = matches!(dag.get(x), Node::Slope(_) | Node::Curvature(_));
        (raw && end == -other && (end > 0.0) == least).then_some((x, end.abs()))
    };
    match *dag.get(node) {
        Node::Min(a, b) => ends((a, b), true),
        Node::Max(a, b) => ends((a, b), false),
        _ => None,
    }
}

impl Lowerer<'_> {
    /// `x`, limited to `-limit .. limit`.
    pub(super) fn limited(&mut self, x: NodeId, limit: f64) -> Result<Real, OpError> {
        let real = self.real(x)?;
        let scaled = self.rescaled(real, limit * exp2(-LIMIT))?;
        let ends = (limit / scaled.lsb).round() as i64;
        let value = self.clamped(scaled.value, Range::new(-ends, ends - 1))?;
        Ok(Real {
            value,
            error: scaled.error + scaled.lsb,
            ..scaled
        })
    }
}
