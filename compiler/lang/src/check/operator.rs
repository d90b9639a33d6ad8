//! Operators: what they ask of their operands and what they give.

use super::dubious::DoubtKind;
use super::elaborate::Elaborator;
use super::scope::ScopeId;
use super::types::{Ty, Value};
use crate::diag::{Code, Diagnostic};
use crate::model::{CellKind, Cmp, Node};
use crate::syntax::ast::{BinOp, Expr};
use crate::units::Dim;
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// `a op b`
    pub fn binary(
        &mut self,
        scope: ScopeId,
        op: BinOp,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        match op {
            BinOp::And | BinOp::Or => self.logic(scope, op, a, b, span),
            BinOp::Pow => self.power(scope, a, b, span),
            BinOp::Add | BinOp::Sub => self.sum(scope, op, a, b, span),
            BinOp::Mul | BinOp::Div => self.product(scope, op, a, b, span),
            BinOp::Lt => self.comparison(scope, Cmp::Lt, a, b, span),
            BinOp::Le => self.comparison(scope, Cmp::Le, a, b, span),
            BinOp::Gt => self.comparison(scope, Cmp::Gt, a, b, span),
            BinOp::Ge => self.comparison(scope, Cmp::Ge, a, b, span),
        }
    }

    /// `-a`
    pub fn negative(&mut self, scope: ScopeId, a: &'a Expr, span: Span) -> Option<Value> {
        let value = self.expr(scope, a)?;
        let dim = self.real(value, a, "a minus sign needs")?;
        Some(Value::real(self.node(Node::Neg(value.node), span), dim))
    }

    fn logic(
        &mut self,
        scope: ScopeId,
        op: BinOp,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        let word = if op == BinOp::And { "and" } else { "or" };
        let first = self.condition(scope, a, &format!("the left side of `{word}`"));
        let second = self.condition(scope, b, &format!("the right side of `{word}`"));
        let (a, b) = (first?, second?);
        let node = if op == BinOp::And {
            Node::And(a, b)
        } else {
            Node::Or(a, b)
        };
        Some(Value::bool(self.node(node, span)))
    }

    fn sum(
        &mut self,
        scope: ScopeId,
        op: BinOp,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        let (first, second) = (self.expr(scope, a), self.expr(scope, b));
        let (first, second) = (first?, second?);
        let problem = |a: &str, b: &str| match op {
            BinOp::Add => format!("{a} and {b} cannot be added"),
            _ => format!("{b} cannot be subtracted from {a}"),
        };
        let dim = self.alike(problem, (a, first), (b, second))?;
        let node = match op {
            BinOp::Add => Node::Add(first.node, second.node),
            _ => Node::Sub(first.node, second.node),
        };
        Some(Value::real(self.node(node, span), dim))
    }

    fn product(
        &mut self,
        scope: ScopeId,
        op: BinOp,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        let (first, second) = (self.expr(scope, a), self.expr(scope, b));
        let needs = if op == BinOp::Mul {
            "`*` needs"
        } else {
            "`/` needs"
        };
        let left = first.and_then(|v| self.real(v, a, needs));
        let right = second.and_then(|v| self.real(v, b, needs));
        let (left, right, first, second) = (left?, right?, first?, second?);
        let (node, dim) = match op {
            BinOp::Mul => (Node::Mul(first.node, second.node), left.mul(right)),
            _ => (Node::Div(first.node, second.node), left.div(right)),
        };
        Some(Value::real(self.node(node, span), dim))
    }

    fn comparison(
        &mut self,
        scope: ScopeId,
        cmp: Cmp,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        let (first, second) = (self.expr(scope, a), self.expr(scope, b));
        let (first, second) = (first?, second?);
        self.alike(
            |a, b| format!("{a} and {b} cannot be compared"),
            (a, first),
            (b, second),
        )?;
        for (expr, other) in [(a, second), (b, first)] {
            if self.is_angular_rate(other) {
                self.doubt(expr, DoubtKind::AngularRate);
            }
        }
        Some(Value::bool(
            self.node(Node::Compare(cmp, first.node, second.node), span),
        ))
    }

    /// Whether a value is the rate of an angle.
    fn is_angular_rate(&self, value: Value) -> bool {
        let cell = match self.model.dag.get(value.node) {
            Node::Cell(cell) => &self.model.cells[cell],
            _ => return false,
        };
        cell.kind == CellKind::Rate && value.ty == Ty::Real(Dim::PER_TIME)
    }

    /// The dimension that two operands share; `problem` says of their kinds that they do not go
    /// together.
    pub fn alike(
        &mut self,
        problem: impl FnOnce(&str, &str) -> String,
        a: (&Expr, Value),
        b: (&Expr, Value),
    ) -> Option<Dim> {
        match (a.1.ty, b.1.ty) {
            (Ty::Real(first), Ty::Real(second)) if first == second => Some(first),
            (Ty::Bool, Ty::Bool) => {
                let message = "numbers are needed here, and these are bools";
                let diagnostic = Diagnostic::new(Code::WrongType, b.0.span, message, "a bool");
                self.report(
                    diagnostic
                        .also(a.0.span, "a bool")
                        .hint("join bools by `and`, `or` and `not`"),
                );
                None
            }
            _ => {
                self.mismatch(problem, a, b);
                None
            }
        }
    }

    /// The dimension of a value that must be a number.
    pub fn real(&mut self, value: Value, expr: &Expr, needs: &str) -> Option<Dim> {
        if value.ty == Ty::Bool {
            let message = format!("{needs} a number, and this is a bool");
            let diagnostic = Diagnostic::new(Code::WrongType, expr.span, message, "a bool");
            self.report(diagnostic.hint("choose numbers by it: `if .. then .. else ..`"));
        }
        value.ty.dim()
    }

    /// `a ^ n` for n = 1, 1.5, 2, 2.5, 3.
    fn power(&mut self, scope: ScopeId, a: &'a Expr, n: &'a Expr, span: Span) -> Option<Value> {
        let base = self.expr(scope, a);
        let exponent = self.constant(scope, n, Dim::NUMBER, "an exponent");
        let base = base?;
        let dim = self.real(base, a, "`^` needs")?;
        let exponent = exponent?;
        let halves = exponent * 2.0;
        if ![2.0, 3.0, 4.0, 5.0, 6.0].contains(&halves) {
            let message =
                format!("`^ {exponent}` is not one of the powers that can be computed exactly");
            let hint = "exponents are 1, 1.5, 2, 2.5 and 3; divide for negative ones";
            self.report(
                Diagnostic::new(Code::BadExponent, n.span, message, "this exponent").hint(hint),
            );
            return None;
        }
        let Some(power) = dim.pow_halves(halves as i8) else {
            let message = format!(
                "{} to the power {exponent} has no whole dimension",
                base.ty.words()
            );
            let hint =
                format!("divide it by a value in {dim} first, and multiply again after the power");
            self.report(
                Diagnostic::new(Code::FractionalDim, a.span, message, base.ty.words())
                    .also(n.span, "not a whole number")
                    .hint(hint),
            );
            return None;
        };
        let node = if halves == 2.0 {
            base.node
        } else {
            self.node(Node::Power(base.node, halves as u8), span)
        };
        Some(Value::real(node, power))
    }
}
