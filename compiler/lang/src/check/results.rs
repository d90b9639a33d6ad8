//! Results of terms: `name = expr` defines what the head of the term names after `->`.

use super::elaborate::Elaborator;
use super::items::TermItem;
use super::scope::{Made, ScopeId, Thing};
use super::slot::{SlotId, Source};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::syntax::ast::{Expr, Name};

impl<'a> Elaborator<'a, '_> {
    /// Defines a result of the term.
    pub fn declare_result(&mut self, scope: ScopeId, name: &'a Name, value: &'a Expr) -> Made {
        let Some(term) = self.scopes[scope.0].term else {
            let message = format!(
                "`{} = ..` defines a result, and an instrument has none",
                name.node
            );
            let hint = format!(
                "write `let {} = ..`, or `next {0} = ..` for a state",
                name.node
            );
            let label = "no keyword before it";
            self.report(Diagnostic::new(Code::NotAResult, name.span, message, label).hint(hint));
            if !self.scopes[scope.0].values.contains_key(name.node.as_str()) {
                self.enter(scope, name, Thing::Broken);
            }
            return Made::Nothing;
        };
        let Some(slot) = self.scopes[scope.0].result(&name.node) else {
            self.not_a_result(name, term);
            return Made::Nothing;
        };
        if let Source::Typed(_, first, _) = self.slots[slot.0].source {
            self.duplicate("result", name, first.span, "a second definition");
            return Made::Nothing;
        }
        let ty = term
            .ast
            .results
            .iter()
            .find(|r| r.name.node == name.node)
            .map(|r| &r.ty);
        let ty = ty.and_then(|ty| self.any_type(ty));
        self.slots[slot.0].source = Source::Typed(scope, value, ty);
        Made::Slot(slot)
    }

    fn not_a_result(&mut self, name: &Name, term: TermItem) {
        let term = term.ast;
        let message = format!(
            "the term `{}` has no result `{}`",
            term.name.node, name.node
        );
        let names: Vec<&str> = term.results.iter().map(|r| r.name.node.as_str()).collect();
        let hint = match nearest(&name.node, names.iter().copied()) {
            Some(near) => Advice::did_you_mean(near),
            None => format!("name it after `->`, or write `let {} = ..`", name.node).into(),
        };
        let label = "not named after `->`";
        self.report(Diagnostic::new(Code::NotAResult, name.span, message, label).hint(hint));
    }

    pub fn missing_results(&mut self, scope: ScopeId) {
        let Some(term) = self.scopes[scope.0].term else {
            return;
        };
        for result in &term.ast.results {
            let slot = self.scopes[scope.0].result(&result.name.node);
            if slot.is_some_and(|SlotId(s)| matches!(self.slots[s].source, Source::Missing)) {
                let message = format!(
                    "the term `{}` never defines `{}`",
                    term.ast.name.node, result.name.node
                );
                let hint = format!("add `{} = ..` to the term", result.name.node);
                let label = "has no value";
                self.report(
                    Diagnostic::new(Code::MissingResult, result.name.span, message, label)
                        .hint(hint),
                );
            }
        }
    }
}
