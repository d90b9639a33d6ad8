//! Frictions: `friction f(v) against w = law`, an equation for the slip `v` of this very tick, of a
//! body or, `at` a place, of a string.
//!
//! Three values are evaluated when they are first asked for, like any other: the motion without the
//! friction, the slip that is tried (`v` in the law), and the force `f`. So what the law and
//! `w` are made of may stand anywhere, and a circle shows itself.

use super::body::motion;
use super::builtin;
use super::elaborate::Elaborator;
use super::scope::{ScopeId, Thing};
use super::slot::{SlotId, Source};
use super::types::{Ty, Value};
use crate::diag::{Code, Diagnostic};
use crate::model::prime::{NoPrime, slope};
use crate::model::{Balance, CellId, CellKind, Cmp, Dag, Friction, Model, Node, NodeId, StrandId};
use crate::range;
use crate::syntax::ast::{BodyPart, Expr, Name};
use crate::units::Dim;
use std::collections::HashMap;
use whippen_source::Span;

/// A friction as it is written.
#[derive(Debug, Clone, Copy)]
pub struct Rubbed<'a> {
    /// Its name.
    pub name: &'a Name,
    /// The name of the slip in its law.
    pub slip: &'a Name,
    /// Where it rubs a string.
    pub place: Option<&'a Expr>,
    /// The speed that the slip is relative to.
    pub against: &'a Expr,
    /// The force against the slip.
    pub law: &'a Expr,
    /// The line.
    pub span: Span,
}

/// What a friction rubs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RubbedBy {
    /// A body: index into the Model's.
    Body(usize),
    /// A string.
    Strand(StrandId),
}

/// What is known of a friction while it is elaborated.
#[derive(Debug, Clone, Copy, Default)]
pub struct RubInfo {
    /// Its force.
    pub force: Option<SlotId>,
    /// Its slip.
    pub slip: Option<Value>,
}

pub fn rubbed(part: &BodyPart) -> Option<Rubbed<'_>> {
    let BodyPart::Friction {
        name,
        slip,
        against,
        law,
        span,
    } = part
    else {
        return None;
    };
    Some(Rubbed {
        name,
        slip,
        place: None,
        against,
        law,
        span: *span,
    })
}

impl<'a> Elaborator<'a, '_> {
    /// Enters the friction of something. A second one is known, but broken.
    pub fn declare_frictions(
        &mut self,
        scope: ScopeId,
        on: Option<RubbedBy>,
        all: impl Iterator<Item = Rubbed<'a>>,
    ) -> Vec<Span> {
        let mut spans: Vec<Span> = Vec::new();
        for rubbed in all {
            match on.filter(|_| spans.is_empty()) {
                Some(on) => self.declare_friction(scope, on, rubbed),
                None => self.enter(scope, rubbed.name, Thing::Broken),
            }
            spans.push(rubbed.span);
        }
        spans
    }

    fn declare_friction(&mut self, scope: ScopeId, on: RubbedBy, rubbed: Rubbed<'a>) {
        let Rubbed { name, slip, .. } = rubbed;
        let full = self.scopes[scope.0].full(&name.node);
        let trial = self.new_slot(
            format!("{full}({})", slip.node),
            slip.span,
            Source::Trial(scope, on, rubbed),
        );
        let laws = &mut self.scopes[scope.0].laws;
        laws.push((rubbed.law.span, slip, trial));
        let source = Source::Friction(scope, on, rubbed);
        let force = self.new_slot(full, name.span, source);
        self.rub_of(on).force = Some(force);
        self.enter(scope, name, Thing::Friction(force, on));
    }

    /// What is known of the friction of something.
    pub fn rub_of(&mut self, on: RubbedBy) -> &mut RubInfo {
        match on {
            RubbedBy::Body(index) => &mut self.bodies[index].rub,
            RubbedBy::Strand(id) => &mut self.strands[id].rub,
        }
    }

    /// The slip that is tried, where a name in the law of a friction means that.
    pub fn tried(&self, scope: ScopeId, name: &str, span: Span) -> Option<SlotId> {
        let inside =
            |law: Span| law.file == span.file && law.start <= span.start && span.end <= law.end;
        let laws = self.scopes[scope.0].laws.iter();
        laws.rev()
            .find(|(law, slip, _)| slip.node == name && inside(*law))
            .map(|(.., trial)| *trial)
    }

    /// The friction of something, with the names for it in traces.
    pub fn frictions(&mut self, scope: ScopeId, on: RubbedBy, first: Option<Rubbed<'a>>) {
        let Some(force) = self.rub_of(on).force else {
            return;
        };
        let value = self.slot(force);
        let slip = self.rub_of(on).slip;
        if let Some(rubbed) = first {
            self.export(scope, rubbed.name, value);
            let name = Name {
                node: format!("{}.slip", rubbed.name.node),
                span: rubbed.name.span,
            };
            self.export(scope, &name, slip);
        }
    }

    /// `f.slip`
    pub fn slip(&mut self, force: SlotId, on: RubbedBy, field: &Name) -> Option<Value> {
        self.slot(force)?;
        if field.node == "slip" {
            return self.rub_of(on).slip;
        }
        let message = format!("a friction has no result `{}`", field.node);
        let diagnostic = Diagnostic::new(Code::NoResults, field.span, message, "not known of it");
        self.report(
            diagnostic.hint("its name is its force, and `.slip` the speed it acts against"),
        );
        None
    }

    /// The slip that is tried: between 0 and what it would be without the friction.
    pub fn trial(&mut self, scope: ScopeId, on: RubbedBy, rubbed: Rubbed<'a>) -> Option<Value> {
        self.check_name_of_slip(scope, rubbed.slip);
        let Value { node, ty } = self.free_rate(scope, on, rubbed)?;
        let against = self.expr(scope, rubbed.against)?;
        let against = self.expect(against, rubbed.against, ty, || {
            "what follows `against`".to_string()
        })?;
        let outer = self.here.replace(scope);
        let free = self.model.dag.add_folded(Node::Sub(node, against));
        let last = format!("{}.last", self.scopes[scope.0].full(&rubbed.name.node));
        let (last, _) = self.new_cell(last, CellKind::Slip, ty.dim()?, rubbed.name.span);
        let trial = self.node(Node::Trial(last, free), rubbed.slip.span);
        self.here = outer;
        Some(Value { node: trial, ty })
    }

    /// The rate there would be without the friction: of a body after the tick, of a string as the
    /// mean of before and after.
    fn free_rate(&mut self, scope: ScopeId, on: RubbedBy, rubbed: Rubbed<'a>) -> Option<Value> {
        let index = match on {
            RubbedBy::Strand(id) => return self.free_rate_of_string(scope, id, rubbed.place?),
            RubbedBy::Body(index) => index,
        };
        let acceleration = self.slot(self.bodies[index].acceleration)?.node;
        let body = self.model.bodies[index].clone();
        let dim = self.model.cells[body.rate].dim;
        let outer = self.here.replace(scope);
        let tick = self.model.dag.constant(1.0 / f64::from(self.model.rate_hz));
        let rate = self.model.dag.add(Node::Cell(body.rate));
        let change = self.model.dag.add_folded(Node::Mul(tick, acceleration));
        let new_rate = self.model.dag.add_folded(Node::Add(rate, change));
        self.mark(rubbed.slip.span);
        self.here = outer;
        Some(Value::real(new_rate, dim))
    }

    fn check_name_of_slip(&mut self, scope: ScopeId, slip: &Name) {
        let known = self.find(scope, &slip.node);
        match known.map(|entry| (entry.span, entry.thing.words())) {
            Some((first, words)) => {
                let label = format!("already the name of {words}");
                self.duplicate("value", slip, first, label);
            }
            None if builtin::constant(&slip.node).is_some() => {
                let message = format!("`{}` is built in", slip.node);
                let label = "this name is taken";
                self.report(
                    Diagnostic::new(Code::DuplicateName, slip.span, message, label)
                        .hint("choose another name"),
                );
            }
            None => {}
        }
    }

    /// The force of a friction, from the slip at which it is in balance.
    pub fn friction(&mut self, scope: ScopeId, on: RubbedBy, rubbed: Rubbed<'a>) -> Option<Value> {
        let laws = self.scopes[scope.0].laws.iter();
        let own = laws.clone().find(|(law, ..)| *law == rubbed.law.span);
        let trial = self.slot(own.map(|(.., slot)| *slot)?)?;
        let Node::Trial(last, free) = *self.model.dag.get(trial.node) else {
            return None;
        };
        let turns = trial.ty == Ty::Real(Dim::PER_TIME);
        let law = self.expr(scope, rubbed.law)?;
        let force = motion(turns);
        let law = self.expect(law, rubbed.law, Ty::Real(force.torque_dim), || {
            format!("the {} of `{}`", force.torque, rubbed.name.node)
        })?;
        let outer = self.here.replace(scope);
        let slope = slope(&mut self.model.dag, trial.node, law);
        self.mark(rubbed.law.span);
        let balanced = match slope {
            Ok(slope) => Some(self.balanced(on, rubbed, (last, free, trial.node), [law, slope])),
            Err(errors) => {
                errors
                    .iter()
                    .for_each(|error| self.report_no_slope(error, rubbed));
                None
            }
        };
        self.here = outer;
        let (slip, force_node) = balanced??;
        self.rub_of(on).slip = Some(Value {
            node: slip,
            ty: trial.ty,
        });
        Some(Value::real(force_node, force.torque_dim))
    }

    /// The slip and the force, and what the friction does to its body.
    fn balanced(
        &mut self,
        on: RubbedBy,
        rubbed: Rubbed<'a>,
        (last, free, trial): (CellId, NodeId, NodeId),
        [law, slope]: [NodeId; 2],
    ) -> Option<(NodeId, NodeId)> {
        let span = rubbed.span;
        let gain = self.slip_by_force(on)?;
        let dag = &mut self.model.dag;
        let before = dag.add(Node::Cell(last));
        let slip = dag.add(Node::Slip(Balance {
            free,
            gain,
            trial,
            law,
            slope,
            last: before,
        }));
        // As the slip, what is taken lies between 0 and the slip without the friction. It is held
        // there, so that roundings cannot give it the other sign.
        let zero = dag.constant(0.0);
        let (low, high) = (
            dag.add(Node::Min(free, zero)),
            dag.add(Node::Max(free, zero)),
        );
        let taken = dag.add(Node::Sub(free, slip));
        let taken = dag.add(Node::Max(taken, low));
        let taken = dag.add(Node::Min(taken, high));
        let force = self.force_of(on, taken)?;
        let dag = &mut self.model.dag;
        // A friction that gives no force forgets its slip. Where it slips fast it may give none
        // that integers can hold, and would still hold what comes to rest.
        let forward = dag.add(Node::Compare(Cmp::Gt, taken, zero));
        let backward = dag.add(Node::Compare(Cmp::Lt, taken, zero));
        let at_rest = at(dag, (trial, zero), slope);
        let grips = dag.add(Node::Compare(Cmp::Gt, at_rest, zero));
        let kept = [backward, forward, grips]
            .into_iter()
            .fold(zero, |other, rubs| dag.add(Node::Select(rubs, slip, other)));
        self.mark(span);
        self.model.nexts.push((last, kept));
        self.next_spans.push(rubbed.name.span);
        self.rubs(on, taken, last, span)?;
        Some((slip, force))
    }

    /// The force that takes so much off the slip.
    fn force_of(&mut self, on: RubbedBy, taken: NodeId) -> Option<NodeId> {
        let index = match on {
            RubbedBy::Strand(id) => return self.force_of_string(id, taken),
            RubbedBy::Body(index) => index,
        };
        let inertia = self.bodies[index].inertia?;
        let dag = &mut self.model.dag;
        let per_tick = dag.constant(self.model.rate_hz.into());
        let change = dag.add_folded(Node::Mul(inertia, per_tick));
        Some(dag.add_folded(Node::Mul(taken, change)))
    }

    /// What a force changes the slip by.
    fn slip_by_force(&mut self, on: RubbedBy) -> Option<NodeId> {
        let index = match on {
            RubbedBy::Strand(id) => return self.slip_of_string(id),
            RubbedBy::Body(index) => index,
        };
        let inertia = self.bodies[index].inertia?;
        let dag = &mut self.model.dag;
        let tick = dag.constant(1.0 / f64::from(self.model.rate_hz));
        Some(dag.add_folded(Node::Div(tick, inertia)))
    }

    /// Gives what is rubbed its friction, which takes so much off its slip.
    fn rubs(&mut self, on: RubbedBy, taken: NodeId, last: CellId, span: Span) -> Option<()> {
        let force = self.rub_of(on).force?;
        let name = self.slots[force.0].name.clone();
        match on {
            RubbedBy::Strand(id) => self.string_is_rubbed(id, (name, taken, last, span)),
            RubbedBy::Body(index) => {
                self.model.bodies[index].friction = Some(Friction {
                    name,
                    taken,
                    last,
                    span,
                });
            }
        }
        Some(())
    }

    fn report_no_slope(&mut self, error: &NoPrime, rubbed: Rubbed) {
        let name = &rubbed.name.node;
        let slip = &rubbed.slip.node;
        let place = self.model.spans.get(error.node).copied().flatten();
        let message = format!(
            "the law of `{name}` has no derivative: this choice asks for the slip `{slip}`, so it may jump"
        );
        let hint = format!(
            "a force that turns round with the slip is `tanh({slip} / (1 mm/s))`: steep, but not a jump; \
             `min`, `max` and `clamp` have a derivative too"
        );
        let span = place.unwrap_or(rubbed.law.span);
        let mut found = Diagnostic::new(Code::FrictionSlope, span, message, "the choice");
        if span != rubbed.law.span {
            found = found.also(rubbed.law.span, "the law");
        }
        self.report(found.hint(hint));
    }
}

/// A value with a constant in the place of the slip that is tried.
fn at(dag: &mut Dag, (trial, slip): (NodeId, NodeId), value: NodeId) -> NodeId {
    let mut new = HashMap::from([(trial, slip)]);
    for id in dag.between(trial, value).into_iter().skip(1) {
        let mut node = dag.get(id).clone();
        node.map_operands(|operand| *new.get(&operand).unwrap_or(&operand));
        let changed = dag.add_folded(node);
        new.insert(id, changed);
    }
    *new.get(&value).unwrap_or(&value)
}

/// Gives the memories of frictions the ranges of their slips, once everything is known. Where a
/// value has no range there is a message of it later.
pub fn remember_slips(model: &mut Model) {
    let of_bodies = model.bodies.iter().any(|body| body.friction.is_some());
    let of_strings = model.strands.iter().any(|strand| strand.friction.is_some());
    if !of_bodies && !of_strings {
        return;
    }
    let Ok(ranges) = range::analyze(model) else {
        return;
    };
    for (cell, value) in &model.nexts {
        if model.cells[cell].kind == CellKind::Slip {
            model.cells[cell].range = ranges.get(*value);
        }
    }
}
