//! Memory: `state` and `next`, and pulses.

use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::types::Value;
use crate::diag::{Code, Diagnostic};
use crate::model::{Cell, CellId, CellKind, Interval, Node, Pulse, PulseId};
use crate::syntax::ast::{Expr, Name, RangeExpr};
use crate::units::{Dim, shown_range};
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// A new cell, whose range and first value are filled in later, and its value.
    pub fn new_cell(
        &mut self,
        name: String,
        kind: CellKind,
        dim: Dim,
        span: Span,
    ) -> (CellId, Value) {
        let id = self.model.cells.next_id();
        let range = Interval {
            low: 0.0,
            high: 0.0,
        };
        self.model.cells.push(Cell {
            name,
            kind,
            dim,
            range,
            init: 0.0,
            span,
        });
        (id, Value::real(self.node(Node::Cell(id), span), dim))
    }

    /// Fills in range and first value of a cell.
    pub fn fill_cell(
        &mut self,
        scope: ScopeId,
        cell: CellId,
        range: &'a RangeExpr,
        init: Option<&'a Expr>,
    ) {
        let Cell { name, dim, .. } = self.model.cells[cell].clone();
        let bounds = self.range(scope, range, dim, &format!("the range of `{name}`"));
        let first = self.first_value(scope, init, bounds.map(|b| (b, range.span)), dim, &name);
        let cell = &mut self.model.cells[cell];
        cell.range = bounds.unwrap_or(cell.range);
        cell.init = first;
    }

    /// Enters a `state`.
    pub fn declare_state(&mut self, scope: ScopeId, name: &'a Name, ty: &Name) -> Made {
        let Some(dim) = self.real_type(
            ty,
            "a `state`",
            "use `states` for something that is one thing or another",
        ) else {
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        };
        let full = self.scopes[scope.0].full(&name.node);
        let (cell, value) = self.new_cell(full, CellKind::State, dim, name.span);
        self.enter(scope, name, Thing::State(cell, value));
        Made::Cell(cell)
    }

    /// Its range and first value.
    pub fn state(
        &mut self,
        scope: ScopeId,
        cell: CellId,
        range: &'a RangeExpr,
        init: Option<&'a Expr>,
    ) {
        self.fill_cell(scope, cell, range, init);
    }

    /// `next name = value`
    pub fn next(&mut self, scope: ScopeId, name: &'a Name, value: &'a Expr) {
        let found = self.expr(scope, value);
        let Some(entry) = self.lookup_written(scope, name) else {
            return;
        };
        let Thing::State(cell, state) = entry.thing else {
            if !matches!(entry.thing, Thing::Broken) {
                self.not_a_state(name, entry.thing, entry.span);
            }
            return;
        };
        let node = found.and_then(|v| {
            self.expect(v, value, state.ty, || {
                format!("the next value of `{}`", name.node)
            })
        });
        if let Some(first) = self.model.nexts.iter().position(|(c, _)| *c == cell) {
            let message = format!("`{}` has two next values", name.node);
            self.report(
                Diagnostic::new(Code::TwoNexts, name.span, message, "the second")
                    .also(self.next_spans[first], "the first")
                    .hint("choose between them: `next .. = if .. then .. else ..`"),
            );
            return;
        }
        let missing = self.model.dag.constant(0.0);
        self.model.nexts.push((cell, node.unwrap_or(missing)));
        self.next_spans.push(name.span);
    }

    fn not_a_state(&mut self, name: &Name, thing: Thing, span: Span) {
        let message = format!("`{}` is {} and has no next value", name.node, thing.words());
        let hint = match thing {
            Thing::Coordinate(..) => "a body moves by its torques; write it with `:=` in an event",
            Thing::Pulse(..) => "a pulse is started with `fire` in an event",
            Thing::Let(..) => "only a `state` remembers: declare `state name: type in low .. high`",
            _ => "only a `state` remembers",
        };
        self.report(
            Diagnostic::new(Code::NextOfOther, name.span, message, "not a `state`")
                .also(span, format!("declared here as {}", thing.words()))
                .hint(hint),
        );
    }

    /// Enters a pulse.
    pub fn declare_pulse(&mut self, scope: ScopeId, name: &'a Name, ty: &Name) -> Made {
        let Some(dim) = self.real_type(
            ty,
            "a pulse",
            "fire a force, and ask whether it is above zero",
        ) else {
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        };
        let full = self.scopes[scope.0].full(&name.node);
        let (level, value) = self.new_cell(full.clone(), CellKind::Pulse, dim, name.span);
        let pulse = self.model.pulses.push(Pulse {
            name: full,
            level,
            ticks: 1,
            span: name.span,
        });
        self.enter(scope, name, Thing::Pulse(pulse, value));
        Made::Pulse(pulse)
    }

    /// Its range, which must hold the zero of rest, and how long it lasts.
    pub fn pulse(
        &mut self,
        scope: ScopeId,
        pulse: PulseId,
        range: &'a RangeExpr,
        lasting: &'a Expr,
    ) {
        let Pulse { name, level, .. } = self.model.pulses[pulse].clone();
        let dim = self.model.cells[level].dim;
        if let Some(bounds) = self.range(scope, range, dim, &format!("the range of `{name}`")) {
            self.model.cells[level].range = bounds;
            if bounds.low > 0.0 || bounds.high < 0.0 {
                let message =
                    format!("the pulse `{name}` is zero while it rests, outside its range");
                let label = shown_range(bounds, dim);
                let diagnostic =
                    Diagnostic::new(Code::PulseWithoutZero, range.span, message, label);
                self.report(diagnostic.hint("widen the range so that it holds zero"));
            }
        }
        if let Some(seconds) = self.positive(
            scope,
            lasting,
            Dim::TIME,
            &format!("the duration of `{name}`"),
        ) {
            let ticks = (seconds * f64::from(self.model.rate_hz))
                .round()
                .clamp(1.0, f64::from(i32::MAX));
            self.model.pulses[pulse].ticks = ticks as u32;
        }
    }
}
