//! The scopes of calls: each call of a term is a copy of the term with memory of its own.

use super::elaborate::Elaborator;
use super::items::TermItem;
use super::scope::{Caller, Scope, ScopeId, Thing};
use super::walk;
use crate::diag::{Code, Diagnostic};
use crate::syntax::ast::{Arg, Decl, DeclKind, Expr, ExprKind, Name};

/// Calls of terms in one instrument, counted through all terms.
const MAX_CALLS: usize = 4096;
/// Terms that call terms that call terms.
const MAX_NESTING: usize = 32;

impl<'a> Elaborator<'a, '_> {
    /// Makes the scopes of the calls in a declaration.
    pub fn children(&mut self, scope: ScopeId, decl: &'a Decl) -> Vec<ScopeId> {
        let mut made = Vec::new();
        let each = self.items.function("each", self.scopes[scope.0].in_std());
        let member = self.scopes[scope.0].member.filter(|_| each.is_some());
        for call in walk::calls(decl, member.map(|member| member.number)) {
            let ExprKind::Call(callee, args) = &call.kind else {
                continue;
            };
            let from_std = self.scopes[scope.0].in_std();
            if self.items.function(&callee.node, from_std).is_some()
                || self.delay_of(scope, callee).is_some()
                || self.table_of(scope, callee).is_some()
                || self.displacement_of(scope, callee).is_some()
                || self.derivative_of(scope, callee, args).is_some()
            {
                continue;
            }
            let bound = match &decl.kind {
                DeclKind::Let { name, value } if std::ptr::eq(value, call) => Some(name),
                _ => None,
            };
            let child = self.child(scope, call, callee, args, bound);
            if let Some(name) = bound {
                self.bind_let(scope, name, child);
            }
            if let Some(child) = child {
                self.scopes[scope.0].calls.insert(call.span, child);
                made.push(child);
            }
        }
        made
    }

    /// Tells the name of a `let` which call it stands for.
    fn bind_let(&mut self, scope: ScopeId, name: &Name, child: Option<ScopeId>) {
        if let Some(entry) = self.scopes[scope.0].values.get_mut(name.node.as_str())
            && entry.span == name.span
            && let Thing::Let(slot, _) = entry.thing
        {
            entry.thing = if child.is_some() {
                Thing::Let(slot, child)
            } else {
                Thing::Broken
            };
        }
    }

    fn child(
        &mut self,
        scope: ScopeId,
        call: &'a Expr,
        callee: &'a Name,
        args: &'a [Arg],
        bound: Option<&Name>,
    ) -> Option<ScopeId> {
        let Some(term) = self.items.term(&callee.node, self.scopes[scope.0].in_std()) else {
            self.unknown_term(callee);
            return None;
        };
        self.check_nesting(scope, callee, term)?;
        let arguments = self.bind(scope, call, term, args);
        let name = match bound {
            Some(name) => name.node.clone(),
            None => self.free_name(scope, &callee.node),
        };
        let path = format!("{}.", self.scopes[scope.0].full(&name));
        let caller = Caller {
            scope,
            span: call.span,
            is_let: bound.is_some(),
        };
        Some(self.instantiate_with(
            Scope::new(path, &term.ast.decls, Some(term), Some(caller)),
            arguments,
        ))
    }

    /// The next free of `plectrum_1`, `plectrum_2`, ..
    fn free_name(&mut self, scope: ScopeId, term: &'a str) -> String {
        let here = &mut self.scopes[scope.0];
        let count = here.unnamed.entry(term).or_insert(0);
        loop {
            *count += 1;
            let name = format!("{term}_{count}");
            if !here.values.contains_key(name.as_str()) {
                return name;
            }
        }
    }

    /// A term may not call itself, and the tree of calls is small.
    fn check_nesting(&mut self, scope: ScopeId, callee: &Name, term: TermItem<'a>) -> Option<()> {
        let mut path = vec![callee.node.as_str()];
        let mut above = Some(scope);
        while let Some(id) = above {
            let here = &self.scopes[id.0];
            let Some(outer) = here.term else { break };
            if let Some(member) = here.member {
                above = Some(member.outer);
                continue;
            }
            path.push(&outer.ast.name.node);
            if std::ptr::eq(outer.ast, term.ast) {
                path.reverse();
                let message = format!(
                    "the term `{}` calls itself: {}",
                    callee.node,
                    path.join(" -> ")
                );
                let label = "closes the circle";
                let diagnostic = Diagnostic::new(Code::RecursiveTerm, callee.span, message, label);
                self.report(
                    diagnostic
                        .hint("terms are copied into the instrument, so they cannot be recursive"),
                );
                return None;
            }
            above = here.caller.map(|c| c.scope);
        }
        if path.len() > MAX_NESTING || self.scopes.len() > MAX_CALLS {
            let message = format!(
                "too many calls of terms: more than {MAX_CALLS}, or {MAX_NESTING} inside each other"
            );
            self.report(
                Diagnostic::new(
                    Code::TooManyCalls,
                    callee.span,
                    message,
                    "not followed any further",
                )
                .hint("every call is a copy with memory of its own: use fewer"),
            );
            return None;
        }
        Some(())
    }
}
