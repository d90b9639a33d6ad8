//! The tree of scopes: names, cells, machines and calls, before any expression is looked at.

use super::builtin;
use super::elaborate::Elaborator;
use super::items::TermItem;
use super::scope::{Caller, Entry, Label, Made, Scope, ScopeId, Thing};
use super::slot::{SlotId, Source};
use super::types::{Ty, Value};
use super::walk;
use crate::diag::{Code, Diagnostic};
use crate::model::{Interval, Live, Node};
use crate::source::Span;
use crate::syntax::ast::{Arg, Decl, DeclKind, Expr, ExprKind, Name};

/// Calls of terms in one instrument, counted through all terms.
const MAX_CALLS: usize = 4096;
/// Terms that call terms that call terms.
const MAX_NESTING: usize = 32;

impl<'a> Elaborator<'a, '_> {
    /// Makes a scope and everything below it.
    pub fn instantiate(&mut self, scope: Scope<'a>) -> ScopeId {
        let sources = scope.term.map_or(0, |t| t.ast.params.len());
        self.instantiate_with(scope, vec![Source::Missing; sources])
    }

    /// Makes the scope of a term whose parameters stand for any value of their type.
    pub fn instantiate_alone(&mut self, term: TermItem<'a>) -> ScopeId {
        let sources = term.ast.params.iter().map(|param| self.any_value(&param.ty)).collect();
        self.instantiate_with(Scope::new(String::new(), &term.ast.decls, Some(term), None), sources)
    }

    fn any_value(&mut self, ty: &Name) -> Source<'a> {
        let index = self.model.lives.len() as u32;
        let Some(ty_of) = self.any_type(ty) else { return Source::Missing };
        let range = Interval { low: 0.0, high: 0.0 };
        let live = Live { name: String::new(), dim: ty_of.dim(), value: 0.0, range, span: ty.span };
        self.model.lives.push(live);
        let node = if ty_of == Ty::Bool { Node::LiveBool(index) } else { Node::Live(index) };
        Source::Given(Value { node: self.node(node, ty.span), ty: ty_of })
    }

    fn instantiate_with(&mut self, scope: Scope<'a>, arguments: Vec<Source<'a>>) -> ScopeId {
        let id = ScopeId(self.scopes.len());
        let (term, decls) = (scope.term, scope.decls);
        self.scopes.push(scope);
        if let Some(term) = term {
            self.signature(id, term, arguments);
        }
        for decl in decls {
            let made = self.declare(id, decl);
            self.scopes[id.0].made.push(made);
        }
        self.missing_results(id);
        for decl in decls {
            let children = self.children(id, decl);
            self.scopes[id.0].children.push(children);
        }
        id
    }

    /// Enters parameters and results of a term.
    fn signature(&mut self, id: ScopeId, term: TermItem<'a>, arguments: Vec<Source<'a>>) {
        for (param, source) in term.ast.params.iter().zip(arguments) {
            let ty = self.any_type(&param.ty);
            let source = match source {
                Source::Expr(caller, expr) => Source::Typed(caller, expr, ty),
                other => other,
            };
            let slot = self.new_slot(self.scopes[id.0].full(&param.name.node), param.name.span, source);
            self.scopes[id.0].args.push(slot);
            self.enter(id, &param.name, Thing::Argument(slot));
        }
        for result in &term.ast.results {
            let slot = self.new_slot(self.scopes[id.0].full(&result.name.node), result.name.span, Source::Missing);
            self.scopes[id.0].results.push((&result.name.node, slot));
            self.enter(id, &result.name, Thing::Result(slot));
        }
    }

    /// Enters a name; of two equal ones the first is kept.
    pub fn enter(&mut self, scope: ScopeId, name: &'a Name, thing: Thing) {
        if builtin::constant(&name.node).is_some() {
            let message = format!("`{}` is built in", name.node);
            let label = "this name is taken";
            self.report(Diagnostic::new(Code::DuplicateName, name.span, message, label).hint("choose another name"));
            return;
        }
        match self.scopes[scope.0].values.get(name.node.as_str()) {
            Some(first) => {
                let label = format!("already the name of {}", first.thing.words());
                self.duplicate("value", name, first.span, label);
            }
            None => {
                self.scopes[scope.0].values.insert(&name.node, Entry { thing, span: name.span });
            }
        }
    }

    /// Reports a second declaration of a name.
    pub fn duplicate(&mut self, kind: &str, name: &Name, first: Span, label: impl Into<String>) {
        let message = format!("the {kind} `{}` is declared twice", name.node);
        self.report(
            Diagnostic::new(Code::DuplicateName, name.span, message, label)
                .also(first, "declared first here")
                .hint("rename one of them: nothing hides anything"),
        );
    }

    fn declare(&mut self, scope: ScopeId, decl: &'a Decl) -> Made {
        let in_term = self.scopes[scope.0].term.is_some();
        match &decl.kind {
            DeclKind::Sense { name, .. } | DeclKind::Param { name, .. } | DeclKind::Force { name, .. } if in_term => {
                self.not_in_a_term(scope, &decl.kind, name)
            }
            DeclKind::Sense { name, ty, .. } => self.declare_sense(scope, name, ty),
            DeclKind::Param { live, name, value, range } => {
                self.declare_param(scope, *live, name, value, range.as_ref())
            }
            DeclKind::Let { name, value } => {
                let slot = self.new_slot(self.scopes[scope.0].full(&name.node), name.span, Source::Expr(scope, value));
                self.enter(scope, name, Thing::Let(slot, None));
                Made::Slot(slot)
            }
            DeclKind::States { name, transitions } => self.declare_machine(scope, name, transitions),
            DeclKind::State { name, ty, .. } => self.declare_state(scope, name, ty),
            DeclKind::Body { name, parts } => self.declare_body(scope, name, parts),
            DeclKind::Pulse { name, ty, .. } => self.declare_pulse(scope, name, ty),
            DeclKind::Result { name, value } => self.declare_result(scope, name, value),
            DeclKind::Event { name, .. } => self.declare_event(scope, name),
            DeclKind::Force { name, .. } => self.declare_force(scope, name),
            DeclKind::Next { .. } | DeclKind::Hold { .. } => Made::Itself,
        }
    }

    fn not_in_a_term(&mut self, scope: ScopeId, kind: &DeclKind, name: &'a Name) -> Made {
        let (word, hint) = match kind {
            DeclKind::Sense { .. } => ("sense", "give the sensed value to the term as a parameter"),
            DeclKind::Param { .. } => ("param", "make it a parameter of the term, or a `let`"),
            _ => ("force", "make it a result of the term and write `force` in the instrument"),
        };
        let message = format!("a `{word}` cannot be declared in a term");
        let label = "belongs in an instrument";
        self.report(Diagnostic::new(Code::NotInTerm, name.span, message, label).hint(hint));
        if word != "force" {
            self.enter(scope, name, Thing::Broken);
        }
        Made::Nothing
    }

    fn declare_event(&mut self, scope: ScopeId, name: &'a Name) -> Made {
        match self.scopes[scope.0].events.get(name.node.as_str()) {
            Some(first) => self.duplicate("event", name, first.span, "a second event of this name"),
            None => drop(self.scopes[scope.0].events.insert(&name.node, Label { id: (), span: name.span })),
        }
        Made::Itself
    }

    fn declare_force(&mut self, scope: ScopeId, name: &'a Name) -> Made {
        match self.scopes[scope.0].forces.get(name.node.as_str()) {
            Some(first) => self.duplicate("force", name, first.span, "a second force term of this name"),
            None => drop(self.scopes[scope.0].forces.insert(&name.node, Label { id: (), span: name.span })),
        }
        Made::Itself
    }

    /// Makes the scopes of the calls in a declaration.
    fn children(&mut self, scope: ScopeId, decl: &'a Decl) -> Vec<ScopeId> {
        let mut made = Vec::new();
        for call in walk::calls(decl) {
            let ExprKind::Call(callee, args) = &call.kind else { continue };
            if builtin::function(&callee.node).is_some() {
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
            entry.thing = if child.is_some() { Thing::Let(slot, child) } else { Thing::Broken };
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
        let caller = Caller { scope, span: call.span, is_let: bound.is_some() };
        Some(self.instantiate_with(Scope::new(path, &term.ast.decls, Some(term), Some(caller)), arguments))
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
            path.push(&outer.ast.name.node);
            if std::ptr::eq(outer.ast, term.ast) {
                path.reverse();
                let message = format!("the term `{}` calls itself: {}", callee.node, path.join(" -> "));
                let label = "closes the circle";
                let diagnostic = Diagnostic::new(Code::RecursiveTerm, callee.span, message, label);
                self.report(diagnostic.hint("terms are copied into the instrument, so they cannot be recursive"));
                return None;
            }
            above = here.caller.map(|c| c.scope);
        }
        if path.len() > MAX_NESTING || self.scopes.len() > MAX_CALLS {
            let message = format!("too many calls of terms: more than {MAX_CALLS}, or {MAX_NESTING} inside each other");
            self.report(
                Diagnostic::new(Code::TooManyCalls, callee.span, message, "not followed any further")
                    .hint("every call is a copy with memory of its own: use fewer"),
            );
            return None;
        }
        Some(())
    }

    /// Defines a result of the term.
    fn declare_result(&mut self, scope: ScopeId, name: &'a Name, value: &'a Expr) -> Made {
        let Some(term) = self.scopes[scope.0].term else {
            let message = format!("`{} = ..` defines a result, and an instrument has none", name.node);
            let hint = format!("write `let {} = ..`, or `next {0} = ..` for a state", name.node);
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
        let ty = term.ast.results.iter().find(|r| r.name.node == name.node).map(|r| &r.ty);
        let ty = ty.and_then(|ty| self.any_type(ty));
        self.slots[slot.0].source = Source::Typed(scope, value, ty);
        Made::Slot(slot)
    }

    fn not_a_result(&mut self, name: &Name, term: TermItem) {
        let term = term.ast;
        let message = format!("the term `{}` has no result `{}`", term.name.node, name.node);
        let names: Vec<&str> = term.results.iter().map(|r| r.name.node.as_str()).collect();
        let hint = match crate::diag::nearest(&name.node, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("name it after `->`, or write `let {} = ..`", name.node),
        };
        let label = "not named after `->`";
        self.report(Diagnostic::new(Code::NotAResult, name.span, message, label).hint(hint));
    }

    fn missing_results(&mut self, scope: ScopeId) {
        let Some(term) = self.scopes[scope.0].term else { return };
        for result in &term.ast.results {
            let slot = self.scopes[scope.0].result(&result.name.node);
            if slot.is_some_and(|SlotId(s)| matches!(self.slots[s].source, Source::Missing)) {
                let message = format!("the term `{}` never defines `{}`", term.ast.name.node, result.name.node);
                let hint = format!("add `{} = ..` to the term", result.name.node);
                let label = "has no value";
                self.report(Diagnostic::new(Code::MissingResult, result.name.span, message, label).hint(hint));
            }
        }
    }
}
