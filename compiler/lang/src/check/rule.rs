//! Rules: transitions and events become guard and actions, in the order of the text.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use crate::diag::{Code, Diagnostic};
use crate::model::{Cell, CellKind, Cmp, Interval, Item, Node, NodeId, Rule, RuleKind};
use crate::syntax::ast::{Action, Expr, Name, Trigger};
use crate::units::{Dim, shown};
use whippen_source::Span;

/// Ticks of the longest period: a count of them is exact in 24 bits.
const PERIOD_MAX: f64 = 16_777_216.0;

impl<'a> Elaborator<'a, '_> {
    /// `event name when guard { .. }`, `event name every t { .. }`
    pub fn event(
        &mut self,
        scope: ScopeId,
        name: &Name,
        trigger: &'a Trigger,
        actions: &'a [Action],
        span: Span,
    ) {
        let full = self.scopes[scope.0].full(&name.node);
        let guard = match trigger {
            Trigger::When(guard) => self.condition(scope, guard, "a guard"),
            Trigger::Every(period) => self.clock(scope, &full, period),
        };
        self.guarded(scope, RuleKind::Event { name: full }, guard, actions, span);
    }

    /// Counts ticks; whether a period is over.
    fn clock(&mut self, scope: ScopeId, event: &str, period: &'a Expr) -> Option<NodeId> {
        let what = format!("the period of `{event}`");
        let seconds = self.positive(scope, period, Dim::TIME, &what)?;
        let rate_hz = f64::from(self.model.rate_hz);
        let ticks = (seconds * rate_hz).round();
        if !(2.0..=PERIOD_MAX).contains(&ticks) {
            let message = format!("{what} is {ticks:.0} ticks, and it must be 2 to {PERIOD_MAX}");
            let hint = match ticks < 2.0 {
                true => "what happens in every tick needs no event: use `let`, `next` or a `force`",
                false => "count shorter periods in a `state`",
            };
            let label = format!("{} at {rate_hz} Hz", shown(seconds, Dim::TIME));
            self.report(Diagnostic::new(Code::Period, period.span, message, label).hint(hint));
            return None;
        }
        let cell = self.model.cells.push(Cell {
            name: format!("{event}.ticks"),
            kind: CellKind::State,
            dim: Dim::NUMBER,
            range: Interval {
                low: 0.0,
                high: ticks,
            },
            init: 0.0,
            span: period.span,
        });
        let [one, end] = [1.0, ticks].map(|value| self.model.dag.constant(value));
        let now = self.node(Node::Cell(cell), period.span);
        let over = self.node(Node::Compare(Cmp::Ge, now, end), period.span);
        let counted = self.node(Node::Add(now, one), period.span);
        let kept = self.node(Node::Min(counted, end), period.span);
        let next = self.node(Node::Select(over, one, kept), period.span);
        self.model.nexts.push((cell, next));
        self.next_spans.push(period.span);
        Some(over)
    }

    /// Adds a rule. Guard and all actions are looked at, whatever fails.
    pub fn rule(
        &mut self,
        scope: ScopeId,
        kind: RuleKind,
        guard: &'a Expr,
        actions: &'a [Action],
        span: Span,
    ) {
        let guard = self.condition(scope, guard, "a guard");
        self.guarded(scope, kind, guard, actions, span);
    }

    fn guarded(
        &mut self,
        scope: ScopeId,
        kind: RuleKind,
        guard: Option<NodeId>,
        actions: &'a [Action],
        span: Span,
    ) {
        let actions: Vec<_> = actions
            .iter()
            .map(|action| self.action(scope, action))
            .collect();
        let actions: Option<Vec<_>> = actions.into_iter().collect();
        if let (Some(guard), Some(actions)) = (guard, actions) {
            let rule = Rule {
                kind,
                guard,
                actions,
                span,
                call: self.scopes[scope.0].call,
            };
            if matches!(rule.kind, RuleKind::Transition { .. }) {
                self.model.items.push(Item {
                    name: self.model.rule_name(&rule),
                    span,
                    call: rule.call,
                });
            }
            self.model.rules.push(rule);
        }
    }
}
