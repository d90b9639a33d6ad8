//! The tree of scopes: names, cells, machines and calls, before any expression is looked at.

use super::builtin;
use super::elaborate::Elaborator;
use super::items::TermItem;
use super::param::ParamText;
use super::scope::{Entry, Made, NameEntry, Scope, ScopeId, Thing};
use super::slot::Source;
use super::strand::StringText;
use super::types::{Ty, Value};
use crate::diag::{Code, Diagnostic};
use crate::model::{Call, Interval, Live, Node};
use crate::syntax::ast::{Decl, DeclKind, Name};
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// Makes a scope and everything below it.
    pub fn instantiate(&mut self, scope: Scope<'a>) -> ScopeId {
        let sources = scope.term.map_or(0, |t| t.ast.params.len());
        self.instantiate_with(scope, vec![Source::Missing; sources])
    }

    /// Makes the scope of a term whose parameters stand for any value of their type.
    pub fn instantiate_alone(&mut self, term: TermItem<'a>) -> ScopeId {
        let sources = term
            .ast
            .params
            .iter()
            .map(|param| self.any_value(&param.ty))
            .collect();
        self.instantiate_with(
            Scope::new(String::new(), &term.ast.decls, Some(term), None),
            sources,
        )
    }

    fn any_value(&mut self, ty: &Name) -> Source<'a> {
        let index = self.model.lives.len() as u32;
        let Some(ty_of) = self.any_type(ty) else {
            return Source::Missing;
        };
        let range = Interval {
            low: 0.0,
            high: 0.0,
        };
        let live = Live {
            name: String::new(),
            dim: ty_of.dim(),
            unit: String::new(),
            value: 0.0,
            range,
            span: ty.span,
        };
        self.model.lives.push(live);
        let node = if ty_of == Ty::Bool {
            Node::LiveBool(index)
        } else {
            Node::Live(index)
        };
        Source::Given(Value {
            node: self.node(node, ty.span),
            ty: ty_of,
        })
    }

    /// Makes a scope whose parameters have these sources, and everything below it.
    pub fn instantiate_with(&mut self, scope: Scope<'a>, arguments: Vec<Source<'a>>) -> ScopeId {
        let id = ScopeId(self.scopes.len());
        let term = scope.term;
        let caller = scope.caller;
        self.scopes.push(scope);
        self.scopes[id.0].call = caller.map(|caller| {
            let outer = self.scopes[caller.scope.0].call;
            self.model.calls.push(Call {
                span: caller.span,
                outer,
            });
            self.model.calls.len() as u32 - 1
        });
        if let Some(term) = term {
            self.signature(id, term, arguments);
        }
        self.declare_all(id);
        id
    }

    /// Enters all that stands in a scope, then makes the scopes below it.
    pub fn declare_all(&mut self, id: ScopeId) {
        let decls = self.scopes[id.0].decls;
        for decl in decls {
            let misplaced = self.not_in_a_bank(id, &decl.kind);
            let made = misplaced.unwrap_or_else(|| self.declare(id, decl));
            self.scopes[id.0].made.push(made);
        }
        if self.scopes[id.0].member.is_none() {
            self.missing_results(id);
        }
        for (index, decl) in decls.iter().enumerate() {
            let children = match self.scopes[id.0].made[index] {
                Made::Bank(bank) => self.members(id, decl, bank),
                _ => self.children(id, decl),
            };
            self.scopes[id.0].children.push(children);
        }
    }

    /// Enters parameters and results of a term.
    fn signature(&mut self, id: ScopeId, term: TermItem<'a>, arguments: Vec<Source<'a>>) {
        for (param, source) in term.ast.params.iter().zip(arguments) {
            let ty = self.any_type(&param.ty);
            let source = match source {
                Source::Expr(caller, expr) => Source::Typed(caller, expr, ty),
                other => other,
            };
            let slot = self.new_slot(
                self.scopes[id.0].full(&param.name.node),
                param.name.span,
                source,
            );
            self.scopes[id.0].args.push(slot);
            self.enter(id, &param.name, Thing::Argument(slot));
        }
        for result in &term.ast.results {
            let slot = self.new_slot(
                self.scopes[id.0].full(&result.name.node),
                result.name.span,
                Source::Missing,
            );
            self.scopes[id.0].results.push((&result.name.node, slot));
            self.enter(id, &result.name, Thing::Result(slot));
        }
    }

    /// Enters a name; of two equal ones the first is kept.
    pub fn enter(&mut self, scope: ScopeId, name: &'a Name, thing: Thing) {
        if builtin::constant(&name.node).is_some() {
            let message = format!("`{}` is built in", name.node);
            let label = "this name is taken";
            self.report(
                Diagnostic::new(Code::DuplicateName, name.span, message, label)
                    .hint("choose another name"),
            );
            return;
        }
        match self.find(scope, &name.node) {
            Some(first) => {
                let label = format!("already the name of {}", first.thing.words());
                self.duplicate("value", name, first.span, label);
            }
            None => {
                self.scopes[scope.0].values.insert(
                    &name.node,
                    Entry {
                        thing,
                        span: name.span,
                    },
                );
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
            DeclKind::Bank { name, .. } => self.declare_bank(scope, name),
            DeclKind::Sense { name, .. }
            | DeclKind::Param { name, .. }
            | DeclKind::Force { name, .. }
            | DeclKind::Sound { name, .. }
                if in_term =>
            {
                self.not_in_a_term(scope, &decl.kind, name)
            }
            DeclKind::Sense { name, ty, .. } => self.declare_sense(scope, name, ty),
            DeclKind::Param {
                live,
                name,
                value,
                range,
                glide,
            } => {
                let written = ParamText {
                    live: *live,
                    name,
                    value,
                    range: range.as_ref(),
                    glide: glide.as_ref(),
                };
                self.declare_param(scope, written)
            }
            DeclKind::Let { name, value } => {
                let slot = self.new_slot(
                    self.scopes[scope.0].full(&name.node),
                    name.span,
                    Source::Expr(scope, value),
                );
                self.enter(scope, name, Thing::Let(slot, None));
                Made::Slot(slot)
            }
            DeclKind::States { name, transitions } => {
                self.declare_machine(scope, name, transitions)
            }
            DeclKind::State { name, ty, .. } => self.declare_state(scope, name, ty),
            DeclKind::Body { name, parts } => self.declare_body(scope, name, parts),
            DeclKind::String { name, along, parts } => {
                self.declare_string(scope, StringText { name, along, parts })
            }
            DeclKind::Pulse { name, ty, .. } => self.declare_pulse(scope, name, ty),
            DeclKind::Result { name, value } => self.declare_result(scope, name, value),
            DeclKind::Event { name, .. } => self.declare_event(scope, name),
            DeclKind::Force { name, on, .. } => self.declare_force(scope, name, on.as_ref()),
            DeclKind::Noise { name } => self.declare_noise(scope, name),
            DeclKind::Delay { name, ty, .. } => self.declare_delay(scope, name, ty),
            DeclKind::Table { .. } => self.declare_table(scope, &decl.kind),
            DeclKind::Sound { name, side, .. } => self.declare_sound(scope, name, side.as_ref()),
            DeclKind::Next { .. } | DeclKind::Feed { .. } | DeclKind::Hold { .. } => Made::Itself,
        }
    }

    fn not_in_a_term(&mut self, scope: ScopeId, kind: &DeclKind, name: &'a Name) -> Made {
        let (word, hint) = match kind {
            DeclKind::Sense { .. } => ("sense", "give the sensed value to the term as a parameter"),
            DeclKind::Param { .. } => ("param", "make it a parameter of the term, or a `let`"),
            DeclKind::Force { turning: true, .. } => (
                "torque",
                "make it a result of the term and write `torque` in the instrument",
            ),
            DeclKind::Sound { .. } => (
                "sound",
                "make it a result of the term and write `sound` in the instrument",
            ),
            _ => (
                "force",
                "make it a result of the term and write `force` in the instrument",
            ),
        };
        let message = format!("a `{word}` cannot be declared in a term");
        let label = "belongs in an instrument";
        self.report(Diagnostic::new(Code::NotInTerm, name.span, message, label).hint(hint));
        if !matches!(kind, DeclKind::Force { .. } | DeclKind::Sound { .. }) {
            self.enter(scope, name, Thing::Broken);
        }
        Made::Nothing
    }

    fn declare_event(&mut self, scope: ScopeId, name: &'a Name) -> Made {
        match self.scopes[scope.0].events.get(name.node.as_str()) {
            Some(first) => self.duplicate("event", name, first.span, "a second event of this name"),
            None => drop(self.scopes[scope.0].events.insert(
                &name.node,
                NameEntry {
                    id: (),
                    span: name.span,
                },
            )),
        }
        Made::Itself
    }

    /// A label stands once for each sense.
    fn declare_force(&mut self, scope: ScopeId, name: &'a Name, on: Option<&'a Name>) -> Made {
        let decls = self.scopes[scope.0].decls;
        let first = decls.iter().find_map(|decl| match &decl.kind {
            DeclKind::Sense { name, .. } => Some(name),
            _ => None,
        });
        let port = on.or(first).map_or("", |port| port.node.as_str());
        let key = (name.node.as_str(), port);
        match self.scopes[scope.0].forces.get(&key) {
            Some(first) => {
                let label = "a second force term of this name";
                self.duplicate("force", name, first.span, label);
            }
            None => {
                let span = name.span;
                let entry = NameEntry { id: (), span };
                self.scopes[scope.0].forces.insert(key, entry);
            }
        }
        Made::Itself
    }
}
