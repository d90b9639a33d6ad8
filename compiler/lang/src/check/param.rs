//! Parameters: constants, live values, values per key; and what the keyboard and the caller set.

use super::constant::within;
use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::slot::Source;
use super::types::{Ty, Value};
use super::written_unit::unit_of_text;
use crate::diag::{Code, Diagnostic};
use crate::model::{Cell, CellKind, Interval, Keyed, Live, Node, NodeId, Parameter};
use crate::syntax::ast::{Expr, Name, RangeExpr};
use crate::units::{Dim, Quantity, shown, shown_range};
use whippen_source::Span;

/// How a parameter gets into the Model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParamKind {
    /// As a constant.
    Constant,
    /// As a live value: index into the Model's.
    Live(usize),
    /// As a value per key: index into the Model's.
    Keyed(usize),
}

/// A parameter as it is written.
#[derive(Debug, Clone, Copy)]
pub struct ParamText<'a> {
    /// Whether it may change while playing.
    pub live: bool,
    /// Its name.
    pub name: &'a Name,
    /// Its value.
    pub value: &'a Expr,
    /// Its bounds.
    pub range: Option<&'a RangeExpr>,
    /// How long it takes to move over its whole range.
    pub glide: Option<&'a Expr>,
}

/// A declared parameter.
#[derive(Debug, Clone, Copy)]
pub struct ParamDecl<'a> {
    kind: ParamKind,
    text: ParamText<'a>,
}

impl<'a> Elaborator<'a, '_> {
    /// Enters a parameter. What the caller sets is as it was declared; what the keyboard sets is a
    /// value per key.
    pub fn declare_param(&mut self, scope: ScopeId, written: ParamText<'a>) -> Made {
        let ParamText { live, name, .. } = written;
        let model = &mut self.model;
        let full = self.scopes[scope.0].full(&name.node);
        let is_member = self.scopes[scope.0].member.is_some();
        let (text, span, bounds) = (
            full.clone(),
            name.span,
            Interval {
                low: 0.0,
                high: 0.0,
            },
        );
        let set = is_member || self.settings.sets.contains_key(&full);
        let kind = if !set && self.settings.per_key.contains_key(name.node.as_str()) {
            model.keyed.push(Keyed {
                name: text,
                dim: Dim::NUMBER,
                values: Vec::new(),
                range: bounds,
                span,
            });
            ParamKind::Keyed(model.keyed.len() - 1)
        } else if live {
            model.lives.push(Live {
                name: text,
                dim: None,
                unit: String::new(),
                value: 0.0,
                range: bounds,
                span,
            });
            ParamKind::Live(model.lives.len() - 1)
        } else {
            ParamKind::Constant
        };
        let decl = ParamDecl {
            kind,
            text: written,
        };
        let slot = self.new_slot(full, name.span, Source::Param(scope, decl));
        self.enter(scope, name, Thing::Param(slot));
        Made::Slot(slot)
    }

    /// The value of a parameter.
    pub fn param(&mut self, scope: ScopeId, decl: ParamDecl<'a>) -> Option<Value> {
        let declared = self.expr(scope, decl.text.value)?;
        match declared.ty {
            Ty::Real(dim) => self.real_param(scope, decl, declared, dim),
            Ty::Bool => self.bool_param(scope, decl, declared),
        }
    }

    fn real_param(
        &mut self,
        scope: ScopeId,
        decl: ParamDecl<'a>,
        declared: Value,
        dim: Dim,
    ) -> Option<Value> {
        let name = &self.scopes[scope.0].full(&decl.text.name.node);
        let what = format!("the value of `{name}`");
        if let Some(wanted) = decl
            .text
            .range
            .and_then(|range| self.both_ends(scope, range))
        {
            self.expect(declared, decl.text.value, wanted, || what.clone())?;
        }
        let value = self.known(declared.node, decl.text.value.span, &what);
        let range = match decl.text.range {
            Some(range) => Some((
                self.range(scope, range, dim, &format!("the range of `{name}`"))?,
                range.span,
            )),
            None if decl.text.live => return self.missing_range(decl, dim),
            None => None,
        };
        let value = self.in_range(value?, dim, decl.text.value.span, range, name);
        let value = match self.settings.sets.get(name.as_str()).copied() {
            Some(set) => {
                let value = match set.value {
                    Quantity::Real { value, dim } if set.in_si && dim.is_number() => value,
                    value => self.set_number(name, value, set.span, dim)?,
                };
                self.in_range(value, dim, set.span, range, name)
            }
            None => value,
        }?;
        let bounds = range.map(|(range, _)| range);
        self.keep(name, (value, dim), bounds, decl.text.value.span);
        let node = match decl.kind {
            ParamKind::Constant => Node::Const(crate::model::dag::Real(value)),
            ParamKind::Live(index) => {
                let live = &mut self.model.lives[index];
                (live.dim, live.value, live.range) = (Some(dim), value, bounds?);
                live.unit = unit_of_text(&decl.text, dim);
                Node::Live(index as u32)
            }
            ParamKind::Keyed(index) => {
                self.fill_keyed(index, name, dim, range)?;
                Node::Keyed(index as u32)
            }
        };
        let node = self.node(node, decl.text.name.span);
        let node = match decl.text.glide {
            Some(glide) => self.glide(scope, decl, (node, value, bounds), dim, glide)?,
            None => node,
        };
        Some(Value::real(node, dim))
    }

    /// Notes what a parameter is, in the Model: constants are folded away elsewhere.
    fn keep(&mut self, name: &str, (value, dim): (f64, Dim), range: Option<Interval>, span: Span) {
        self.model.parameters.push(Parameter {
            name: name.to_string(),
            dim,
            value,
            range,
            span,
        });
    }

    /// A live value that moves towards what was set, at most over its whole range in a time.
    fn glide(
        &mut self,
        scope: ScopeId,
        decl: ParamDecl<'a>,
        (target, init, range): (NodeId, f64, Option<Interval>),
        dim: Dim,
        glide: &'a Expr,
    ) -> Option<NodeId> {
        let name = &self.scopes[scope.0].full(&decl.text.name.node);
        let seconds = self.positive(scope, glide, Dim::TIME, &format!("the glide of `{name}`"))?;
        let range = match (decl.kind, range) {
            (ParamKind::Live(_), Some(range)) => range,
            // It is set per key, for good.
            (ParamKind::Keyed(_), _) if decl.text.live => return Some(target),
            _ => {
                self.nothing_glides(decl, glide, "a constant");
                return None;
            }
        };
        let step = range.width() / (seconds * f64::from(self.model.rate_hz)).max(1.0);
        let span = decl.text.name.span;
        let cell = self.model.cells.push(Cell {
            name: format!("{name}.glide"),
            kind: CellKind::Glide,
            dim,
            range,
            init,
            span,
        });
        let (now, step) = (
            self.node(Node::Cell(cell), span),
            self.model.dag.constant(step),
        );
        // In this form the intervals do not leave the range.
        let (below, above) = (
            self.node(Node::Sub(now, step), span),
            self.node(Node::Add(now, step), span),
        );
        let raised = self.node(Node::Max(target, below), span);
        let moved = self.node(Node::Min(raised, above), span);
        self.model.nexts.push((cell, moved));
        self.next_spans.push(span);
        Some(moved)
    }

    fn nothing_glides(&mut self, decl: ParamDecl, glide: &Expr, what: &str) {
        let name = &decl.text.name.node;
        let message = format!("`{name}` is {what} and cannot glide");
        let label = "moves towards what is set while playing";
        let hint = match decl.text.live {
            true => "take the glide away: a bool is on or off",
            false => "write `live param`, or take the glide away",
        };
        self.report(Diagnostic::new(Code::Glide, glide.span, message, label).hint(hint));
    }

    /// The type of both ends of a range, if they agree and have a unit: then a value of another
    /// type is to blame.
    fn both_ends(&mut self, scope: ScopeId, range: &'a RangeExpr) -> Option<Ty> {
        let (low, high) = (
            self.expr(scope, &range.low)?.ty,
            self.expr(scope, &range.high)?.ty,
        );
        (low == high && low != Ty::Bool && low != Ty::Real(Dim::NUMBER)).then_some(low)
    }

    fn bool_param(
        &mut self,
        scope: ScopeId,
        decl: ParamDecl<'a>,
        declared: Value,
    ) -> Option<Value> {
        let name = &self.scopes[scope.0].full(&decl.text.name.node);
        if let Some(glide) = decl.text.glide {
            self.nothing_glides(decl, glide, "a bool");
        }
        if let Some(range) = decl.text.range {
            let message = format!("`{name}` is a bool and needs no range");
            let diagnostic =
                Diagnostic::new(Code::WrongType, range.span, message, "a range of a bool");
            self.report(
                diagnostic
                    .also(decl.text.value.span, "a bool")
                    .hint("take the range away"),
            );
        }
        let Some(mut value) = self.model.dag.bool(declared.node) else {
            self.report_not_constant(
                declared.node,
                decl.text.value.span,
                &format!("the value of `{name}`"),
            );
            return None;
        };
        if let Some(set) = self.settings.sets.get(name.as_str()).copied() {
            value = self.set_bool(name, set.value, set.span)?;
        }
        let node = match decl.kind {
            ParamKind::Constant => Node::Bool(value),
            ParamKind::Live(index) => {
                let live = &mut self.model.lives[index];
                (live.dim, live.value, live.range) = (
                    None,
                    f64::from(value),
                    Interval {
                        low: 0.0,
                        high: 1.0,
                    },
                );
                Node::LiveBool(index as u32)
            }
            ParamKind::Keyed(_) => {
                self.bool_per_key(decl);
                return None;
            }
        };
        Some(Value::bool(self.node(node, decl.text.name.span)))
    }

    fn bool_per_key(&mut self, decl: ParamDecl) {
        let name = &decl.text.name.node;
        let per_key = self.settings.per_key.get(name.as_str());
        let span = per_key.map_or(decl.text.name.span, |p| p.param.span);
        let message = format!("`{name}` is a bool and cannot be set per key");
        let label = "nothing lies between on and off";
        let diagnostic = Diagnostic::new(Code::WrongType, span, message, label);
        self.report(
            diagnostic
                .also(decl.text.value.span, "a bool")
                .hint("set numbers per key only"),
        );
    }

    fn missing_range(&mut self, decl: ParamDecl, dim: Dim) -> Option<Value> {
        let name = &decl.text.name.node;
        let message = format!("the live param `{name}` needs a range");
        let unit = dim.unit();
        let space = if unit.is_empty() { "" } else { " " };
        let hint = format!("add `in low .. high`, such as `in 0{space}{unit} .. 1{space}{unit}`");
        let label = "may change while playing, between which values?";
        self.report(
            Diagnostic::new(Code::MissingRange, decl.text.name.span, message, label).hint(hint),
        );
        None
    }

    /// The value, if it lies in the range.
    pub fn in_range(
        &mut self,
        value: f64,
        dim: Dim,
        span: Span,
        range: Option<(Interval, Span)>,
        name: &str,
    ) -> Option<f64> {
        let Some((range, range_span)) = range else {
            return Some(value);
        };
        let inside = within(value, range);
        if inside.is_none() {
            let message = format!("`{name}` is {}, outside its range", shown(value, dim));
            self.report(
                Diagnostic::new(Code::OutOfRange, span, message, "outside the range")
                    .also(
                        range_span,
                        format!("its range is {}", shown_range(range, dim)),
                    )
                    .hint("choose a value inside the range, or widen it"),
            );
        }
        inside
    }

    fn set_number(&mut self, name: &str, value: Quantity, span: Span, dim: Dim) -> Option<f64> {
        let found = match value {
            Quantity::Real { value, dim: found } if found == dim => return Some(value),
            Quantity::Real { dim: found, .. } => Ty::Real(found),
            Quantity::Bool(_) => Ty::Bool,
        };
        let wanted = Ty::Real(dim);
        let code = if found == Ty::Real(Dim::NUMBER) {
            Code::MissingUnit
        } else {
            Code::WrongType
        };
        let message = format!(
            "`{name}` is {}, and this is {}",
            wanted.words(),
            found.words()
        );
        let hint = match wanted.unit() {
            unit if unit.is_empty() => "give a number without unit".to_string(),
            unit => format!("give a number with a unit, such as `{name}=1{unit}`"),
        };
        self.report(Diagnostic::new(code, span, message, found.words()).hint(hint));
        None
    }

    fn set_bool(&mut self, name: &str, value: Quantity, span: Span) -> Option<bool> {
        if let Quantity::Bool(value) = value {
            return Some(value);
        }
        let message = format!("`{name}` is a bool, and this is a number");
        let hint = format!("write `{name}=on` or `{name}=off`");
        self.report(Diagnostic::new(Code::WrongType, span, message, "a number").hint(hint));
        None
    }
}
