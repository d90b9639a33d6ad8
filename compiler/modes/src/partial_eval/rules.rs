//! Algebraic simplification: a simpler node with the same value as an operator of these operands.

use super::PartialEval;
use crate::graph::{Graph, NodeId};
use whippen_kernel::{Op, Range, Type};

impl PartialEval {
    /// Something simpler with the same value, if there is.
    pub(super) fn simplified(
        &mut self,
        graph: &mut Graph,
        op: Op,
        ty: Type,
        args: &[NodeId],
    ) -> Option<NodeId> {
        match (op, args) {
            (
                Op::Add | Op::Mul | Op::MulWide | Op::Min | Op::Max | Op::And | Op::Or | Op::Eq,
                [a, b],
            ) if rank(graph, *b) < rank(graph, *a) => {
                Some(self.fold_pure(graph, op, ty, &[*b, *a]))
            }
            (Op::Add | Op::Sub, [a, b]) if graph.constant(*b) == Some(0) => Some(*a),
            (Op::Mul, [a, b]) if graph.constant(*b) == Some(1) => Some(*a),
            (Op::Shl(0) | Op::Sar(0) | Op::SarRound(0), [a]) => Some(*a),
            (Op::Shl(n), [a]) => self.narrower(graph, *a, n),
            (Op::Sar(n), [a]) => self.shifted_back(graph, ty, *a, n),
            (Op::Assume(low, high), [a]) => {
                Range::new(low, high).contains(self.range(*a)).then_some(*a)
            }
            (Op::Narrow, [a]) => inner(graph, *a, Op::Widen),
            (Op::Widen, [a]) => inner(graph, *a, Op::Narrow),
            (Op::DivRound(n), [a, b]) => self.quotient(graph, *a, *b, n),
            (Op::MacWide, [a, b, c]) => self.product(graph, *a, *b, *c),
            (Op::MacTop, [a, b, c])
                if [b, c]
                    .iter()
                    .any(|factor| self.range(**factor) == Range::point(0)) =>
            {
                Some(*a)
            }
            (Op::Min, [a, b]) => self
                .extreme(*a, *b, |x, y| x.high <= y.low)
                .or_else(|| self.before_shift(graph, op, ty, *a, *b)),
            (Op::Max, [a, b]) => self
                .extreme(*a, *b, |x, y| x.low >= y.high)
                .or_else(|| self.before_shift(graph, op, ty, *a, *b)),
            (Op::Le, [a, b]) => {
                let less = self.fold_pure(graph, Op::Lt, ty, &[*b, *a]);
                Some(self.fold_pure(graph, Op::Not, ty, &[less]))
            }
            (Op::Lt, [a, b]) => self.less(graph, *a, *b),
            (Op::Eq, [a, b]) if a == b => Some(self.constant(graph, Type::I1, 1)),
            (Op::Not, [a]) => inner(graph, *a, Op::Not),
            (Op::And, [a, b]) => self.both(graph, *a, *b, Op::And, Op::Or, 1),
            (Op::Or, [a, b]) => self.both(graph, *a, *b, Op::Or, Op::And, 0),
            (Op::Select, [c, a, b]) => self.choice(graph, ty, *c, *a, *b),
            _ => None,
        }
    }

    fn product(&mut self, graph: &mut Graph, a: NodeId, b: NodeId, c: NodeId) -> Option<NodeId> {
        let (x, y) = (self.range(b), self.range(c));
        let known = x.low == x.high && y.low == y.high;
        if known || x == Range::point(0) || y == Range::point(0) {
            let product = self.constant(graph, Type::I64, x.low.checked_mul(y.low)?);
            return Some(self.fold_pure(graph, Op::Add, Type::I64, &[a, product]));
        }
        (self.range(a) == Range::point(0))
            .then(|| self.fold_pure(graph, Op::MulWide, Type::I64, &[b, c]))
    }

    /// A shift of a word that fits a word.
    fn narrower(&mut self, graph: &mut Graph, a: NodeId, n: u8) -> Option<NodeId> {
        let word = inner(graph, a, Op::Widen)?;
        let Range { low, high } = self.range(word);
        if n > 31 || !Type::I32.range().contains(Range::new(low << n, high << n)) {
            return None;
        }
        let shifted = self.fold_pure(graph, Op::Shl(n), Type::I32, &[word]);
        Some(self.fold_pure(graph, Op::Widen, Type::I64, &[shifted]))
    }

    /// What was shifted up, which loses nothing, and then down.
    fn shifted_back(&mut self, graph: &mut Graph, ty: Type, a: NodeId, n: u8) -> Option<NodeId> {
        let (Op::Shl(up), of) = (graph.op(a)?, *graph.args(a).first()?) else {
            return None;
        };
        let op = if up >= n {
            Op::Shl(up - n)
        } else {
            Op::Sar(n - up)
        };
        Some(self.fold_pure(graph, op, ty, &[of]))
    }

    /// A limit `b` of what was shifted or widened is one of what it was before, where no bit is
    /// lost.
    fn before_shift(
        &mut self,
        graph: &mut Graph,
        op: Op,
        ty: Type,
        a: NodeId,
        b: NodeId,
    ) -> Option<NodeId> {
        let (limit, outer) = (graph.constant(b)?, graph.op(a)?);
        let (inside, limit) = match outer {
            Op::Widen => (Type::I32, Some(limit)),
            Op::Shl(n) => (ty, Some(limit >> n).filter(|k| k << n == limit)),
            _ => return None,
        };
        let (limit, of) = (limit.filter(|k| inside.range().has(*k))?, graph.args(a)[0]);
        let limit = self.constant(graph, inside, limit);
        let held = self.fold_pure(graph, op, inside, &[of, limit]);
        Some(self.fold_pure(graph, outer, ty, &[held]))
    }

    /// The one of two that the comparison of their ranges prefers.
    fn extreme(&self, a: NodeId, b: NodeId, prefer: fn(Range, Range) -> bool) -> Option<NodeId> {
        let (x, y) = (self.range(a), self.range(b));
        if a == b || prefer(x, y) {
            Some(a)
        } else {
            prefer(y, x).then_some(b)
        }
    }

    /// Comparisons with a constant are all `x < k` or its opposite, and `x` is no sum with a
    /// constant.
    fn less(&mut self, graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
        if a == b {
            return Some(self.constant(graph, Type::I1, 0));
        }
        let ty = graph.ty(a);
        if let (Some(k), None) = (graph.constant(a), graph.constant(b)) {
            let next = k.checked_add(1).filter(|next| ty.range().has(*next))?;
            let next = self.constant(graph, ty, next);
            let less = self.fold_pure(graph, Op::Lt, Type::I1, &[b, next]);
            return Some(self.fold_pure(graph, Op::Not, Type::I1, &[less]));
        }
        let k = graph.constant(b)?;
        let (inner, moved) = match (graph.op(a)?, graph.args(a)) {
            (Op::Add, [x, n]) => (*x, k.checked_sub(graph.constant(*n)?)?),
            (Op::Sub, [x, n]) => (*x, k.checked_add(graph.constant(*n)?)?),
            _ => return None,
        };
        let moved = ty
            .range()
            .has(moved)
            .then(|| self.constant(graph, ty, moved))?;
        Some(self.fold_pure(graph, Op::Lt, Type::I1, &[inner, moved]))
    }

    /// `and` (`strong` 1, dual `or`), or `or` (`strong` 0, dual `and`).
    fn both(
        &mut self,
        graph: &mut Graph,
        a: NodeId,
        b: NodeId,
        op: Op,
        dual: Op,
        strong: i64,
    ) -> Option<NodeId> {
        for (one, other) in [(a, b), (b, a)] {
            match graph.constant(one) {
                Some(value) if value == strong => return Some(other),
                Some(value) => return Some(self.constant(graph, Type::I1, value)),
                None => {}
            }
            if one == other || parts(graph, other, op).is_some_and(|(x, y)| x == one || y == one) {
                return Some(other);
            }
            if opposite(graph, one, other) {
                return Some(self.constant(graph, Type::I1, 1 - strong));
            }
            if let Some((x, y)) = parts(graph, other, dual) {
                if x == one || y == one {
                    return Some(one);
                }
                for (x, y) in [(x, y), (y, x)] {
                    if opposite(graph, one, x) {
                        return Some(self.fold_pure(graph, op, Type::I1, &[one, y]));
                    }
                }
            }
        }
        None
    }

    fn choice(
        &mut self,
        graph: &mut Graph,
        ty: Type,
        c: NodeId,
        a: NodeId,
        b: NodeId,
    ) -> Option<NodeId> {
        match graph.constant(c) {
            Some(1) => return Some(a),
            Some(_) => return Some(b),
            None if a == b => return Some(a),
            None => {}
        }
        if let Some(inside) = inner(graph, c, Op::Not) {
            return Some(self.fold_pure(graph, Op::Select, ty, &[inside, b, a]));
        }
        if ty == Type::I1 {
            return self.bool_choice(graph, c, a, b);
        }
        let nested = |id: NodeId| match (graph.op(id)?, graph.args(id)) {
            (Op::Select, [d, x, y]) if *d == c => Some((*x, *y)),
            _ => None,
        };
        let (yes, no) = (
            nested(a).map_or(a, |(x, _)| x),
            nested(b).map_or(b, |(_, y)| y),
        );
        ((yes, no) != (a, b)).then(|| self.fold_pure(graph, Op::Select, ty, &[c, yes, no]))
    }

    fn bool_choice(
        &mut self,
        graph: &mut Graph,
        c: NodeId,
        a: NodeId,
        b: NodeId,
    ) -> Option<NodeId> {
        let ty = Type::I1;
        let not =
            |eval: &mut PartialEval, graph: &mut Graph| eval.fold_pure(graph, Op::Not, ty, &[c]);
        match (graph.constant(a), graph.constant(b)) {
            (Some(1), Some(0)) => Some(c),
            (Some(0), Some(1)) => Some(not(self, graph)),
            (Some(1), _) => Some(self.fold_pure(graph, Op::Or, ty, &[c, b])),
            (_, Some(0)) => Some(self.fold_pure(graph, Op::And, ty, &[c, a])),
            (Some(_), _) => {
                let not = not(self, graph);
                Some(self.fold_pure(graph, Op::And, ty, &[not, b]))
            }
            (_, Some(_)) => {
                let not = not(self, graph);
                Some(self.fold_pure(graph, Op::Or, ty, &[not, a]))
            }
            _ => None,
        }
    }
}

/// Constants come last, then what was made first.
fn rank(graph: &Graph, id: NodeId) -> (bool, NodeId) {
    (graph.constant(id).is_some(), id)
}

/// The operand of this operator, if the node is one.
fn inner(graph: &Graph, id: NodeId, op: Op) -> Option<NodeId> {
    (graph.op(id) == Some(op)).then(|| graph.args(id)[0])
}

fn parts(graph: &Graph, id: NodeId, op: Op) -> Option<(NodeId, NodeId)> {
    match graph.args(id) {
        [a, b] if graph.op(id) == Some(op) => Some((*a, *b)),
        _ => None,
    }
}

fn opposite(graph: &Graph, a: NodeId, b: NodeId) -> bool {
    inner(graph, a, Op::Not) == Some(b) || inner(graph, b, Op::Not) == Some(a)
}
