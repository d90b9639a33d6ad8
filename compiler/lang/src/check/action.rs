//! Actions: writes, pulses, emitted events.

use super::builtin;
use super::elaborate::Elaborator;
use super::scope::{ScopeId, Thing};
use super::types::{Ty, Value};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Action, CellId, Emission, EmissionId};
use crate::syntax::ast::{self, ActionKind, Expr, Name};
use crate::units::Dim;
use whippen_source::Span;

/// The argument that tells which member of a bank an event is of.
const MEMBER: &str = "member";

impl<'a> Elaborator<'a, '_> {
    /// One action; `None` if it is in error.
    pub fn action(&mut self, scope: ScopeId, action: &'a ast::Action) -> Option<Action> {
        match &action.kind {
            ActionKind::Emit { name, args } => self.emit(scope, name, args, action.span),
            ActionKind::Write { name, rate, value } => {
                self.write(scope, name, *rate, value, action.span)
            }
            ActionKind::Fire { pulse, value } => self.fire(scope, pulse, value, action.span),
        }
    }

    fn write(
        &mut self,
        scope: ScopeId,
        name: &Name,
        rate: bool,
        value: &'a Expr,
        span: Span,
    ) -> Option<Action> {
        let found = self.expr(scope, value);
        let cell = self.written(scope, name, rate)?;
        let dim = self.model.cells[cell].dim;
        let prime = if rate { "'" } else { "" };
        let node = self.expect(found?, value, Ty::Real(dim), || {
            format!("`{}{prime}`", name.node)
        })?;
        Some(Action::Write {
            cell,
            value: node,
            span,
        })
    }

    /// The cell that a write changes.
    fn written(&mut self, scope: ScopeId, name: &Name, rate: bool) -> Option<CellId> {
        let entry = self.lookup_written(scope, name)?;
        match (entry.thing, rate) {
            (Thing::Broken, _) => None,
            (Thing::State(cell, _), false) | (Thing::Coordinate(cell, _, _), false) => Some(cell),
            (Thing::Coordinate(_, rate, _), true) => Some(rate),
            (thing, _) => {
                self.not_writable(name, thing, entry.span, rate);
                None
            }
        }
    }

    fn not_writable(&mut self, name: &Name, thing: Thing, declared: Span, rate: bool) {
        let name_text = &name.node;
        let message = match (thing, rate) {
            (Thing::State(..), true) => {
                format!("`{name_text}` is a state and has no rate that could be written")
            }
            _ => format!("`{name_text}` is {} and cannot be written", thing.words()),
        };
        let hint = match thing {
            Thing::State(..) => format!("write `{name_text} := ..`"),
            Thing::Pulse(..) => format!("start it with `fire {name_text} at ..`"),
            Thing::Sense(_) => {
                "what is measured cannot be changed; write a coordinate or a `state`".to_string()
            }
            Thing::Param(_) => "declare a `state` if it is to change while playing".to_string(),
            Thing::Let(..) | Thing::Result(_) => {
                "it is what its `=` says, always; declare a `state` if it is to be written"
                    .to_string()
            }
            _ => "a term can write its own `state`s only; give the new value back as a result"
                .to_string(),
        };
        self.report(
            Diagnostic::new(Code::NotWritable, name.span, message, "cannot be written")
                .also(declared, format!("declared here as {}", thing.words()))
                .hint(hint),
        );
    }

    fn fire(&mut self, scope: ScopeId, name: &Name, value: &'a Expr, span: Span) -> Option<Action> {
        let found = self.expr(scope, value);
        let entry = self.lookup_written(scope, name)?;
        match entry.thing {
            Thing::Pulse(pulse, level) => {
                let node = self.expect(found?, value, level.ty, || {
                    format!("the level of `{}`", name.node)
                })?;
                Some(Action::Fire {
                    pulse,
                    value: node,
                    span,
                })
            }
            Thing::Broken => None,
            other => {
                let message = format!("`{}` is {} and cannot be fired", name.node, other.words());
                self.report(
                    Diagnostic::new(Code::FireOfOther, name.span, message, "not a pulse")
                        .also(entry.span, format!("declared here as {}", other.words()))
                        .hint("only a pulse is fired: `pulse name: force in low .. high lasting time`"),
                );
                None
            }
        }
    }

    fn emit(
        &mut self,
        scope: ScopeId,
        name: &'a Name,
        args: &'a [(Name, Expr)],
        span: Span,
    ) -> Option<Action> {
        let values: Vec<_> = args
            .iter()
            .map(|(arg, value)| self.emitted(scope, arg, value))
            .collect();
        self.repeated_names(args)?;
        let named = args.iter().any(|(arg, _)| arg.node == MEMBER);
        let member = self.emitting_member(scope, span).filter(|_| !named);
        let emission = match builtin::event(&name.node) {
            Some(event) => {
                let args = event
                    .args
                    .iter()
                    .map(|(n, dim)| ((*n).to_string(), *dim))
                    .collect();
                self.emission(name, args, member.is_some())
            }
            None => self.free_emission(name, args, &values, member.is_some())?,
        };
        self.match_arguments(emission, name, args, member.is_some())?;
        let wanted = self.model.emissions[emission].args.clone();
        let mut nodes = Vec::new();
        for (arg, dim) in &wanted {
            if let Some(member) = member.filter(|_| arg == MEMBER) {
                nodes.push(Some(member.node));
                continue;
            }
            let index = args.iter().position(|(n, _)| n.node == *arg)?;
            let what = || format!("`{arg}` of `{}`", name.node);
            nodes.push(
                values[index].and_then(|v| self.expect(v, &args[index].1, Ty::Real(*dim), what)),
            );
        }
        let args = nodes.into_iter().collect::<Option<_>>()?;
        Some(Action::Emit {
            emission,
            args,
            span,
        })
    }

    fn emitted(&mut self, scope: ScopeId, arg: &Name, value: &'a Expr) -> Option<Value> {
        let found = self.expr(scope, value)?;
        self.real(found, value, &format!("the argument `{}` needs", arg.node))?;
        Some(found)
    }

    fn repeated_names(&mut self, args: &[(Name, Expr)]) -> Option<()> {
        let mut good = Some(());
        for (index, (arg, _)) in args.iter().enumerate() {
            if let Some((first, _)) = args[..index].iter().find(|(n, _)| n.node == arg.node) {
                let message = format!("the argument `{}` is given twice", arg.node);
                self.report(
                    Diagnostic::new(
                        Code::RepeatedArgument,
                        arg.span,
                        message,
                        "the second value",
                    )
                    .also(first.span, "the first value")
                    .hint("take one of them away"),
                );
                good = None;
            }
        }
        good
    }

    /// The kind of an event that is not built in: what its first emission makes of it.
    fn free_emission(
        &mut self,
        name: &Name,
        args: &[(Name, Expr)],
        values: &[Option<Value>],
        of_member: bool,
    ) -> Option<EmissionId> {
        let emissions = &self.model.emissions;
        let known = emissions.ids().find(|id| emissions[id].name == name.node);
        if known.is_some() {
            return known;
        }
        let dims: Option<Vec<Dim>> = values.iter().map(|v| v.and_then(|v| v.ty.dim())).collect();
        let args = args
            .iter()
            .zip(dims?)
            .map(|((n, _), dim)| (n.node.clone(), dim))
            .collect();
        Some(self.emission(name, args, of_member))
    }

    /// The kind of an event; those of members of a bank say which.
    fn emission(
        &mut self,
        name: &Name,
        mut args: Vec<(String, Dim)>,
        of_member: bool,
    ) -> EmissionId {
        args.extend(of_member.then(|| (MEMBER.to_string(), Dim::NUMBER)));
        let (emission, span) = (
            Emission {
                name: name.node.clone(),
                args,
            },
            name.span,
        );
        let emissions = &self.model.emissions;
        let known = emissions
            .ids()
            .find(|id| emissions[id].name == emission.name);
        known.unwrap_or_else(|| {
            self.emission_spans.push(span);
            self.model.emissions.push(emission)
        })
    }

    /// Whether the argument names are those of the event.
    fn match_arguments(
        &mut self,
        id: EmissionId,
        name: &Name,
        args: &[(Name, Expr)],
        of_member: bool,
    ) -> Option<()> {
        let wanted: Vec<String> = self.model.emissions[id]
            .args
            .iter()
            .map(|(n, dim)| format!("{n} ({dim})"))
            .collect();
        let names: Vec<String> = self.model.emissions[id]
            .args
            .iter()
            .map(|(n, _)| n.clone())
            .collect();
        let mut good = Some(());
        for (arg, _) in args.iter().filter(|(arg, _)| !names.contains(&arg.node)) {
            let hint = match nearest(&arg.node, names.iter().map(String::as_str)) {
                Some(near) => Advice::did_you_mean(near),
                None if names.is_empty() => "it has none: take it away".into(),
                None => format!("it has {}", wanted.join(", ")).into(),
            };
            let message = format!("the event `{}` has no argument `{}`", name.node, arg.node);
            self.report_emission(
                Code::UnknownArgument,
                id,
                arg.span,
                message,
                "no such argument",
                hint,
            );
            good = None;
        }
        good = good.and(self.once_in_banks(id, name, of_member));
        let missing: Vec<&str> = names
            .iter()
            .filter(|n| !(of_member && **n == MEMBER))
            .filter(|n| args.iter().all(|(a, _)| a.node != **n))
            .map(String::as_str)
            .collect();
        if good.is_some() && !missing.is_empty() {
            let message = format!("`emit {}` leaves out {}", name.node, missing.join(", "));
            let hint = format!("it has {}", wanted.join(", "));
            self.report_emission(
                Code::MissingArgument,
                id,
                name.span,
                message,
                "an argument is missing",
                hint,
            );
            good = None;
        }
        good
    }

    /// Whether an event that a member emits is one of members.
    fn once_in_banks(&mut self, id: EmissionId, name: &Name, of_member: bool) -> Option<()> {
        let known = self.model.emissions[id]
            .args
            .iter()
            .any(|(n, _)| n == MEMBER);
        if of_member && !known {
            let message = format!(
                "`{}` is emitted in a bank, where it has the argument `{MEMBER}`, and outside of it",
                name.node
            );
            let hint = "give the two events different names";
            let label = "in a bank";
            self.report_emission(Code::UnknownArgument, id, name.span, message, label, hint);
            return None;
        }
        Some(())
    }

    fn report_emission(
        &mut self,
        code: Code,
        id: EmissionId,
        span: Span,
        message: String,
        label: &str,
        hint: impl Into<Advice>,
    ) {
        let mut diagnostic = Diagnostic::new(code, span, message, label);
        let emission = &self.model.emissions[id];
        let first = self.emission_spans[id];
        if builtin::event(&emission.name).is_none() && first != span {
            diagnostic = diagnostic.also(first, "first emitted here");
        }
        self.report(diagnostic.hint(hint));
    }
}
