//! Loads: linear forms in `d2(u)`, `d4(u)`, `u'` and `d2(u')` whose coefficients are values.

use super::super::elaborate::Elaborator;
use super::super::scope::ScopeId;
use super::super::types::{Ty, Value};
use super::{StrandInfo, own_name};
use crate::diag::{Code, Diagnostic};
use crate::model::{Node, NodeId, StrandId};
use crate::syntax::ast::{Arg, BinOp, Expr, ExprKind, StringPart};
use crate::units::Dim;

/// N/m
const PER_LENGTH: Dim = Dim::FORCE.div(Dim::LENGTH);

/// `d2(u)`, `d4(u)`, `u'` and `d2(u')`, in this order: their dimensions, and whether what they are
/// multiplied by pushes against them.
const FORMS: [(Dim, bool); 4] = [
    (Dim::LENGTH.powi(-1), false),
    (Dim::LENGTH.powi(-3), true),
    (Dim::SPEED, true),
    (Dim::new(-1, 0, -1, 0), false),
];

/// What stands before a form.
#[derive(Debug, Clone, Copy)]
enum Factor {
    /// Nothing: one.
    One,
    /// A value.
    Value(Value),
    /// What the tension to be found decides.
    Tension,
}

/// A part of a load: what stands before each form, or a value without any.
#[derive(Debug, Clone, Copy)]
enum Linear {
    Value(Factor),
    Forms([Option<Factor>; 4]),
}

/// How a load is looked at.
#[derive(Debug, Clone, Copy)]
struct LoadView<'t> {
    scope: ScopeId,
    id: StrandId,
    /// The name of the tension, where that is to be found: it is left open.
    tension: Option<&'t str>,
}

impl<'a> Elaborator<'a, '_> {
    /// What pulls a string straight, all along: tension, stiffness, damping, viscosity. Without the
    /// tension, where it is to be found.
    pub(super) fn loads(&mut self, id: StrandId, tension: Option<&str>) -> Option<[NodeId; 4]> {
        let StrandInfo { scope, text, .. } = self.strands[id];
        let view = LoadView { scope, id, tension };
        let zero = self.model.dag.constant(0.0);
        let mut sums = Some([zero; 4]);
        for part in text.parts {
            let StringPart::Load { value, .. } = part else {
                continue;
            };
            let load = self.load(view, value);
            sums = sums.zip(load).map(|(sums, load)| {
                std::array::from_fn(|at| match (sums[at] == zero, load[at] == zero) {
                    (_, true) => sums[at],
                    (true, _) => load[at],
                    _ => self.node(Node::Add(sums[at], load[at]), value.span),
                })
            });
        }
        sums
    }

    /// The coefficients of one load.
    fn load(&mut self, view: LoadView, value: &'a Expr) -> Option<[NodeId; 4]> {
        let zero = self.model.dag.constant(0.0);
        let forms = match self.linear(view, value)? {
            Linear::Forms(forms) => forms,
            Linear::Value(_) => {
                self.bad_load::<()>(view, value, "this load does not depend on the string");
                return None;
            }
        };
        let mut found = Some([zero; 4]);
        for (at, factor) in forms.into_iter().enumerate() {
            let (form, against) = FORMS[at];
            let wanted = PER_LENGTH.div(form);
            let node = match factor {
                None => Some(zero),
                Some(Factor::Tension) if at == 0 => Some(zero),
                Some(Factor::Tension) => {
                    self.not_before_bend(view, value);
                    None
                }
                Some(Factor::One) => {
                    self.wrong_load(value, Dim::NUMBER.mul(form));
                    None
                }
                Some(Factor::Value(own)) if own.ty == Ty::Real(wanted) => Some(match against {
                    true => self.node(Node::Neg(own.node), value.span),
                    false => own.node,
                }),
                Some(Factor::Value(own)) => {
                    self.wrong_load(value, own.ty.dim().unwrap_or_default().mul(form));
                    None
                }
            };
            found = found.zip(node).map(|(mut found, node)| {
                found[at] = node;
                found
            });
        }
        found
    }

    fn linear(&mut self, view: LoadView, expr: &'a Expr) -> Option<Linear> {
        if !self.holds_field(view, expr) {
            let open = view.tension.is_some_and(|tension| names(expr, tension));
            return Some(Linear::Value(match open {
                true => Factor::Tension,
                false => {
                    let value = self.expr(view.scope, expr)?;
                    self.real(value, expr, "a load is made of numbers:")?;
                    Factor::Value(value)
                }
            }));
        }
        let alone = |at: usize| {
            let mut forms = [None; 4];
            forms[at] = Some(Factor::One);
            Some(Linear::Forms(forms))
        };
        match &expr.kind {
            ExprKind::Prime(a) if self.is_field(view, a) => alone(2),
            ExprKind::Call(callee, args) => match (callee.node.as_str(), &args[..]) {
                ("d2", [Arg { value, .. }]) if self.is_field(view, value) => alone(0),
                ("d4", [Arg { value, .. }]) if self.is_field(view, value) => alone(1),
                ("d2", [Arg { value, .. }]) if self.is_rate(view, value) => alone(3),
                _ => self.bad_load(view, expr, "no load of a string is made of this"),
            },
            ExprKind::Neg(a) => self.times(view, expr, a, None),
            ExprKind::Binary(BinOp::Add, a, b) => self.plus(view, expr, [a, b], false),
            ExprKind::Binary(BinOp::Sub, a, b) => self.plus(view, expr, [a, b], true),
            ExprKind::Binary(BinOp::Mul, a, b) => match self.holds_field(view, a) {
                true => self.times(view, expr, a, Some((b, false))),
                false => self.times(view, expr, b, Some((a, false))),
            },
            ExprKind::Binary(BinOp::Div, a, b) => self.times(view, expr, a, Some((b, true))),
            ExprKind::Name(_) => {
                let own = own_name(&self.model.strands[view.id]);
                let message = format!("no load of a string is made of `{own}` itself");
                self.bad_load(view, expr, &message)
            }
            _ => self.bad_load(view, expr, "no load of a string is made of this"),
        }
    }

    /// The sum or difference of two parts.
    fn plus(
        &mut self,
        view: LoadView,
        expr: &'a Expr,
        [a, b]: [&'a Expr; 2],
        less: bool,
    ) -> Option<Linear> {
        let (first, second) = (self.linear(view, a), self.linear(view, b));
        let (Linear::Forms(mut first), Linear::Forms(second)) = (first?, second?) else {
            return self.bad_load(
                view,
                expr,
                "a part of this load does not depend on the string",
            );
        };
        for (at, second) in second.into_iter().enumerate() {
            let Some(second) = second else { continue };
            let second = match less {
                true => self.scaled(expr, second, None)?,
                false => second,
            };
            first[at] = Some(match first[at] {
                None => second,
                Some(first) => self.added(expr, [a, b], [first, second])?,
            });
        }
        Some(Linear::Forms(first))
    }

    fn added(
        &mut self,
        expr: &Expr,
        [a, b]: [&Expr; 2],
        [first, second]: [Factor; 2],
    ) -> Option<Factor> {
        let (first, second) = match [first, second].map(|factor| self.factor(expr, factor)) {
            [Some(first), Some(second)] => (first, second),
            _ => return Some(Factor::Tension),
        };
        let problem = |a: &str, b: &str| format!("{a} and {b} cannot be added");
        if first.ty != second.ty {
            self.mismatch(problem, (a, first), (b, second));
            return None;
        }
        let node = self.node(Node::Add(first.node, second.node), expr.span);
        Some(Factor::Value(Value { node, ..first }))
    }

    /// A factor as a value; none of what is open.
    fn factor(&mut self, expr: &Expr, factor: Factor) -> Option<Value> {
        match factor {
            Factor::Tension => None,
            Factor::Value(value) => Some(value),
            Factor::One => {
                let one = self.model.dag.constant(1.0);
                self.mark(expr.span);
                Some(Value::real(one, Dim::NUMBER))
            }
        }
    }

    /// A part times a value, divided by it, or, without one, times -1.
    fn times(
        &mut self,
        view: LoadView,
        expr: &'a Expr,
        forms: &'a Expr,
        by: Option<(&'a Expr, bool)>,
    ) -> Option<Linear> {
        let left = self.linear(view, forms);
        let by = match by {
            None => None,
            Some((by, divides)) => match self.linear(view, by)? {
                Linear::Value(by) => Some((by, divides)),
                Linear::Forms(_) => {
                    let message = "a load is linear: what a string has all along is not multiplied";
                    return self.bad_load(view, expr, message);
                }
            },
        };
        let Linear::Forms(mut forms) = left? else {
            return self.bad_load(view, expr, "no load of a string is made of this");
        };
        for form in forms.iter_mut() {
            if let Some(factor) = *form {
                *form = Some(self.scaled(expr, factor, by)?);
            }
        }
        Some(Linear::Forms(forms))
    }

    fn scaled(
        &mut self,
        expr: &Expr,
        factor: Factor,
        by: Option<(Factor, bool)>,
    ) -> Option<Factor> {
        if let (Factor::One, Some((by, false))) = (factor, by) {
            return Some(by);
        }
        let Some(own) = self.factor(expr, factor) else {
            return Some(Factor::Tension);
        };
        let Ty::Real(dim) = own.ty else { return None };
        let (node, dim) = match by {
            None => (Node::Neg(own.node), dim),
            Some((by, divides)) => {
                let Some(by) = self.factor(expr, by) else {
                    return Some(Factor::Tension);
                };
                let by_dim = by.ty.dim()?;
                match divides {
                    true => (Node::Div(own.node, by.node), dim.div(by_dim)),
                    false => (Node::Mul(own.node, by.node), dim.mul(by_dim)),
                }
            }
        };
        Some(Factor::Value(Value::real(self.node(node, expr.span), dim)))
    }

    fn is_field(&self, view: LoadView, expr: &Expr) -> bool {
        matches!(&expr.kind, ExprKind::Name(name)
            if self.displacement(view.scope, name) == Some(view.id))
    }

    fn is_rate(&self, view: LoadView, expr: &Expr) -> bool {
        matches!(&expr.kind, ExprKind::Prime(inner) if self.is_field(view, inner))
    }

    /// Whether an expression is made of what the string has all along.
    fn holds_field(&self, view: LoadView, expr: &Expr) -> bool {
        let mut waiting = vec![expr];
        while let Some(expr) = waiting.pop() {
            match &expr.kind {
                ExprKind::Name(_) if self.is_field(view, expr) => return true,
                // The slope at a place is a value.
                ExprKind::Call(callee, args) if callee.node == "d1" && args.len() == 2 => {
                    waiting.push(&args[1].value);
                }
                _ => waiting.extend(children(expr)),
            }
        }
        false
    }

    fn bad_load<T>(&mut self, view: LoadView, expr: &Expr, message: &str) -> Option<T> {
        let u = own_name(&self.model.strands[view.id]);
        let label = "not linear in how the string is bent and moves";
        self.report(
            Diagnostic::new(Code::StringLoad, expr.span, message, label).hint(format!(
                "a load is a sum of `d2({u})`, `d4({u})`, `{u}'` and `d2({u}')`, each times a value; \
                 what acts at one place is a `force .. at ..`"
            )),
        );
        None
    }

    fn wrong_load(&mut self, value: &Expr, found: Dim) {
        let found = Ty::Real(found).words();
        let message = format!("a load must be a force per length (N/m), not {found}");
        let hint = "tension times `d2(u)`, stiffness in N*m^2 times `d4(u)`, N*s/m^2 times `u'`, \
                    N*s times `d2(u')` are";
        let diagnostic = Diagnostic::new(Code::WrongType, value.span, message, found);
        self.report(diagnostic.hint(hint));
    }

    fn not_before_bend(&mut self, view: LoadView, value: &Expr) {
        let (u, tension) = (
            own_name(&self.model.strands[view.id]),
            view.tension.unwrap_or_default(),
        );
        let message =
            format!("`{tension}` is found from the pitch, and may stand before `d2({u})` only");
        let diagnostic = Diagnostic::new(Code::StringTuned, value.span, message, "elsewhere");
        self.report(diagnostic.hint(format!("write `load {tension} * d2({u})`")));
    }
}

/// The operands of an expression.
fn children(expr: &Expr) -> Vec<&Expr> {
    match &expr.kind {
        ExprKind::Call(_, args) => args.iter().map(|arg| &arg.value).collect(),
        ExprKind::Field(a, _) | ExprKind::Prime(a) | ExprKind::Neg(a) | ExprKind::Not(a) => vec![a],
        ExprKind::Binary(_, a, b) => vec![a, b],
        ExprKind::If(c, a, b) => vec![c, a, b],
        ExprKind::Number(_)
        | ExprKind::Bool(_)
        | ExprKind::Name(_)
        | ExprKind::Is { .. }
        | ExprKind::Error => vec![],
    }
}

/// Whether a name stands in an expression.
fn names(expr: &Expr, name: &str) -> bool {
    let mut waiting = vec![expr];
    while let Some(expr) = waiting.pop() {
        if matches!(&expr.kind, ExprKind::Name(own) if own == name) {
            return true;
        }
        waiting.extend(children(expr));
    }
    false
}
