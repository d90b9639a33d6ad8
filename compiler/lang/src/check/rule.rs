//! Rules: transitions and events become guard and actions, in the order of the text.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use crate::model::{Item, Rule, RuleKind};
use crate::syntax::ast::{Action, Expr, Name};
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// `event name when guard { .. }`
    pub fn event(
        &mut self,
        scope: ScopeId,
        name: &Name,
        guard: &'a Expr,
        actions: &'a [Action],
        span: Span,
    ) {
        let kind = RuleKind::Event {
            name: self.scopes[scope.0].full(&name.node),
        };
        self.rule(scope, kind, guard, actions, span);
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
