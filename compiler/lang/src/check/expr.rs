//! Expressions: a type and a node for each.

use super::builtin;
use super::elaborate::Elaborator;
use super::elsewhere;
use super::scope::{Entry, Scope, ScopeId, Thing};
use super::slot::SlotId;
use super::types::{Ty, Value};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{MachineId, Node, NodeId};
use crate::syntax::ast::{Expr, ExprKind, Name, Number};
use crate::units::{Dim, Unit, parse_unit};
use whippen_source::Span;

/// How deep expressions may be nested, counted through the values that are evaluated because they
/// are named.
const MAX_DEPTH: usize = 400;

impl<'a> Elaborator<'a, '_> {
    /// The value of an expression; `None` if it is in error, which has then been reported.
    pub fn expr(&mut self, scope: ScopeId, expr: &'a Expr) -> Option<Value> {
        if self.depth == MAX_DEPTH {
            let message =
                format!("this is reached through more than {MAX_DEPTH} steps from value to value");
            let label = "not followed any further";
            let hint = "declare a `let` after those it uses";
            self.report(Diagnostic::new(Code::TooManySteps, expr.span, message, label).hint(hint));
            return None;
        }
        let outer = self.here.replace(scope);
        self.depth += 1;
        let value = self.by_kind(scope, expr);
        self.depth -= 1;
        self.here = outer;
        value
    }

    fn by_kind(&mut self, scope: ScopeId, expr: &'a Expr) -> Option<Value> {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Number(number) => self.number(number, span),
            ExprKind::Bool(value) => Some(Value::bool(self.node(Node::Bool(*value), span))),
            ExprKind::Name(name) => self.name(scope, name, span),
            ExprKind::Field(base, field) => self.field(scope, base, field),
            ExprKind::Member(..) => self.bank_as_value(span),
            ExprKind::Call(callee, args) => self.call(scope, expr, callee, args),
            ExprKind::Prime(base) => self.primed(scope, base, span),
            ExprKind::Neg(a) => self.negative(scope, a, span),
            ExprKind::Not(a) => {
                let a = self.condition(scope, a, "what `not` is applied to")?;
                Some(Value::bool(self.node(Node::Not(a), span)))
            }
            ExprKind::Binary(op, a, b) => self.binary(scope, *op, a, b, span),
            ExprKind::Is {
                machine,
                state,
                negated,
            } => self.is(scope, machine, state, *negated, span),
            ExprKind::If(c, a, b) => self.choice(scope, c, a, b, span),
            ExprKind::Error => None,
        }
    }

    fn number(&mut self, number: &Number, span: Span) -> Option<Value> {
        let unit = match &number.unit {
            Some(unit) => parse_unit(unit)?,
            None => Unit::ONE,
        };
        let value = unit.to_si(number.value);
        if !value.is_finite() {
            let message = format!("`{}` is too large", number.text);
            let diagnostic = Diagnostic::new(Code::NotFinite, span, message, "not a finite number");
            self.report(diagnostic.hint("write a smaller number"));
            return None;
        }
        let node = self.model.dag.constant(value);
        self.mark(span);
        Some(Value::real(node, unit.dim))
    }

    pub fn name(&mut self, scope: ScopeId, name: &str, span: Span) -> Option<Value> {
        if let Some(constant) = builtin::constant(name) {
            let node = self.model.dag.constant(constant.value);
            self.mark(span);
            return Some(Value::real(node, constant.dim));
        }
        if name == builtin::TICK && self.means_length_of_tick(scope) {
            let seconds = 1.0 / f64::from(self.model.rate_hz);
            let node = self.model.dag.constant(seconds);
            self.mark(span);
            return Some(Value::real(node, Dim::TIME));
        }
        if let Some(trial) = self.tried(scope, name, span) {
            return self.slot(trial);
        }
        match self.lookup(scope, name, span)?.thing {
            Thing::Broken => None,
            Thing::Sense(v)
            | Thing::State(_, v)
            | Thing::Coordinate(_, _, v)
            | Thing::Pulse(_, v)
            | Thing::Noise(v)
            | Thing::Number(v) => Some(v),
            Thing::Bank(_) => self.bank_as_value(span),
            Thing::Displacement(_) => {
                self.displacement_as_value(name, span);
                None
            }
            Thing::Delay(_) => {
                self.delay_as_value(name, span);
                None
            }
            Thing::Table(_) => {
                self.table_as_value(name, span);
                None
            }
            Thing::Let(_, Some(call)) => {
                let slot = self.only_result(call, span)?;
                self.slot(slot)
            }
            Thing::Let(slot, None)
            | Thing::Friction(slot, _)
            | Thing::Tension(slot)
            | Thing::Param(slot)
            | Thing::Argument(slot)
            | Thing::Result(slot) => self.slot(slot),
        }
    }

    /// Whether `tick` is the length of a tick: not in a keyboard, and not where it is declared.
    fn means_length_of_tick(&self, scope: ScopeId) -> bool {
        let here = &self.scopes[scope.0];
        !here.decls.is_empty() && !here.values.contains_key(builtin::TICK)
    }

    /// What a name stands for.
    pub fn lookup(&mut self, scope: ScopeId, name: &str, span: Span) -> Option<Entry> {
        let found = self.find(scope, name);
        if found.is_none() {
            self.unknown_name(scope, name, span);
        }
        found
    }

    /// The machine of a scope that has a state of this name.
    fn machine_with<'s>(&self, here: &'s Scope<'a>, name: &str) -> Option<&'s str> {
        let has = |id: MachineId| self.model.machines[id].states.iter().any(|s| s == name);
        let mut machines = here.machines.iter();
        machines.find_map(|(machine, entry)| has(entry.id).then_some(*machine))
    }

    fn unknown_name(&mut self, scope: ScopeId, name: &str, span: Span) {
        let here = &self.scopes[scope.0];
        let constants = builtin::CONSTANTS.iter().map(|c| c.name);
        let hint = if here.decls.is_empty() {
            "a keyboard is made of numbers: it knows no names but `pi` and `gravity`".into()
        } else if here.machines.contains_key(name) {
            format!("`{name}` is a machine: ask `{name} is ..` for one of its states").into()
        } else if let Some(base) = rate_of(name).filter(|base| here.values.contains_key(base)) {
            Advice::instead(
                format!("the rate of `{base}` is written `{base}'`"),
                format!("{base}'"),
            )
        } else if let Some(machine) = self.machine_with(here, name) {
            format!("`{name}` is a state: ask `{machine} is {name}`").into()
        } else if let Some(instead) = elsewhere::value(name) {
            instead
        } else if let Some(near) = nearest(
            name,
            here.values
                .keys()
                .copied()
                .chain(constants)
                .chain([builtin::TICK]),
        ) {
            Advice::did_you_mean(near)
        } else if here.term.is_some() {
            "a term sees only its parameters: add one and hand the value in".into()
        } else if name == "tension" {
            "let it be found, with a line `tuned tension to 110 Hz` in the string, or declare it, for example \
             `let tension = 60 N`"
                .into()
        } else {
            format!("declare it, for example `let {name} = ..`").into()
        };
        let message = format!("nothing here is called `{name}`");
        self.report(Diagnostic::new(Code::UnknownName, span, message, "unknown name").hint(hint));
    }

    /// The result of a call that is used as a value.
    pub fn only_result(&mut self, call: ScopeId, span: Span) -> Option<SlotId> {
        let here = &self.scopes[call.0];
        if let [(_, slot)] = here.results[..] {
            return Some(slot);
        }
        let name = here.term.map_or("", |t| &t.ast.name.node);
        let names: Vec<String> = here
            .results
            .iter()
            .map(|(n, _)| format!("`.{n}`"))
            .collect();
        let message = format!(
            "`{name}` gives {} results, and one value is needed here",
            names.len()
        );
        let diagnostic =
            Diagnostic::new(Code::SeveralResults, span, message, "which of its results?");
        self.report(diagnostic.hint(format!("choose one: {}", names.join(", "))));
        None
    }

    /// A result that something has, if that has results; the value is `None` if it is in error.
    pub fn result_of(&mut self, thing: Thing, field: &Name) -> Option<Option<Value>> {
        match thing {
            Thing::Broken => Some(None),
            Thing::Friction(force, on) => Some(self.slip(force, on, field)),
            Thing::Let(_, Some(call)) => Some(self.result(call, field)),
            _ => None,
        }
    }

    /// `b[2].x` and `b[2].x.y`; none where the base is no member of a bank.
    fn of_member(
        &mut self,
        scope: ScopeId,
        base: &'a Expr,
        field: &'a Name,
    ) -> Option<Option<Value>> {
        let (base, path) = match &base.kind {
            ExprKind::Field(inner, first) => (&**inner, vec![first, field]),
            _ => (base, vec![field]),
        };
        let ExprKind::Member(bank, index) = &base.kind else {
            return None;
        };
        let member = self.member(scope, bank, index);
        Some(member.and_then(|member| self.member_value(member, &path)))
    }

    fn field(&mut self, scope: ScopeId, base: &'a Expr, field: &'a Name) -> Option<Value> {
        if let Some(value) = self.of_member(scope, base, field) {
            return value;
        }
        let call = match &base.kind {
            ExprKind::Name(name) => {
                let found = self.find(scope, name);
                if let Some(value) = found.and_then(|found| self.result_of(found.thing, field)) {
                    return value;
                }
                None
            }
            ExprKind::Call(callee, _) if !self.is_function(scope, callee) => {
                let call = self.scopes[scope.0].calls.get(&base.span).copied();
                if call.is_none() {
                    self.expr(scope, base);
                    return None;
                }
                call
            }
            _ => None,
        };
        let Some(call) = call else {
            let value = self.expr(scope, base)?;
            let message = format!(
                "only a call of a term has results, and this is {}",
                value.ty.words()
            );
            let hint = "bind a call with `let name = term(..)` and write `name.result`";
            let diagnostic =
                Diagnostic::new(Code::NoResults, field.span, message, "asks for a result");
            self.report(diagnostic.also(base.span, value.ty.words()).hint(hint));
            return None;
        };
        self.result(call, field)
    }

    /// The result of a call that is named.
    fn result(&mut self, call: ScopeId, field: &Name) -> Option<Value> {
        let found = self.scopes[call.0].result(&field.node);
        if found.is_none() {
            self.unknown_result(call, field);
        }
        self.slot(found?)
    }

    fn is_function(&self, scope: ScopeId, callee: &Name) -> bool {
        let from_std = self.scopes[scope.0].in_std();
        self.items.function(&callee.node, from_std).is_some()
    }

    fn unknown_result(&mut self, call: ScopeId, field: &Name) {
        let here = &self.scopes[call.0];
        let term = here.term.map_or("", |t| &t.ast.name.node);
        let names: Vec<&str> = here.results.iter().map(|(n, _)| *n).collect();
        let hint = match nearest(&field.node, names.iter().copied()) {
            Some(near) => Advice::did_you_mean(near),
            None => format!(
                "it has {}",
                names
                    .iter()
                    .map(|n| format!("`{n}`"))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
            .into(),
        };
        let message = format!("the term `{term}` has no result `{}`", field.node);
        self.report(
            Diagnostic::new(Code::UnknownResult, field.span, message, "no such result").hint(hint),
        );
    }

    fn is(
        &mut self,
        scope: ScopeId,
        machine: &Name,
        state: &Name,
        negated: bool,
        span: Span,
    ) -> Option<Value> {
        let Some(label) = self.machine(scope, &machine.node) else {
            self.unknown_machine(scope, machine);
            return None;
        };
        let states = &self.model.machines[label.id].states;
        let Some(index) = states.iter().position(|s| *s == state.node) else {
            self.unknown_state(label.id, label.span, state);
            return None;
        };
        let is = self.node(Node::Is(label.id, index as u32), span);
        Some(Value::bool(if negated {
            self.node(Node::Not(is), span)
        } else {
            is
        }))
    }

    fn choice(
        &mut self,
        scope: ScopeId,
        c: &'a Expr,
        a: &'a Expr,
        b: &'a Expr,
        span: Span,
    ) -> Option<Value> {
        let condition = self.condition(scope, c, "the condition of `if`");
        let (first, second) = (self.expr(scope, a), self.expr(scope, b));
        let (first, second) = (first?, second?);
        if first.ty != second.ty {
            self.mismatch(
                |a, b| format!("`if` chooses between {a} and {b}"),
                (a, first),
                (b, second),
            );
            return None;
        }
        let condition = condition?;
        let node = match first.ty {
            Ty::Real(_) => Node::Select(condition, first.node, second.node),
            Ty::Bool => Node::SelectBool(condition, first.node, second.node),
        };
        Some(Value {
            node: self.node(node, span),
            ty: first.ty,
        })
    }

    /// The node of an expression that must be a bool.
    pub fn condition(&mut self, scope: ScopeId, expr: &'a Expr, what: &str) -> Option<NodeId> {
        let value = self.expr(scope, expr)?;
        self.expect(value, expr, Ty::Bool, || what.to_string())
    }
}

/// What a name that spells a rate is the rate of (`xdot`, `x_dot`, `dx`).
fn rate_of(name: &str) -> Option<&str> {
    let ending = ["_dot", "dot", "_prime", "prime", "_v"]
        .into_iter()
        .find_map(|end| name.strip_suffix(end));
    ending
        .or(name.strip_prefix("d"))
        .filter(|base| !base.is_empty())
}
