//! What the names of a program stand for.

use super::{Index, NameKind, Occurrence};
use crate::syntax::ast::*;
use whippen_source::{SourceMap, Span};

/// Adds every name that is understood.
pub(super) fn resolve(index: &mut Index, map: &SourceMap, files: &[File]) {
    let mut resolver = Resolver {
        index,
        map,
        item: 0,
        slip: None,
    };
    for (n, item) in files.iter().flat_map(|f| &f.items).enumerate() {
        resolver.item = n;
        match item {
            Item::Instrument(i) => i.decls.iter().for_each(|d| resolver.decl(d)),
            Item::Term(t) => t.decls.iter().for_each(|d| resolver.decl(d)),
            Item::Keyboard(k) => k.settings.iter().for_each(|s| resolver.setting(s)),
        }
    }
}

struct Resolver<'a> {
    index: &'a mut Index,
    map: &'a SourceMap,
    /// The item whose names are looked up.
    item: usize,
    /// In the law of a friction its slip.
    slip: Option<usize>,
}

impl Resolver<'_> {
    fn found(&mut self, span: Span, definition: Option<usize>) {
        self.index
            .occurrences
            .extend(definition.map(|definition| Occurrence { span, definition }));
    }

    fn name(&mut self, name: &Name, is: impl Fn(NameKind) -> bool) {
        self.found(name.span, self.index.find(self.item, &name.node, is));
    }

    fn value(&mut self, name: &Name) {
        self.name(name, NameKind::is_value);
    }

    fn decl(&mut self, decl: &Decl) {
        match &decl.kind {
            DeclKind::Sense {
                range, slew, over, ..
            } => {
                self.range(range);
                slew.iter().chain(over).for_each(|e| self.expr(e));
            }
            DeclKind::Param {
                value,
                range,
                glide,
                ..
            } => {
                self.expr(value);
                range.iter().for_each(|r| self.range(r));
                glide.iter().for_each(|e| self.expr(e));
            }
            DeclKind::Let { value, .. } | DeclKind::Sound { value, .. } => self.expr(value),
            DeclKind::Force { on, value, .. } => {
                on.iter()
                    .for_each(|on| self.name(on, |k| k == NameKind::Sense));
                self.expr(value);
            }
            DeclKind::Noise { .. } => {}
            DeclKind::Next { name, value }
            | DeclKind::Feed { delay: name, value }
            | DeclKind::Result { name, value } => {
                self.value(name);
                self.expr(value);
            }
            DeclKind::States { name, transitions } => {
                transitions.iter().for_each(|t| self.transition(name, t));
            }
            DeclKind::State { range, init, .. } => {
                self.range(range);
                init.iter().for_each(|e| self.expr(e));
            }
            DeclKind::Body { parts, .. } => parts.iter().for_each(|p| self.part(p)),
            DeclKind::String { along, parts, .. } => {
                self.range(along);
                parts.iter().for_each(|p| self.string_part(p));
            }
            DeclKind::Event {
                trigger, actions, ..
            } => {
                self.expr(trigger.expr());
                actions.iter().for_each(|a| self.action(a));
            }
            DeclKind::Pulse { range, lasting, .. } | DeclKind::Delay { range, lasting, .. } => {
                self.range(range);
                self.expr(lasting);
            }
            DeclKind::Table { knots, .. } => self.knots(knots),
            DeclKind::Bank { range, decls, .. } => self.bank(range, decls),
            DeclKind::Hold { body, guard } => self.hold(body, guard),
        }
    }

    fn hold(&mut self, body: &Name, guard: &Expr) {
        self.name(body, |k| matches!(k, NameKind::Body | NameKind::String));
        self.expr(guard);
    }

    fn knots(&mut self, knots: &Knots) {
        if let Knots::Listed(all) = knots {
            all.iter().for_each(|(x, value)| {
                self.expr(x);
                self.expr(value);
            });
        }
    }

    fn bank(&mut self, range: &RangeExpr, decls: &[Decl]) {
        self.range(range);
        decls.iter().for_each(|inner| self.decl(inner));
    }

    fn range(&mut self, range: &RangeExpr) {
        self.expr(&range.low);
        self.expr(&range.high);
    }

    fn transition(&mut self, machine: &Name, transition: &Transition) {
        self.state(&machine.node, &transition.from);
        self.state(&machine.node, &transition.to);
        self.expr(&transition.guard);
        transition.actions.iter().for_each(|a| self.action(a));
    }

    fn state(&mut self, machine: &str, state: &Name) {
        let machine = self
            .index
            .find(self.item, machine, |k| k == NameKind::Machine);
        let of_machine = |d: &super::Definition| {
            d.machine.is_some() && d.machine == machine && d.name == state.node
        };
        let found = self.index.definitions.iter().position(of_machine);
        self.found(state.span, found);
    }

    fn part(&mut self, part: &BodyPart) {
        match part {
            BodyPart::Coordinate {
                range,
                init,
                rate_range,
                rate_init,
                ..
            } => {
                self.range(range);
                self.range(rate_range);
                init.iter().chain(rate_init).for_each(|e| self.expr(e));
            }
            BodyPart::Inertia { value, .. } | BodyPart::Torque { value, .. } => self.expr(value),
            BodyPart::Friction {
                slip, against, law, ..
            } => self.rubbed(slip, against, law),
        }
    }

    /// A friction, in whose law alone its slip is known.
    fn rubbed(&mut self, slip: &Name, against: &Expr, law: &Expr) {
        self.expr(against);
        let definitions = self.index.definitions.iter();
        self.slip = definitions.clone().position(|d| d.span == slip.span);
        self.expr(law);
        self.slip = None;
    }

    fn string_part(&mut self, part: &StringPart) {
        match part {
            StringPart::Coordinate {
                range, rate_range, ..
            } => {
                self.range(range);
                self.range(rate_range);
            }
            StringPart::Density { value, .. }
            | StringPart::Load { value, .. }
            | StringPart::Tuned { pitch: value, .. }
            | StringPart::Points { value, .. } => self.expr(value),
            StringPart::Friction {
                slip,
                place,
                against,
                law,
                ..
            } => {
                self.expr(place);
                self.rubbed(slip, against, law);
            }
            StringPart::Force { value, place, .. } => {
                self.expr(value);
                self.expr(place);
            }
            StringPart::Ends { .. } => {}
        }
    }

    fn action(&mut self, action: &Action) {
        match &action.kind {
            ActionKind::Emit { args, .. } => args.iter().for_each(|(_, value)| self.expr(value)),
            ActionKind::Write { name, value, .. } | ActionKind::Fire { pulse: name, value } => {
                self.value(name);
                self.expr(value);
            }
        }
    }

    fn setting(&mut self, setting: &Setting) {
        match setting {
            Setting::Board { .. }
            | Setting::Device(_)
            | Setting::DeviceFile(_)
            | Setting::Keys(..) => {}
            Setting::Rate(rate) => self.expr(rate),
            Setting::Programs(names) => names.iter().for_each(|n| self.program(n)),
            Setting::Zones { zones, .. } => zones.iter().for_each(|zone| {
                self.instrument(&zone.instrument);
            }),
            Setting::PerKey {
                instrument,
                param,
                points,
            } => {
                let item = self.instrument(instrument);
                let found =
                    item.and_then(|item| self.index.find(item, &param.node, NameKind::is_value));
                self.found(param.span, found);
                points.iter().for_each(|(_, value)| self.expr(value));
            }
        }
    }

    /// Zones of this keyboard, or an instrument.
    fn program(&mut self, name: &Name) {
        match self
            .index
            .find(self.item, &name.node, |kind| kind == NameKind::Zones)
        {
            None => drop(self.instrument(name)),
            zones => self.found(name.span, zones),
        }
    }

    /// Its place among the items.
    fn instrument(&mut self, name: &Name) -> Option<usize> {
        let found = self.index.item_named(&name.node, NameKind::Instrument);
        self.found(name.span, found);
        found.map(|at| self.index.definitions[at].item)
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                let slip = self
                    .slip
                    .filter(|at| self.index.definitions[*at].name == *name);
                let found = slip.or(self.index.find(self.item, name, NameKind::is_value));
                self.found(self.without_brackets(expr.span, name), found);
            }
            ExprKind::Field(base, field) => {
                self.expr(base);
                let term = self.term_of(base);
                let result = term.and_then(|term| {
                    self.index
                        .find(term, &field.node, |k| k == NameKind::Result)
                });
                let member = match self.is_bank(base) {
                    true => self.index.find(self.item, &field.node, NameKind::is_value),
                    false => None,
                };
                self.found(field.span, result.or(member));
            }
            ExprKind::Call(callee, args) => {
                let term = self.index.item_named(&callee.node, NameKind::Term);
                // A string, a delay line or a table is read like a call.
                let read = |kind| {
                    let kinds = [NameKind::Coordinate, NameKind::Delay, NameKind::Table];
                    kinds.contains(&kind)
                };
                let own = self.index.find(self.item, &callee.node, read);
                self.found(callee.span, own.or(term));
                for arg in args {
                    let of_term = term
                        .map(|at| self.index.definitions[at].item)
                        .zip(arg.name.as_ref());
                    if let Some((term, name)) = of_term {
                        self.found(
                            name.span,
                            self.index
                                .find(term, &name.node, |k| k == NameKind::Parameter),
                        );
                    }
                    self.expr(&arg.value);
                }
            }
            ExprKind::Prime(a) | ExprKind::Neg(a) | ExprKind::Not(a) => self.expr(a),
            ExprKind::Binary(_, a, b) | ExprKind::Member(a, b) => {
                [a, b].into_iter().for_each(|e| self.expr(e))
            }
            ExprKind::If(c, a, b) => [c, a, b].into_iter().for_each(|e| self.expr(e)),
            ExprKind::Is { machine, state, .. } => {
                self.name(machine, |k| k == NameKind::Machine);
                self.state(&machine.node, state);
            }
            ExprKind::Number(_) | ExprKind::Bool(_) | ExprKind::Error => {}
        }
    }

    /// Whether an expression is a bank or a member of one.
    fn is_bank(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Name(name) => {
                let found = self.index.find(self.item, name, NameKind::is_value);
                found.is_some_and(|at| self.index.definitions[at].kind == NameKind::Bank)
            }
            ExprKind::Member(bank, _) => self.is_bank(bank),
            _ => false,
        }
    }

    /// The item of the term whose results a value has.
    fn term_of(&self, base: &Expr) -> Option<usize> {
        let callee = match &base.kind {
            ExprKind::Call(callee, _) => &callee.node,
            ExprKind::Name(name) => {
                let at = self.index.find(self.item, name, |k| k == NameKind::Let)?;
                self.index.definitions[at].calls.as_ref()?
            }
            _ => return None,
        };
        self.index
            .item_named(callee, NameKind::Term)
            .map(|at| self.index.definitions[at].item)
    }

    /// The place of an expression holds the round brackets around it: here is the name alone.
    fn without_brackets(&self, span: Span, name: &str) -> Span {
        let at = self.map.text(span).find(name).unwrap_or(0) as u32;
        Span {
            start: span.start + at,
            end: span.start + at + name.len() as u32,
            ..span
        }
    }
}
