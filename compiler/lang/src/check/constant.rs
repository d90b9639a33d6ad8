//! Constants: values that must be known before the first tick, and the ranges, times and rates made
//! of them.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use super::types::Ty;
use crate::diag::{Code, Diagnostic};
use crate::model::{CellKind, Interval, Node, NodeId};
use crate::syntax::ast::{Expr, RangeExpr};
use crate::units::{Dim, shown, shown_range};
use whippen_source::Span;

/// Values that differ by less than this part of a range count as equal: `0.3 mm` is not below `300
/// um`.
const ROUNDING: f64 = 1e-12;

impl<'a> Elaborator<'a, '_> {
    /// The value of an expression that must be a constant number of a dimension.
    pub fn constant(
        &mut self,
        scope: ScopeId,
        expr: &'a Expr,
        dim: Dim,
        what: &str,
    ) -> Option<f64> {
        let value = self.expr(scope, expr)?;
        let node = self.expect(value, expr, Ty::Real(dim), || what.to_string())?;
        self.known(node, expr.span, what)
    }

    /// The value of a node that must be a constant number.
    pub fn known(&mut self, node: NodeId, span: Span, what: &str) -> Option<f64> {
        match self.model.dag.real(node) {
            Some(value) => Some(value),
            None => {
                self.report_not_constant(node, span, what);
                None
            }
        }
    }

    /// Reports that a value changes while playing; silent if it only depends on what a term is
    /// given.
    pub fn report_not_constant(&mut self, node: NodeId, span: Span, what: &str) {
        let leaf = self.changing_leaf(node);
        if leaf.is_none()
            && self.alone
            && self.any_leaf(node, |n| matches!(n, Node::Live(_) | Node::LiveBool(_)))
        {
            return;
        }
        let Some((place, reason)) = leaf else {
            let message = format!("{what} is not a finite number");
            let label = "too large, or divided by zero";
            self.report(
                Diagnostic::new(Code::NotFinite, span, message, label)
                    .hint("look at the divisors in it"),
            );
            return;
        };
        let message = format!("{what} must be a constant, but {reason}");
        let mut diagnostic = Diagnostic::new(
            Code::NotConstant,
            span,
            message,
            "not known before the first tick",
        );
        if let Some(place) = place.filter(|p| *p != span) {
            diagnostic = diagnostic.also(place, reason);
        }
        self.report(diagnostic.hint("use numbers and `param`s only"));
    }

    /// The first thing below a node that changes while playing: its place and why.
    fn changing_leaf(&self, node: NodeId) -> Option<(Option<Span>, String)> {
        let model = &self.model;
        self.leaves(node).into_iter().find_map(|id| {
            let place = model.spans.get(id).copied().flatten();
            let reason = match model.dag.get(id) {
                Node::Sense(s) | Node::Slope(s) | Node::Curvature(s) => {
                    format!("`{}` is measured", model.senses[*s as usize].name)
                }
                Node::Live(_) | Node::LiveBool(_) if self.alone => return None,
                Node::Live(l) | Node::LiveBool(l) => {
                    format!("`{}` is a live param", model.lives[*l as usize].name)
                }
                Node::Keyed(k) => format!(
                    "`{}` differs from key to key",
                    model.keyed[*k as usize].name
                ),
                Node::Cell(c) => {
                    let cell = &model.cells[c];
                    let kind = if cell.kind == CellKind::Pulse {
                        "is a pulse"
                    } else {
                        "moves"
                    };
                    format!("`{}` {kind}", cell.name)
                }
                Node::Read(s, ..) => format!("the string `{}` moves", model.strands[s].name),
                Node::Noise(n) => format!("`{}` is noise", model.noises[n].name),
                Node::Is(m, _) => {
                    format!("`{}` changes its state", model.machines[m].name)
                }
                _ => return None,
            };
            Some((place, reason))
        })
    }

    fn any_leaf(&self, node: NodeId, test: impl Fn(&Node) -> bool) -> bool {
        self.leaves(node)
            .into_iter()
            .any(|id| test(self.model.dag.get(id)))
    }

    /// The nodes without operands below a node, in their order.
    fn leaves(&self, node: NodeId) -> Vec<NodeId> {
        let dag = &self.model.dag;
        dag.below(node)
            .into_iter()
            .filter(|id| dag.get(*id).operands().is_empty())
            .collect()
    }

    /// A constant range. Both ends are looked at before it fails.
    pub fn range(
        &mut self,
        scope: ScopeId,
        range: &'a RangeExpr,
        dim: Dim,
        of: &str,
    ) -> Option<Interval> {
        let low = self.constant(scope, &range.low, dim, &format!("the lower end of {of}"));
        let high = self.constant(scope, &range.high, dim, &format!("the upper end of {of}"));
        let (low, high) = (low?, high?);
        if low < high {
            return Some(Interval { low, high });
        }
        let message = format!(
            "{of} is empty: {}",
            shown_range(Interval { low, high }, dim)
        );
        let label = "the lower end must be below the upper end";
        let hint = if low > high {
            "swap the two ends"
        } else {
            "widen it"
        };
        self.report(Diagnostic::new(Code::EmptyRange, range.span, message, label).hint(hint));
        None
    }

    /// A constant that must be above zero.
    pub fn positive(
        &mut self,
        scope: ScopeId,
        expr: &'a Expr,
        dim: Dim,
        what: &str,
    ) -> Option<f64> {
        let value = self.constant(scope, expr, dim, what)?;
        self.above_zero(value, dim, expr.span, what)
    }

    /// Reports a constant that is not above zero.
    pub fn above_zero(&mut self, value: f64, dim: Dim, span: Span, what: &str) -> Option<f64> {
        if value > 0.0 {
            return Some(value);
        }
        let message = format!("{what} must be above zero, it is {}", shown(value, dim));
        let diagnostic = Diagnostic::new(Code::NotPositive, span, message, "zero or below");
        self.report(diagnostic.hint("give it a value above zero"));
        None
    }

    /// A first value: `= v` or zero, which must lie in its range.
    pub fn first_value(
        &mut self,
        scope: ScopeId,
        init: Option<&'a Expr>,
        range: Option<(Interval, Span)>,
        dim: Dim,
        name: &str,
    ) -> f64 {
        let first = match init {
            Some(expr) => self.constant(scope, expr, dim, &format!("the first value of `{name}`")),
            None => Some(0.0),
        };
        let (Some(first), Some((range, range_span))) = (first, range) else {
            return 0.0;
        };
        if let Some(first) = within(first, range) {
            return first;
        }
        let message = format!(
            "`{name}` starts at {}, outside its range",
            shown(first, dim)
        );
        let range_label = format!("its range is {}", shown_range(range, dim));
        let diagnostic = match init {
            Some(expr) => Diagnostic::new(
                Code::InitOutOfRange,
                expr.span,
                message,
                "outside the range",
            )
            .also(range_span, range_label)
            .hint("start inside the range, or widen it"),
            None => Diagnostic::new(Code::InitOutOfRange, range_span, message, range_label)
                .hint("without `= value` it starts at zero: give a first value after the range"),
        };
        self.report(diagnostic);
        range.low
    }
}

/// The value, moved onto an end of the range that it misses by rounding only; `None` outside.
pub fn within(value: f64, range: Interval) -> Option<f64> {
    let slack = ROUNDING * (range.high - range.low);
    (value >= range.low - slack && value <= range.high + slack)
        .then(|| value.clamp(range.low, range.high))
}
